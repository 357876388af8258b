//! State learnt from a foot, as it is stored, sent and restored: a warm start.

use crate::order::Order;
use crate::range::{ParamsError, Row, in_range, name, ranges};
use crate::units::Unit;

/// Evidence of each class from which the learnt state counts as settled, s. Four to five steps.
pub const SETTLED_AFTER: f32 = 1.0;

/// Range of the logarithm of an amplitude in [`Learnt`]: amplitudes of 1e-4 to 1e4.
pub const LOGARITHM: (f32, f32) = (-9.3, 9.3);

/// Largest number of seconds of a class in [`Learnt`].
pub const MOST_SECONDS: f32 = 1.0e3;

/// Largest age that is counted, s: eleven days.
pub const OLDEST: f32 = 1.0e6;

/// Learnt classes of one quantity; natural logarithms of amplitudes in m/s² or rad/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Classes {
    /// Mean in stillness.
    pub still: f32,
    /// Mean in motion.
    pub moving: f32,
    /// Mean deviation in stillness.
    pub width: f32,
}

/// Learnt state of a foot, and the amount of observation behind it. It can be stored and restored:
/// a warm start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Learnt {
    /// Acceleration without gravity.
    pub acceleration: Classes,
    /// Angular rate.
    pub rate: Classes,
    /// Leaky mean of the acceleration.
    pub velocity: Classes,
    /// Observed stillness, s; at most [`StillnessParams::memory`](super::StillnessParams::memory).
    pub still_seconds: f32,
    /// Observed motion, s; at most [`StillnessParams::memory`](super::StillnessParams::memory).
    pub moving_seconds: f32,
    /// Age: time that the foot has run since it was last learnt from, s.
    pub idle_seconds: f32,
}

impl Classes {
    /// Limits the numbers to the ranges in which they can be stored.
    pub(super) fn limited(self) -> Self {
        let (_, largest) = LOGARITHM;
        Self {
            still: self.still.lesser(largest),
            moving: self.moving.lesser(largest),
            width: self.width.lesser(largest),
        }
    }
}

impl Learnt {
    /// Number of values that are stored and sent.
    pub const NUMBERS: usize = 12;

    /// Returns the numbers in the order of the fields.
    #[must_use]
    pub const fn to_array(&self) -> [f32; Self::NUMBERS] {
        let Self {
            acceleration: a,
            rate: w,
            velocity: v,
            still_seconds,
            moving_seconds,
            idle_seconds,
        } = self;
        [
            a.still,
            a.moving,
            a.width,
            w.still,
            w.moving,
            w.width,
            v.still,
            v.moving,
            v.width,
            *still_seconds,
            *moving_seconds,
            *idle_seconds,
        ]
    }

    /// Creates the state from numbers in the order of [`Self::to_array`].
    #[must_use]
    pub const fn from_array(numbers: [f32; Self::NUMBERS]) -> Self {
        let [
            a0,
            a1,
            a2,
            w0,
            w1,
            w2,
            v0,
            v1,
            v2,
            still_seconds,
            moving_seconds,
            idle_seconds,
        ] = numbers;
        Self {
            acceleration: Classes {
                still: a0,
                moving: a1,
                width: a2,
            },
            rate: Classes {
                still: w0,
                moving: w1,
                width: w2,
            },
            velocity: Classes {
                still: v0,
                moving: v1,
                width: v2,
            },
            still_seconds,
            moving_seconds,
            idle_seconds,
        }
    }

    /// Returns whether enough was observed: [`SETTLED_AFTER`] of each class.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.still_seconds >= SETTLED_AFTER && self.moving_seconds >= SETTLED_AFTER
    }

    /// The rows of the table of limits, in the order of [`Self::to_array`].
    pub const ROWS: [Row; Self::NUMBERS] = {
        const fn row(
            path: &'static str,
            about: &'static str,
            unit: Unit,
            (least, most): (f32, f32),
        ) -> Row {
            Row {
                name: name(path),
                about: name(about),
                unit,
                least,
                most,
                default: 0.0,
            }
        }
        const fn seconds(path: &'static str, about: &'static str, most: f32) -> Row {
            row(path, about, Unit::Second, (0.0, most))
        }
        /// The paths of a quantity's numbers, with their rows.
        macro_rules! classes {
            ($quantity:literal, $unit:ident) => {{
                let (_, most) = LOGARITHM;
                [
                    row(
                        concat!("learnt.", $quantity, ".still"),
                        "mean of the logarithm of this amplitude in stillness",
                        Unit::$unit,
                        LOGARITHM,
                    ),
                    row(
                        concat!("learnt.", $quantity, ".moving"),
                        "mean of the logarithm of this amplitude in motion; not below that in stillness",
                        Unit::$unit,
                        LOGARITHM,
                    ),
                    row(
                        concat!("learnt.", $quantity, ".width"),
                        "mean deviation of the logarithm of this amplitude in stillness",
                        Unit::One,
                        (0.0, most),
                    ),
                ]
            }};
        }
        let [a0, a1, a2] = classes!("acceleration", LogMetrePerSecondSquared);
        let [w0, w1, w2] = classes!("rate", LogRadianPerSecond);
        let [v0, v1, v2] = classes!("velocity", LogMetrePerSecondSquared);
        [
            a0,
            a1,
            a2,
            w0,
            w1,
            w2,
            v0,
            v1,
            v2,
            seconds(
                "learnt.still_seconds",
                "stillness that was learnt from",
                MOST_SECONDS,
            ),
            seconds(
                "learnt.moving_seconds",
                "motion that was learnt from",
                MOST_SECONDS,
            ),
            seconds(
                "learnt.idle_seconds",
                "how long the foot has run since it last learnt anything",
                OLDEST,
            ),
        ]
    };

    /// Name of a number; empty on a microcontroller, to save room.
    fn name(i: usize) -> &'static str {
        if cfg!(target_os = "none") {
            return "";
        }
        Self::ROWS.get(i).map_or("", |row| row.name)
    }

    /// Checks that every number is in its range, and no motion below its stillness.
    pub(crate) fn validate(&self) -> Result<(), ParamsError> {
        let Self {
            acceleration: a,
            rate: w,
            velocity: v,
            ..
        } = self;
        static RANGES: [(f32, f32); Learnt::NUMBERS] = ranges(&Learnt::ROWS);
        for (i, ((least, most), value)) in RANGES.iter().zip(self.to_array()).enumerate() {
            let least = match i {
                1 => a.still,
                4 => w.still,
                7 => v.still,
                _ => *least,
            };
            in_range(Self::name(i), value, least, *most)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_below_its_stillness_is_rejected_by_name() {
        for (i, name) in [
            (1, "learnt.acceleration.moving"),
            (4, "learnt.rate.moving"),
            (7, "learnt.velocity.moving"),
        ] {
            for (moving, refused) in [(1.9, true), (2.1, false)] {
                let mut numbers = [0.0; Learnt::NUMBERS];
                (numbers[i - 1], numbers[i]) = (2.0, moving);
                let field = match Learnt::from_array(numbers).validate() {
                    Err(ParamsError::OutOfRange { field, .. }) => field,
                    Err(ParamsError::WindowLength { .. }) | Ok(()) => "",
                };
                assert_eq!(field, if refused { name } else { "" });
            }
        }
    }
}
