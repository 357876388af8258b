//! Files touched by a change, according to git.

use std::collections::BTreeSet;

use anyhow::Result;

use crate::command::Step;

/// Paths, relative to the root, of all files that differ from `commit`, including untracked files.
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
