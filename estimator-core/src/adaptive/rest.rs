//! Rest: means of the acceleration and of the angular rate stay small for longer than a stance. The hum of a motor has no
//! mean.

use super::constants::Constants;
use super::evidence::Reading;
use crate::order::Order;
use crate::vector::Vec3;

/// Largest acceleration, m/s², and rate, rad/s, that count in the means: an impact decays soon.
const LARGEST: f32 = 2.0;

/// Means over a window, and the time for which they were small.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// m/s² and rad/s, frame of the foot.
    acceleration: Vec3,
    rate: Vec3,
    /// Rest, less the time without it, s.
    seconds: f32,
}

impl Rest {
    /// No rest so far.
    pub const NONE: Self = Self { acceleration: Vec3::ZERO, rate: Vec3::ZERO, seconds: 0.0 };

    /// Processes a sample; returns whether the foot has rested for longer than a stance.
    pub fn push(&mut self, constants: &Constants, reading: &Reading) -> bool {
        let &Reading { acceleration, rate, seconds, share, .. } = reading;
        self.acceleration += (acceleration.clipped(LARGEST) - self.acceleration) * share;
        self.rate += (rate.clipped(LARGEST) - self.rate) * share;
        let turns = self.rate.dot(self.rate) >= constants.rest_rate * constants.rest_rate;
        let rests = !self.is_accelerated(constants) && !turns;
        self.seconds = match rests {
            true => (self.seconds + seconds).lesser(constants.stance),
            false => (self.seconds - seconds).greater(0.0),
        };
        self.seconds >= constants.stance
    }

    /// Returns whether the mean acceleration is too large for rest.
    pub fn is_accelerated(&self, constants: &Constants) -> bool {
        let limit = constants.rest_acceleration;
        self.acceleration.dot(self.acceleration) >= limit * limit
    }

    /// Lets a time in s pass without a reliable sample.
    pub fn pass(&mut self, seconds: f32) {
        self.seconds = (self.seconds - seconds).greater(0.0);
    }
}
