//! Builds programs for the target and boots them.

// Every test takes what it needs.
#![allow(dead_code)]

use std::path::PathBuf;
use std::process::Command;
use std::sync::Mutex;

use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use virtual_board::chip::Chip;
use virtual_board::core::cpu::Cpu;
use virtual_board::elf::Image;
use virtual_board::machine::Machine;

pub const TARGET: &str = "thumbv7em-none-eabihf";

/// A directory to write to.
pub fn directory(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Whether what takes many minutes is to be run as well.
pub fn everything() -> bool {
    std::env::var_os("FOOTFALL_HOUR").is_some_and(|value| value == "1")
}

/// Builds a release ELF for the target and returns its path.
pub fn build(package: &str, program: &str) -> PathBuf {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock();
    // A directory of its own: the host's build holds the lock of the other.
    let directory = workspace().join("target").join("board");
    let status = Command::new(env!("CARGO"))
        .current_dir(workspace())
        .args([
            "build",
            "--release",
            "--locked",
            "-p",
            package,
            "--bin",
            program,
        ])
        .args(["--target", TARGET, "--target-dir"])
        .arg(&directory)
        .env_remove("RUSTFLAGS")
        .status()
        .expect("cargo starts");
    assert!(status.success(), "{program} does not build");
    directory.join(TARGET).join("release").join(program)
}

/// The ELF and its parts.
pub fn image(package: &str, program: &str) -> Image {
    let elf = std::fs::read(build(package, program)).expect("the ELF was built");
    Image::parse(&elf).expect("it is an ELF")
}

/// A core with a program in flash.
pub fn boot(image: &Image) -> Cpu {
    Cpu::new(Machine::new(Chip::default()), &image.segments).expect("it fits the flash")
}

/// Whether the product is built here: one from elsewhere has numbers of its own, which are not
/// those of the README.
pub fn is_built_here() -> bool {
    std::env::var_os("FOOTFALL_ELF").is_none()
}

/// The product: the ELF that `FOOTFALL_ELF` names, or a fresh build where there is its source.
/// `None` where there is neither, which counts as a failure where everything is required.
pub fn product() -> Option<Vec<u8>> {
    let path = match std::env::var_os("FOOTFALL_ELF") {
        Some(path) => PathBuf::from(path),
        None if workspace().join("firmware/src/main.rs").exists() => build("firmware", "foot"),
        None => {
            unmet("there is no product to boot");
            return None;
        }
    };
    Some(std::fs::read(path).expect("the ELF was built"))
}
