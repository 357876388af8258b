//! Frames in a stream of bytes: CRC, COBS, and a decoder that finds frames among any other content.
//!
//! COBS is Consistent Overhead Byte Stuffing (Cheshire and Baker 1999), here of up to 254 bytes. The distance to the
//! next zero replaces each zero, the first distance goes in front, and a zero ends the frame.

use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::Vec;

use super::{Kind, Message};
use crate::bytes::{Reader, Writer};

/// Version of the format. A receiver rejects all others.
pub const VERSION: u8 = 1;

/// Maximum length of a payload, bytes.
pub const MAX_PAYLOAD: usize = 128;

/// Bytes of version, type and sequence.
const HEADER: usize = 4;

/// Bytes of the CRC.
const CHECK: usize = 4;

/// Maximum length of a frame before coding, bytes.
const MAX_DECODED: usize = HEADER + MAX_PAYLOAD + CHECK;

/// Maximum length of a frame on the line, bytes: COBS adds one byte (to up to 254), and there are two zeros.
pub const MAX_FRAME: usize = MAX_DECODED + 3;

const _: () = assert!(MAX_DECODED <= 254);

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Contents of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Sequence number, incremented with each frame.
    pub sequence: u16,
    /// Message.
    pub message: Message,
}

/// Encoded frame.
#[derive(Clone, Copy, Debug)]
pub struct Encoded {
    bytes: [u8; MAX_FRAME],
    length: u8,
}

const _: () = assert!(MAX_FRAME <= u8::MAX as usize);

impl Encoded {
    /// Frame without bytes, which [`write`](Self::write) fills.
    pub const EMPTY: Self = Self { bytes: [0; MAX_FRAME], length: 0 };

    /// The bytes to send, including the zeros at both ends.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// Encodes a message in place of the previous content, like [`encode`]. A microcontroller encodes a thousand frames a
    /// second, and moving each of them would take longer than encoding it.
    pub fn write(&mut self, sequence: u16, message: &Message) {
        // COBS puts the first distance into the second byte.
        let [_, _, plain @ ..] = &mut self.bytes;
        let mut writer = Writer::new(plain);
        writer.u8(VERSION);
        writer.u8(message.kind().code());
        writer.u16(sequence);
        message.write(&mut writer);
        // Every message is shorter than the longest payload; a test encodes the longest of each.
        let length = writer.finish().unwrap_or(0);
        if let Some((body, rest)) = plain.split_at_mut_checked(length) {
            Writer::new(rest).u32(CRC.checksum(body));
        }
        // The frame has at most `MAX_FRAME` bytes.
        self.length = stuff(&mut self.bytes, length + CHECK).unwrap_or(0) as u8;
    }
}

/// Encodes a message. `sequence` must be one more than that of the previous frame, even if that frame was not sent.
#[must_use]
pub fn encode(sequence: u16, message: &Message) -> Encoded {
    let mut frame = Encoded::EMPTY;
    frame.write(sequence, message);
    frame
}

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
    /// Frames missing from the sequence, including the dropped ones.
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

/// Decoder that takes bytes one by one and returns frames. Garbage before a frame does not affect it: the zero at the
/// beginning of a frame ends garbage, and ends a frame that lost its end.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    plain: Vec<u8, MAX_DECODED>,
    unstuffing: Unstuffing,
    /// The frame is too long. Bytes are ignored until its end.
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

    /// Returns whether bytes followed the last zero. At the end of a recording this is an incomplete frame.
    #[must_use]
    pub fn is_inside_frame(&self) -> bool {
        !self.plain.is_empty() || !self.unstuffing.is_fresh()
    }

    /// Takes a byte. Returns the frame at its end, or its problem.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame, Problem>> {
        self.push_as(byte, Message::checked)
    }

    /// Takes a byte, like [`push`](Self::push), but rejects messages other than requests to a foot as of an unknown type.
    pub fn push_request(&mut self, byte: u8) -> Option<Result<Frame, Problem>> {
        self.push_as(byte, Message::checked_request)
    }

    fn push_as(
        &mut self,
        byte: u8,
        decode: fn(Kind, &[u8]) -> Result<Message, Problem>,
    ) -> Option<Result<Frame, Problem>> {
        if byte != 0 {
            if let Some(plain) = self.unstuffing.push(byte) {
                self.overflowed |= self.plain.push(plain).is_err();
            }
            return None;
        }
        let complete = core::mem::take(&mut self.unstuffing).is_complete();
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
            parse(&plain, decode)
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

/// Maximum distance of an overtaken UART frame behind the newest sequence number. A foot sends a contact before
/// responses and raw samples that have waited for longer.
const OVERTAKEN: u16 = 64;

/// Position of a UART frame's sequence number relative to the newest number so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Newer. This many numbers between the two are missing so far.
    Missing(u16),
    /// One of the numbers missing so far.
    Late,
    /// The sender has restarted.
    Restart,
}

