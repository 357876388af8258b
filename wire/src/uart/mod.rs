//! The serial line: frames that a receiver finds in any stream.
//!
//! A frame is coded with COBS, so that it contains no zero byte. A zero byte precedes it and another follows it: the
//! first ends any garbage that was on the line before. The decoded frame:
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

mod config;
mod contact;
mod framing;
mod health;
mod log;
mod raw;

pub use config::{Answer, ConfigGet, ConfigResponse, ConfigSet, MAX_VALUE, NmtRequest};
pub use contact::ContactMessage;
pub use framing::{
    Decoder, Drops, Encoded, Frame, MAX_FRAME, MAX_PAYLOAD, Problem, Step, VERSION, encode,
    step_u16,
};
pub use health::HealthMessage;
pub use log::{LogMessage, MAX_LOG};
pub use raw::RawMessage;

use crate::bytes::{Reader, Writer};

/// Type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`ContactMessage`].
    Contact,
    /// [`RawMessage`].
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
    Raw(RawMessage),
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

    /// Decodes a message of this type; `None` if the payload has a wrong length or an invalid value.
    #[must_use]
    pub fn decode(kind: Kind, payload: &[u8]) -> Option<Self> {
        let reader = Reader::new(payload);
        Some(match kind {
            Kind::Contact => Self::Contact(ContactMessage::read(reader)?),
            Kind::Raw => Self::Raw(RawMessage::read(reader)?),
            Kind::Health => Self::Health(HealthMessage::read(reader)?),
            Kind::ConfigGet => Self::ConfigGet(ConfigGet::read(reader)?),
            Kind::ConfigSet => Self::ConfigSet(ConfigSet::read(reader)?),
            Kind::ConfigResponse => Self::ConfigResponse(ConfigResponse::read(reader)?),
            Kind::Log => Self::Log(LogMessage::read(reader)?),
            Kind::Nmt => Self::Nmt(NmtRequest::read(reader)?),
        })
    }

    fn checked(kind: Kind, payload: &[u8]) -> Result<Self, Problem> {
        Self::decode(kind, payload).ok_or(Problem::Payload(kind))
    }

    /// Decodes a request to a foot. A foot needs no decoder of its own messages, which would take 2 KB of its flash.
    fn checked_request(kind: Kind, payload: &[u8]) -> Result<Self, Problem> {
        let reader = Reader::new(payload);
        let request = match kind {
            Kind::ConfigGet => ConfigGet::read(reader).map(Self::ConfigGet),
            Kind::ConfigSet => ConfigSet::read(reader).map(Self::ConfigSet),
            Kind::Nmt => NmtRequest::read(reader).map(Self::Nmt),
            Kind::Contact | Kind::Raw | Kind::Health | Kind::ConfigResponse | Kind::Log => {
                return Err(Problem::Kind(kind.code()));
            }
        };
        request.ok_or(Problem::Payload(kind))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_has_a_unique_code() {
        for kind in Kind::ALL {
            assert_eq!(Kind::from_code(kind.code()), Some(kind));
        }
        assert_eq!(Kind::from_code(0), None);
    }
}
