//! The serial line: frames that can be found in any stream.
//!
//! A frame is coded with COBS, so that it holds no zero byte, with a zero byte before it and one
//! after it: the first ends whatever garbage was on the line before. Decoded:
//!
//! | bytes | field |
//! |---|---|
//! | 0 | version of the format: 1 |
//! | 1 | type of the message |
//! | 2, 3 | sequence: one more with each frame, sent or dropped, modulo 2¹⁶ |
//! | 4 … | payload, by type |
//! | last 4 | CRC-32 (ISO-HDLC, as in zlib and Ethernet) of all before it |
//!
//! [`encode`] builds a frame, [`Decoder`] takes bytes as they arrive and counts dropped frames.

mod cobs;
mod config;
mod contact;
mod decoder;
mod health;
mod log;
mod raw;

pub use config::{Answer, ConfigGet, ConfigResponse, ConfigSet, MAX_VALUE, NmtRequest};
pub use contact::ContactMessage;
pub use decoder::{Decoder, Drops, Problem};
pub use health::HealthMessage;
pub use log::{LogMessage, MAX_LOG};
pub use raw::RawSample;

use crate::bytes::{Reader, Writer};
use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::Vec;

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

/// Maximum length of a frame on the line, bytes: COBS adds one byte (to as many as 254), and there are two zeros.
pub const MAX_FRAME: usize = MAX_DECODED + 3;

const _: () = assert!(MAX_DECODED <= 254);

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`ContactMessage`].
    Contact,
    /// [`RawSample`].
    Raw,
    /// [`HealthMessage`].
    Health,
    /// [`ConfigGet`].
    ConfigGet,
    /// [`ConfigSet`].
    ConfigSet,
    /// [`ConfigResponse`].
    ConfigResponse,
    /// [`LogMessage`].
    Log,
    /// [`NmtRequest`].
    Nmt,
}

impl Kind {
    /// All types.
    pub const ALL: [Self; 8] = [
        Self::Contact,
        Self::Raw,
        Self::Health,
        Self::ConfigGet,
        Self::ConfigSet,
        Self::ConfigResponse,
        Self::Log,
        Self::Nmt,
    ];

    /// The type's byte.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Contact => 0x01,
            Self::Raw => 0x02,
            Self::Health => 0x03,
            Self::ConfigGet => 0x10,
            Self::ConfigSet => 0x11,
            Self::ConfigResponse => 0x12,
            Self::Nmt => 0x13,
            Self::Log => 0x20,
        }
    }

    /// Type with this code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.code() == code)
    }
}

/// A message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// Contact.
    Contact(ContactMessage),
    /// Sample of the sensor.
    Raw(RawSample),
    /// State of the board.
    Health(HealthMessage),
    /// Request for an object's value.
    ConfigGet(ConfigGet),
    /// A new value for an object.
    ConfigSet(ConfigSet),
    /// Response to either.
    ConfigResponse(ConfigResponse),
    /// A line of text.
    Log(LogMessage),
    /// A change of the NMT state.
    Nmt(NmtRequest),
}

impl Message {
    /// The type.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Contact(_) => Kind::Contact,
            Self::Raw(_) => Kind::Raw,
            Self::Health(_) => Kind::Health,
            Self::ConfigGet(_) => Kind::ConfigGet,
            Self::ConfigSet(_) => Kind::ConfigSet,
            Self::ConfigResponse(_) => Kind::ConfigResponse,
            Self::Log(_) => Kind::Log,
            Self::Nmt(_) => Kind::Nmt,
        }
    }

    /// Decodes a message of this type; `None` if the payload has a wrong length
    /// or an invalid value.
    #[must_use]
    pub fn decode(kind: Kind, payload: &[u8]) -> Option<Self> {
        let reader = Reader::new(payload);
        Some(match kind {
            Kind::Contact => Self::Contact(ContactMessage::read(reader)?),
            Kind::Raw => Self::Raw(RawSample::read(reader)?),
            Kind::Health => Self::Health(HealthMessage::read(reader)?),
            Kind::ConfigGet => Self::ConfigGet(ConfigGet::read(reader)?),
            Kind::ConfigSet => Self::ConfigSet(ConfigSet::read(reader)?),
            Kind::ConfigResponse => Self::ConfigResponse(ConfigResponse::read(reader)?),
            Kind::Log => Self::Log(LogMessage::read(reader)?),
            Kind::Nmt => Self::Nmt(NmtRequest::read(reader)?),
        })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match self {
            Self::Contact(message) => message.write(writer),
            Self::Raw(message) => message.write(writer),
            Self::Health(message) => message.write(writer),
            Self::ConfigGet(message) => message.write(writer),
            Self::ConfigSet(message) => message.write(writer),
            Self::ConfigResponse(message) => message.write(writer),
            Self::Log(message) => message.write(writer),
            Self::Nmt(message) => message.write(writer),
        }
    }
}

/// Contents of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Sequence number, incremented with each frame.
    pub sequence: u16,
    /// Message.
    pub message: Message,
}

/// Encoded frame.
#[derive(Clone, Debug)]
pub struct Encoded(Vec<u8, MAX_FRAME>);

impl Encoded {
    /// The bytes to send, the zeros at both ends included.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

/// Encodes a message. `sequence` must be one more than that of the previous frame, whether or not that frame was sent.
#[must_use]
pub fn encode(sequence: u16, message: &Message) -> Encoded {
    let mut plain = [0; MAX_DECODED];
    let mut writer = Writer::new(&mut plain);
    writer.u8(VERSION);
    writer.u8(message.kind().code());
    writer.u16(sequence);
    message.write(&mut writer);
    let length = writer.finish().unwrap_or(0);
    if let Some((body, rest)) = plain.split_at_mut_checked(length) {
        Writer::new(rest).u32(CRC.checksum(body));
    }
    // Every message is shorter than the longest payload; a test encodes the longest of each.
    let mut frame = Encoded(Vec::new());
    let plain = plain.get(..length + CHECK);
    if plain.and_then(|plain| cobs::encode(plain, &mut frame.0)).is_none() {
        frame.0.clear();
    }
    frame
}

/// Parses a decoded frame; returns the problem if it is invalid.
fn parse(plain: &[u8]) -> Result<Frame, Problem> {
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
    let message = Message::decode(kind, reader.rest()).ok_or(Problem::Payload(kind))?;
    Ok(Frame { sequence, message })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dictionary::Address;

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
    fn each_type_has_a_unique_code() {
        for kind in Kind::ALL {
            assert_eq!(Kind::from_code(kind.code()), Some(kind));
        }
        assert_eq!(Kind::from_code(0), None);
    }

    #[test]
    fn an_invalid_frame_reports_its_problem() {
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
}
