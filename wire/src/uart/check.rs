//! CRC of a frame: CRC-32 (ISO-HDLC, as in zlib and Ethernet), with the library's table, but a
//! few bytes at a time, so that code that visits each byte anyway can do so in the same loop.

use crc::{CRC_32_ISO_HDLC, Crc};

static TABLE: [u32; 256] = {
    let [table] = *Crc::<u32>::new(&CRC_32_ISO_HDLC).table();
    table
};

/// CRC in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Check(u32);

impl Check {
    pub(super) const fn new() -> Self {
        Self(CRC_32_ISO_HDLC.init)
    }

    /// Adds the next byte.
    #[inline(always)]
    pub(super) fn push(&mut self, byte: u8) {
        self.0 ^= u32::from(byte);
        self.shift();
    }

    /// Adds the next four bytes.
    #[inline(always)]
    pub(super) fn push_four(&mut self, bytes: [u8; 4]) {
        self.0 ^= u32::from_le_bytes(bytes);
        for _ in 0..4 {
            self.shift();
        }
    }

    #[inline(always)]
    fn shift(&mut self) {
        // An index of eight bits is always inside a table of 256.
        let entry = TABLE.get(usize::from(self.0 as u8)).copied();
        self.0 = entry.unwrap_or(0) ^ self.0 >> 8;
    }

    /// CRC, as the bytes that follow those added.
    pub(super) const fn finish(self) -> [u8; 4] {
        (self.0 ^ CRC_32_ISO_HDLC.xorout).to_le_bytes()
    }
}

/// CRC of `bytes`.
pub(super) fn of(bytes: &[u8]) -> [u8; 4] {
    let mut check = Check::new();
    for byte in bytes {
        check.push(*byte);
    }
    check.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_crc_matches_the_library_for_any_chunk_size() {
        let theirs = Crc::<u32>::new(&CRC_32_ISO_HDLC);
        assert_eq!(of(b"123456789"), 0xCBF4_3926_u32.to_le_bytes());
        for length in 0..=132_u8 {
            let bytes: Vec<u8> = (0..length).map(|i| i.wrapping_mul(37) ^ length).collect();
            let expected = theirs.checksum(&bytes).to_le_bytes();
            assert_eq!(of(&bytes), expected);
            let mut by_fours = Check::new();
            let (fours, rest) = bytes.as_chunks::<4>();
            fours.iter().for_each(|four| by_fours.push_four(*four));
            rest.iter().for_each(|byte| by_fours.push(*byte));
            assert_eq!(by_fours.finish(), expected);
        }
    }
}
