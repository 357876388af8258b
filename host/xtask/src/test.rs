//! The product's tests: every behaviour once, and the flashed programs on the virtual board.

use std::thread;

use anyhow::Result;

use crate::command::{Step, root};
use crate::install::{self, Tool};
use crate::{firmware, python};

/// Packages of the tests. They are compiled as one selection, so that nothing is compiled twice: the features of shared
/// dependencies are those of all packages together.
pub const PACKAGES: [&str; 3] = ["--workspace", "--exclude", "foot-stm32f405"];

/// Workspace of the virtual board.
const LABORATORY: [&str; 2] = ["--manifest-path", "laboratory/Cargo.toml"];

/// What the virtual board's emulator is compiled with, beside libclang.
const FOR_THE_BOARD: [Tool; 1] = [("cmake", &["cmake"])];

/// Tests every behaviour once. Installs what the tests need, compiles them, and runs them.
///
/// # Errors
/// A test fails, or a tool cannot be installed.
pub fn run() -> Result<()> {
    install::run(&FOR_THE_BOARD)?;
    // Linking a program of a board keeps one core busy, so the tests are compiled beside it.
    side_by_side(
        || {
            python::install_core()?;
            firmware::build_all()
        },
        // The libraries too, for that of Python.
        || {
            Step::cargo(&["build", "--locked", "--lib", "--tests"]).with(PACKAGES).run()?;
            Step::cargo(&["build", "--locked", "--tests"]).with(LABORATORY).run()
        },
    )?;
    side_by_side(python::core, || Step::cargo(&["test", "--locked"]).with(PACKAGES).run())?;
    Step::cargo(&["test", "--locked"])
        .with(LABORATORY)
        .env("FOOTFALL_PROGRAM", root().join("target/debug/footfall"))
        .run()
}

/// Runs two tasks at the same time. The first error is that of the second task, which takes longer.
fn side_by_side(
    short: impl FnOnce() -> Result<()> + Send,
    long: impl FnOnce() -> Result<()>,
) -> Result<()> {
    thread::scope(|scope| {
        let short = scope.spawn(short);
        let long = long();
        let short = short.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        long.and(short)
    })
}
