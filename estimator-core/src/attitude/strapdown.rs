//! Strapdown integration of the angular rate to a small rotation.

use crate::step::{Continuity, Step};
use crate::vector::{Quaternion, Vec3};

/// Largest rotation integrated within one step (rad, squared): beyond it the series does not
/// hold, and at such rates one sample does not determine the sensor's orientation.
const LARGEST_TURN_SQUARED: f32 = 1.0;

/// Rotation between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    /// The sensor turned by this much, in its own frame.
    By(Increment),
    /// The rotation is unknown.
    Unknown,
}

/// A rotation and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Increment {
    /// From the sensor's axes at this sample to those at the sample before.
    pub(super) turn: Quaternion,
    /// Square of the difference between a change of rate right after the previous sample and one right
    /// before this sample, rad².
    pub(super) spread_squared: f32,
}

/// The gyroscope's previous sample and its delay.
#[derive(Clone, Debug)]
pub(super) struct Strapdown {
    gyro_delay: f32,
    previous_rate: Vec3,
}

impl Strapdown {
    pub(super) const fn new(gyro_delay: f32) -> Self {
        Self { gyro_delay, previous_rate: Vec3::ZERO }
    }

    pub(super) const fn start(&mut self, rate: Vec3) {
        self.previous_rate = rate;
    }

    /// Returns the rotation since the previous sample. The rate changes linearly between samples, and
    /// each sample lies `gyro_delay` behind its timestamp: the trapezoid is shifted by that.
    pub(super) fn turn(&mut self, rate: Vec3, bias: Vec3, step: Step) -> Turn {
        let change = rate - self.previous_rate;
        self.previous_rate = rate;
        let angle = (rate - bias) * step.seconds + change * (self.gyro_delay - 0.5 * step.seconds);
        if step.continuity == Continuity::Interrupted || angle.dot(angle) > LARGEST_TURN_SQUARED {
            return Turn::Unknown;
        }
        let spread = change * step.seconds;
        Turn::By(Increment {
            turn: Quaternion::from_small_rotation(angle),
            spread_squared: spread.dot(spread),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Step = Step { seconds: 0.001, continuity: Continuity::Continuous };

    #[test]
    fn a_constant_rate_turns_by_rate_times_time_less_the_bias() {
        let mut strapdown = Strapdown::new(0.0);
        strapdown.start(Vec3::new(0.0, 0.0, 2.0));
        let turn = strapdown.turn(Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.0, 0.0, 0.5), STEP);
        let Turn::By(increment) = turn else {
            panic!("{turn:?}");
        };
        // Half of 1.5 rad/s · 1 ms.
        assert!((increment.turn.z - 0.75e-3).abs() < 1e-9, "{increment:?}");
        assert_eq!(increment.spread_squared, 0.0);
    }

    #[test]
    fn a_delay_of_half_a_period_is_the_rectangle_rule() {
        let mut strapdown = Strapdown::new(0.5e-3);
        strapdown.start(Vec3::ZERO);
        let turn = strapdown.turn(Vec3::new(1.0, 0.0, 0.0), Vec3::ZERO, STEP);
        let increment = Increment {
            turn: Quaternion::from_small_rotation(Vec3::new(1.0e-3, 0.0, 0.0)),
            spread_squared: 1.0e-3 * 1.0e-3,
        };
        assert_eq!(turn, Turn::By(increment));
    }

    #[test]
    fn turn_across_a_gap_uses_the_mean_of_both_rates() {
        let mut strapdown = Strapdown::new(0.0);
        strapdown.start(Vec3::new(1.0, 0.0, 0.0));
        let gap = Step { seconds: 0.05, continuity: Continuity::Gap };
        let turn = strapdown.turn(Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO, gap);
        let Turn::By(increment) = turn else {
            panic!("{turn:?}");
        };
        // Half of 2 rad/s · 50 ms.
        assert!((increment.turn.x - 0.05).abs() < 1e-4, "{increment:?}");
        assert!((increment.spread_squared - 0.01).abs() < 1e-6, "{increment:?}");
    }

    #[test]
    fn turn_is_unknown_after_interruption_or_impossible_rate() {
        let mut strapdown = Strapdown::new(0.0);
        let interruption = Step { seconds: 0.001, continuity: Continuity::Interrupted };
        assert_eq!(strapdown.turn(Vec3::ZERO, Vec3::ZERO, interruption), Turn::Unknown);
        let spin = Vec3::new(0.0, 999.0, 999.0);
        strapdown.start(spin);
        assert_eq!(strapdown.turn(spin, Vec3::ZERO, STEP), Turn::Unknown);
    }
}
