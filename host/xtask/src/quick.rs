//! Quick check during development: format, lints and unit tests of the packages that a change affects.

use std::collections::BTreeSet;

use anyhow::Result;

use crate::command::Step;
use crate::packages::Packages;

/// Packages that are not built on a host.
const NOT_FOR_HOSTS: [&str; 3] = ["bootloader-stm32f405", "foot-stm32f405", "stm32f405-chip"];

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
    let names = affected.iter().map(String::as_str);
    let on_hosts: Vec<&str> = names.filter(|name| !NOT_FOR_HOSTS.contains(name)).collect();
    if on_hosts.is_empty() {
        eprintln!(
            "nothing was checked but the format: no package that a host builds has changed; `.ci/run` checks the laboratory \
             and the programs of the boards"
        );
        return Ok(());
    }
    let named = |names: &[&str]| {
        let pair = |name| ["-p".to_owned(), format!("{name}@{VERSION}")];
        names.iter().flat_map(pair).collect::<Vec<String>>()
    };
    let lints = Step::cargo(&["clippy", "--locked", "--all-targets"]);
    lints.with(named(&on_hosts)).with(["--", "-D", "warnings"]).run()?;
    let tests = Step::cargo(&["test", "--locked", "--quiet", "--lib", "--bins"]);
    tests.with(named(&on_hosts)).run()
}
