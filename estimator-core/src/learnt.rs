//! State learnt from a foot, as it is stored, sent and restored for a warm start.

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
    /// Mean of the logarithm of the acceleration in swings, ln(m/s²); not below that in stances.
    pub moving: f32,
    /// Logarithm of the speed that accelerations along the ground add up to in stances, ln(m/s).
    pub speed: f32,
    /// Duration of observed stillness, s.
    pub still_seconds: f32,
    /// Duration of observed motion, s.
    pub moving_seconds: f32,
}

impl Learnt {
    /// Number of values that are stored and sent.
    pub const NUMBERS: usize = 5;

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
                "mean of the logarithm of the acceleration in swings; not below that in stances",
                Unit::LogMetrePerSecondSquared,
                AMPLITUDE,
            ),
            row(
                "learnt.speed",
                "logarithm of the speed that accelerations along the ground add up to in stances",
                Unit::LogMetrePerSecond,
                SPEED,
            ),
            row(
                "learnt.still_seconds",
                "stances that were learnt from",
                Unit::Second,
                (0.0, MOST_SECONDS),
            ),
            row(
                "learnt.moving_seconds",
                "swings that were learnt from",
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_below_stillness_is_rejected_by_name() {
        for (moving, refused) in [(1.9, true), (2.1, false)] {
            let learnt = Learnt { still: 2.0, moving, ..Learnt::default() };
            let field = match learnt.validate() {
                Err(ParamsError::OutOfRange { field, .. }) => field,
                Err(ParamsError::WindowLength { .. }) | Ok(()) => "",
            };
            assert_eq!(field, if refused { "learnt.moving" } else { "" });
        }
    }
}
