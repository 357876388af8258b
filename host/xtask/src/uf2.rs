//! The program of the Nano RP2040 as a UF2 file, which its loader takes as a copy to a drive.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use program_images::segments;

use crate::command::{Step, root};

/// Folder of the package, a workspace of its own.
const PACKAGE: &str = "firmware/boards/rp2040";

/// Name of the program.
pub const PROGRAM: &str = "foot-nano-rp2040";

const TARGET: &str = "thumbv6m-none-eabi";

/// Bytes of a block that go to the flash.
const PAGE: usize = 256;

/// Family of the chip, by Microsoft's list of UF2 families.
const RP2040: u32 = 0xE48B_FF56;

/// Builds the program and writes its UF2 file beside the ELF; returns the path.
///
/// # Errors
/// It does not build, or a file cannot be written.
pub fn run() -> Result<PathBuf> {
    Step::program("rustup").with(["target", "add", TARGET]).run()?;
    let target = root().join("target/nano-rp2040");
    Step::cargo(&["build", "--locked", "--release", "--target", TARGET])
        .with(["--target-dir", &target.display().to_string()])
        .at(&root().join(PACKAGE))
        .run()?;
    let elf = target.join(TARGET).join("release").join(PROGRAM);
    let output = elf.with_extension("uf2");
    write(&elf, &output)?;
    println!("{}", output.display());
    Ok(output)
}

fn write(elf: &Path, output: &Path) -> Result<()> {
    let bytes = fs::read(elf).with_context(|| elf.display().to_string())?;
    let pages = pages(&bytes).with_context(|| elf.display().to_string())?;
    fs::write(output, blocks(&pages)).with_context(|| output.display().to_string())
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

/// Blocks of a UF2 file, one for each page.
fn blocks(pages: &BTreeMap<u32, [u8; PAGE]>) -> Vec<u8> {
    /// Of the four words at both ends that name the format.
    const MAGIC: [u32; 3] = [0x0A32_4655, 0x9E5D_5157, 0x0AB1_6F30];
    const HAS_FAMILY: u32 = 0x2000;
    const DATA: usize = 476;
    let mut file = Vec::new();
    for (number, (address, page)) in pages.iter().enumerate() {
        let [first, second, last] = MAGIC;
        let (number, all) = (number as u32, pages.len() as u32);
        for word in [first, second, HAS_FAMILY, *address, PAGE as u32, number, all, RP2040] {
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
    fn each_page_becomes_a_block_of_512_bytes() {
        let pages = BTreeMap::from([(0x1000_0000, [1; PAGE]), (0x1000_0100, [2; PAGE])]);
        let file = blocks(&pages);
        assert_eq!(file.len(), 2 * 512);
        let (_, second) = file.split_at(512);
        let word = |at: usize| u32::from_le_bytes(second[at..at + 4].try_into().expect("a word"));
        assert_eq!([word(12), word(16), word(20), word(24)], [0x1000_0100, 256, 1, 2]);
        assert_eq!((second[32], second[287], second[288]), (2, 2, 0));
    }
}
