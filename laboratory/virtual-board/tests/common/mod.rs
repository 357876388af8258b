//! Builds programs for the target and boots them.

pub mod image;
pub mod rig;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use lsm6dsox::sim::Stimulus;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::chip::{Chip, ChipOptions};
use virtual_board::emulator::core::cpu::Cpu;
use virtual_board::emulator::elf::ElfImage;
use virtual_board::emulator::machine::Machine;
use virtual_board::emulator::time::PER_SECOND;
use virtual_board::emulator::wiring::Wiring;

/// Millisecond of virtual time.
pub const MILLISECOND: u64 = PER_SECOND / 1000;

pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Root of the repository.
fn repository() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().nth(2).expect("the laboratory is a folder of the repository")
}

/// Builds a program that tests the emulator and returns its path.
pub fn build_proof(program: &str) -> PathBuf {
    let manifest = ["--manifest-path", "laboratory/Cargo.toml"];
    build_with(&[&manifest[..], &["-p", "board-proofs", "--bin", program]].concat(), program)
}

/// Builds the firmware of a board and returns its path.
pub fn build_board(board: &Wiring) -> PathBuf {
    build_with(&board.cargo_arguments(), board.program)
}

/// Builds the program that measures a new board, and returns its path.
pub fn build_bring_up(board: &Wiring) -> PathBuf {
    let program = match board.name {
        "reference" => "bring-up".to_owned(),
        name => format!("bring-up-{name}"),
    };
    let mut chosen = board.cargo_arguments();
    if let Some(last) = chosen.last_mut() {
        *last = &program;
    }
    build_with(&chosen, &program)
}

/// Builds the bootloader of a board and returns its path, which differs from board to board.
pub fn build_bootloader(board: &Wiring) -> PathBuf {
    static NAMED: Mutex<BTreeMap<&str, PathBuf>> = Mutex::new(BTreeMap::new());
    let mut named = NAMED.lock().unwrap_or_else(PoisonError::into_inner);
    let copy = named.entry(board.name).or_insert_with(|| {
        let features = format!("program,{}", board.name);
        let chosen = ["-p", "bootloader-stm32f405", "--bin", "bootloader", "--features", &features];
        let built = build_with(&chosen, "bootloader");
        let copy = built.with_file_name(format!("bootloader-{}", board.name));
        std::fs::copy(&built, &copy).expect("copied");
        copy
    });
    copy.clone()
}

/// Builds a program once.
fn build_with(chosen: &[&str], program: &str) -> PathBuf {
    static BUILT: Mutex<BTreeMap<String, PathBuf>> = Mutex::new(BTreeMap::new());
    let mut built = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
    let path = built.entry(chosen.join(" ")).or_insert_with(|| {
        let directory = repository().join("target");
        let status = Command::new(env!("CARGO"))
            .current_dir(repository())
            .args(["build", "--profile", "firmware", "--locked"])
            .args(chosen)
            .args(["--target", TARGET, "--target-dir"])
            .arg(&directory)
            .env_remove("RUSTFLAGS")
            .status()
            .expect("cargo starts");
        assert!(status.success(), "{program} does not build");
        directory.join(TARGET).join("firmware").join(program)
    });
    path.clone()
}

/// Parsed ELF of a program that tests the emulator.
pub fn image(program: &str) -> ElfImage {
    let elf = std::fs::read(build_proof(program)).expect("the ELF was built");
    ElfImage::parse(&elf).expect("it is an ELF")
}

/// Boots a core with a program in flash.
pub fn boot(image: &ElfImage) -> Cpu {
    Cpu::new(
        Machine::new(Chip::new(ChipOptions::default(), Wiring::reference(), None)),
        &image.segments,
        image.vectors(),
    )
    .expect("it fits the flash")
}

/// Returns whether the product is built here: an ELF from elsewhere has numbers that differ from those of the
/// pages.
pub fn is_built_here() -> bool {
    std::env::var_os("FOOTFALL_ELF").is_none()
}

/// Path of the product: the ELF that `FOOTFALL_ELF` names, or a fresh build.
pub fn product_file() -> PathBuf {
    let given = std::env::var_os("FOOTFALL_ELF").map(PathBuf::from);
    given.unwrap_or_else(|| build_board(Wiring::reference()))
}

/// Content of [`product_file`].
pub fn product() -> Vec<u8> {
    std::fs::read(product_file()).expect("the ELF was built")
}

/// ELFs of all boards; the ELF of the reference board is [`product`].
pub fn products() -> Vec<(&'static Wiring, Vec<u8>)> {
    let read = |board: &'static Wiring| {
        if board.name == Wiring::reference().name {
            (board, product())
        } else {
            (board, std::fs::read(build_board(board)).expect("the ELF was built"))
        }
    };
    Wiring::all().iter().map(read).collect()
}

/// Options with the specimen that `FOOTFALL_CORNER` names, or a typical one.
pub fn options() -> BoardOptions {
    let name = std::env::var("FOOTFALL_CORNER").unwrap_or_else(|_| "typical".into());
    let mut options = BoardOptions::default();
    options.set_corner(name.parse().unwrap_or_else(|problem| panic!("{problem}")));
    options
}

/// Boots a board at rest with the product in its flash.
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