/// Step from the newest 16-bit number to the received `next`.
#[must_use]
pub const fn step_u16(newest: u16, next: u16) -> Step {
    let missing = next.wrapping_sub(newest).wrapping_sub(1);
    let back = newest.wrapping_sub(next);
    if missing < 1 << 15 {
        Step::Missing(missing)
    } else if 0 < back && back <= OVERTAKEN {
        Step::Late
    } else {
        Step::Restart
    }
}

/// Parses a decoded frame. Returns its problem if it is invalid.
fn parse(
    plain: &[u8],
    decode: fn(Kind, &[u8]) -> Result<Message, Problem>,
) -> Result<Frame, Problem> {
    let (body, check) = plain.split_last_chunk::<CHECK>().ok_or(Problem::TooShort)?;
    if CRC.checksum(body).to_le_bytes() != *check {
        return Err(Problem::Check);
    }
    let mut reader = Reader::new(body);
    let (Some(version), Some(kind), Some(sequence)) = (reader.u8(), reader.u8(), reader.u16())
    else {
        return Err(Problem::TooShort);
    };
    if version != VERSION {
        return Err(Problem::Version(version));
    }
    let kind = Kind::from_code(kind).ok_or(Problem::Kind(kind))?;
    Ok(Frame { sequence, message: decode(kind, reader.rest())? })
}

/// Encodes by COBS the `length` bytes, at most 254, that begin with the third of `frame`, and puts a zero before and after
/// them. Returns the length of the frame; `None` if it does not fit.
fn stuff(frame: &mut [u8], length: usize) -> Option<usize> {
    let frame = frame.get_mut(..length + 3)?;
    let mut next = length + 2;
    for (at, byte) in frame.iter_mut().enumerate().rev() {
        if at == 0 || at == length + 2 {
            *byte = 0;
        } else if at == 1 || *byte == 0 {
            *byte = u8::try_from(next - at).ok()?;
            next = at;
        }
    }
    Some(length + 3)
}

/// Decoder of COBS that takes one byte after the other.
#[derive(Clone, Debug, Default)]
struct Unstuffing {
    /// Bytes until the next distance.
    left: u8,
    /// Whether a zero follows at that distance.
    zero_due: bool,
}

impl Unstuffing {
    /// Decodes `coded`, which is not zero; `None` for a distance that encodes no byte.
    fn push(&mut self, coded: u8) -> Option<u8> {
        if self.left > 0 {
            self.left -= 1;
            return Some(coded);
        }
        let zero = core::mem::replace(&mut self.zero_due, coded != u8::MAX);
        self.left = coded.wrapping_sub(1);
        zero.then_some(0)
    }

    /// Returns whether no byte has been received yet.
    const fn is_fresh(&self) -> bool {
        self.left == 0 && !self.zero_due
    }

    /// Returns whether a frame may end here.
    const fn is_complete(&self) -> bool {
        self.left == 0
    }
}

#[cfg(test)]
mod tests {
    use super::super::ConfigGet;
    use super::*;
    use crate::dictionary::Address;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use std::vec::Vec;

    const GET: Message = Message::ConfigGet(ConfigGet { address: Address::new(0x2010, 0) });

    #[test]
    fn golden_bytes_of_a_frame() {
        let frame = encode(0x0102, &GET);
        assert_eq!(
            frame.as_bytes(),
            [0, 7, 1, 0x10, 2, 1, 0x10, 0x20, 5, 0x86, 0x65, 0x13, 0x73, 0]
        );
    }

