//! Detection of slides without shaking, by the speed gained along the ground.
//!
//! A foot on a slick floor can slide off at a tenth of the acceleration that its stances show. Its accelerations
//! all point one way, though, and add up. The component across up is summed into a speed that decays:
//!
//! ```text
//! v ← v·(1 − dt/τ) + clip(a)·dt
//! S = 1 / (1 + (|v|/limit)⁴)
//! limit² = (factor · usual · √(usual / (quiet · swing)))² + (lever · turn)²
//! ```
//!
//! *usual* is the speed that the foot's own stances leave in the sum: 0.3 mm/s on a noise-free simulated robot, 10 to
//! 20 mm/s on real feet, where slides below that cannot be told from stances. *swing* is the acceleration of its swings, so
//! that the result does not depend on a robot's size. *turn* is the angular rate: an IMU above the sole of a foot that
//! rolls moves, and slides nowhere.
//!
//! Not detected: a steady acceleration below limit/τ, and a foot that slides on at a constant speed.

use super::constants::Constants;
use crate::logarithm::{exp, ln};
use crate::order::Order;
use crate::vector::Vec3;

/// Speed in stances over acceleration in swings of a robot without noise, s, natural logarithm: 0.1 ms.
const QUIET: f32 = ln(1.0e-4);

/// Square of a speed too small to be told from none, m²/s².
const NONE: f32 = 1.0e-8;

/// Speed along the ground, and the usual one in stances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slide {
    /// Time between samples, s.
    period: f32,
    /// Share of the speed that decays with each sample, and of the newest rate in its mean.
    share: f32,
    /// Speed along the ground, m/s, frame of the foot.
    speed: Vec3,
    /// Mean angular rate, rad/s.
    turn: f32,
    /// Usual speed in stances, natural logarithm of m/s.
    usual: f32,
    /// Duration of the stances that it was learnt from, s.
    observed: f32,
}

impl Slide {
    /// A foot that stands. `usual` is the learnt logarithm of the usual speed and the time it was observed for, s.
    pub fn new(constants: &Constants, period: f32, learnt: Option<(f32, f32)>) -> Self {
        let (usual, observed) = learnt.unwrap_or((ln(constants.slide_speed), 0.0));
        Self {
            period,
            share: 1.0 - exp(-period / constants.window),
            speed: Vec3::ZERO,
            turn: 0.0,
            usual,
            observed,
        }
    }

    /// Lets what was learnt count as no more than one stance.
    pub fn doubt(&mut self, constants: &Constants) {
        self.observed = self.observed.lesser(constants.stance);
    }

    /// Usual speed in stances, natural logarithm of m/s.
    pub const fn usual(&self) -> f32 {
        self.usual
    }

    /// Adds an acceleration along the ground, m/s², of a foot that turns at `rate` rad/s and has swings of the
    /// logarithm `swing`. Returns the probability that it does not slide.
    pub fn push(
        &mut self,
        constants: &Constants,
        level: Vec3,
        rate: f32,
        swing: f32,
        tilt: f32,
    ) -> f32 {
        let clipped = level.clipped(constants.slide_acceleration);
        self.speed = self.speed * (1.0 - self.share) + clipped * self.period;
        self.turn += (rate - self.turn) * self.share;
        let louder = 0.5 * (self.usual - swing - QUIET);
        let standing = constants.slide_factor * exp(self.usual + louder);
        let rolling = constants.slide_lever * self.turn;
        let tilted = tilt * constants.window;
        let limit = standing * standing + rolling * rolling + tilted * tilted;
        let ratio = self.speed.dot(self.speed) / limit;
        1.0 / (1.0 + ratio * ratio)
    }

    /// Learns the usual speed from the newest sample, for a time in s times the probability of stillness.
    pub fn learn(&mut self, constants: &Constants, seconds: f32) {
        self.observed = (self.observed + seconds).lesser(constants.memory);
        let difference = 0.5 * ln(self.speed.dot(self.speed) + NONE) - self.usual;
        self.usual += difference * seconds / (self.observed + constants.prior);
    }
}
