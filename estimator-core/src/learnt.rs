//! State learnt from a foot, as it is stored, sent and restored for a warm start.
//!
//! The stored form has seven words of 32 bits, the same in Rust, in C and on a board:
//!
//! | word | content |
//! |---|---|
//! | 0 | [`Learnt::VERSION`] |
//! | 1 to 5 | the numbers in the order of [`Learnt::to_array`], as IEEE 754 binary32 |
//! | 6 | CRC-32 (ISO-HDLC) of the words before, each with its lowest byte first |
//!
//! As bytes, each word has its lowest byte first. A state with another version or a wrong CRC is rejected, since its
//! numbers might mean something else. The foot then learns again.

use core::fmt;

use crate::constants::Constants;
use crate::math::{Order, exp, ln};
use crate::range::{ParamsError, Row, in_range, name};
use crate::units::Unit;

/// Whether the learnt state follows the foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Learning {
    /// The foot keeps learning.
    #[default]
    On,
    /// The state stays as it was at the start.
    Frozen,
}

/// Duration of each class from which the learnt state counts as settled, s: two to three steps. A restored state counts
/// for at most as much, so that a few steps outweigh it.
pub const SETTLED_AFTER: f32 = 0.5;

/// Range of the logarithms of amplitudes in [`Learnt`]: 0.01 to 400 m/s².
pub const AMPLITUDE: (f32, f32) = (-4.6, 6.0);

/// Range of the logarithm of the speed: 10 µm/s to 1 m/s.
pub const SPEED: (f32, f32) = (-11.5, 0.0);

/// Largest number of seconds of a class in [`Learnt`].
pub const MOST_SECONDS: f32 = 1.0e3;

/// Least distance between the logarithms of the two classes. If the classes coincided, nothing would be still.
pub(crate) const LEAST_DISTANCE: f32 = 0.3;

/// Learnt state of a foot, and the amount of observation behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Learnt {
    /// Mean of the logarithm of the acceleration in stances, ln(m/s²).
    pub still: f32,
    /// Mean of the logarithm of the acceleration in swings, ln(m/s²); not below the mean in stances.
    pub moving: f32,
    /// Logarithm of the speed that accelerations along the ground add up to in stances, ln(m/s).
    pub speed: f32,
    /// Duration of observed stillness, s.
    pub still_seconds: f32,
    /// Duration of observed motion, s.
    pub moving_seconds: f32,
}

/// Reason why a stored state cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LearntError {
    /// The state was stored by another version of the estimator.
    Version(u32),
    /// The CRC does not match: a bit has changed, or nothing was stored here.
    Damaged,
}

impl fmt::Display for LearntError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version(found) => {
                write!(f, "learnt has version {found}, expected {}", Learnt::VERSION)
            }
            Self::Damaged => f.write_str("learnt is damaged: its CRC does not match"),
        }
    }
}

impl core::error::Error for LearntError {}

impl Learnt {
    /// Number of values that are stored and sent.
    pub const NUMBERS: usize = 5;

    /// Version of the stored form. It changes with the meaning of a number.
    pub const VERSION: u32 = 1;

    /// Number of words of the stored form.
    pub const WORDS: usize = Self::NUMBERS + 2;

    /// Size of the stored form, bytes.
    pub const BYTES: usize = 4 * Self::WORDS;

    /// Returns the stored form as words.
    #[must_use]
    pub fn to_words(&self) -> [u32; Self::WORDS] {
        let mut words = [Self::VERSION; Self::WORDS];
        let numbers = self.to_array().into_iter().map(f32::to_bits);
        for (word, content) in words.iter_mut().skip(1).zip(numbers.chain([self.crc()])) {
            *word = content;
        }
        words
    }

    /// CRC of the stored form.
    #[must_use]
    pub fn crc(&self) -> u32 {
        let numbers = self.to_array().into_iter().map(f32::to_bits);
        crc([Self::VERSION].into_iter().chain(numbers))
    }

