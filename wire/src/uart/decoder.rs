//! Decoder for frames in a stream of bytes with any other content.

use heapless::Vec;

use super::cobs::Decoding;
use super::{Frame, Kind, MAX_DECODED, parse};
use crate::sequence::{Step, step_u16};

/// Reason for dropping a part of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Problem {
    /// The frame ended too early: bytes were lost, or it is garbage.
    Coding,
    /// No end within the maximum length of a frame.
    TooLong,
    /// Too few bytes for a frame.
    TooShort,
    /// The CRC does not match.
    Check,
    /// Unknown version.
    Version(u8),
    /// Unknown type.
    Kind(u8),
    /// Invalid payload of a known type.
    Payload(Kind),
}

/// Counters of received and dropped frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drops {
    /// Valid frames.
    pub frames: u32,
    /// Frames missing from the sequence, the dropped ones included.
    pub missing: u32,
    /// Pieces that are not frames: wrong coding, too long or too short.
    pub garbage: u32,
    /// Frames with a wrong CRC.
    pub check: u32,
    /// Frames of an unknown version.
    pub version: u32,
    /// Frames of an unknown type.
    pub kind: u32,
    /// Frames with an invalid payload.
    pub payload: u32,
}

impl Drops {
    /// Number of rejected frames and pieces.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.garbage
            .wrapping_add(self.check)
            .wrapping_add(self.version)
            .wrapping_add(self.kind)
            .wrapping_add(self.payload)
    }

    fn count(&mut self, problem: Problem) {
        let counter = match problem {
            Problem::Coding | Problem::TooLong | Problem::TooShort => &mut self.garbage,
            Problem::Check => &mut self.check,
            Problem::Version(_) => &mut self.version,
            Problem::Kind(_) => &mut self.kind,
            Problem::Payload(_) => &mut self.payload,
        };
        *counter = counter.wrapping_add(1);
    }
}

/// Decoder that takes bytes one by one and returns frames. Garbage before a frame does not affect it: the
/// zero at the frame's beginning ends the garbage, or a frame that lost its end.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    plain: Vec<u8, MAX_DECODED>,
    decoding: Decoding,
    /// The frame is too long: bytes are ignored until its end.
    overflowed: bool,
    /// Newest sequence number.
    newest: Option<u16>,
    drops: Drops,
}

impl Decoder {
    /// Creates a decoder before its first byte.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Counters of received and dropped frames.
    #[must_use]
    pub const fn drops(&self) -> Drops {
        self.drops
    }

    /// Returns whether bytes followed the last zero: at the end of a recording, an incomplete frame.
    #[must_use]
    pub fn is_inside_frame(&self) -> bool {
        !self.plain.is_empty() || !self.decoding.is_fresh()
    }

