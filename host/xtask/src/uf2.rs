//! Programs of the boards with an RP2040 or an RP2350 as UF2 files, which their loader takes as a copy to a drive.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use program_images::segments;

use crate::command::{Step, root};

/// Folder of the package, a workspace of its own.
const PACKAGE: &str = "firmware/boards/rp";

/// Bytes of a block that go to the flash.
const PAGE: usize = 256;

/// Bytes of the flash that are erased at once.
const SECTOR: u32 = 4096;

/// Board with a loader that takes UF2 files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// Arduino Nano RP2040 Connect.
    NanoRp2040,
    /// Adafruit Feather RP2350, with a breakout of the sensor on a cable.
    FeatherRp2350,
}

impl Board {
    /// All boards.
    pub const ALL: [Self; 2] = [Self::NanoRp2040, Self::FeatherRp2350];

    /// Name of the board and of its feature.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NanoRp2040 => "nano-rp2040",
            Self::FeatherRp2350 => "feather-rp2350",
        }
    }

    /// Target of the Rust compiler.
    pub const fn target(self) -> &'static str {
        match self {
            Self::NanoRp2040 => "thumbv6m-none-eabi",
            Self::FeatherRp2350 => "thumbv8m.main-none-eabihf",
        }
    }

    /// Family of the chip, by Microsoft's list of UF2 families.
    const fn family(self) -> u32 {
        match self {
            Self::NanoRp2040 => 0xE48B_FF56,
            // A program in the secure state of the Arm cores.
            Self::FeatherRp2350 => 0xE48B_FF59,
        }
    }
}

/// Builds the program of a board and writes its UF2 file beside the ELF; returns the path.
///
/// # Errors
/// It does not build, or a file cannot be written.
pub fn run(board: Board) -> Result<PathBuf> {
    let (name, target) = (board.name(), board.target());
    Step::program("rustup").with(["target", "add", target]).run()?;
    let folder = root().join("target").join(name);
    let program = format!("foot-{name}");
    Step::cargo(&["build", "--locked", "--release", "--target", target])
        .with(["--no-default-features", "--features", name, "--bin", &program])
        .with(["--target-dir", &folder.display().to_string()])
        .at(&root().join(PACKAGE))
        .run()?;
    let elf = folder.join(target).join("release").join(program);
    let output = elf.with_extension("uf2");
    write(board, &elf, &output)?;
    println!("{}", output.display());
    Ok(output)
}

/// Lints the programs of all boards.
///
/// # Errors
/// A lint fails.
pub fn lint() -> Result<()> {
    for board in Board::ALL {
        let (name, target) = (board.name(), board.target());
        Step::program("rustup").with(["target", "add", target]).run()?;
        let folder = root().join("target").join(name);
        Step::cargo(&["clippy", "--locked", "--target", target])
            .with(["--no-default-features", "--features", name])
            .with(["--target-dir", &folder.display().to_string(), "--", "-D", "warnings"])
            .at(&root().join(PACKAGE))
            .run()?;
    }
    Ok(())
}

fn write(board: Board, elf: &Path, output: &Path) -> Result<()> {
    let bytes = fs::read(elf).with_context(|| elf.display().to_string())?;
    let pages = pages(&bytes).with_context(|| elf.display().to_string())?;
    check_gaps(&pages).with_context(|| elf.display().to_string())?;
    fs::write(output, blocks(board.family(), &pages)).with_context(|| output.display().to_string())
}

/// Content of the flash, in pages by their addresses.
fn pages(elf: &[u8]) -> Result<BTreeMap<u32, [u8; PAGE]>> {
    let mut pages = BTreeMap::new();
    for (first, bytes) in segments(elf)? {
        for (address, byte) in (first..).zip(bytes) {
            let start = address - address % PAGE as u32;
            let page = pages.entry(start).or_insert([0; PAGE]);
            page[(address - start) as usize] = *byte;
        }
    }
    Ok(pages)
}

/// Checks that the pages follow each other from the start of a sector. The loader of the RP2040 erases a sector with the
/// block of its first page, as it knows by the numbers of the blocks. After a gap it would write to a sector that is not
/// erased.
fn check_gaps(pages: &BTreeMap<u32, [u8; PAGE]>) -> Result<()> {
    let mut addresses = pages.keys();
    let Some(&first) = addresses.next() else { bail!("the program has no pages") };
    if !first.is_multiple_of(SECTOR) {
        bail!(
            "the program begins at {first:#x}, which is not the start of a sector of {SECTOR} bytes"
        );
    }
    for (expected, address) in (first..).step_by(PAGE).skip(1).zip(addresses) {
        if *address != expected {
            bail!("the program has a gap from {expected:#x} to {address:#x}");
        }
    }
    Ok(())
}

/// Blocks of a UF2 file, one for each page.
fn blocks(family: u32, pages: &BTreeMap<u32, [u8; PAGE]>) -> Vec<u8> {
    /// Words at both ends of a block that identify the format.
    const MAGIC: [u32; 3] = [0x0A32_4655, 0x9E5D_5157, 0x0AB1_6F30];
    const HAS_FAMILY: u32 = 0x2000;
    const DATA: usize = 476;
    let mut file = Vec::new();
    for (number, (address, page)) in pages.iter().enumerate() {
        let [first, second, last] = MAGIC;
        let (number, all) = (number as u32, pages.len() as u32);
        for word in [first, second, HAS_FAMILY, *address, PAGE as u32, number, all, family] {
            file.extend(word.to_le_bytes());
        }
        file.extend(page);
        file.extend([0; DATA - PAGE]);
        file.extend(last.to_le_bytes());
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_with_a_gap_are_rejected() {
        let check = |addresses: &[u32]| {
            let pages = addresses.iter().map(|address| (*address, [0; PAGE])).collect();
            check_gaps(&pages).map_err(|error| error.to_string())
        };
        assert_eq!(check(&[0x1000_0000, 0x1000_0100]), Ok(()));
        let gap = "the program has a gap from 0x10000100 to 0x10000200";
        assert_eq!(check(&[0x1000_0000, 0x1000_0200]), Err(gap.to_owned()));
        let start =
            "the program begins at 0x10000100, which is not the start of a sector of 4096 bytes";
        assert_eq!(check(&[0x1000_0100]), Err(start.to_owned()));
        assert_eq!(check(&[]), Err("the program has no pages".to_owned()));
    }

    #[test]
    fn each_page_becomes_a_block_of_512_bytes() {
        let pages = BTreeMap::from([(0x1000_0000, [1; PAGE]), (0x1000_0100, [2; PAGE])]);
        let file = blocks(Board::FeatherRp2350.family(), &pages);
        assert_eq!(file.len(), 2 * 512);
        let (_, second) = file.split_at(512);
        let word = |at: usize| u32::from_le_bytes(second[at..at + 4].try_into().expect("a word"));
        assert_eq!([word(12), word(16), word(20), word(24)], [0x1000_0100, 256, 1, 2]);
        // rp2350-arm-s
        assert_eq!(word(28), 0xE48B_FF59);
        assert_eq!((second[32], second[287], second[288]), (2, 2, 0));
    }
}
