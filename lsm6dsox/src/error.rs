//! Errors of the driver, with the register, the value written and the value read.

use core::fmt;

use crate::register::{self, Register};

/// Error of the driver. `E` is the error type of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The transfer itself failed.
    Bus(E),
    /// `WHO_AM_I` does not hold 0x6C: another part, or no part at all. 0x00 and 0xFF
    /// indicate a data line that is stuck or not connected.
    Identity {
        /// Value read.
        read: u8,
    },
    /// `SW_RESET` in `CTRL3_C` did not return to 0 in time.
    ResetTimeout {
        /// Value written to start the reset.
        written: u8,
        /// Last value read.
        read: u8,
    },
    /// A register does not hold the value written: the write was lost, or the part has been
    /// reset since.
    ReadBack {
        /// Register that was read back.
        register: Register,
        /// Value written.
        written: u8,
        /// Value read.
        read: u8,
    },
    /// A status register has bits set that no part sets. The value read is not a status, and the data read with it are
    /// invalid.
    Status {
        /// Status register.
        register: Register,
        /// Value read.
        read: u8,
    },
    /// No new sample arrived in time during the self-test.
    DataReadyTimeout {
        /// Last value of `STATUS_REG`.
        read: u8,
    },
    /// The part is not known to hold the configuration, so its codes have no scale. It was not initialised, was
    /// switched off, or an init, a check or a self-test has failed since.
    Unconfigured,
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Self::Bus(error)
    }
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "bus: {error:?}"),
            Self::Identity { read } => write!(
                f,
                "WHO_AM_I (0x0F): read 0x{read:02X}, expected 0x{:02X}",
                register::WHO_AM_I.reset
            ),
            Self::ResetTimeout { written, read } => write!(
                f,
                "CTRL3_C (0x12): wrote 0x{written:02X}, still reads 0x{read:02X}, reset not done"
            ),
            Self::ReadBack { register, written, read } => write!(
                f,
                "{} (0x{:02X}): wrote 0x{written:02X}, read 0x{read:02X}",
                register.name, register.address
            ),
            Self::Status { register, read } => write!(
                f,
                "{} (0x{:02X}): read 0x{read:02X}, which no part sends",
                register.name, register.address
            ),
            Self::DataReadyTimeout { read } => {
                write!(f, "STATUS_REG (0x1E): reads 0x{read:02X}, no new sample in time")
            }
            Self::Unconfigured => {
                write!(f, "the part is not known to hold the configuration, init comes first")
            }
        }
    }
}

impl<E: fmt::Debug> core::error::Error for Error<E> {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_message_names_the_register_and_the_bytes() {
        let messages = [
            (Error::Identity { read: 0x6A }, "WHO_AM_I (0x0F): read 0x6A, expected 0x6C"),
            (
                Error::ResetTimeout { written: 0x05, read: 0x05 },
                "CTRL3_C (0x12): wrote 0x05, still reads 0x05, reset not done",
            ),
            (
                Error::ReadBack { register: register::CTRL1_XL, written: 0xA6, read: 0x00 },
                "CTRL1_XL (0x10): wrote 0xA6, read 0x00",
            ),
            (
                Error::Status { register: register::STATUS_REG, read: 0xFF },
                "STATUS_REG (0x1E): read 0xFF, which no part sends",
            ),
            (
                Error::DataReadyTimeout { read: 0x00 },
                "STATUS_REG (0x1E): reads 0x00, no new sample in time",
            ),
            (
                Error::Unconfigured,
                "the part is not known to hold the configuration, init comes first",
            ),
            (Error::Bus("overrun"), "bus: \"overrun\""),
        ];
        for (error, message) in messages {
            assert_eq!(error.to_string(), message);
        }
    }
}
