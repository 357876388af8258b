//! Consistent Overhead Byte Stuffing (Cheshire and Baker 1999) of up to 254 bytes.
//!
//! Each zero is replaced by the distance to the next, the first distance stands in front, and a
//! zero ends the frame.

/// Encodes at most 254 bytes in place, one after the other, so that code that visits each byte
/// anyway can do so in the same loop.
#[derive(Debug)]
pub(super) struct Coding<'a> {
    /// Place of the distance to the next zero: that of the previous zero.
    place: &'a mut u8,
    distance: u32,
}

impl<'a> Coding<'a> {
    /// Starts a frame: `first` is the byte before all others, for the first distance.
    pub(super) const fn new(first: &'a mut u8) -> Self {
        Self {
            place: first,
            distance: 1,
        }
    }

    /// Adds the next byte.
    #[inline(always)]
    pub(super) const fn push(&mut self, byte: &'a mut u8) {
        if *byte == 0 {
            *self.place = self.distance as u8;
            self.place = byte;
            self.distance = 0;
        }
        self.distance = self.distance.wrapping_add(1);
    }

    /// Adds the next four bytes; at once if none of them is zero, which is the usual case.
    #[inline(always)]
    pub(super) fn push_four(&mut self, bytes: &'a mut [u8; 4]) {
        if has_zero(u32::from_le_bytes(*bytes)) {
            for byte in bytes {
                self.push(byte);
            }
        } else {
            self.distance = self.distance.wrapping_add(4);
        }
    }

    /// Ends the frame: a zero has to follow it.
    pub(super) const fn finish(self) {
        *self.place = self.distance as u8;
    }
}

/// Returns whether one of the four bytes is zero: after one is subtracted from each, no other byte gains a
/// highest bit, except one above a zero.
const fn has_zero(word: u32) -> bool {
    word.wrapping_sub(0x0101_0101) & !word & 0x8080_8080 != 0
}

/// Decoder that takes one byte after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Decoding {
    /// Bytes until the next distance.
    left: u8,
    /// Whether that distance replaces a zero.
    zero_due: bool,
}

impl Decoding {
    /// Decodes `coded`, not zero; `None` for a distance that encodes no byte.
    pub(super) fn push(&mut self, coded: u8) -> Option<u8> {
        if self.left > 0 {
            self.left -= 1;
            return Some(coded);
        }
        let zero = core::mem::replace(&mut self.zero_due, coded != u8::MAX);
        self.left = coded.wrapping_sub(1);
        zero.then_some(0)
    }

    /// Returns whether no byte has been received yet.
    pub(super) const fn is_fresh(&self) -> bool {
        self.left == 0 && !self.zero_due
    }

    /// Returns whether a frame may end here.
    pub(super) const fn is_complete(&self) -> bool {
        self.left == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn decode(coded: &[u8]) -> Vec<u8> {
        let mut decoding = Decoding::default();
        let (end, body) = coded.split_last().expect("not empty");
        assert_eq!(*end, 0);
        let plain = body
            .iter()
            .filter_map(|byte| decoding.push(*byte))
            .collect();
        assert!(decoding.is_complete());
        plain
    }

    fn encoded(plain: &[u8]) -> Vec<u8> {
        let mut frame = [&[0xEE], plain, &[0]].concat();
        let mut by_fours = frame.clone();
        if let [first, bytes @ .., _end] = &mut frame[..] {
            let mut coding = Coding::new(first);
            bytes.iter_mut().for_each(|byte| coding.push(byte));
            coding.finish();
        }
        if let [first, bytes @ .., _end] = &mut by_fours[..] {
            let mut coding = Coding::new(first);
            let (fours, rest) = bytes.as_chunks_mut();
            fours.iter_mut().for_each(|four| coding.push_four(four));
            rest.iter_mut().for_each(|byte| coding.push(byte));
            coding.finish();
        }
        assert_eq!(frame, by_fours);
        frame
    }

    #[test]
    fn golden_bytes() {
        assert_eq!(encoded(&[0x11, 0, 0, 0x22]), [2, 0x11, 1, 2, 0x22, 0]);
        assert_eq!(encoded(&[]), [1, 0]);
    }

    #[test]
    fn another_implementation_encodes_and_decodes_alike() {
        let mut state = 1_u32;
        for length in 0..=253 {
            let plain: Vec<u8> = (0..length)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    // A quarter of the bytes are zero.
                    if state >> 30 == 0 {
                        0
                    } else {
                        (state >> 16) as u8
                    }
                })
                .collect();
            let coded = encoded(&plain);
            let mut theirs = ::cobs::encode_vec(&plain);
            theirs.push(0);
            assert_eq!(coded, theirs);
            assert_eq!(decode(&coded), plain);
        }
    }

    #[test]
    fn a_full_block_of_another_encoder_is_decoded_too() {
        let plain: Vec<u8> = (1..=254).chain(1..=9).collect();
        let mut coded = ::cobs::encode_vec(&plain);
        coded.push(0);
        assert_eq!(decode(&coded), plain);
    }
}
