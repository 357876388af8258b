//! Writes generated files and tables again: descriptions of the wire, pictures, tables in the
//! documents.

use anyhow::Result;

use crate::command::Step;

/// The packages whose tests hold generated files, those first that others read.
const PACKAGES: [&[&str]; 3] = [
    &["-p", "wire", "-p", "estimator-core", "-p", "lsm6dsox"],
    &["-p", "footfall", "-p", "host-tests"],
    &["-p", "virtual-board"],
];

/// Runs the tests that generate, and writes what differs.
///
/// # Errors
/// A test fails for another reason than an old file.
pub fn run() -> Result<()> {
    Step::program(".ci/install").run()?;
    for packages in PACKAGES {
        Step::cargo(&["test", "--locked", "--no-fail-fast"])
            .with(packages)
            .with_env("FOOTFALL_UPDATE", "1")
            .with_env("FOOTFALL_REQUIRE_EVERYTHING", "1")
            .run()?;
    }
    Step::program("git").with(["status", "--short"]).run()
}
