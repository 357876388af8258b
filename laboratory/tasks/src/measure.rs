//! Measures the gate from scratch, and writes the figures that CONTRIBUTING.md shows: wall time, CPU time and compiled
//! packages, in a fresh clone of the last commit with an empty cargo home. It needs an idle machine.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use results::{Measurement, rounded};

use xtask::command::{Step, cpu_s_of_children, remove_folder, root};

/// Runs the gate in a fresh clone, and writes the figures of its two tiers.
///
/// # Errors
/// The gate fails, or a file cannot be read or written.
pub fn run() -> Result<()> {
    let root = root().canonicalize()?;
    let work = root.join("../measured");
    let (clone, cargo) = (work.join("footfall"), work.join("cargo"));
    remove_folder(&work)?;
    fs::create_dir_all(&cargo)?;
    let (from, to) = (root.display().to_string(), clone.display().to_string());
    Step::program("git").with(["clone", "--quiet", &from, &to]).run()?;
    // Where a mirror of the registry is set up.
    let configuration = cargo_home()?.join("config.toml");
    if configuration.is_file() {
        fs::copy(configuration, cargo.join("config.toml"))?;
    }
    let datasets = env::var_os("FOOTFALL_DATASETS").map(PathBuf::from);
    let log = root.join("target/measured.log");
    let cpu_s_before = cpu_s_of_children()?;
    let begin = Instant::now();
    let passed = Step::program(&clone.join(".ci/run").display().to_string())
        .at(&clone)
        .env("CARGO_HOME", &cargo)
        .env("FOOTFALL_DATASETS", datasets.unwrap_or_else(|| root.join("../shared/datasets")))
        .run_into(&log)?;
    let (wall_s, cpu_s) = (begin.elapsed().as_secs_f64(), cpu_s_of_children()? - cpu_s_before);
    let text = fs::read_to_string(&log)?;
    if !passed {
        bail!("the gate fails; its output is in {}", log.display());
    }
    let tests = tests_of(&text)?;
    let gate = Tier { wall_s, cpu_s, packages: packages(&text) };
    let mut result = Measurement::new(
        "gate",
        "Time of the tests and of the gate from nothing: a fresh clone, an empty cargo home, two idle cores, downloads \
         included.",
    )
    .measured_by("cargo laboratory measure");
    for (command, cost) in [(".ci/test", tests), (".ci/run", gate)] {
        result.row([
            ("command", command.into()),
            ("minutes", rounded(cost.wall_s / 60.0, 1).into()),
            ("cpu_minutes", rounded(cost.cpu_s / 60.0, 1).into()),
            ("packages_compiled", cost.packages.into()),
        ]);
    }
    result.write()?;
    fs::remove_dir_all(&work)?;
    Ok(())
}

/// Cost of a tier of checks.
struct Tier {
    /// Wall time, s.
    wall_s: f64,
    /// CPU time, s.
    cpu_s: f64,
    /// Packages that were compiled.
    packages: usize,
}

fn cargo_home() -> Result<PathBuf> {
    let named = env::var_os("CARGO_HOME").map(PathBuf::from);
    named.or_else(|| Some(env::home_dir()?.join(".cargo"))).context("no cargo home is known")
}

/// Cost of the tests, from the line of the gate's output that ends them.
fn tests_of(log: &str) -> Result<Tier> {
    let (before, rest) = log.split_once("\n.ci/test: ").context("no line of .ci/test")?;
    let line = rest.lines().next().unwrap_or_default();
    let times = line.split_once(" s, CPU ");
    let (wall, cpu) = times.with_context(|| format!("no times: {line}"))?;
    let cpu = cpu.trim_end_matches(" s");
    Ok(Tier { wall_s: wall.parse()?, cpu_s: cpu.parse()?, packages: packages(before) })
}

/// Number of packages that cargo compiled, by its output.
fn packages(log: &str) -> usize {
    let lines = log.lines().filter_map(|line| line.trim_start().strip_prefix("Compiling "));
    let names = lines.map(|line| line.split(" (").next().unwrap_or(line));
    names.collect::<BTreeSet<&str>>().len()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "   Compiling libm v0.2.16
   Compiling wire v0.1.0 (/footfall/wire)
   Compiling libm v0.2.16
.ci/test: 90.0 s, CPU 150.0 s
   Compiling csv v1.4.0
";

    #[test]
    fn log_gives_the_cost_of_the_tests() {
        let tests = tests_of(LOG).expect("the line is there");
        assert_eq!((tests.wall_s, tests.cpu_s), (90.0, 150.0));
        assert_eq!((tests.packages, packages(LOG)), (2, 3));
    }
}
