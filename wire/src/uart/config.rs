//! Types 0x10 to 0x13: the object dictionary over UART, by the same rules as over SDO.
//!
//! | type | bytes | field |
//! |---|---|---|
//! | 0x10 get | 0, 1 | index |
//! | | 2 | sub-index |
//! | 0x11 set | 0 to 2 | as in get |
//! | | 3 … | the value, of the length of its type |
//! | 0x12 response | 0 to 2 | as in the request |
//! | | 3 | 0: done or refused, 1: value |
//! | | 4 … | 0: abort code of CiA 301, 4 bytes, 0 if done; 1: the value |
//! | 0x13 NMT | 0 | command, as in the NMT message: 1 start, 2 stop, 0x80 enter pre-operational, 0x81 reset node, 0x82 reset communication |

use crate::abort::AbortCode;
use crate::address::Address;
use crate::bytes::{Reader, Writer};
use crate::node::NmtCommand;
use crate::value::Value;

/// Maximum length of a value, bytes: that of a text.
pub const MAX_VALUE: usize = 32;

/// Bytes of a value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ValueBytes {
    bytes: [u8; MAX_VALUE],
    length: u8,
}

impl ValueBytes {
    /// Copies bytes; `None` if there are too many.
    #[must_use]
    pub fn new(bytes: &[u8]) -> Option<Self> {
        if bytes.len() > MAX_VALUE {
            return None;
        }
        let mut value = Self::default();
        for (to, from) in value.bytes.iter_mut().zip(bytes) {
            *to = *from;
        }
        value.length = bytes.len() as u8;
        Some(value)
    }

    /// The bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }
}

impl From<Value> for ValueBytes {
    /// Encodes a value. A text that is too long is cut off.
    fn from(value: Value) -> Self {
        let raw = value.to_raw().to_le_bytes();
        let bytes = match value {
            Value::Text(text) => text.as_bytes(),
            _ => raw.get(..value.data_type().size().unwrap_or(0)).unwrap_or(&[]),
        };
        let cut = bytes.get(..MAX_VALUE).unwrap_or(bytes);
        Self::new(cut).unwrap_or_default()
    }
}

/// Request for an object's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigGet {
    /// The object.
    pub address: Address,
}

/// Request to change an object's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigSet {
    /// The object.
    pub address: Address,
    /// New value.
    pub value: ValueBytes,
}

/// Response to [`ConfigGet`] and [`ConfigSet`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigResponse {
    /// The object.
    pub address: Address,
    /// Result of the request.
    pub answer: Answer,
}

/// Result of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Read: the value.
    Value(ValueBytes),
    /// Written, stored or restored.
    Done,
    /// Refused, with the reason.
    Refused(AbortCode),
}

/// Request to change the NMT state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NmtRequest(pub NmtCommand);

fn write_address(writer: &mut Writer<'_>, address: Address) {
    writer.u16(address.index);
    writer.u8(address.subindex);
}

fn read_address(reader: &mut Reader<'_>) -> Option<Address> {
    Some(Address::new(reader.u16()?, reader.u8()?))
}

impl ConfigGet {
    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        write_address(writer, self.address);
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let address = read_address(&mut reader)?;
        reader.finish(Self { address })
    }
}

impl ConfigSet {
    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        write_address(writer, self.address);
        writer.bytes(self.value.as_bytes());
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let address = read_address(&mut reader)?;
        let value = ValueBytes::new(reader.rest())?;
        Some(Self { address, value })
    }
}

impl ConfigResponse {
    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        write_address(writer, self.address);
        match &self.answer {
            Answer::Value(value) => {
                writer.u8(1);
                writer.bytes(value.as_bytes());
            }
            Answer::Done => {
                writer.u8(0);
                writer.u32(0);
            }
            Answer::Refused(code) => {
                writer.u8(0);
                writer.u32(code.code());
            }
        }
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let address = read_address(&mut reader)?;
        let answer = match reader.u8()? {
            1 => Answer::Value(ValueBytes::new(reader.rest())?),
            0 => {
                let code = reader.u32()?;
                reader.finish(())?;
                match code {
                    0 => Answer::Done,
                    code => Answer::Refused(AbortCode::from_code(code)?),
                }
            }
            _ => return None,
        };
        Some(Self { address, answer })
    }
}

impl NmtRequest {
    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.0 as u8);
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let command = NmtCommand::from_byte(reader.u8()?).ok()?;
        reader.finish(Self(command))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uart::{Kind, Message};

    fn bytes(message: &Message) -> std::vec::Vec<u8> {
        let mut payload = [0; 64];
        let mut writer = Writer::new(&mut payload);
        message.write(&mut writer);
        let length = writer.finish().expect("it fits");
        payload[..length].to_vec()
    }

    #[test]
    fn golden_bytes() {
        let address = Address::new(0x2014, 1);
        let half = ValueBytes::from(Value::F32(0.5));
        let cases: [(Message, &[u8]); 6] = [
            (Message::ConfigGet(ConfigGet { address }), &[0x14, 0x20, 1]),
            (
                Message::ConfigSet(ConfigSet { address, value: half }),
                &[0x14, 0x20, 1, 0, 0, 0, 0x3F],
            ),
            (
                Message::ConfigResponse(ConfigResponse { address, answer: Answer::Value(half) }),
                &[0x14, 0x20, 1, 1, 0, 0, 0, 0x3F],
            ),
            (
                Message::ConfigResponse(ConfigResponse { address, answer: Answer::Done }),
                &[0x14, 0x20, 1, 0, 0, 0, 0, 0],
            ),
            (
                Message::ConfigResponse(ConfigResponse {
                    address,
                    answer: Answer::Refused(AbortCode::TooHigh),
                }),
                &[0x14, 0x20, 1, 0, 0x31, 0, 9, 6],
            ),
            (Message::Nmt(NmtRequest(NmtCommand::EnterPreOperational)), &[0x80]),
        ];
        for (message, golden) in cases {
            assert_eq!(bytes(&message), golden);
            assert_eq!(Message::decode(message.kind(), golden), Some(message));
        }
    }

    #[test]
    fn malformed_requests_are_rejected() {
        assert_eq!(Message::decode(Kind::ConfigGet, &[0x14, 0x20]), None);
        assert_eq!(Message::decode(Kind::ConfigSet, &[0; 36]), None);
        assert_eq!(Message::decode(Kind::ConfigResponse, &[0, 0, 0, 2]), None);
        assert_eq!(Message::decode(Kind::Nmt, &[7]), None);
    }
}
