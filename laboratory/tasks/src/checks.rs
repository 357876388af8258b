//! The tiers of checks beyond the product's tests: the gate, and everything that the gate leaves out.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use xtask::command::{Step, cpu_s_of_children, remove_folder, root};
use xtask::firmware::{self, Board};
use xtask::test::{LABORATORY, PACKAGES};
use xtask::{hex, uf2};

use crate::requirements::Purpose;
use crate::{book, crates, install, installed, panics, python, release, socketcan};

/// Programs of tests that cargo runs only by their names, because they take minutes, or read what third-party programs write.
const MORE_TESTS: [&str; 4] = ["--test", "thorough", "--test", "python"];

/// Packages with all features.
const ALL_FEATURES: [&str; 2] = ["--features", "host-tests/full"];

/// Manifests of all workspaces. Besides the product and the laboratory, there are programs with other HALs or lock files.
const WORKSPACES: [&str; 5] = [
    "Cargo.toml",
    "firmware/boards/rp/Cargo.toml",
    "laboratory/Cargo.toml",
    "laboratory/fuzz/Cargo.toml",
    "laboratory/rp2350/Cargo.toml",
];

/// Turns each warning of clippy into an error.
const DENY: [&str; 3] = ["--", "-D", "warnings"];

/// Makes a missing recording or tool a failure, unless the environment decides. The gate and the full checks set it. On
/// a machine without the third-party recordings, set it to `tools`: the tests then report missing recordings, and pass.
const REQUIRE_EVERYTHING: &str = "FOOTFALL_REQUIRE_EVERYTHING";

/// Wall time since the start, in the headings of the parts.
struct Clock {
    start: Instant,
}

impl Clock {
    fn start() -> Self {
        Self { start: Instant::now() }
    }

    fn heading(&self, name: &str) {
        let seconds = self.start.elapsed().as_secs();
        println!("\n== {name} ({} min {:02} s)", seconds / 60, seconds % 60);
    }
}

fn require_everything(step: Step) -> Step {
    let value = env::var(REQUIRE_EVERYTHING).unwrap_or_else(|_| "1".into());
    step.env(REQUIRE_EVERYTHING, value)
}

/// Runs the gate: format; all tests but those that take hours, with nothing left unchecked; lints, documentation, the budgets of the boards' programs,
/// the README's first command, and the installed Python package.
///
/// # Errors
/// A check fails.
pub fn gate() -> Result<()> {
    let clock = Clock::start();
    clock.heading("format");
    for manifest in WORKSPACES {
        Step::cargo(&["fmt", "--all", "--check", "--manifest-path", manifest]).run()?;
    }

    clock.heading("tests");
    let cpu_s_before = cpu_s_of_children()?;
    let begin = Instant::now();
    require_everything(Step::program(".ci/test")).run()?;
    let (wall_s, cpu_s) = (begin.elapsed().as_secs_f64(), cpu_s_of_children()? - cpu_s_before);
    println!(".ci/test: {wall_s:.1} s, CPU {cpu_s:.1} s");

    clock.heading("more tests");
    more_tests()?;
    results::print_older()?;

    clock.heading("lints");
    // These lints cover the packages of bags and of Python as well, which the tests leave out.
    Step::cargo(&["clippy", "--locked", "--all-targets"])
        .with(["--workspace", "--exclude", "foot-stm32f405"])
        .with(DENY)
        .run()?;
    Step::cargo(&["clippy", "--locked"]).with(PACKAGES).with(MORE_TESTS).with(DENY).run()?;
    Step::cargo(&["clippy", "--locked", "--all-targets"]).with(LABORATORY).with(DENY).run()?;
    firmware::lint()?;
    Step::cargo(&["clippy", "--locked", "--profile", "firmware", "--target", firmware::TARGET])
        .with(LABORATORY)
        .with(["--package", "board-proofs"])
        .with(DENY)
        .run()?;
    uf2::lint()?;

    clock.heading("documentation");
    document(&[])?;
    Step::cargo(&["doc", "--locked", "--no-deps"])
        .with(LABORATORY)
        .env("RUSTDOCFLAGS", "-D warnings")
        .run()?;

    clock.heading("programs of the boards");
    let mut elfs = Vec::new();
    let mut bootloaders = Vec::new();
    for board in Board::all()? {
        let (elf, bootloader) =
            (firmware::elf_of(&board.program), firmware::build_bootloader(&board, &[])?);
        hex::run(&elf, Some(&bootloader))?;
        elfs.push(elf);
        // The linker holds the bootloader to its two sectors.
        bootloaders.push(bootloader);
    }
    for elf in elfs.iter().chain(&bootloaders) {
        panics::run(elf, false)?;
    }
    elfs.push(firmware::elf_of("self-check"));
    firmware::check_sizes(&elfs)?;

    clock.heading("the first command");
    first_command()?;

    clock.heading("the Python package");
    python::package(&first_command_target())?;
    fs::remove_dir_all(first_command_target())?;

    clock.heading("passed");
    Ok(())
}

