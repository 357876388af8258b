//! Gravity as the accelerometer reads it: at rest the length of the mean force, before the first rest the mean force along
//! up, since a foot that walks gains no speed in it.

use crate::order::Order;
use crate::units::STANDARD_GRAVITY;

/// Least and largest reading, m/s². A NAO's accelerometer reads 9.06; readings outside this range are limited to it.
const RANGE: (f32, f32) = (0.9 * STANDARD_GRAVITY, 1.1 * STANDARD_GRAVITY);

/// Time constant at rest, s.
const REST_TIME_CONSTANT: f32 = 0.2;

/// Time constant before the first rest, s.
const MOTION_TIME_CONSTANT: f32 = 5.0;

/// A reading of gravity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gravity {
    /// m/s².
    value: f32,
    /// Whether it was read at rest.
    at_rest: bool,
}

impl Gravity {
    /// The standard value.
    pub const STANDARD: Self = Self { value: STANDARD_GRAVITY, at_rest: false };

    /// m/s².
    pub const fn value(self) -> f32 {
        self.value
    }

    /// Processes the mean force of `dt` seconds of rest, m/s².
    pub fn rest(&mut self, force: f32, dt: f32) {
        self.at_rest = true;
        self.approach(force, dt / (REST_TIME_CONSTANT + dt));
    }

    /// Processes the force along up of `dt` seconds of motion, m/s².
    pub fn walk(&mut self, upward: f32, dt: f32) {
        if !self.at_rest {
            self.approach(upward, dt / MOTION_TIME_CONSTANT);
        }
    }

    fn approach(&mut self, read: f32, share: f32) {
        let (least, largest) = RANGE;
        let moved = self.value + (read - self.value) * share;
        self.value = moved.greater(least).lesser(largest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_is_the_mean_force_of_a_walk_until_the_first_rest() {
        const DT: f32 = 0.001;
        let mut gravity = Gravity::STANDARD;
        let walk = |gravity: &mut Gravity| {
            for k in 0..20_000 {
                let swing = 5.0 * libm::sinf(10.0 * k as f32 * DT);
                gravity.walk(9.06 + swing, DT);
            }
            gravity.value()
        };
        assert!((walk(&mut gravity) - 9.06).abs() < 0.15);
        (0..4_000).for_each(|_| gravity.rest(9.81, DT));
        assert!((gravity.value() - 9.81).abs() < 0.01);
        assert!((walk(&mut gravity) - 9.81).abs() < 0.01);
        (0..40_000).for_each(|_| gravity.rest(8.0, DT));
        assert_eq!(gravity.value(), 0.9 * STANDARD_GRAVITY);
    }
}
