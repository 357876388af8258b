//! Mutation tests with cargo-mutants: breaks the code in one place at a time and checks that a test fails.
//! `.cargo/mutants.toml` lists the exclusions, with reasons.

use std::collections::BTreeSet;
use std::fs;

use anyhow::{Context, Result, bail};

use crate::command::{Step, root};

/// Package to mutate, and the tests that must detect the mutants: the first suite is run on every mutant, the next ones
/// on those missed so far.
struct Target(&'static str, &'static [Suite]);

/// Tests that must detect mutants: a package, and cargo arguments that select its tests; empty for all.
struct Suite(&'static str, &'static [&'static str]);

/// Libraries of the foot. A mutant takes 2 s in `estimator-core`, 5 s in `lsm6dsox`, 7 s in `wire`
/// and 3 s in `firmware`; one missed by the firmware's own tests takes 40 s more, 12 s of them in the tests
/// that drive a whole foot. The other tests of `host-tests` take minutes, and test the estimator.
const TARGETS: [Target; 4] = [
    Target("estimator-core", &[Suite("estimator-core", &[])]),
    Target("lsm6dsox", &[Suite("lsm6dsox", &[])]),
    Target("wire", &[Suite("wire", &[])]),
    Target(
        "firmware",
        &[
            Suite("firmware", &["--lib"]),
            Suite("host-tests", &["--test=foot"]),
        ],
    ),
];

const VERSION: &str = "27.1.0";

/// Timeout of tests whose baseline has passed, s.
const TIMEOUT: &str = "120";

/// Exit codes of cargo-mutants: all caught, some missed, some timed out.
const COMPLETED: [i32; 3] = [0, 2, 3];

/// Tests one in `one_in` mutants of `packages`, or of all packages if empty: the one with index `nth`, from
/// 0, of each `one_in`.
///
/// # Errors
/// A mutant is missed, cargo-mutants cannot be installed, or tests fail without a mutant.
pub fn run(packages: &[String], one_in: u32, nth: u32) -> Result<()> {
    let tools = root().join("target/tools");
    let program = tools.join("bin/cargo-mutants");
    if !program.exists() {
        let install = Step::cargo(&["install", "--locked", "cargo-mutants", "--version", VERSION]);
        let root = tools.display().to_string();
        install.with(["--root", &root]).run()?;
    }
    let program = program.display().to_string();
    let one_in = one_in.max(1);
    let shard = format!("{}/{one_in}", nth % one_in);
    let sample = ["--sharding", "round-robin", "--shard", &shard].map(str::to_owned);
    let mut missed = BTreeSet::new();
    for target in &TARGETS {
        if packages.is_empty() || packages.iter().any(|name| name == target.0) {
            missed.append(&mut target.missed(&program, &sample)?);
        }
    }
    if missed.is_empty() {
        return Ok(());
    }
    let list = Vec::from_iter(missed).join("\n  ");
    bail!("no test fails with\n  {list}");
}

impl Target {
    /// Names of the mutants of a sample that no test has detected.
    fn missed(&self, program: &str, sample: &[String]) -> Result<BTreeSet<String>> {
        let Self(mutated, suites) = *self;
        let mut left = BTreeSet::<String>::new();
        for (turn, &Suite(package, tests)) in suites.iter().enumerate() {
            let output = root().join("target/mutants").join(mutated).join(package);
            fs::create_dir_all(&output)
                .with_context(|| format!("{} cannot be made", output.display()))?;
            let chosen = if turn == 0 {
                sample.to_vec()
            } else if left.is_empty() {
                break;
            } else {
                // cargo-mutants would check the baseline of the mutants' own package instead.
                let passes = Step::cargo(&["test", "--package", package]).with(tests);
                passes.run()?;
                let again = ["--baseline", "skip", "--timeout", TIMEOUT].map(str::to_owned);
                let pattern = |name: &String| ["--re".to_owned(), exact_pattern(name)];
                let patterns = left.iter().flat_map(pattern);
                again.into_iter().chain(patterns).collect()
            };
            let step = Step::program(program)
                .with(["mutants", "--package", mutated, "--test-package"])
                .with([package, "--output", &output.display().to_string()])
                .with(chosen)
                // After `--` these tests would be selected, but all others would be built.
                .with(tests.iter().map(|test| format!("--cargo-arg={test}")));
            let code = step.exit_code()?;
            if !code.is_some_and(|code| COMPLETED.contains(&code)) {
                bail!("cargo-mutants has not judged {mutated}");
            }
            let list = output.join("mutants.out/missed.txt");
            let found = fs::read_to_string(&list);
            let found = found.with_context(|| format!("{} cannot be read", list.display()))?;
            let found: BTreeSet<_> = found.lines().map(str::to_owned).collect();
            // Mutants that delete a field are generated regardless of `--re`.
            left = match turn {
                0 => found,
                _ => left.intersection(&found).cloned().collect(),
            };
        }
        Ok(left)
    }
}

/// Regular expression that matches exactly a mutant's name.
fn exact_pattern(name: &str) -> String {
    let is_special = |letter: char| r"\.+*?()|[]{}^$".contains(letter);
    let escaped = |letter| {
        (is_special(letter).then_some('\\'))
            .into_iter()
            .chain([letter])
    };
    let letters: String = name.chars().flat_map(escaped).collect();
    format!("^{letters}$")
}
