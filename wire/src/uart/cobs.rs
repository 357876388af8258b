//! Consistent Overhead Byte Stuffing (Cheshire and Baker 1999) of up to 254 bytes.
//!
//! Each zero is replaced by the distance to the next, the first distance stands in front, and a
//! zero ends the frame.

use heapless::Vec;

/// Encodes at most 254 bytes into an empty `frame`, with a zero before them and one after them; `None` if they do not fit.
pub(super) fn encode<const N: usize>(plain: &[u8], frame: &mut Vec<u8, N>) -> Option<()> {
    frame.extend_from_slice(&[0, 0]).ok()?;
    frame.extend_from_slice(plain).ok()?;
    frame.push(0).ok()?;
    let mut next = frame.len() - 1;
    for (at, byte) in frame.iter_mut().enumerate().skip(1).rev() {
        if *byte == 0 {
            *byte = u8::try_from(next - at).ok()?;
            next = at;
        }
    }
    Some(())
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
        let plain = body.iter().filter_map(|byte| decoding.push(*byte)).collect();
        assert!(decoding.is_complete());
        plain
    }

    fn encoded(plain: &[u8]) -> Vec<u8> {
        let mut frame = heapless::Vec::<u8, 260>::new();
        encode(plain, &mut frame).expect("it fits");
        let (zero, coded) = frame.split_first().expect("not empty");
        assert_eq!(*zero, 0);
        coded.to_vec()
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
                    if state >> 30 == 0 { 0 } else { (state >> 16) as u8 }
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