    /// Takes a byte; at the end of a frame returns the frame, or the problem with it.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame, Problem>> {
        if byte != 0 {
            if let Some(plain) = self.decoding.push(byte) {
                self.overflowed |= self.plain.push(plain).is_err();
            }
            return None;
        }
        let complete = core::mem::take(&mut self.decoding).is_complete();
        let plain = core::mem::take(&mut self.plain);
        let overflowed = core::mem::take(&mut self.overflowed);
        let result = if overflowed {
            Err(Problem::TooLong)
        } else if !complete {
            Err(Problem::Coding)
        } else if plain.is_empty() {
            // Zeros between frames are ignored.
            return None;
        } else {
            parse(&plain)
        };
        match result {
            Ok(frame) => self.count_frame(frame.sequence),
            Err(problem) => self.drops.count(problem),
        }
        Some(result)
    }

    fn count_frame(&mut self, sequence: u16) {
        self.drops.frames = self.drops.frames.wrapping_add(1);
        let step = self.newest.map(|newest| step_u16(newest, sequence));
        match step {
            Some(Step::Late) => {
                self.drops.missing = self.drops.missing.saturating_sub(1);
                return;
            }
            Some(Step::Missing(count)) => {
                self.drops.missing = self.drops.missing.wrapping_add(u32::from(count));
            }
            Some(Step::Restart) | None => {}
        }
        self.newest = Some(sequence);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ConfigGet, Message, encode};
    use super::*;
    use crate::dictionary::Address;
    use std::vec::Vec;

    fn frame(sequence: u16) -> Vec<u8> {
        let address = Address::new(0x2010, 0);
        encode(sequence, &Message::ConfigGet(ConfigGet { address })).as_bytes().to_vec()
    }

    fn decode(bytes: &[u8]) -> (Vec<u16>, Drops) {
        let mut decoder = Decoder::new();
        let frames = bytes
            .iter()
            .filter_map(|byte| decoder.push(*byte)?.ok())
            .map(|frame| frame.sequence)
            .collect();
        (frames, decoder.drops())
    }

    #[test]
    fn frames_round_trip() {
        let stream: Vec<u8> = (0..300).flat_map(frame).collect();
        let (frames, drops) = decode(&stream);
        assert!(frames.into_iter().eq(0..300));
        assert_eq!(drops.refused() + drops.missing, 0);
    }

    #[test]
    fn the_next_frame_after_garbage_is_found() {
        let mut state = 7_u32;
        for length in 0..2000 {
            let mut stream: Vec<u8> = (0..length % 400)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 24) as u8
                })
                .collect();
            stream.extend(frame(5));
            let (frames, _) = decode(&stream);
            assert_eq!(frames, [5]);
        }
    }

    #[test]
    fn a_stream_joined_inside_a_frame_loses_only_that_one() {
        let stream = [frame(1), frame(2)].concat();
        for start in 2..frame(1).len() {
            let (frames, drops) = decode(&stream[start..]);
            assert_eq!(frames, [2]);
            assert!(drops.refused() <= 1);
        }
    }

    #[test]
    fn any_flipped_bit_is_detected_and_counted() {
        let clean = frame(2);
        // Flips in the leading zero do no damage; those in the trailing zero are covered by the test
        // after this one.
        for bit in 8..8 * (clean.len() - 1) {
            let mut damaged = clean.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let (frames, drops) = decode(&[frame(1), damaged, frame(3)].concat());
            assert_eq!(frames, [1, 3], "bit {bit}");
            assert!(drops.refused() >= 1, "bit {bit}");
            assert_eq!(drops.missing, 1, "bit {bit}");
        }
    }

    #[test]
    fn a_lost_or_damaged_zero_between_frames_costs_nothing() {
        let mut first = frame(1);
        first.pop();
        let (frames, drops) = decode(&[first.clone(), frame(2), frame(3)].concat());
        assert_eq!((frames, drops.refused()), ([1, 2, 3].to_vec(), 0));
        first.push(0x55);
        let (frames, drops) = decode(&[first, frame(2), frame(3)].concat());
        assert_eq!((frames, drops.refused()), ([2, 3].to_vec(), 1));
        // Both zeros gone: the two frames are one piece of garbage.
        let (first, second) = (frame(1), frame(2));
        let joined = [&first[..first.len() - 1], &second[1..], &frame(3)].concat();
        let (frames, drops) = decode(&joined);
        assert_eq!((frames, drops.refused()), ([3].to_vec(), 1));
    }

    #[test]
    fn gaps_are_counted_across_the_wrap() {
        let (_, drops) = decode(&[frame(65_534), frame(1)].concat());
        assert_eq!(drops.missing, 2);
        // A restart of the sender is not a gap.
        let (_, drops) = decode(&[frame(500), frame(0)].concat());
        assert_eq!(drops.missing, 0);
    }

    #[test]
    fn overtaken_frames_are_not_missing() {
        let stream: Vec<u8> = [1, 4, 2, 3, 6, 7].into_iter().flat_map(frame).collect();
        let (frames, drops) = decode(&stream);
        assert_eq!(frames, [1, 4, 2, 3, 6, 7]);
        assert_eq!(drops.missing, 1);
    }

    #[test]
    fn a_recording_that_ends_inside_a_frame_is_detected() {
        let mut decoder = Decoder::new();
        for byte in frame(1) {
            decoder.push(byte);
        }
        assert!(!decoder.is_inside_frame());
        decoder.push(0);
        assert!(!decoder.is_inside_frame());
        for byte in &frame(2)[1..4] {
            decoder.push(*byte);
            assert!(decoder.is_inside_frame());
        }
    }

    #[test]
    fn an_endless_frame_is_one_piece_of_garbage() {
        let mut stream = std::vec![0xAA; 100_000];
        stream.push(0);
        let (_, drops) = decode(&stream);
        assert_eq!(drops.garbage, 1);
        // A frame followed by excess bytes is invalid: they are not just ignored.
        let mut plain: Vec<u8> = std::vec![super::super::VERSION, 0x20, 0, 0, 1];
        plain.resize(MAX_DECODED - 4, b'x');
        plain.extend(super::super::CRC.checksum(&plain).to_le_bytes());
        for tail in [0, 1, 90] {
            let mut coded = ::cobs::encode_vec(&[&plain[..], &std::vec![7; tail]].concat());
            coded.push(0);
            let mut decoder = Decoder::new();
            let found = coded.iter().find_map(|byte| decoder.push(*byte));
            let too_long = found == Some(Err(Problem::TooLong));
            assert_eq!(too_long, tail > 0, "{found:?}");
        }
    }
}