/// Tests of the product that take longer, or read the output of third-party programs, and tests of the laboratory. The
/// tests that ran before have built the dependencies of the first ones.
fn more_tests() -> Result<()> {
    install::for_gate()?;
    firmware::build_all()?;
    require_everything(Step::cargo(&["test", "--locked"])).with(PACKAGES).with(MORE_TESTS).run()?;
    require_everything(Step::cargo(&["test", "--locked", "--package", "bags"])).run()?;
    require_everything(Step::cargo(&["test", "--locked"]))
        .with(LABORATORY)
        // Tests of the virtual board run the program against boards.
        .env("FOOTFALL_PROGRAM", root().join("target/debug/footfall"))
        .run()
}

/// Builds the documentation of all packages with `features`, without a warning.
fn document(features: &[&str]) -> Result<()> {
    Step::cargo(&["doc", "--locked", "--no-deps"])
        .with(PACKAGES)
        .with(features)
        .env("RUSTDOCFLAGS", "-D warnings")
        .run()
}

/// Folder in which the first command is built from nothing. The Python package, which is built like it, then finds the
/// packages there that both have.
fn first_command_target() -> PathBuf {
    root().join("target/first-command")
}

/// Measures the README's first command from nothing, without the downloads. Holds it to a budget of processor time and of the
/// program's size.
///
/// The processor time is given in multiples of that of one of its packages, because a machine that is slow or busy takes
/// longer for both.
fn first_command() -> Result<()> {
    /// Package of the first command, as a unit of processor time.
    const UNIT: &str = "clap_builder";
    /// A tenth more than was measured: 17.6, with the topics and the checks that came since 14.3. Loads of one machine differ
    /// by 3 %.
    const BUDGET_UNITS: f64 = 19.5;
    const SIZE_BUDGET_MB: f64 = 16.0;
    let tree = ["tree", "--locked", "--package", "footfall-program", "--edges", "normal,build"];
    let listed = Step::cargo(&tree).with(["--prefix", "none", "--no-dedupe"]).output()?;
    let packages = listed.lines().filter_map(|line| line.split(" (").next());
    let packages: std::collections::BTreeSet<&str> = packages.collect();
    println!("packages: {}", packages.len());

    let build = |package: &str, target: &Path| -> Result<f64> {
        remove_folder(target)?;
        let before = cpu_s_of_children()?;
        Step::cargo(&["build", "--quiet", "--release", "--locked", "--package", package])
            .with(["--target-dir", &target.display().to_string()])
            .run()?;
        Ok(cpu_s_of_children()? - before)
    };
    let (target, unit_target) = (first_command_target(), root().join("target/unit"));
    // The load of the machine may change meanwhile.
    let before_s = build(UNIT, &unit_target)?;
    let cpu_s = build("footfall-program", &target)?;
    let after_s = build(UNIT, &unit_target)?;
    let units = cpu_s / (0.5 * (before_s + after_s));
    let program = target.join("release/footfall");
    let size_mb = fs::metadata(&program).context("the program is built")?.len() as f64 / 1e6;
    println!("CPU time to compile: {cpu_s:.0} s, {units:.1} of {BUDGET_UNITS} times {UNIT}");
    println!("size of the program: {size_mb:.1} of {SIZE_BUDGET_MB} MB");
    if units > BUDGET_UNITS {
        bail!(
            "the first command takes {units:.1} times as long to compile as {UNIT}, more than {BUDGET_UNITS}"
        );
    }
    if size_mb > SIZE_BUDGET_MB {
        bail!("the program has {size_mb:.1} MB, more than {SIZE_BUDGET_MB}");
    }
    Ok(())
}

/// Part of the full checks.
type Part = (&'static str, fn() -> Result<()>);

/// The parts, in the order in which they run.
const PARTS: [Part; 11] = [
    ("features", features),
    ("hosts", hosts),
    ("boards", boards),
    ("python", python::full),
    ("research", python::research),
    ("socketcan", socketcan::run),
    ("fuzz", fuzz),
    ("benches", benches),
    ("book", || book::run().map(drop)),
    ("crates", crates::run),
    ("release", || {
        release::run(None, Purpose::Draft)?;
        installed::run(&root().join("dist"))
    }),
];

/// Names of the parts of the full checks.
pub fn parts() -> impl Iterator<Item = &'static str> {
    PARTS.iter().map(|(name, _)| *name)
}

/// Runs the full checks, which take hours: all parts, or the named ones. A part that fails does not stop the others.
///
/// # Errors
/// A part fails, or a name is unknown.
pub fn full(chosen: &[String]) -> Result<()> {
    if let Some(unknown) = chosen.iter().find(|name| !parts().any(|part| part == **name)) {
        let parts: Vec<&str> = parts().collect();
        bail!("no part is called {unknown:?}: there are {}", parts.join(", "));
    }
    install::run()?;
    let clock = Clock::start();
    let mut failed = Vec::new();
    for (name, _) in PARTS
        .iter()
        .filter(|(name, _)| chosen.is_empty() || chosen.iter().any(|chosen| chosen == name))
    {
        clock.heading(name);
        // A separate process, whose environment requires everything.
        let this = env::current_exe()?.display().to_string();
        if let Err(error) = require_everything(Step::program(&this).with(["part", name])).run() {
            eprintln!("error: {error:#}");
            failed.push(*name);
        }
    }
    clock.heading("end");
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    Ok(())
}

