//! Measures the checks from scratch, and writes the figures that CONTRIBUTING.md shows: wall time, CPU time and compiled
//! packages, in fresh clones with empty cargo homes. Another commit is measured in the same run, so that both find the
//! machine as fast. It needs an idle machine.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use results::{Measurement, rounded};
use xtask::command::{Step, cpu_s_of_children, remove_folder, root};

/// The README's first command, built but not run: `cargo run` builds this program alone.
const FIRST_COMMAND: &str = "cargo build --release --bin footfall";

/// Measures the last commit, and the tests and the first command of another commit.
///
/// # Errors
/// A command fails, there is no such commit, or a file cannot be read or written.
pub fn run(beside: Option<&str>) -> Result<()> {
    let mut result = Measurement::new(
        "gate",
        "Time of the checks and of the first command: a fresh clone, an empty cargo home, two idle cores, downloads included.",
    )
    .measured_by("cargo laboratory measure");
    let mut add = |command: &str, commit: &str, cost: &Cost| {
        result.row([
            ("command", command.into()),
            ("commit", commit.into()),
            ("minutes", rounded(cost.wall_s / 60.0, 1).into()),
            ("cpu_minutes", rounded(cost.cpu_s / 60.0, 1).into()),
            ("packages_compiled", cost.packages.into()),
        ]);
    };
    // A gate that fails ends the measurement before the other commit takes its time.
    for commit in ["HEAD"].into_iter().chain(beside) {
        let clone = Clone::of(commit)?;
        add(FIRST_COMMAND, &clone.commit, &clone.measure(FIRST_COMMAND)?.0);
        // The tests find nothing that the first command has built.
        clone.clean()?;
        if commit == "HEAD" {
            let (gate, log) = clone.measure(".ci/run")?;
            add(".ci/test", &clone.commit, &tests_of(&log)?);
            add(".ci/run", &clone.commit, &gate);
            add(".ci/test, again", &clone.commit, &clone.measure(".ci/test")?.0);
        } else {
            add(".ci/test", &clone.commit, &clone.measure(".ci/test")?.0);
        }
    }
    result.write()?;
    remove_folder(&work()?)
}

/// Cost of a command.
struct Cost {
    /// Wall time, s.
    wall_s: f64,
    /// CPU time, s.
    cpu_s: f64,
    /// Packages that were compiled.
    packages: usize,
}

/// Folder of the clones, beside the repository, where the recordings are found, too.
fn work() -> Result<PathBuf> {
    Ok(root().canonicalize()?.join("../measured"))
}

/// Clone of a commit, with an empty cargo home.
struct Clone {
    folder: PathBuf,
    cargo: PathBuf,
    /// The first digits of the commit.
    commit: String,
}

impl Clone {
    fn of(commit: &str) -> Result<Self> {
        let git = |arguments: &[&str]| Step::program("git").with(arguments);
        let commit = git(&["rev-parse", "--short=8", "--verify", commit]).output()?;
        let commit = commit.trim().to_owned();
        let work = work()?.join(&commit);
        let (folder, cargo) = (work.join("footfall"), work.join("cargo"));
        remove_folder(&work)?;
        let from = root().canonicalize()?.display().to_string();
        git(&["clone", "--quiet", &from, &folder.display().to_string()]).run()?;
        git(&["checkout", "--quiet", "--detach", &commit]).at(&folder).run()?;
        let clone = Self { folder, cargo, commit };
        clone.empty_cargo_home()?;
        Ok(clone)
    }

    fn empty_cargo_home(&self) -> Result<()> {
        remove_folder(&self.cargo)?;
        fs::create_dir_all(&self.cargo)?;
        // Where a mirror of the registry is set up.
        let configuration = cargo_home()?.join("config.toml");
        if configuration.is_file() {
            fs::copy(configuration, self.cargo.join("config.toml"))?;
        }
        Ok(())
    }

    /// Removes all that was built and downloaded.
    fn clean(&self) -> Result<()> {
        remove_folder(&self.folder.join("target"))?;
        self.empty_cargo_home()
    }

    /// Runs a command in the clone, and returns its cost and its output.
    fn measure(&self, command: &str) -> Result<(Cost, String)> {
        let datasets = env::var_os("FOOTFALL_DATASETS").map(PathBuf::from);
        let datasets =
            datasets.map_or_else(|| root().join("../shared/datasets").canonicalize(), Ok);
        let log = root().join("target/measured.log");
        let mut words = command.split(' ');
        let program = words.next().context("a command has a name")?;
        let program = if program.starts_with('.') {
            self.folder.join(program).display().to_string()
        } else {
            program.to_owned()
        };
        let (cpu_s_before, begin) = (cpu_s_of_children()?, Instant::now());
        let passed = Step::program(&program)
            .at(&self.folder)
            .with(words)
            .env("CARGO_HOME", &self.cargo)
            .env("FOOTFALL_DATASETS", datasets.unwrap_or_default())
            .run_into(&log)?;
        let wall_s = begin.elapsed().as_secs_f64();
        let cpu_s = cpu_s_of_children()? - cpu_s_before;
        let text = fs::read_to_string(&log)?;
        if !passed {
            let commit = &self.commit;
            bail!("{command} of {commit} fails; its output is in {}", log.display());
        }
        Ok((Cost { wall_s, cpu_s, packages: packages(&text) }, text))
    }
}

fn cargo_home() -> Result<PathBuf> {
    let named = env::var_os("CARGO_HOME").map(PathBuf::from);
    named.or_else(|| Some(env::home_dir()?.join(".cargo"))).context("no cargo home is known")
}

/// Cost of the tests, from the line of the gate's output that ends them.
fn tests_of(log: &str) -> Result<Cost> {
    let (before, rest) = log.split_once("\n.ci/test: ").context("no line of .ci/test")?;
    let line = rest.lines().next().unwrap_or_default();
    let times = line.split_once(" s, CPU ");
    let (wall, cpu) = times.with_context(|| format!("no times: {line}"))?;
    let cpu = cpu.trim_end_matches(" s");
    Ok(Cost { wall_s: wall.parse()?, cpu_s: cpu.parse()?, packages: packages(before) })
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
