//! Installs the tools that the gate and the full checks need and this machine lacks.

use anyhow::Result;
use xtask::command::{Step, is_installed};
use xtask::install::{self, Tool};
use xtask::test::TOOLS;
use xtask::uf2::Board;

/// An emulated Cortex-M4F, and can-utils.
const FOR_GATE: [Tool; 2] =
    [("qemu-system-arm", &["qemu-system-arm"]), ("log2asc", &["can-utils"])];

/// Valgrind for instruction counts, Node.js for the emulator of the Nano's chip, and compilers and emulators of other
/// processors for the library in C, whose Rust targets `cargo xtask library` adds.
const FOR_FULL: [Tool; 13] = [
    ("valgrind", &["valgrind"]),
    ("node", &["nodejs"]),
    ("npm", &["npm"]),
    ("arm-none-eabi-gcc", &["gcc-arm-none-eabi", "libnewlib-arm-none-eabi"]),
    ("riscv64-unknown-elf-gcc", &["gcc-riscv64-unknown-elf", "picolibc-riscv64-unknown-elf"]),
    ("aarch64-linux-gnu-gcc", &["gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross"]),
    ("i686-linux-gnu-gcc", &["gcc-i686-linux-gnu", "libc6-dev-i386-cross"]),
    ("x86_64-w64-mingw32-gcc", &["gcc-mingw-w64-x86-64"]),
    ("qemu-system-riscv32", &["qemu-system-misc"]),
    ("qemu-aarch64", &["qemu-user"]),
    ("pkg-config", &["pkg-config"]),
    ("wasm2c", &["wabt"]),
    ("xtensa-lx106-elf-gcc", &["gcc-xtensa-lx106", "picolibc-xtensa-lx106-elf"]),
];

/// Names of a browser for the page of a replay.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Installs the Debian packages that the gate needs.
///
/// # Errors
/// A package is missing that this system cannot install.
pub fn for_gate() -> Result<()> {
    install::run(&TOOLS)?;
    install::run(&FOR_GATE)?;
    if Step::program("python3").with(["-c", "import ensurepip, venv"]).output().is_err() {
        install::install_packages(&["python3", "python3-venv"])?;
    }
    Ok(())
}

/// Installs the Rust targets of all boards, and the Debian packages that the full checks need.
///
/// # Errors
/// A package is missing that this system cannot install.
pub fn run() -> Result<()> {
    for_gate()?;
    install::run(&FOR_FULL)?;
    if !BROWSERS.iter().any(|name| is_installed(name)) {
        install::install_packages(&["chromium"])?;
    }
    let targets = Board::ALL.map(Board::target);
    Step::program("rustup").with(["target", "add"]).with(targets).run()
}
