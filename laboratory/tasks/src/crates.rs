//! Packs the packages that can be published, and checks only the packed files: a program outside the workspace runs
//! with them, their own tests pass, and each compiles with the oldest compiler that its manifest names.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use xtask::command::{Step, remove_folder, root};

/// Names of the packages, without their common beginning, in the order in which they are published.
const NAMES: [&str; 5] = ["estimator", "wire", "lsm6dsox", "storage", "bootloader"];

/// Features that the packages' tests need.
const FOR_TESTS: &str =
    "footfall-bootloader/verify,footfall-lsm6dsox/estimator,footfall-lsm6dsox/sim";

/// Files in each package.
const FILES: [&str; 4] = ["Cargo.toml", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];

/// Beginnings of lines in each manifest, which a registry shows.
const FIELDS: [&str; 6] = [
    "description = ",
    "documentation = ",
    "license = ",
    "repository = ",
    "rust-version = ",
    "[package.metadata.docs.rs]",
];

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A program that uses an item of each package.
const PROGRAM: &str = r#"use estimator_core::{ContactEstimator, ImuSample, Params, Stream};

fn main() -> Result<(), estimator_core::ParamsError> {
    let config = Params::DEFAULT.validate()?;
    let mut estimator = ContactEstimator::new(&config, Stream::KILOHERTZ);
    let estimate = estimator.update(&ImuSample::default(), None);
    assert!((0.0..=1.0).contains(&estimate.probabilities.stable));
    assert!(lsm6dsox::Config::FRESH_KILOHERTZ.noise().specific_force.is_some());
    assert_eq!(storage::Origin::Blank.fault_detail(), None);
    assert!(wire::CanFrame::new(0x191, &[]).is_some());
    assert!(bootloader::image::USED > 0);
    Ok(())
}
"#;

/// Packs the packages and checks them.
///
/// # Errors
/// A package cannot be packed, lacks a file or a field, does not compile, or fails a test.
pub fn run() -> Result<()> {
    pack()?;
    let outside = root().join("target/outside");
    remove_folder(&outside)?;
    fs::create_dir_all(outside.join("src"))?;
    for name in NAMES {
        unpack(name, &outside)?;
    }
    fs::write(outside.join("Cargo.toml"), manifest())?;
    fs::write(outside.join("src/main.rs"), PROGRAM)?;
    Step::program("cargo").at(&outside).with(["run", "--quiet"]).run()?;
    println!("a program outside the workspace runs with all {} packages", NAMES.len());
    let tree = ["tree", "--package", "footfall-estimator", "--edges", "normal"];
    let tree = Step::program("cargo").at(&outside).with(tree).output()?;
    if tree.lines().count() != 1 {
        bail!("footfall-estimator has dependencies:\n{tree}");
    }
    Step::program("cargo")
        .at(&outside)
        .with(["test", "--workspace", "--quiet", "--features", FOR_TESTS])
        // Random histories take minutes without it.
        .env("CARGO_PROFILE_TEST_OPT_LEVEL", "2")
        .run()?;
    println!("the tests of the packed packages pass");
    for name in NAMES {
        let oldest = oldest_compiler(name, &outside)?;
        let install = ["toolchain", "install", "--profile", "minimal", "--no-self-update"];
        Step::program("rustup").with(install).with([&oldest]).run()?;
        Step::program("rustup")
            .at(&outside)
            .with(["run", &oldest, "cargo", "check", "--locked", "--quiet"])
            .with(["--package", &format!("footfall-{name}")])
            .run()?;
        println!("footfall-{name} compiles with Rust {oldest}");
    }
    Ok(())
}

/// Packs the packages, and returns the files in the order in which a registry takes them: a package after those that it
/// depends on.
///
/// # Errors
/// A package cannot be packed.
pub fn pack() -> Result<[PathBuf; NAMES.len()]> {
    let packages = NAMES.map(|name| format!("--package=footfall-{name}"));
    Step::cargo(&["package", "--locked", "--no-verify", "--quiet"]).with(packages).run()?;
    Ok(NAMES.map(packed))
}

/// File of a packed package.
fn packed(name: &str) -> PathBuf {
    root().join("target/package").join(format!("{}.crate", folder_of(name)))
}

fn folder_of(name: &str) -> String {
    format!("footfall-{name}-{VERSION}")
}

fn unpack(name: &str, outside: &Path) -> Result<()> {
    let (folder, file) = (folder_of(name), packed(name));
    Step::program("tar")
        .with(["--extract", "--gzip", "--directory", &outside.display().to_string()])
        .with(["--file", &file.display().to_string()])
        .run()?;
    for file in FILES {
        let metadata = fs::symlink_metadata(outside.join(&folder).join(file));
        if !metadata.is_ok_and(|metadata| metadata.is_file()) {
            bail!("footfall-{name} lacks {file}");
        }
    }
    let manifest = fs::read_to_string(outside.join(&folder).join("Cargo.toml"))?;
    for field in FIELDS {
        if !manifest.lines().any(|line| line.starts_with(field)) {
            bail!("footfall-{name}: its manifest has no line {field:?}");
        }
    }
    Ok(())
}

/// Manifest of the program outside the workspace, whose packages are the unpacked ones.
fn manifest() -> String {
    let mut text = format!(
        r#"[package]
name = "outside"
edition = "2024"
rust-version = "1.88"

[workspace]
members = ["footfall-*"]

[dependencies]
footfall-estimator = "{VERSION}"
footfall-lsm6dsox = {{ version = "{VERSION}", features = ["estimator"] }}
footfall-storage = "{VERSION}"
footfall-wire = "{VERSION}"
footfall-bootloader = {{ version = "{VERSION}", features = ["verify"] }}

[patch.crates-io]
"#
    );
    for name in NAMES {
        let _ = writeln!(text, "footfall-{name} = {{ path = \"{}\" }}", folder_of(name));
    }
    text
}

/// Oldest compiler that the manifest of an unpacked package names.
fn oldest_compiler(name: &str, outside: &Path) -> Result<String> {
    let manifest = fs::read_to_string(outside.join(folder_of(name)).join("Cargo.toml"))?;
    let mut lines = manifest.lines();
    let line = lines.find_map(|line| line.strip_prefix("rust-version = "));
    let version = line.with_context(|| format!("footfall-{name} names no oldest compiler"))?;
    Ok(version.trim_matches('"').to_owned())
}

#[cfg(test)]
mod tests {
    use xtask::packages::Packages;

    use super::*;

    #[test]
    fn packed_crates_are_those_that_may_be_published() {
        let packages = Packages::read().expect("manifests");
        let mut packed = NAMES.map(|name| format!("footfall-{name}"));
        packed.sort();
        let publishable: Vec<&str> = packages.publishable().collect();
        assert_eq!(publishable, packed, "`publish` of the manifests, and `NAMES`");
        let page = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("the page");
        for name in packed {
            assert!(page.contains(&format!("`{name}`")), "CONTRIBUTING.md: {name}");
        }
    }
}
