//! Detection of a foot that rolls: it is on the ground and turns about a point of it, so the IMU moves.
//!
//! A shoe whose heel rises hardly accelerates at first, and P stays high while the heel moves at up to 1 m/s. Its turn
//! shows the speed: a foot that turns at |ω| about a point at the lever r moves the IMU at r |ω|.
//!
//! ```text
//! turn  = mean over τ of |ω|
//! usual = mean over the memory of |ω| in stances, P > ½
//! rolls = turn > max(speed/r, factor · usual) and |mean over τ of a| > least
//! ```
//!
//! The second limit is for a point foot below a leg that sweeps over it. Such a foot turns in each stance, and its
//! stances must not be lost. The last condition is for such a foot, too, because the heel of a shoe that rises
//! accelerates by some m/s², whereas the IMU just above a point foot hardly does, while the shank turns at 3 rad/s.
//! `docs/design/rolling.md` has the alternatives.

use crate::constants::Constants;
use crate::math::{Order, exp};
use crate::stream::period_s;
use crate::velocity::VelocityParams;

/// Time constant τ of the mean rate, s: that of the means of the self-calibrating estimate.
const WINDOW: f32 = Constants::DEFAULT.window;

/// Time of stances over which the usual rate is learnt, s.
const MEMORY: f32 = 1.5;

/// Speed of the IMU above which a foot rolls, m/s.
const SPEED: f32 = 0.2;

/// Rate of a foot that rolls, as a multiple of its usual rate in stances.
const FACTOR: f32 = 2.0;

/// Least acceleration of the IMU of a foot that rolls, m/s². With values up to this one, the shoe is not found to roll later.
const LEAST_ACCELERATION: f32 = 0.7;

/// Probability above which the foot is in a stance.
const STANCE: f32 = 0.5;

/// Usual rate in stances before any is observed, rad/s.
const USUAL: f32 = 0.3;

/// Detection of a foot that rolls.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roll {
    /// Share of the newest rate in its mean.
    newest: f32,
    /// Share of the newest rate in the usual one.
    lesson: f32,
    /// Rate at which the IMU moves at [`SPEED`], rad/s.
    limit: f32,
    /// Mean rate, rad/s.
    turn: f32,
    /// Usual rate in stances, rad/s.
    usual: f32,
}

impl Roll {
    /// A foot that stands, with samples each `period_us` µs. Levers outside the range of the parameters give some
    /// limit.
    pub(crate) fn new(period_us: u64, velocity: &VelocityParams) -> Self {
        let period = period_s(period_us);
        Self {
            newest: 1.0 - exp(-period / WINDOW),
            lesson: (period / MEMORY).lesser(1.0),
            limit: SPEED / velocity.lever,
            turn: 0.0,
            usual: USUAL,
        }
    }

    /// Processes the rate of turn of a sample, rad/s, with its probability of stable contact, which is 0 for a doubtful sample.
    pub(crate) fn push(&mut self, rate: f32, probability: f32) {
        self.turn += (rate - self.turn) * self.newest;
        if probability > STANCE {
            self.usual += (rate - self.usual) * self.lesson;
        }
    }

    /// Returns whether the foot rolls, if its mean acceleration over [`WINDOW`] has this length, m/s².
    pub(crate) fn rolls(&self, acceleration: f32) -> bool {
        self.turn > self.limit.greater(FACTOR * self.usual) && acceleration > LEAST_ACCELERATION
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A foot that has stood for ten seconds and turned at these rates in its stances, at 1 kHz.
    fn stood(stance: impl Fn(u32) -> f32) -> Roll {
        let mut roll = Roll::new(1_000, &VelocityParams::DEFAULT);
        (0..10_000).for_each(|ms| roll.push(stance(ms), 0.9));
        roll
    }

    /// Milliseconds until a foot that turns at `rate` rolls, up to 300.
    fn until_it_rolls(mut roll: Roll, rate: f32) -> Option<u32> {
        (0..300).find(|_| {
            roll.push(rate, 0.9);
            roll.rolls(4.0)
        })
    }

    #[test]
    fn heel_that_rises_rolls_within_a_few_windows() {
        for (rate, most) in [(1.2, None), (1.6, Some(50)), (4.0, Some(12))] {
            let found = until_it_rolls(stood(|_| 0.1), rate);
            assert_eq!(found.is_some(), most.is_some(), "{rate}");
            assert!(found <= most, "{rate}: {found:?}");
        }
    }

    #[test]
    fn point_foot_that_turns_in_each_stance_does_not_roll() {
        let sweeping = |ms| 4.0 + 1.5 * (ms % 250) as f32 / 250.0;
        assert!(!stood(sweeping).rolls(4.0));
        assert_eq!(until_it_rolls(stood(sweeping), 6.0), None);
    }

    #[test]
    fn point_foot_that_turns_without_accelerating_does_not_roll() {
        let mut roll = stood(|_| 0.1);
        (0..100).for_each(|_| roll.push(2.0, 0.9));
        assert!(!roll.rolls(0.3) && roll.rolls(3.0));
    }

    #[test]
    fn turn_in_swings_and_in_doubt_is_not_usual() {
        let mut roll = stood(|_| 0.1);
        let usual = roll.usual;
        (0..5_000).for_each(|_| roll.push(8.0, 0.0));
        assert_eq!(roll.usual, usual);
    }

    #[test]
    fn foot_without_a_lever_never_rolls() {
        let point = VelocityParams { lever: 0.0, ..VelocityParams::DEFAULT };
        assert_eq!(until_it_rolls(Roll::new(1_000, &point), 30.0), None);
    }

    #[test]
    fn extreme_rates_are_forgotten() {
        let mut roll = Roll::new(1_000, &VelocityParams::DEFAULT);
        roll.push(1.0e3, 0.9);
        assert!(roll.rolls(4.0));
        (0..1_000).for_each(|_| roll.push(0.0, 0.9));
        assert!(!roll.rolls(4.0));
    }
}
