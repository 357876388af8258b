//! The product's tests, and one boot of the flashed program.

use std::thread;

use anyhow::Result;

use crate::command::Step;
use crate::firmware::{self, Board};
use crate::install::{self, Tool};

/// Packages of the tests. They are compiled as one selection, so that nothing is compiled twice: the features of
/// shared dependencies are the union over all packages. Python is tested with an installed package. The readers of
/// bags are left out, because they would give the program under test a feature that is off by default, and compile
/// `SQLite`. The gate tests them by themselves.
pub const PACKAGES: [&str; 7] = [
    "--workspace",
    "--exclude",
    "bags",
    "--exclude",
    "foot-stm32f405",
    "--exclude",
    "footfall-python",
];

/// Workspace of the emulated board.
pub const LABORATORY: [&str; 2] = ["--manifest-path", "laboratory/Cargo.toml"];

/// The board whose program is booted.
const BOARD: &str = "reference";

/// Compilers of C and C++, and the tools beside libclang with which the emulator is compiled.
pub const TOOLS: [Tool; 3] = [("cc", &["gcc"]), ("c++", &["g++"]), ("cmake", &["cmake"])];

/// Tests every package, and boots the program of a board. Installs what the tests need first.
///
/// # Errors
/// A test fails, or a tool cannot be installed.
pub fn run() -> Result<()> {
    install::run(&TOOLS)?;
    // Linking the program of a board keeps only one core busy, so the tests are compiled at the same time.
    side_by_side(
        || {
            let board = Board::named(BOARD)?;
            firmware::build(&board, &[])?;
            firmware::build_bootloader(&board, &[]).map(drop)
        },
        || {
            Step::cargo(&["build", "--locked", "--tests"]).with(PACKAGES).run()?;
            boot().with(["--no-run"]).run()
        },
    )?;
    Step::cargo(&["test", "--locked"]).with(PACKAGES).run()?;
    boot().run()
}

/// Boots the program of a board on the emulated board: a walk with the bits of the host, a fault, an update.
fn boot() -> Step {
    Step::cargo(&["test", "--locked"]).with(LABORATORY).with(["--package", "boot"])
}

/// Runs two tasks at the same time. The first error comes from the second task, which takes longer.
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