/// Runs one part of the full checks in this process.
///
/// # Errors
/// The part fails, or there is no such part.
pub fn part(name: &str) -> Result<()> {
    let mut parts = PARTS.iter();
    let part = parts.find(|(part, _)| *part == name);
    let (_, run) = part.with_context(|| format!("no part is called {name:?}"))?;
    run()
}

/// Target folder of builds with all features.
const FULL_TARGET: [&str; 2] = ["--target-dir", "target/full"];

/// Lints the program without a feature and with each feature alone, and the formats for a log on the target. Then lints,
/// documents and tests everything with all features. The gate leaves all of it out, because the dependencies take minutes
/// to compile.
fn features() -> Result<()> {
    Step::cargo(&["clippy", "--locked", "--all-targets"])
        .with(PACKAGES)
        .with(ALL_FEATURES)
        .with(DENY)
        .run()?;
    document(&ALL_FEATURES)?;
    for features in ["", "bags", "foxglove", "parquet", "ros2"] {
        Step::cargo(&["clippy", "--quiet", "--locked", "--package", "footfall-program"])
            .with(["--features", features])
            .with(DENY)
            .run()?;
    }
    Step::cargo(&["clippy", "--quiet", "--locked", "--package", "footfall-estimator"])
        .with(["--package", "footfall-wire", "--features", "footfall-wire/defmt"])
        .with(DENY)
        .run()?;
    let features = "footfall-program/all,host-tests/full,replay/parquet,tables/parquet";
    Step::cargo(&["test", "--locked", "--no-fail-fast"])
        .with(FULL_TARGET)
        .with(["--package", "footfall-program"])
        .with([
            "--package",
            "bags",
            "--package",
            "replay",
            "--package",
            "tables",
            "--package",
            "host-tests",
        ])
        .with(["--features", features, "--", "--include-ignored"])
        .run()?;
    // The gate runs it without features.
    Step::cargo(&["test", "--locked", "--package", "footfall-program", "--test", "thorough"])
        .with(FULL_TARGET)
        .with(["--features", "all"])
        .run()
}

/// Long tests of the packages that no other part tests.
fn hosts() -> Result<()> {
    Step::cargo(&["test", "--locked", "--no-fail-fast"])
        .with(PACKAGES)
        .with(["--exclude", "footfall-program"])
        .with(["--exclude", "host-tests"])
        .with(["--", "--ignored"])
        .run()?;
    Step::cargo(&["test", "--locked", "--no-fail-fast", "--package", "host-tests"])
        .with(["--package", "footfall-wire"])
        .with(MORE_TESTS)
        .with(["--", "--ignored"])
        .run()
}

/// Long tests of the laboratory: of the virtual board, of the measurements (among them instructions, processors and the
/// Nano's emulator), and of the RP2350's emulator. Recordings are bags, so the tests use a program with all features.
fn boards() -> Result<()> {
    firmware::build_all()?;
    Step::cargo(&["build", "--locked", "--package", "footfall-program", "--features", "all"])
        .with(FULL_TARGET)
        .run()?;
    Step::cargo(&["test", "--locked", "--package", "virtual-board", "--no-fail-fast"])
        .with(LABORATORY)
        .with(["--package", "measurements", "--", "--ignored"])
        .env("FOOTFALL_PROGRAM", root().join("target/full/debug/footfall"))
        .run()?;
    Step::cargo(&["test", "--locked", "--manifest-path", "laboratory/rp2350/Cargo.toml"]).run()
}

/// Checks that the targets of fuzzing compile; fuzzing itself needs a nightly compiler.
fn fuzz() -> Result<()> {
    Step::cargo(&["check", "--manifest-path", "laboratory/fuzz/Cargo.toml"]).run()
}

/// Runs the throughput benches, and checks that the density estimate takes more than 10 million samples a second, the figure
/// in docs/reference/evaluation.md. A fast core reaches several times that.
fn benches() -> Result<()> {
    const LEAST_MILLIONS_PER_SECOND: f64 = 10.0;
    // The test of the instruction counts has compiled the same there.
    let target: PathBuf = root().join("target/benches");
    let table = Step::cargo(&["bench", "--locked", "--package", "footfall-estimator"])
        .with(["--bench", "estimator", "--target-dir", &target.display().to_string()])
        .output()?;
    println!("{table}");
    let mut lines = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let line = lines.find(|words| words.first() == Some(&"kde/paper_50"));
    let line = line.context("the bench printed no kde/paper_50")?;
    let rate: f64 = line.get(1).copied().unwrap_or_default().parse().context("kde/paper_50")?;
    if rate <= LEAST_MILLIONS_PER_SECOND {
        bail!(
            "kde/paper_50: {rate} million samples a second, expected more than {LEAST_MILLIONS_PER_SECOND}"
        );
    }
    Ok(())
}
