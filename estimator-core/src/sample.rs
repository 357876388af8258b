//! One IMU sample in SI units, and its validity.
//!
//! A driver converts to SI once, at its boundary; from here on every quantity has its own
//! type. Axes are those of the sensor until a [mounting](crate::mounting) rotates them to those
//! of the foot.

use crate::vector::Vec3;

/// Accelerometer output in m/s², gravity included: at rest it points up with 9.81 m/s².
///
/// The name follows Wahlström and Skog, *Fifteen years of progress at zero velocity* (2021).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpecificForce(pub Vec3);

/// Acceleration of the foot in m/s², gravity removed: at rest it is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinearAcceleration(pub Vec3);

/// Gyroscope output in rad/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AngularRate(pub Vec3);

/// Time at which a sample was acquired: microseconds since the clock's own start.
///
/// 64 bits suffice for half a million years, so it never wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Timestamp(u64);

impl Timestamp {
    /// A time `micros` µs after the clock's start.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// Microseconds since the clock's start.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// Microseconds from `earlier` to `self`; `None` if `self` is the earlier one.
    #[must_use]
    pub const fn micros_since(self, earlier: Self) -> Option<u64> {
        self.0.checked_sub(earlier.0)
    }
}

/// Time between consecutive samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// Seconds; after an interruption, one period.
    pub(crate) seconds: f32,
    pub(crate) continuity: Continuity,
}

/// Whether motion can be integrated between two consecutive samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuity {
    /// The samples are close enough to integrate between them.
    Continuous,
    /// Samples so far apart that the integral between them is only a guess.
    Gap,
    /// Samples too far apart for any assumption about the motion in between.
    Interrupted,
}

/// Quality of a sample as reported by its source.
///
/// Any value except [`Validity::Valid`] counts as "not stable": doubt never turns into contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Validity {
    /// A fresh reading inside the sensor's range.
    #[default]
    Valid,
    /// At least one axis is at the end of its range: the true value is beyond it.
    Saturated(Saturation),
    /// The sensor gave no new reading: the values repeat an earlier one.
    Stale,
    /// The reading failed: the values are meaningless.
    Invalid,
}

/// Sensor that is at the end of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Saturation {
    /// The accelerometer alone: the rotation is known, the force is not.
    Accelerometer,
    /// The gyroscope alone: the force is known, the rotation is not.
    Gyroscope,
    /// Both.
    Both,
}

impl Saturation {
    /// Returns whether the specific force is beyond the reading.
    #[must_use]
    pub const fn includes_accelerometer(self) -> bool {
        matches!(self, Self::Accelerometer | Self::Both)
    }

    /// Returns whether the angular rate is beyond the reading.
    #[must_use]
    pub const fn includes_gyroscope(self) -> bool {
        matches!(self, Self::Gyroscope | Self::Both)
    }
}

/// Measurement of an IMU on a foot at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImuSample {
    /// Time at which the sample was acquired.
    pub timestamp: Timestamp,
    /// Accelerometer, m/s². With [`Gravity::Removed`](crate::Gravity::Removed) in the parameters
    /// the source has removed gravity already and the estimator uses it unchanged.
    pub specific_force: SpecificForce,
    /// Gyroscope, rad/s.
    pub angular_rate: AngularRate,
    /// Quality of the sample as reported by its source.
    pub validity: Validity,
}

/// Largest plausible specific force, m/s². A larger number is a broken reading, and it would overflow f32 squares.
const SPECIFIC_FORCE_LIMIT: f32 = 1.0e4;

/// Largest plausible angular rate, rad/s.
const ANGULAR_RATE_LIMIT: f32 = 1.0e3;

impl ImuSample {
    /// Returns the quality of the sample after a check of its values: a value that is not
    /// finite, or beyond 10⁴ m/s² or 10³ rad/s, ten times the range of any IMU that fits a foot, makes it
    /// [`Validity::Invalid`] whatever the source reported.
    #[must_use]
    #[inline(always)]
    pub fn checked_validity(&self) -> Validity {
        let measurable = self.specific_force.0.is_within(SPECIFIC_FORCE_LIMIT)
            && self.angular_rate.0.is_within(ANGULAR_RATE_LIMIT);
        if measurable { self.validity } else { Validity::Invalid }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample_with_ax(ax: f32) -> ImuSample {
        ImuSample {
            specific_force: SpecificForce(Vec3::new(ax, 0.0, 9.81)),
            ..ImuSample::default()
        }
    }

    #[test]
    fn implausible_number_makes_the_sample_invalid() {
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0e30, -1.1e4] {
            assert_eq!(sample_with_ax(broken).checked_validity(), Validity::Invalid, "{broken}");
        }
    }

    #[test]
    fn implausible_rate_makes_the_sample_invalid() {
        for broken in [f32::NAN, 1.001e3, -1.0e30] {
            let sample = ImuSample {
                angular_rate: AngularRate(Vec3::new(0.0, broken, 0.0)),
                ..sample_with_ax(0.0)
            };
            assert_eq!(sample.checked_validity(), Validity::Invalid, "{broken}");
        }
    }

    #[test]
    fn plausible_sample_keeps_the_validity_of_its_source() {
        for validity in [Validity::Valid, Validity::Saturated(Saturation::Both), Validity::Stale] {
            let sample = ImuSample { validity, ..sample_with_ax(157.0) };
            assert_eq!(sample.checked_validity(), validity);
        }
    }

    #[test]
    fn time_since_a_later_timestamp_is_unknown() {
        let (early, late) = (Timestamp::from_micros(1_000), Timestamp::from_micros(3_500));
        assert_eq!(late.micros_since(early), Some(2_500));
        assert_eq!(early.micros_since(late), None);
    }
}
