//! The FIFO: up to 512 words of a tag and six bytes, batched at the full data rate.

use core::fmt;

use crate::config::Config;
use crate::register::{FIFO_STATUS2, fifo_data_out_tag, fifo_status2};
use crate::scale::{AccelFullScale, Codes, GyroFullScale, TemperatureCode};
use crate::timestamp::SensorTimestamp;

/// Words the FIFO holds: 3 kB of seven bytes with some overhead \[D, S\].
pub const CAPACITY: u16 = 512;

/// Bytes of a word: one tag, six of data.
pub const WORD_BYTES: usize = 7;

/// A word as read from the bus.
pub type WordBytes = [u8; WORD_BYTES];

/// `FIFO_STATUS1` and `FIFO_STATUS2`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FifoStatus {
    /// Unread words.
    pub level: u16,
    /// The level has reached the watermark.
    pub watermark: bool,
    /// The FIFO is full.
    pub full: bool,
    /// Words have been overwritten since the last reading: there is a gap.
    pub overrun: bool,
}

impl FifoStatus {
    /// Decodes the two registers; `None` if no part sends such bytes.
    #[must_use]
    pub const fn decode([low, high]: [u8; 2]) -> Option<Self> {
        let level = u16::from_le_bytes([low, fifo_status2::DIFF_FIFO.of(high)]);
        if !FIFO_STATUS2.keeps_reserved_bits(high) || level > CAPACITY {
            return None;
        }
        Some(Self {
            level,
            watermark: fifo_status2::FIFO_WTM_IA.is_set(high),
            full: fifo_status2::FIFO_FULL_IA.is_set(high),
            overrun: fifo_status2::FIFO_OVR_IA.is_set(high)
                || fifo_status2::OVER_RUN_LATCHED.is_set(high),
        })
    }
}

/// Type of a word: `TAG_SENSOR` \[P\].
pub mod tag {
    /// Angular rate, not compressed.
    pub const GYRO: u8 = 0x01;
    /// Specific force, not compressed.
    pub const ACCEL: u8 = 0x02;
    /// Temperature.
    pub const TEMPERATURE: u8 = 0x03;
    /// Timestamp.
    pub const TIMESTAMP: u8 = 0x04;
    /// The configuration changed here.
    pub const CONFIG_CHANGE: u8 = 0x05;
}

/// The contents of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FifoData {
    /// Angular rate.
    AngularRate(Codes<GyroFullScale>),
    /// Specific force.
    SpecificForce(Codes<AccelFullScale>),
    /// Temperature.
    Temperature(TemperatureCode),
    /// Time at which the samples of the same slot were taken.
    Timestamp(SensorTimestamp),
    /// The configuration changed here.
    ConfigChange,
    /// A type of word that this configuration does not request.
    Other {
        /// `TAG_SENSOR`.
        tag: u8,
        /// The six bytes.
        data: [u8; 6],
    },
}

/// One word of the FIFO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FifoWord {
    /// Counts time slots from 0 to 3: words with the same count belong to the same instant.
    pub slot: u8,
    /// Contents of the word.
    pub data: FifoData,
}

/// The tag's parity is wrong: the word was corrupted in transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TagParityError {
    /// The tag byte as it was read.
    pub tag: u8,
}

impl fmt::Display for TagParityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "FIFO_DATA_OUT_TAG (0x78): read 0x{:02X}, whose parity is odd",
            self.tag
        )
    }
}

impl core::error::Error for TagParityError {}

