//! Updates generated files: descriptions of the wire, pictures, tables in the documents.

use anyhow::Result;

use crate::command::Step;

/// Packages whose tests generate files, in order of dependency.
const PACKAGES: [&[&str]; 3] = [
    &["-p", "wire", "-p", "estimator-core", "-p", "lsm6dsox"],
    &["-p", "footfall", "-p", "host-tests"],
    &["-p", "virtual-board"],
];

/// Runs the tests that generate files, and writes those that differ.
///
/// # Errors
/// A test fails for a reason other than an outdated file.
pub fn run() -> Result<()> {
    Step::program(".ci/install").run()?;
    for packages in PACKAGES {
        Step::cargo(&["test", "--locked", "--no-fail-fast"])
            .with(packages)
            .with_env("FOOTFALL_REQUIRE_EVERYTHING", "1")
            .with_env("FOOTFALL_UPDATE", "1")
            .run()?;
    }
    Step::program("git").with(["status", "--short"]).run()
}
