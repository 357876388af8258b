//! Consistent Overhead Byte Stuffing (Cheshire and Baker 1999) of up to 254 bytes.
//!
//! Each zero is replaced by the distance to the next, the first distance stands in front, and a
//! zero ends the frame.

/// Codes at most 254 bytes in their place, one after the other, so that code that looks at each byte
/// anyway can do so in the same loop.
#[derive(Debug)]
pub(super) struct Coding<'a> {
    /// Where the distance to the next zero belongs: in the place of the one before.
    place: &'a mut u8,
    distance: u32,
}

impl<'a> Coding<'a> {
    /// Begins a frame: `first` is the byte before all others, for the first distance.
    pub(super) const fn new(first: &'a mut u8) -> Self {
        Self {
            place: first,
            distance: 1,
        }
    }

    /// Takes the next byte in.
    #[inline(always)]
    pub(super) const fn push(&mut self, byte: &'a mut u8) {
        if *byte == 0 {
            *self.place = self.distance as u8;
            self.place = byte;
            self.distance = 0;
        }
        self.distance = self.distance.wrapping_add(1);
    }

    /// Takes the next four bytes in; where none of them is zero, which is mostly so, at once.
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

    /// All bytes are in: a zero has to follow them.
    pub(super) const fn finish(self) {
        *self.place = self.distance as u8;
    }
}

/// Whether one of the four bytes is zero: with one taken from each, no other gets a highest bit that
/// it did not have, but for a byte above a zero.
const fn has_zero(word: u32) -> bool {
    word.wrapping_sub(0x0101_0101) & !word & 0x8080_8080 != 0
}

/// Decodes one byte after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Decoding {
    /// Bytes until the next distance.
    left: u8,
    /// Whether that distance stands in the place of a zero.
    zero_due: bool,
}

impl Decoding {
    /// The byte that `coded`, not zero, stands for; `None` for a distance that stands for nothing.
    pub(super) fn push(&mut self, coded: u8) -> Option<u8> {
        if self.left > 0 {
            self.left -= 1;
            return Some(coded);
        }
        let zero = core::mem::replace(&mut self.zero_due, coded != u8::MAX);
        self.left = coded.wrapping_sub(1);
        zero.then_some(0)
    }

    /// Whether nothing has come yet.
    pub(super) const fn is_fresh(&self) -> bool {
        self.left == 0 && !self.zero_due
    }

    /// Whether a frame may end here.
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
    fn another_implementation_codes_and_decodes_alike() {
        let mut state = 1_u32;
        for length in 0..=253 {
            let plain: Vec<u8> = (0..length)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    // A quarter are zeros.
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
