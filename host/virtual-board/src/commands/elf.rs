//! The ELF to boot: the named file, or the firmware of this workspace for a board, built now.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use virtual_board::emulator::wiring::Wiring;

/// Options that choose the ELF.
#[derive(Args)]
pub struct ElfArguments {
    /// The ELF; without it the firmware is built first.
    #[arg(long)]
    elf: Option<PathBuf>,
    /// The board whose firmware is built: reference or feather. An ELF names its board.
    #[arg(long, default_value = "reference", value_parser = Wiring::named, conflicts_with = "elf")]
    board: &'static Wiring,
}

impl ElfArguments {
    /// Reads the named ELF, or builds the firmware for the board.
    pub fn read(&self) -> Result<Vec<u8>, String> {
        match &self.elf {
            Some(path) => read(path),
            None => read(&build(self.board)?),
        }
    }
}

/// Reads an ELF.
pub fn read(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Builds the firmware and returns its path.
fn build(board: &Wiring) -> Result<PathBuf, String> {
    const TARGET: &str = "thumbv7em-none-eabihf";
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let directory = workspace.join("target");
    let status = Command::new("cargo")
        .current_dir(&workspace)
        .args(["build", "--profile", "firmware", "--locked"])
        .args(board.cargo_arguments())
        .args(["--target", TARGET, "--target-dir"])
        .arg(&directory)
        .status()
        .map_err(|error| format!("cargo does not start: {error}"))?;
    if !status.success() {
        return Err("the firmware does not build".into());
    }
    Ok(directory.join(TARGET).join("firmware").join(board.program))
}
