//! Facts about the samples that an estimator is given: how often they come, and whether they contain gravity.

use crate::math::rounded;
use crate::range::{ParamsError, Row, name};
use crate::units::Unit;

/// Whether the accelerometer's samples still contain gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gravity {
    /// The samples are as an accelerometer measures them. The attitude filter removes gravity and gyro bias.
    #[default]
    Included,
    /// Gravity and bias have been removed already, as in simulator recordings:
    /// samples are used as they are. [`GravityCheck`](crate::gravity::GravityCheck) finds samples that still contain gravity.
    Removed,
}

/// Range of the sample rate.
pub const SAMPLE_RATE: Row = Row {
    name: name("sample_rate_hz"),
    about: name("rate at which samples arrive"),
    unit: Unit::Hertz,
    least: 20.0,
    most: 10_000.0,
    default: 1_000.0,
};

/// The samples of one sensor: their rate, and whether they contain gravity.
///
/// These are facts about a recording or a board, whereas [`Params`](crate::Params) are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    sample_rate: f32,
    gravity: Gravity,
}

impl Stream {
    /// Samples of an accelerometer and a gyroscope at 1 kHz, as the firmware reads them.
    pub const KILOHERTZ: Self =
        Self { sample_rate: SAMPLE_RATE.default, gravity: Gravity::Included };

    /// Samples at a rate in Hz.
    ///
    /// # Errors
    /// The rate is not one of 20 to 10 000 Hz.
    pub const fn new(sample_rate: f32, gravity: Gravity) -> Result<Self, ParamsError> {
        match SAMPLE_RATE.check(sample_rate) {
            Ok(()) => Ok(Self { sample_rate, gravity }),
            Err(error) => Err(error),
        }
    }

    /// The same samples with another content of gravity.
    #[must_use]
    pub const fn with_gravity(self, gravity: Gravity) -> Self {
        Self { gravity, ..self }
    }

    /// Rate at which the samples arrive, Hz.
    #[must_use]
    pub const fn sample_rate(self) -> f32 {
        self.sample_rate
    }

    /// Whether the samples contain gravity.
    #[must_use]
    pub const fn gravity(self) -> Gravity {
        self.gravity
    }

    /// Time between samples, µs.
    pub(crate) fn period_us(self) -> u64 {
        u64::from(rounded(1.0e6 / self.sample_rate))
    }
}

/// Period of this many µs, in s. Converted in 32 bits, because a processor without double precision converts 64 bits
/// by a library.
pub(crate) fn period_s(period_us: u64) -> f32 {
    u32::try_from(period_us).unwrap_or(u32::MAX) as f32 * 1.0e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_out_of_range_is_rejected_by_name() {
        for rate in [0.0, -1_000.0, 19.9, 10_001.0, f32::NAN, f32::INFINITY] {
            let error = Stream::new(rate, Gravity::Included).unwrap_err();
            let ParamsError::OutOfRange { field, .. } = error else {
                panic!("{error}");
            };
            assert_eq!(field, "sample_rate_hz");
        }
        for rate in [20.0, 104.0, 10_000.0] {
            assert_eq!(Stream::new(rate, Gravity::Removed).map(Stream::sample_rate), Ok(rate));
        }
    }

    #[test]
    fn period_is_rounded_to_the_nearest_microsecond() {
        let period = |rate| Stream::new(rate, Gravity::Included).map(Stream::period_us);
        assert_eq!(period(1_000.0), Ok(1_000));
        assert_eq!(period(416.0), Ok(2_404));
    }
}
