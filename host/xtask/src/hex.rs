//! Writes a program and its bootloader as an Intel HEX file and as a `DfuSe` file. These contain only the bytes to be
//! flashed.
//!
//! A raw binary (`objcopy -O binary`) fills the space between two segments with zeros. The settings are between
//! bootloader and program, so flashing a raw binary would overwrite them. `DfuSe` (ST's UM0391) is the format that
//! dfu-util sends over USB to the loader in ROM.

use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, bail};
use program_images::segments;

use crate::command::root;

/// Bytes that are flashed, from their address on.
type Piece = (u32, Vec<u8>);

/// Writes both files next to the ELF of the program. Without a bootloader they contain only the program, for a chip
/// whose bootloader protects its sectors.
///
/// # Errors
/// An ELF cannot be read, segments overlap or are in the settings' pages, or a file cannot be written.
pub fn run(program: &Path, bootloader: Option<&Path>) -> Result<()> {
    let settings = settings()?;
    let mut pieces = Vec::new();
    for path in [Some(program), bootloader].into_iter().flatten() {
        let elf = fs::read(path).with_context(|| path.display().to_string())?;
        let loaded = segments(&elf).with_context(|| path.display().to_string())?;
        pieces.extend(loaded.into_iter().map(|(address, bytes)| (address, bytes.to_vec())));
    }
    pieces.sort();
    check(&pieces, &settings).with_context(|| program.display().to_string())?;
    let hex = program.with_extension("hex");
    let text = hex_file(&pieces);
    fs::write(&hex, &text).with_context(|| hex.display().to_string())?;
    let dfu = program.with_extension("dfu");
    fs::write(&dfu, dfu_file(&pieces)).with_context(|| dfu.display().to_string())?;
    let Range { start, end } = settings;
    let records = text.lines().count();
    println!("{}, .dfu: {records} records, none in {start:#x} to {:#x}", hex.display(), end - 1);
    Ok(())
}

/// Addresses of the settings' pages, from `memory.x`.
fn settings() -> Result<Range<u32>> {
    let text = fs::read_to_string(root().join("memory.x")).context("memory.x")?;
    let symbol = |name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(" = 0x"));
        let digits = line.and_then(|digits| digits.strip_suffix(';'));
        let address = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        address.with_context(|| format!("memory.x has no address {name}"))
    };
    Ok(symbol("_config_start")?..symbol("_config_end")?)
}

/// Checks that no piece touches the settings or another piece.
fn check(pieces: &[Piece], settings: &Range<u32>) -> Result<()> {
    let end = |(address, data): &Piece| address + data.len() as u32;
    for piece in pieces {
        if piece.0 < settings.end && settings.start < end(piece) {
            bail!("a segment at {:#x} lies in the settings' pages", piece.0);
        }
    }
    for pair in pieces.windows(2) {
        if let [first, second] = pair
            && end(first) > second.0
        {
            bail!("segments overlap at {:#x}", second.0);
        }
    }
    Ok(())
}

/// Text of an Intel HEX file.
fn hex_file(pieces: &[Piece]) -> String {
    const DATA: u8 = 0;
    const END: u8 = 1;
    const UPPER_ADDRESS: u8 = 4;
    let mut text = String::new();
    let mut upper = None;
    for (address, data) in pieces {
        let mut address = *address;
        let mut rest = data.as_slice();
        while !rest.is_empty() {
            let [high, low] = [(address >> 16) as u16, address as u16];
            if upper.replace(high) != Some(high) {
                record(&mut text, UPPER_ADDRESS, 0, &high.to_be_bytes());
            }
            // A record ends at a multiple of 16, and so never crosses into the next 64 KiB.
            let length = rest.len().min(16 - usize::from(low % 16));
            let (bytes, after) = rest.split_at(length);
            record(&mut text, DATA, low, bytes);
            address += length as u32;
            rest = after;
        }
    }
    record(&mut text, END, 0, &[]);
    text
}

/// Appends a record: its length, address, kind, bytes and checksum.
fn record(text: &mut String, kind: u8, address: u16, data: &[u8]) {
    let [high, low] = address.to_be_bytes();
    let mut body = vec![data.len() as u8, high, low, kind];
    body.extend(data);
    let sum = body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    body.push(sum.wrapping_neg());
    text.push(':');
    for byte in body {
        let _ = write!(text, "{byte:02X}");
    }
    text.push('\n');
}

/// Bytes of a `DfuSe` file for the loader in ROM of an STM32 (USB 0483:DF11, alternate setting 0).
fn dfu_file(pieces: &[Piece]) -> Vec<u8> {
    const PREFIX: u32 = 11;
    const VERSION: u8 = 1;
    const TARGETS: u8 = 1;
    let mut elements = Vec::new();
    for (address, data) in pieces {
        elements.extend(address.to_le_bytes());
        elements.extend((data.len() as u32).to_le_bytes());
        elements.extend(data);
    }
    let mut target = b"Target\0".to_vec();
    let is_named = 1u32;
    target.extend(is_named.to_le_bytes());
    let mut name = [0; 255];
    name[..8].copy_from_slice(b"footfall");
    target.extend(name);
    target.extend((elements.len() as u32).to_le_bytes());
    target.extend((pieces.len() as u32).to_le_bytes());
    target.extend(elements);

    let mut file = b"DfuSe".to_vec();
    file.push(VERSION);
    file.extend((PREFIX + target.len() as u32).to_le_bytes());
    file.push(TARGETS);
    file.extend(target);
    // The suffix: any version of the device, its product and vendor, the format, and its own length.
    for word in [0xFFFFu16, 0xDF11, 0x0483, 0x011A] {
        file.extend(word.to_le_bytes());
    }
    file.extend(b"UFD\x10");
    // The checksum of DFU is zlib's checksum without its last inversion.
    let sum = !crc32fast::hash(&file);
    file.extend(sum.to_le_bytes());
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_never_cross_64_kib() {
        let text = hex_file(&[(0x0800_FFFE, vec![1, 2, 3])]);
        let expected = [
            ":020000040800F2",
            ":02FFFE000102FE",
            ":020000040801F1",
            ":0100000003FC",
            ":00000001FF",
        ];
        assert_eq!(text.lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn dfu_file_names_its_elements_and_ends_with_its_checksum() {
        let file = dfu_file(&[(0x0800_0000, vec![7; 4])]);
        assert_eq!(file.len(), 11 + 274 + 8 + 4 + 16);
        assert_eq!(&file[285..297], [0, 0, 0, 8, 4, 0, 0, 0, 7, 7, 7, 7]);
        // The expected CRC is computed by Python: zlib.crc32(file[:-4]) ^ 0xFFFFFFFF.
        assert_eq!(file[309..], 0x5B93_9AA5_u32.to_le_bytes());
    }

    #[test]
    fn segments_in_the_settings_or_on_each_other_are_refused() {
        let settings = settings().expect("memory.x has them");
        let check = |pieces: &[Piece]| check(pieces, &settings).map_err(|error| error.to_string());
        assert_eq!(check(&[(settings.end, vec![0]), (settings.end + 1, vec![0])]), Ok(()));
        let inside = check(&[(settings.end - 4, vec![0; 4])]).expect_err("it lies in the settings");
        assert_eq!(inside, "a segment at 0x800fffc lies in the settings' pages");
        let overlap = check(&[(settings.end, vec![0; 8]), (settings.end + 4, vec![0])]);
        assert_eq!(overlap.expect_err("they overlap"), "segments overlap at 0x8010004");
    }
}