impl FifoWord {
    /// Decodes a word. Its codes get the scales of `config`.
    ///
    /// # Errors
    /// An error if the tag byte has an odd number of ones \[P, ST's FIFO utility\].
    pub const fn decode(bytes: WordBytes, config: &Config) -> Result<Self, TagParityError> {
        let [tag, b0, b1, b2, b3, b4, b5] = bytes;
        if !tag.count_ones().is_multiple_of(2) {
            return Err(TagParityError { tag });
        }
        let codes = [
            i16::from_le_bytes([b0, b1]),
            i16::from_le_bytes([b2, b3]),
            i16::from_le_bytes([b4, b5]),
        ];
        let data = match fifo_data_out_tag::TAG_SENSOR.of(tag) {
            tag::GYRO => FifoData::AngularRate(Codes {
                codes,
                full_scale: config.params().gyro.full_scale,
            }),
            tag::ACCEL => FifoData::SpecificForce(Codes {
                codes,
                full_scale: config.params().accel.full_scale,
            }),
            tag::TEMPERATURE => {
                FifoData::Temperature(TemperatureCode(i16::from_le_bytes([b0, b1])))
            }
            tag::TIMESTAMP => {
                FifoData::Timestamp(SensorTimestamp(u32::from_le_bytes([b0, b1, b2, b3])))
            }
            tag::CONFIG_CHANGE => FifoData::ConfigChange,
            other => FifoData::Other {
                tag: other,
                data: [b0, b1, b2, b3, b4, b5],
            },
        };
        Ok(Self {
            slot: fifo_data_out_tag::TAG_CNT.of(tag),
            data,
        })
    }
}

/// Words read in one transfer.
#[derive(Clone, Copy, Debug)]
pub struct FifoBatch<'a> {
    /// The FIFO's status before they were read.
    pub status: FifoStatus,
    /// The words as read, oldest first.
    pub bytes: &'a [WordBytes],
    pub(crate) config: Config,
}

impl FifoBatch<'_> {
    /// Decodes the words, oldest first.
    pub fn words(&self) -> impl Iterator<Item = Result<FifoWord, TagParityError>> {
        self.bytes
            .iter()
            .map(|bytes| FifoWord::decode(*bytes, &self.config))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: Config = Config::FRESH_KILOHERTZ;

    #[test]
    fn word_is_decoded_by_its_tag() {
        // Tag 1, slot 2: 0b00001_10_0 has two ones.
        let word = FifoWord::decode([0x0C, 1, 0, 0xFF, 0xFF, 0, 1], &CONFIG).unwrap();
        assert_eq!(word.slot, 2);
        assert!(
            matches!(word.data, FifoData::AngularRate(codes) if codes.codes == [1, -1, 256]
                && codes.full_scale == GyroFullScale::Dps2000)
        );
        // Tag 4, slot 0: 0b00100_00 has a single one, so the parity bit is set.
        let word = FifoWord::decode([0x21, 1, 2, 0, 0, 0, 0], &CONFIG).unwrap();
        assert_eq!(word.data, FifoData::Timestamp(SensorTimestamp(513)));
    }

    #[test]
    fn word_with_a_flipped_tag_bit_is_rejected() {
        for bit in 0..8 {
            let tag = 0x0C ^ (1 << bit);
            assert_eq!(
                FifoWord::decode([tag, 0, 0, 0, 0, 0, 0], &CONFIG),
                Err(TagParityError { tag })
            );
        }
    }

    #[test]
    fn the_level_has_ten_bits_and_an_overrun_shows_in_either_flag() {
        let status = FifoStatus::decode([0x00, 0x02]).unwrap();
        assert_eq!(status.level, 512);
        assert!(!status.overrun && !status.watermark && !status.full);
        for high in [0x40, 0x08] {
            assert!(FifoStatus::decode([5, high]).unwrap().overrun);
        }
        assert!(FifoStatus::decode([0x2C, 0x81]).unwrap().watermark);
    }

    #[test]
    fn level_beyond_the_capacity_is_rejected() {
        assert_eq!(FifoStatus::decode([0x01, 0x02]), None);
        assert_eq!(FifoStatus::decode([0xFF, 0xFF]), None);
        assert_eq!(FifoStatus::decode([0x00, 0x04]), None);
    }
}