    /// Restores the state from its stored form. The ranges of the numbers are checked by
    /// [`Params::validate`](crate::Params::validate).
    ///
    /// # Errors
    /// The CRC does not match, or the state is of another version.
    pub fn from_words(words: &[u32; Self::WORDS]) -> Result<Self, LearntError> {
        let &[version, numbers @ .., found] = words;
        if crc([version].into_iter().chain(numbers)) != found {
            Err(LearntError::Damaged)
        } else if version != Self::VERSION {
            Err(LearntError::Version(version))
        } else {
            Ok(Self::from_array(numbers.map(f32::from_bits)))
        }
    }

    /// Returns the stored form as bytes.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        for (to, word) in bytes.as_chunks_mut().0.iter_mut().zip(self.to_words()) {
            *to = word.to_le_bytes();
        }
        bytes
    }

    /// Restores the state from bytes, as [`Self::from_words`] does from words.
    ///
    /// # Errors
    /// The CRC does not match, or the state is of another version.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Result<Self, LearntError> {
        let mut words = [0; Self::WORDS];
        for (word, from) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*from);
        }
        Self::from_words(&words)
    }

    /// Returns the numbers in the order of the fields.
    #[must_use]
    pub const fn to_array(&self) -> [f32; Self::NUMBERS] {
        let Self { still, moving, speed, still_seconds, moving_seconds } = *self;
        [still, moving, speed, still_seconds, moving_seconds]
    }

    /// Creates the state from numbers in the order of [`Self::to_array`].
    #[must_use]
    pub const fn from_array(numbers: [f32; Self::NUMBERS]) -> Self {
        let [still, moving, speed, still_seconds, moving_seconds] = numbers;
        Self { still, moving, speed, still_seconds, moving_seconds }
    }

    /// Returns whether enough was observed: [`SETTLED_AFTER`] of each class.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.still_seconds >= SETTLED_AFTER && self.moving_seconds >= SETTLED_AFTER
    }

    /// State before any observation.
    pub(crate) fn unobserved(constants: &Constants) -> Self {
        Self {
            still: ln(constants.still),
            moving: ln(constants.moving),
            speed: ln(constants.slide_speed),
            still_seconds: 0.0,
            moving_seconds: 0.0,
        }
    }

    /// The state that an estimator starts from: no amplitude below the noise, classes that differ, and no more weight
    /// than a few steps have.
    pub(crate) fn at_start(self, constants: &Constants) -> Self {
        let still = self.still.greater(ln(constants.noise));
        Self {
            still,
            moving: self.moving.greater(still + LEAST_DISTANCE),
            speed: self.speed,
            still_seconds: self.still_seconds.lesser(SETTLED_AFTER),
            moving_seconds: self.moving_seconds.lesser(SETTLED_AFTER),
        }
    }

    /// Upper end of stillness, m/s², with these constants.
    #[must_use]
    pub fn edge(&self, constants: &Constants) -> f32 {
        let Self { still, moving, .. } = self.at_start(constants);
        exp(constants.edge(still, moving))
    }

    /// The rows of the table of limits, in the order of [`Self::to_array`].
    pub const ROWS: [Row; Self::NUMBERS] = {
        const fn row(
            path: &'static str,
            about: &'static str,
            unit: Unit,
            (least, most): (f32, f32),
        ) -> Row {
            Row { name: name(path), about: name(about), unit, least, most, default: 0.0 }
        }
        [
            row(
                "learnt.still",
                "mean of the logarithm of the acceleration in stances",
                Unit::LogMetrePerSecondSquared,
                AMPLITUDE,
            ),
            row(
                "learnt.moving",
                "mean of the logarithm of the acceleration in swings; not below the mean in stances",
                Unit::LogMetrePerSecondSquared,
                AMPLITUDE,
            ),
            row(
                "learnt.speed",
                "logarithm of the speed to which accelerations along the ground add up in stances",
                Unit::LogMetrePerSecond,
                SPEED,
            ),
            row(
                "learnt.still_seconds",
                "duration of the stances that were learnt from",
                Unit::Second,
                (0.0, MOST_SECONDS),
            ),
            row(
                "learnt.moving_seconds",
                "duration of the swings that were learnt from",
                Unit::Second,
                (0.0, MOST_SECONDS),
            ),
        ]
    };

    /// Checks that every number is in its range, and motion not below stillness.
    pub(crate) fn validate(&self) -> Result<(), ParamsError> {
        for (row, value) in Self::ROWS.iter().zip(self.to_array()) {
            in_range(row.name, value, row.least, row.most)?;
        }
        let [_, moving, ..] = Self::ROWS;
        in_range(moving.name, self.moving, self.still, moving.most)
    }

    /// The state, limited to the ranges in which it can be stored.
    pub(crate) fn limited(self) -> Self {
        let mut numbers = self.to_array();
        for (number, row) in numbers.iter_mut().zip(Self::ROWS) {
            *number = number.greater(row.least).lesser(row.most);
        }
        Self::from_array(numbers)
    }
}

