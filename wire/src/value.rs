//! Values of objects, and their bytes.

use core::cmp::Ordering;

/// The CiA 301 data types in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataType {
    /// INTEGER16.
    Integer16,
    /// UNSIGNED8.
    Unsigned8,
    /// UNSIGNED16.
    Unsigned16,
    /// UNSIGNED32.
    Unsigned32,
    /// REAL32.
    Real32,
    /// `VISIBLE_STRING`.
    VisibleString,
}

impl DataType {
    /// Index of the type in CiA 301 and EDS files.
    #[must_use]
    pub const fn index(self) -> u16 {
        match self {
            Self::Integer16 => 0x03,
            Self::Unsigned8 => 0x05,
            Self::Unsigned16 => 0x06,
            Self::Unsigned32 => 0x07,
            Self::Real32 => 0x08,
            Self::VisibleString => 0x09,
        }
    }

    /// Name of the type in CiA 301.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Integer16 => "INTEGER16",
            Self::Unsigned8 => "UNSIGNED8",
            Self::Unsigned16 => "UNSIGNED16",
            Self::Unsigned32 => "UNSIGNED32",
            Self::Real32 => "REAL32",
            Self::VisibleString => "VISIBLE_STRING",
        }
    }

    /// Size of a value, bytes; `None` for text.
    #[must_use]
    pub const fn size(self) -> Option<usize> {
        match self {
            Self::Unsigned8 => Some(1),
            Self::Integer16 | Self::Unsigned16 => Some(2),
            Self::Unsigned32 | Self::Real32 => Some(4),
            Self::VisibleString => None,
        }
    }
}

/// A value of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// INTEGER16.
    I16(i16),
    /// UNSIGNED8.
    U8(u8),
    /// UNSIGNED16.
    U16(u16),
    /// UNSIGNED32.
    U32(u32),
    /// REAL32.
    F32(f32),
    /// `VISIBLE_STRING`.
    Text(&'static str),
}

impl Value {
    /// The value's type.
    #[must_use]
    pub const fn data_type(self) -> DataType {
        match self {
            Self::I16(_) => DataType::Integer16,
            Self::U8(_) => DataType::Unsigned8,
            Self::U16(_) => DataType::Unsigned16,
            Self::U32(_) => DataType::Unsigned32,
            Self::F32(_) => DataType::Real32,
            Self::Text(_) => DataType::VisibleString,
        }
    }

    /// Bytes of the value, zero-extended to 32 bits; 0 for text. Format of stored settings.
    #[must_use]
    pub const fn to_raw(self) -> u32 {
        match self {
            Self::I16(value) => value as u16 as u32,
            Self::U8(value) => value as u32,
            Self::U16(value) => value as u32,
            Self::U32(value) => value,
            Self::F32(value) => value.to_bits(),
            Self::Text(_) => 0,
        }
    }

    /// Number of type `data_type` with these bytes; `None` for text.
    #[must_use]
    pub const fn from_raw(data_type: DataType, raw: u32) -> Option<Self> {
        Some(match data_type {
            DataType::Integer16 => Self::I16(raw as u16 as i16),
            DataType::Unsigned8 => Self::U8(raw as u8),
            DataType::Unsigned16 => Self::U16(raw as u16),
            DataType::Unsigned32 => Self::U32(raw),
            DataType::Real32 => Self::F32(f32::from_bits(raw)),
            DataType::VisibleString => return None,
        })
    }

    /// Number of type `data_type` in `bytes`, which must have the length of the type.
    #[must_use]
    pub fn from_bytes(data_type: DataType, bytes: &[u8]) -> Option<Self> {
        if data_type.size() != Some(bytes.len()) {
            return None;
        }
        let raw = bytes.iter().rev().fold(0, |raw, byte| (raw << 8) | u32::from(*byte));
        Self::from_raw(data_type, raw)
    }

    /// Compares two numbers of one type; `None` for different types, for text and for NaN.
    #[must_use]
    pub fn compare(self, other: Self) -> Option<Ordering> {
        match (self, other) {
            (Self::I16(a), Self::I16(b)) => Some(a.cmp(&b)),
            (Self::U8(a), Self::U8(b)) => Some(a.cmp(&b)),
            (Self::U16(a), Self::U16(b)) => Some(a.cmp(&b)),
            (Self::U32(a), Self::U32(b)) => Some(a.cmp(&b)),
            (Self::F32(a), Self::F32(b)) => a.partial_cmp(&b),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_trip_through_bytes() {
        let values = [
            Value::I16(-2),
            Value::U8(200),
            Value::U16(0xBEEF),
            Value::U32(0xDEAD_BEEF),
            Value::F32(-0.25),
        ];
        for value in values {
            let bytes = value.to_raw().to_le_bytes();
            let size = value.data_type().size().expect("a number");
            let back = Value::from_bytes(value.data_type(), &bytes[..size]);
            assert_eq!(back, Some(value));
            assert_eq!(Value::from_bytes(value.data_type(), &[]), None);
        }
    }

    #[test]
    fn nan_compares_with_nothing() {
        assert_eq!(Value::F32(f32::NAN).compare(Value::F32(0.0)), None);
        assert_eq!(Value::U8(1).compare(Value::U16(1)), None);
    }
}
