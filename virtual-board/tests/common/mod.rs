//! Builds programs for the target and boots them.

// Every test takes what it needs.
#![allow(dead_code)]

pub mod rig;

use std::path::PathBuf;
use std::process::Command;
use std::sync::Mutex;

use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use lsm6dsox::sim::Stimulus;
use virtual_board::board::{Board, BoardOptions};
use virtual_board::chip::Chip;
use virtual_board::core::cpu::Cpu;
use virtual_board::elf::Image;
use virtual_board::machine::Machine;
use virtual_board::time::PER_SECOND;
use wire::Emergency;

/// Of the board's time.
pub const MILLISECOND: u64 = PER_SECOND / 1000;

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
            "--profile",
            "firmware",
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
    directory.join(TARGET).join("firmware").join(program)
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
pub fn product_file() -> Option<PathBuf> {
    match std::env::var_os("FOOTFALL_ELF") {
        Some(path) => Some(PathBuf::from(path)),
        None if workspace().join("firmware/src/main.rs").exists() => {
            Some(build("firmware", "foot"))
        }
        None => {
            unmet("there is no product to boot");
            None
        }
    }
}

/// What is in [`product_file`].
pub fn product() -> Option<Vec<u8>> {
    Some(std::fs::read(product_file()?).expect("the ELF was built"))
}

/// The specimen that `FOOTFALL_CORNER` names, or a typical one.
pub fn options() -> BoardOptions {
    let name = std::env::var("FOOTFALL_CORNER").unwrap_or_else(|_| "typical".into());
    let mut options = BoardOptions::default();
    options.set_corner(name.parse().unwrap_or_else(|problem| panic!("{problem}")));
    options
}

/// A board that stands, with the product in its flash.
pub fn boot_product(elf: &[u8]) -> Board {
    let at_rest = |_| Stimulus::REST;
    Board::with_motion(elf, options(), at_rest).expect("it fits the flash")
}

/// Runs the board for `ms`.
pub fn run(board: &mut Board, ms: u64) {
    if let Err(failure) = board.run_for(ms * MILLISECOND) {
        panic!("{failure}");
    }
}

/// Runs the board for `ms`: the codes of the emergency messages meanwhile, and how many contacts.
pub fn watch(board: &mut Board, ms: u64) -> (Vec<u16>, usize) {
    board.take_can();
    run(board, ms);
    let frames = board.take_can();
    let codes = frames
        .iter()
        .filter(|sent| sent.frame.id == 0x091)
        .filter_map(|sent| <[u8; 8]>::try_from(sent.frame.data.as_slice()).ok())
        .map(|data| Emergency::decode(&data).code)
        .filter(|code| *code != 0)
        .collect();
    let contacts = frames.iter().filter(|sent| sent.frame.id == 0x191);
    (codes, contacts.count())
}
