//! Quick check during development: format, lints and unit tests of the packages that a change affects.

use std::collections::BTreeSet;

use anyhow::Result;

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

/// Paths, relative to the root, of all files that differ from `commit`, including untracked files.
fn changed_since(commit: &str) -> Result<BTreeSet<String>> {
    let git = |arguments: &[&str]| Step::program("git").with(arguments).output();
    let changed = git(&["diff", "--name-only", commit, "--"])?;
    let added = git(&["ls-files", "--others", "--exclude-standard"])?;
    let paths = changed.lines().chain(added.lines());
    Ok(paths.map(str::to_owned).collect())
}

/// Checks the packages that differ from `commit`.
///
/// # Errors
/// A check fails.
pub fn run(commit: &str) -> Result<()> {
    Step::cargo(&["fmt", "--all", "--check"]).run()?;
    let affected = Packages::read()?.affected(&changed_since(commit)?);
    if affected.is_empty() {
        eprintln!("no package is touched");
        return Ok(());
    }
    let names = affected.iter().map(String::as_str);
    let on_hosts = names.filter(|name| !NOT_FOR_HOSTS.contains(name));
    let (libraries, others): (Vec<&str>, Vec<&str>) =
        on_hosts.partition(|name| LIBRARY_ALONE.contains(name));
    let named = |names: &[&str]| {
        let pair = |name| ["-p".to_owned(), format!("{name}@{VERSION}")];
        names.iter().flat_map(pair).collect::<Vec<String>>()
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
    let quick = |names: &[&str]| {
        let quick = names.iter().copied().filter(|name| !SLOW.contains(name));
        named(&quick.collect::<Vec<&str>>())
    };
    for (targets, names) in
        [(&["--lib"][..], quick(&libraries)), (&["--lib", "--bins"], quick(&others))]
    {
        if !names.is_empty() {
            let tests = Step::cargo(&["test", "--locked", "--quiet"]);
            tests.with(targets).with(names).run()?;
        }
    }
    Ok(())
}
