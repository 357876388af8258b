//! The program of the Feather RP2350, as its UF2 file: the chip's ROM can take it and find its start, as the data sheet of the
//! RP2350 and Microsoft's description of UF2 say. `laboratory/rp2350` runs it.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use host_tests::committed::workspace;

const FLASH: u32 = 0x1000_0000;
const FLASH_SIZE: u32 = 8 << 20;

/// Size of the settings at the end of the flash.
const SETTINGS: u32 = 2 * 4096;

const RAM: std::ops::RangeInclusive<u32> = 0x2000_0000..=0x2008_0000;

/// Start and end of a block that describes a program to the ROM (5.9.1).
const BLOCK_START: u32 = 0xFFFF_DED3;
const BLOCK_END: u32 = 0xAB12_3579;

/// Builds the file, and returns its words.
fn uf2() -> Vec<u32> {
    let output = Command::new(env!("CARGO"))
        .args(["run", "--locked", "--quiet", "--package", "xtask"])
        .args(["--", "uf2", "--board", "feather-rp2350"])
        .current_dir(workspace())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8_lossy(&output.stdout);
    let path = printed.lines().last().expect("the path of the file");
    let bytes = fs::read(path).expect("the file");
    assert!(bytes.len().is_multiple_of(512));
    bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect()
}

#[test]
#[ignore = "full: another target"]
fn feather_rp2350_has_a_program_that_its_rom_can_start() {
    let words = uf2();
    let blocks = words.as_chunks::<128>().0;
    let mut flash = BTreeMap::new();
    for (number, block) in blocks.iter().enumerate() {
        let [first, second, flags, address, length, index, count, family] = block[..8] else {
            unreachable!("a block has 128 words");
        };
        assert_eq!([first, second, block[127]], [0x0A32_4655, 0x9E5D_5157, 0x0AB1_6F30]);
        // The file names its family, rp2350-arm-s.
        assert_eq!((flags, family), (0x2000, 0xE48B_FF59), "block {number}");
        assert_eq!([length, index, count], [256, number as u32, blocks.len() as u32]);
        assert!((FLASH..FLASH + FLASH_SIZE - SETTINGS).contains(&address), "{address:#010x}");
        for (at, word) in (address..).step_by(4).zip(&block[8..72]) {
            flash.insert(at, *word);
        }
    }
    let word = |at: u32| *flash.get(&at).unwrap_or_else(|| panic!("nothing at {at:#010x}"));

    // Vectors: the stack, and Thumb code in the flash, which runs before the copy to RAM.
    assert!(RAM.contains(&word(FLASH)), "{:#010x}", word(FLASH));
    let reset = word(FLASH + 4);
    assert!(reset % 2 == 1 && flash.contains_key(&(reset & !3)), "{reset:#010x}");

    // A description in the first 4 KiB: a program for the RP2350's Arm cores in the secure state (5.9.3.1), and nothing
    // else, in a loop with itself.
    let described: Vec<u32> =
        (FLASH..FLASH + 4096).step_by(4).filter(|at| flash.get(at) == Some(&BLOCK_START)).collect();
    let [at] = described[..] else { panic!("{described:#010x?}") };
    assert_eq!([4, 8, 12, 16].map(|k| word(at + k)), [0x1021_0142, 0x0000_01FF, 0, BLOCK_END]);
}
