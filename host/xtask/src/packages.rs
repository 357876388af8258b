//! Packages of the workspace and their dependencies.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::command::Step;

/// Output of `cargo metadata`.
#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    workspace_root: PathBuf,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    manifest_path: PathBuf,
    dependencies: Vec<Dependency>,
    /// Registries to which the package may go; `None` means any.
    publish: Option<Vec<String>>,
}

#[derive(Deserialize)]
struct Dependency {
    name: String,
}

/// Packages of the workspace.
pub struct Packages {
    /// Packages by name, each with its folder, relative to the root, and with the packages of the workspace on which it
    /// depends.
    all: BTreeMap<String, (String, BTreeSet<String>)>,
    /// Names of the packages that may be published.
    publishable: BTreeSet<String>,
}

impl Packages {
    /// Reads the packages from cargo's metadata.
    ///
    /// # Errors
    /// A manifest cannot be read.
    pub fn read() -> Result<Self> {
        let text = Step::cargo(&["metadata", "--format-version", "1", "--no-deps"]).output()?;
        let metadata: Metadata = serde_json::from_str(&text)?;
        let names = metadata.packages.iter();
        let names: BTreeSet<&str> = names.map(|package| package.name.as_str()).collect();
        let mut all = BTreeMap::new();
        for package in &metadata.packages {
            let folder = package.manifest_path.parent();
            let folder = folder.and_then(|path| path.strip_prefix(&metadata.workspace_root).ok());
            let folder = folder.and_then(Path::to_str);
            let folder = folder.with_context(|| format!("{} is elsewhere", package.name))?;
            let needs = package.dependencies.iter();
            let needs = needs.filter(|needed| names.contains(needed.name.as_str()));
            let needs = needs.map(|needed| needed.name.clone()).collect();
            all.insert(package.name.clone(), (folder.to_owned(), needs));
        }
        let publishable = metadata.packages.into_iter().filter(|package| package.publish.is_none());
        let publishable = publishable.map(|package| package.name).collect();
        Ok(Self { all, publishable })
    }

    /// Names of the packages that may be published, in alphabetical order.
    pub fn publishable(&self) -> impl Iterator<Item = &str> {
        self.publishable.iter().map(String::as_str)
    }

    /// Returns the package of a file: of all packages whose folder contains the file, the one with the longest folder.
    fn owner(&self, path: &str) -> Option<&str> {
        let rest = |folder: &str| path.strip_prefix(folder);
        let owns = |folder: &str| rest(folder).is_some_and(|rest| rest.starts_with('/'));
        let owners = self.all.iter().filter(|(_, (folder, _))| owns(folder));
        let owner = owners.max_by_key(|(_, (folder, _))| folder.len());
        owner.map(|(name, _)| name.as_str())
    }

    /// Packages with these files, and the packages that depend on them, directly or indirectly. The manifest
    /// at the root and the files that configure compiler, lints and linker affect all packages.
    pub fn affected(&self, paths: &BTreeSet<String>) -> BTreeSet<String> {
        let of_all = [
            "Cargo.toml",
            "Cargo.lock",
            "rust-toolchain.toml",
            "clippy.toml",
            ".cargo/config.toml",
            "memory.x",
        ];
        if of_all.iter().any(|path| paths.contains(*path)) {
            return self.all.keys().cloned().collect();
        }
        let owners = paths.iter().filter_map(|path| self.owner(path));
        let mut affected: BTreeSet<String> = owners.map(str::to_owned).collect();
        loop {
            let depends = |needs: &BTreeSet<String>| !needs.is_disjoint(&affected);
            let users = self.all.iter().filter(|(_, (_, needs))| depends(needs));
            let users: Vec<String> = users.map(|(name, _)| name.clone()).collect();
            let before = affected.len();
            affected.extend(users);
            if affected.len() == before {
                return affected;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packages() -> Packages {
        let package = |folder: &str, needs: &[&str]| {
            let needs = needs.iter().map(|name| (*name).to_owned()).collect();
            (folder.to_owned(), needs)
        };
        let all = [
            ("core", package("core", &[])),
            ("wire", package("wire", &["core"])),
            ("board", package("board", &["wire"])),
            ("proofs", package("board/proofs", &[])),
        ];
        let all = all.map(|(name, package)| (name.to_owned(), package));
        Packages { all: all.into(), publishable: BTreeSet::new() }
    }

    fn touched(path: &str) -> Vec<String> {
        let paths = BTreeSet::from([path.to_owned()]);
        packages().affected(&paths).into_iter().collect()
    }

    #[test]
    fn file_touches_its_package_and_dependents() {
        assert_eq!(touched("wire/src/lib.rs"), ["board", "wire"]);
        assert_eq!(touched("core/src/lib.rs"), ["board", "core", "wire"]);
    }

    #[test]
    fn nested_package_owns_its_files() {
        assert_eq!(touched("board/proofs/src/main.rs"), ["proofs"]);
    }

    #[test]
    fn root_file_touches_all_packages_and_a_document_none() {
        assert!(touched("docs/design/choosing.md").is_empty());
        assert!(touched("wires/src/lib.rs").is_empty());
        for path in ["Cargo.lock", "clippy.toml", ".cargo/config.toml", "memory.x"] {
            assert_eq!(touched(path).len(), 4, "{path}");
        }
    }

    #[test]
    fn workspace_packages_are_found() {
        let packages = Packages::read().expect("the manifests are sound");
        let (folder, _) = &packages.all["xtask"];
        assert_eq!(folder, "host/xtask");
        assert!(packages.all["footfall-wire"].1.contains("footfall-estimator"));
    }
}
