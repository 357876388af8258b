//! Mutation tests with cargo-mutants: breaks the code in one place at a time and checks that a test fails.
//! `.cargo/mutants.toml` lists the exclusions, with reasons.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::command::{Step, root};

/// Package to mutate, and the tests that must detect the mutants.
struct Target {
    package: &'static str,
    /// The first is run on every mutant, the next ones on those missed so far.
    judges: &'static [Judges],
}

/// Tests that must detect mutants: a package, and cargo arguments that select its tests; empty for all.
struct Judges(&'static str, &'static [&'static str]);

/// Libraries of the foot. A mutant takes 2 s in `estimator-core`, 5 s in `lsm6dsox`, 7 s in `wire`
/// and 3 s in `firmware`; one missed by the firmware's own tests takes 40 s more, 12 s of them in the tests
/// that drive a whole foot. The other tests of `host-tests` take minutes, and test the estimator.
const TARGETS: [Target; 4] = [
    Target {
        package: "estimator-core",
        judges: &[Judges("estimator-core", &[])],
    },
    Target {
        package: "lsm6dsox",
        judges: &[Judges("lsm6dsox", &[])],
    },
    Target {
        package: "wire",
        judges: &[Judges("wire", &[])],
    },
    Target {
        package: "firmware",
        judges: &[
            Judges("firmware", &["--lib"]),
            Judges("host-tests", &["--test=foot"]),
        ],
    },
];

const VERSION: &str = "27.1.0";

/// Timeout of tests whose baseline has passed, s.
const TIMEOUT: &str = "120";

/// Exit codes of cargo-mutants: all caught, some missed, some timed out.
const JUDGED: [i32; 3] = [0, 2, 3];

/// Tests one in `one_in` mutants of `packages`, or of all packages if empty: the one with index `nth`, from
/// 0, of each `one_in`.
///
/// # Errors
/// A mutant is missed, cargo-mutants cannot be installed, or tests fail without a mutant.
pub fn run(packages: &[String], one_in: u32, nth: u32) -> Result<()> {
    let tools = root().join("target").join("tools");
    let program = tools.join("bin").join("cargo-mutants");
    if !program.exists() {
        let install = Step::cargo(&["install", "--locked", "cargo-mutants", "--version", VERSION]);
        install
            .with(["--root".to_owned(), tools.display().to_string()])
            .run()?;
    }
    let program = program.display().to_string();
    let one_in = one_in.max(1);
    let sample = ["--sharding".to_owned(), "round-robin".to_owned()];
    let sample = sample
        .into_iter()
        .chain(["--shard".to_owned(), format!("{}/{one_in}", nth % one_in)]);
    let sample: Vec<String> = sample.collect();
    let mut missed = BTreeSet::new();
    for target in &TARGETS {
        if packages.is_empty() || packages.iter().any(|name| name == target.package) {
            missed.append(&mut target.missed(&program, &sample)?);
        }
    }
    if missed.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = missed.into_iter().collect();
    bail!("no test fails with\n  {}", list.join("\n  "));
}

impl Target {
    /// Names of the mutants of a sample that no test has detected.
    fn missed(&self, program: &str, sample: &[String]) -> Result<BTreeSet<String>> {
        let mut left = BTreeSet::<String>::new();
        for (turn, &Judges(package, tests)) in self.judges.iter().enumerate() {
            let output = root().join("target").join("mutants").join(self.package);
            let output = output.join(package);
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
                let names = left
                    .iter()
                    .flat_map(|name| ["--re".to_owned(), whole(name)]);
                again.into_iter().chain(names).collect()
            };
            let step = Step::program(program)
                .with(["mutants", "--package", self.package, "--test-package"])
                .with([package, "--output", &output.display().to_string()])
                .with(chosen)
                // After `--` these tests would be selected, but all others would be built.
                .with(tests.iter().map(|test| format!("--cargo-arg={test}")));
            let code = step.exit_code()?;
            if !code.is_some_and(|code| JUDGED.contains(&code)) {
                bail!("cargo-mutants has not judged {}", self.package);
            }
            let found = names(&output.join("mutants.out").join("missed.txt"))?;
            // Mutants that delete a field are generated regardless of `--re`.
            left = match turn {
                0 => found,
                _ => left.intersection(&found).cloned().collect(),
            };
        }
        Ok(left)
    }
}

fn names(list: &Path) -> Result<BTreeSet<String>> {
    let text = fs::read_to_string(list);
    let text = text.with_context(|| format!("{} cannot be read", list.display()))?;
    Ok(text.lines().map(str::to_owned).collect())
}

/// Regular expression that matches exactly a mutant's name.
fn whole(name: &str) -> String {
    let mut expression = String::from("^");
    for letter in name.chars() {
        if r"\.+*?()|[]{}^$".contains(letter) {
            expression.push('\\');
        }
        expression.push(letter);
    }
    expression.push('$');
    expression
}
