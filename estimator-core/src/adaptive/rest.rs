//! Rest: means of the acceleration and of the angular rate stay small, and the same, for longer than a stance. The hum of a
//! motor has no mean. The acceleration of a sway is small where the sway is fastest, but it changes.

use super::constants::Constants;
use super::evidence::Reading;
use crate::order::Order;
use crate::vector::Vec3;

/// Largest acceleration, m/s², and rate, rad/s, that count in the means: an impact decays soon.
const LARGEST: f32 = 2.0;

/// Means of one reading, in its unit, frame of the foot.
#[derive(Clone, Copy, Debug)]
struct Means {
    /// Over a window, of the reading and of this mean.
    newest: Vec3,
    smooth: Vec3,
    /// Over a stance, of the smooth mean.
    usual: Vec3,
}

impl Means {
    const ZERO: Self = Self { newest: Vec3::ZERO, smooth: Vec3::ZERO, usual: Vec3::ZERO };

    /// Processes a value of some seconds, with this share in a mean over a window; returns the change of the mean within a
    /// stance.
    fn push(&mut self, constants: &Constants, value: Vec3, seconds: f32, share: f32) -> Vec3 {
        self.newest += (value.clipped(LARGEST) - self.newest) * share;
        self.smooth += (self.newest - self.smooth) * share;
        let change = self.smooth - self.usual;
        self.usual += change * (seconds / (constants.stance + seconds));
        change
    }
}

/// Means of the readings, and the time for which they were small.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// m/s².
    acceleration: Means,
    /// rad/s.
    rate: Means,
    /// Rest, less the time without it, s.
    seconds: f32,
}

impl Rest {
    /// No rest so far.
    pub const NONE: Self = Self { acceleration: Means::ZERO, rate: Means::ZERO, seconds: 0.0 };

    /// Processes a sample; returns whether the foot has rested for longer than a stance.
    pub fn push(&mut self, constants: &Constants, reading: &Reading) -> bool {
        let &Reading { acceleration, rate, seconds, share, .. } = reading;
        let accelerates = self.acceleration.push(constants, acceleration, seconds, share);
        let turns = self.rate.push(constants, rate, seconds, share);
        let is_within = |value: Vec3, limit: f32| value.dot(value) < limit * limit;
        let rests = !self.is_accelerated(constants)
            && is_within(self.rate.newest, constants.rest_rate)
            && is_within(accelerates, constants.rest_acceleration_change)
            && is_within(turns, constants.rest_rate_change);
        self.seconds = match rests {
            true => (self.seconds + seconds).lesser(constants.stance),
            false => (self.seconds - seconds).greater(0.0),
        };
        self.seconds >= constants.stance
    }

    /// Returns whether the mean acceleration is too large for rest.
    pub fn is_accelerated(&self, constants: &Constants) -> bool {
        let (mean, limit) = (self.acceleration.newest, constants.rest_acceleration);
        mean.dot(mean) >= limit * limit
    }

    /// Lets a time in s pass without a reliable sample.
    pub fn pass(&mut self, seconds: f32) {
        self.seconds = (self.seconds - seconds).greater(0.0);
    }
}