/// CRC-32 (ISO-HDLC) of words, each with its lowest byte first. It needs no table, because it runs only at a start and at
/// a store.
fn crc(words: impl Iterator<Item = u32>) -> u32 {
    const POLYNOMIAL: u32 = 0xEDB8_8320;
    !words.fold(u32::MAX, |crc, word| {
        (0..u32::BITS).fold(crc ^ word, |crc, _| {
            let carry = if crc & 1 == 0 { 0 } else { POLYNOMIAL };
            (crc >> 1) ^ carry
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEARNT: Learnt =
        Learnt { still: -1.0, moving: 2.0, speed: -4.5, still_seconds: 4.0, moving_seconds: 3.0 };

    #[test]
    fn golden_bytes_of_the_stored_form() {
        let bytes = [
            1, 0, 0, 0, // version
            0, 0, 0x80, 0xBF, 0, 0, 0, 0x40, 0, 0, 0x90, 0xC0, 0, 0, 0x80, 0x40, 0, 0, 0x40, 0x40,
            0x32, 0x42, 0x74, 0xCD, // CRC
        ];
        assert_eq!(LEARNT.to_bytes(), bytes);
        assert_eq!(Learnt::from_bytes(&bytes), Ok(LEARNT));
    }

    #[test]
    fn each_flipped_bit_of_the_stored_form_is_rejected() {
        let stored = LEARNT.to_bytes();
        for bit in 0..8 * Learnt::BYTES {
            let mut flipped = stored;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Learnt::from_bytes(&flipped), Err(LearntError::Damaged), "bit {bit}");
        }
    }

    #[test]
    fn stored_form_of_another_version_is_rejected() {
        for version in [0, 2, u32::MAX] {
            let mut words = LEARNT.to_words();
            words[0] = version;
            words[6] = crc(words.into_iter().take(6));
            assert_eq!(Learnt::from_words(&words), Err(LearntError::Version(version)));
        }
    }

    #[test]
    fn blank_memory_is_no_stored_form() {
        for byte in [0, 0xFF] {
            let blank = Learnt::from_bytes(&[byte; Learnt::BYTES]);
            assert_eq!(blank, Err(LearntError::Damaged));
        }
    }

    #[test]
    fn motion_below_stillness_is_rejected_by_name() {
        for (moving, refused) in [(1.9, true), (2.1, false)] {
            let learnt = Learnt { still: 2.0, moving, ..Learnt::default() };
            let field = match learnt.validate() {
                Err(ParamsError::OutOfRange { field, .. }) => field,
                Err(_) | Ok(()) => "",
            };
            assert_eq!(field, if refused { "learnt.moving" } else { "" });
        }
    }
}
