//! Abort codes of CiA 301: the reasons for refusing a read or a write, on CAN and UART alike.

/// An SDO abort code (CiA 301, table 22).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbortCode {
    /// The toggle bit of a segment did not alternate.
    ToggleBit,
    /// The command specifier is unknown, or invalid in this state of the transfer.
    Command,
    /// The number of a segment of a block download is 0, or above the size of the sub-block.
    SequenceNumber,
    /// The bytes of a block download do not have their CRC.
    Crc,
    /// The object can only be written.
    WriteOnly,
    /// The object can only be read.
    ReadOnly,
    /// The object does not exist.
    NoObject,
    /// The value is incompatible with the other settings.
    Incompatible,
    /// A store, a protection or a confirmation failed, or another one is pending.
    Hardware,
    /// The length does not match the object's type.
    Length,
    /// The value is longer than the object's type.
    TooLong,
    /// The value is shorter than the object's type.
    TooShort,
    /// The sub-index does not exist.
    NoSubindex,
    /// The value is not one of those allowed.
    InvalidValue,
    /// The value is above the upper limit.
    TooHigh,
    /// The value is below the lower limit.
    TooLow,
    /// The data cannot be stored: wrong signature.
    CannotStore,
    /// Refused by the configuration lock.
    Locked,
    /// Refused in this state: configuration is written in pre-operational only.
    DeviceState,
    /// Refused because of the stores just before: the flash wears out.
    TooSoon,
}

impl AbortCode {
    /// All codes.
    pub const ALL: [Self; 20] = [
        Self::ToggleBit,
        Self::Command,
        Self::SequenceNumber,
        Self::Crc,
        Self::WriteOnly,
        Self::ReadOnly,
        Self::NoObject,
        Self::Incompatible,
        Self::Hardware,
        Self::Length,
        Self::TooLong,
        Self::TooShort,
        Self::NoSubindex,
        Self::InvalidValue,
        Self::TooHigh,
        Self::TooLow,
        Self::CannotStore,
        Self::Locked,
        Self::DeviceState,
        Self::TooSoon,
    ];

    /// The code on the wire.
    #[must_use]
    pub const fn code(self) -> u32 {
        match self {
            Self::ToggleBit => 0x0503_0000,
            Self::Command => 0x0504_0001,
            Self::SequenceNumber => 0x0504_0003,
            Self::Crc => 0x0504_0004,
            Self::WriteOnly => 0x0601_0001,
            Self::ReadOnly => 0x0601_0002,
            Self::NoObject => 0x0602_0000,
            Self::Incompatible => 0x0604_0043,
            Self::Hardware => 0x0606_0000,
            Self::Length => 0x0607_0010,
            Self::TooLong => 0x0607_0012,
            Self::TooShort => 0x0607_0013,
            Self::NoSubindex => 0x0609_0011,
            Self::InvalidValue => 0x0609_0030,
            Self::TooHigh => 0x0609_0031,
            Self::TooLow => 0x0609_0032,
            Self::CannotStore => 0x0800_0020,
            Self::Locked => 0x0800_0021,
            Self::DeviceState => 0x0800_0022,
            // A general error: CiA 301 has no code for it.
            Self::TooSoon => 0x0800_0000,
        }
    }

    /// The reason with this code.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|abort| abort.code() == code)
    }

    /// Description, in the words of CiA 301 or shorter.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ToggleBit => "toggle bit not alternated",
            Self::Command => "command specifier not valid",
            Self::SequenceNumber => "sequence number not valid",
            Self::Crc => "CRC error",
            Self::WriteOnly => "write-only object",
            Self::ReadOnly => "read-only object",
            Self::NoObject => "no such object",
            Self::Incompatible => "does not go together with the other settings",
            Self::Hardware => "hardware error",
            Self::Length => "length does not fit the type",
            Self::TooLong => "value too long",
            Self::TooShort => "value too short",
            Self::NoSubindex => "no such sub-index",
            Self::InvalidValue => "value not allowed",
            Self::TooHigh => "value too high",
            Self::TooLow => "value too low",
            Self::CannotStore => "cannot be stored: wrong signature",
            Self::Locked => "configuration is locked",
            Self::DeviceState => "only in pre-operational state",
            Self::TooSoon => "too many stores: one a second",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_stands_for_one_reason() {
        for abort in AbortCode::ALL {
            assert_eq!(AbortCode::from_code(abort.code()), Some(abort));
        }
        assert_eq!(AbortCode::from_code(0), None);
    }
}
