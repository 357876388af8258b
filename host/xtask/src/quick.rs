//! Quick check during development: format, lints and unit tests of the packages that a change affects.

use anyhow::Result;

use crate::changes;
use crate::command::Step;
use crate::packages::Packages;

/// Packages with binaries for the target only; a host builds their libraries.
const LIBRARY_ALONE: [&str; 1] = ["firmware"];

/// Packages that are not built on a host.
const NOT_FOR_HOSTS: [&str; 1] = ["board-proofs"];

/// Packages with only integration tests, which take minutes.
const SLOW: [&str; 1] = ["host-tests"];

/// Version of all packages of the workspace, which distinguishes them from a dependency with the same name.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Checks the packages that differ from `commit`.
///
/// # Errors
/// A check fails.
pub fn run(commit: &str) -> Result<()> {
    Step::cargo(&["fmt", "--all", "--check"]).run()?;
    let touched = Packages::read()?.touched(&changes::since(commit)?);
    if touched.is_empty() {
        eprintln!("no package is touched");
        return Ok(());
    }
    let is_one_of = |list: &[&str], name: &str| list.contains(&name);
    let on_hosts = touched
        .iter()
        .filter(|name| !is_one_of(&NOT_FOR_HOSTS, name));
    let (libraries, others): (Vec<&String>, Vec<&String>) =
        on_hosts.partition(|name| is_one_of(&LIBRARY_ALONE, name));
    let named = |names: &[&String]| {
        let pairs = names
            .iter()
            .flat_map(|name| ["-p".to_owned(), format!("{name}@{VERSION}")]);
        pairs.collect::<Vec<String>>()
    };
    let deny = ["--", "-D", "warnings"];
    if !libraries.is_empty() {
        let lints = Step::cargo(&["clippy", "--locked", "--lib", "--tests"]);
        lints.with(named(&libraries)).with(deny).run()?;
    }
    if !others.is_empty() {
        let lints = Step::cargo(&["clippy", "--locked", "--all-targets"]);
        lints.with(named(&others)).with(deny).run()?;
    }
    let quick = |names: &[&String]| {
        let quick = names.iter().filter(|name| !is_one_of(&SLOW, name));
        named(&quick.copied().collect::<Vec<&String>>())
    };
    for (targets, names) in [
        (&["--lib"][..], quick(&libraries)),
        (&["--lib", "--bins"], quick(&others)),
    ] {
        if !names.is_empty() {
            let tests = Step::cargo(&["test", "--locked", "--quiet"]);
            tests.with(targets).with(names).run()?;
        }
    }
    Ok(())
}