    #[test]
    fn an_invalid_frame_reports_its_problem() {
        let parse = |plain: &[u8]| parse(plain, Message::checked);
        let mut plain = std::vec![VERSION, Kind::ConfigGet.code(), 0, 0, 0x10, 0x20, 0];
        let with_check = |plain: &[u8]| [plain, &CRC.checksum(plain).to_le_bytes()].concat();
        assert!(parse(&with_check(&plain)).is_ok());
        let mut damaged = with_check(&plain);
        damaged[4] ^= 1;
        assert_eq!(parse(&damaged), Err(Problem::Check));
        assert_eq!(parse(&[1, 2, 3]), Err(Problem::TooShort));
        assert_eq!(parse(&with_check(&[1, 2])), Err(Problem::TooShort));
        plain.push(9);
        assert_eq!(parse(&with_check(&plain)), Err(Problem::Payload(Kind::ConfigGet)));
        plain[1] = 0xEE;
        assert_eq!(parse(&with_check(&plain)), Err(Problem::Kind(0xEE)));
        plain[0] = 2;
        assert_eq!(parse(&with_check(&plain)), Err(Problem::Version(2)));
    }

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
        // Both zeros are lost, so the two frames are one piece of garbage.
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
        // A frame with excess bytes is invalid. The bytes are not just ignored.
        let mut plain: Vec<u8> = std::vec![VERSION, 0x20, 0, 0, 1];
        plain.resize(MAX_DECODED - 4, b'x');
        plain.extend(CRC.checksum(&plain).to_le_bytes());
        for tail in [0, 1, 90] {
            let mut coded = cobs::encode_vec(&[&plain[..], &std::vec![7; tail]].concat());
            coded.push(0);
            let mut decoder = Decoder::new();
            let found = coded.iter().find_map(|byte| decoder.push(*byte));
            let too_long = found == Some(Err(Problem::TooLong));
            assert_eq!(too_long, tail > 0, "{found:?}");
        }
    }

    fn unstuffed(coded: &[u8]) -> Vec<u8> {
        let mut unstuffing = Unstuffing::default();
        let (end, body) = coded.split_last().expect("not empty");
        assert_eq!(*end, 0);
        let plain = body.iter().filter_map(|byte| unstuffing.push(*byte)).collect();
        assert!(unstuffing.is_complete());
        plain
    }

    fn stuffed(plain: &[u8]) -> Vec<u8> {
        let mut frame = [0xEE; 257];
        frame[2..2 + plain.len()].copy_from_slice(plain);
        let length = stuff(&mut frame, plain.len()).expect("it fits");
        let (zero, coded) = frame[..length].split_first().expect("not empty");
        assert_eq!(*zero, 0);
        coded.to_vec()
    }

    #[test]
    fn golden_bytes_of_cobs() {
        assert_eq!(stuffed(&[0x11, 0, 0, 0x22]), [2, 0x11, 1, 2, 0x22, 0]);
        assert_eq!(stuffed(&[]), [1, 0]);
    }

    #[test]
    fn a_full_block_of_another_encoder_is_decoded_too() {
        let plain: Vec<u8> = (1..=254).chain(1..=9).collect();
        let mut coded = cobs::encode_vec(&plain);
        coded.push(0);
        assert_eq!(unstuffed(&coded), plain);
    }

    #[test]
    fn consecutive_numbers_miss_nothing_across_the_wrap() {
        for (newest, next, step) in [
            (7, 8, Step::Missing(0)),
            (u16::MAX, 0, Step::Missing(0)),
            (7, 10, Step::Missing(2)),
            (65_534, 1, Step::Missing(2)),
            (0, 1 << 15, Step::Missing(32_767)),
            (0, (1 << 15) + 1, Step::Restart),
            (500, 0, Step::Restart),
            (7, 7, Step::Restart),
        ] {
            assert_eq!(step_u16(newest, next), step, "{newest}, {next}");
        }
    }

    #[test]
    fn near_numbers_are_late_and_distant_ones_a_restart() {
        assert_eq!(step_u16(100, 99), Step::Late);
        assert_eq!(step_u16(3, 65_535), Step::Late);
        assert_eq!(step_u16(100, 100 - OVERTAKEN), Step::Late);
        assert_eq!(step_u16(100, 99 - OVERTAKEN), Step::Restart);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn the_next_frame_after_garbage_is_found(garbage in vec(any::<u8>(), 0..400)) {
            let (frames, _) = decode(&[garbage, frame(5)].concat());
            prop_assert_eq!(frames, [5]);
        }

        #[test]
        fn another_implementation_encodes_and_decodes_alike(
            plain in vec(prop_oneof![1 => Just(0), 3 => any::<u8>()], 0..=253),
        ) {
            let coded = stuffed(&plain);
            let mut theirs = cobs::encode_vec(&plain);
            theirs.push(0);
            prop_assert_eq!(&coded, &theirs);
            prop_assert_eq!(unstuffed(&coded), plain);
        }
    }
}
