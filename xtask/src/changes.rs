//! Which files a change has touched, by git.

use std::collections::BTreeSet;

use anyhow::Result;

use crate::command::Step;

/// Paths from the root of all files that differ from `commit`, those that git does not know yet
/// among them.
///
/// # Errors
/// Git does not know the commit.
pub fn since(commit: &str) -> Result<BTreeSet<String>> {
    let git = |arguments: &[&str]| Step::program("git").with(arguments).output();
    let changed = git(&["diff", "--name-only", commit, "--"])?;
    let added = git(&["ls-files", "--others", "--exclude-standard"])?;
    let paths = changed.lines().chain(added.lines());
    Ok(paths.map(str::to_owned).collect())
}
