//! Breaks the code in one place after the other and looks whether a test fails, with cargo-mutants.

use anyhow::Result;

use crate::command::{Step, root};

/// What is broken: the libraries of the foot, and which packages' tests have to notice.
const TARGETS: [(&str, &[&str]); 4] = [
    ("estimator-core", &["estimator-core"]),
    ("lsm6dsox", &["lsm6dsox"]),
    ("wire", &["wire"]),
    ("firmware", &["firmware", "host-tests"]),
];

const VERSION: &str = "27.1.0";

/// Breaks one of `one_in` places of `packages`, or of all where there are none.
///
/// # Errors
/// A mutant is missed, or cargo-mutants cannot be installed.
pub fn run(packages: &[String], one_in: u32) -> Result<()> {
    let tools = root().join("target").join("tools");
    let program = tools.join("bin").join("cargo-mutants");
    if !program.exists() {
        let install = Step::cargo(&["install", "--locked", "cargo-mutants", "--version", VERSION]);
        install
            .with(["--root".to_owned(), tools.display().to_string()])
            .run()?;
    }
    for (package, judges) in TARGETS {
        if !packages.is_empty() && !packages.iter().any(|name| name == package) {
            continue;
        }
        let output = root().join("target").join("mutants").join(package);
        Step::program(&program.display().to_string())
            .with(["mutants", "--package", package, "--output"])
            .with([output.display().to_string()])
            .with(["--test-package".to_owned(), judges.join(",")])
            .with(["--sharding".to_owned(), "round-robin".to_owned()])
            .with(["--shard".to_owned(), format!("0/{}", one_in.max(1))])
            .run()?;
    }
    Ok(())
}
