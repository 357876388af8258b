//! Address of the project. It stands once, as `repository` in the `Cargo.toml` of the workspace.
//!
//! Manifests of packages inherit it, from where `PyPI`, Debian's package, `cargo binstall` and the library in C have it.
//! Three documents repeat it, into which [`update`] writes it.

use std::fs;

use anyhow::{Context, Result};

use crate::command::root;

/// The address.
pub const ADDRESS: &str = env!("CARGO_PKG_REPOSITORY");

/// Address of a project that has none yet.
pub const PLACEHOLDER: &str = "https://example.org/footfall";

/// Files that repeat the address, with the text before it and behind it.
const PLACES: [(&str, &str, &str); 3] = [
    ("CITATION.cff", "\nrepository-code: ", "\n"),
    ("README.md", "`cargo binstall --git ", " "),
    ("docs/guide/your-own-board.md", "footfall-estimator = { git = \"", "\""),
];

/// Files that name another address, with the text that they should have.
///
/// # Errors
/// A file cannot be read, or lacks the text around the address.
pub fn differing() -> Result<Vec<(&'static str, String)>> {
    let mut differing = Vec::new();
    for (file, before, behind) in PLACES {
        let text = fs::read_to_string(root().join(file)).with_context(|| file.to_owned())?;
        let updated = with_address(&text, before, behind, ADDRESS);
        let updated = updated.with_context(|| format!("{file}: no address behind {before:?}"))?;
        if updated != text {
            differing.push((file, updated));
        }
    }
    Ok(differing)
}

/// Writes the address into the files that name another one.
///
/// # Errors
/// As [`differing`], or a file cannot be written.
pub fn update() -> Result<()> {
    for (file, text) in differing()? {
        fs::write(root().join(file), text).with_context(|| file.to_owned())?;
    }
    Ok(())
}

/// Returns the text with another address at its place.
fn with_address(text: &str, before: &str, behind: &str, address: &str) -> Option<String> {
    let begin = text.find(before)? + before.len();
    let end = begin + text[begin..].find(behind)?;
    Some(format!("{}{address}{}", &text[..begin], &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_the_address_of_the_workspace() {
        if std::env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
            update().expect("the files can be written");
        }
        let differing = differing().expect("each file has an address");
        let files: Vec<_> = differing.iter().map(|(file, _)| file).collect();
        assert!(files.is_empty(), "FOOTFALL_UPDATE=1 writes {ADDRESS} into {files:?}");
    }

    #[test]
    fn packages_that_users_download_inherit_the_address() {
        for package in ["estimator-core", "host/footfall", "python"] {
            let manifest = fs::read_to_string(root().join(package).join("Cargo.toml"));
            let manifest = manifest.expect("a manifest");
            let inherits = manifest.lines().any(|line| line == "repository.workspace = true");
            assert!(inherits, "{package}: repository.workspace = true");
        }
    }

    #[test]
    fn other_address_is_replaced_at_its_place_alone() {
        let text = "a: https://a.org\nrepository-code: https://a.org\nb: c\n";
        let expected = "a: https://a.org\nrepository-code: https://b.org/d\nb: c\n";
        let (before, behind) = ("\nrepository-code: ", "\n");
        let replaced = with_address(text, before, behind, "https://b.org/d");
        assert_eq!(replaced.as_deref(), Some(expected));
        assert_eq!(with_address("a: b\n", before, behind, "c"), None);
    }
}
