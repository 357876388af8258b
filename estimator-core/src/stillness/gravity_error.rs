//! Residual of gravity's removal: the acceleration that a quiet foot still shows.
//!
//! A tilt error of one degree leaves 0.17 m/s² along the ground, and an accelerometer's bias stays
//! until a rest has shown it. Both hardly change within a stance, nor from one to the next, and a
//! quiet foot has no acceleration: the mean over the quiet stretch is the error, and is subtracted
//! from every sample.
//!
//! The first samples weigh most, and without quiet the error decays. A constant push looks like
//! a tilt, as it does to a passenger on a platform that accelerates: it is learnt as an error
//! after some tenths of a second, up to [`GravityErrorParams::limit`]. Along up it may be as large as the
//! errors of accelerometers before a rest has shown them: slides do not point along up.

use super::params::GravityErrorParams;
use crate::order::Order;
use crate::root::sqrt;
use crate::vector::Vec3;

/// Largest acceleration that is learnt from, as a multiple of the limit, squared.
const TEACHES_UP_TO_SQUARED: f32 = 1.44;

/// Largest error along up, m/s²: a tenth of gravity.
const LIMIT_ALONG: f32 = 1.0;

/// Whether the foot is quiet, as far as shaking is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum Foot {
    Quiet,
    Moving,
}

/// Estimator of the error.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct GravityError {
    /// Estimated error, m/s², sensor frame.
    value: Vec3,
    /// Sample period, s.
    period: f32,
    start: f32,
    memory: f32,
    /// Share that decays with each sample without quiet.
    forget: f32,
    /// Square of the largest error across up.
    limit_squared: f32,
    /// Length of the quiet stretch so far and of its start, s; at most `memory`.
    weight: f32,
}

impl GravityError {
    /// An estimator without observations. `sample_rate` in Hz.
    pub fn new(params: &GravityErrorParams, sample_rate: f32) -> Self {
        let period = 1.0 / sample_rate;
        Self {
            value: Vec3::ZERO,
            period,
            start: params.start,
            memory: params.memory,
            forget: (period / params.forgetting).lesser(1.0),
            limit_squared: params.limit * params.limit,
            weight: params.start,
        }
    }

    /// Estimated error, m/s², sensor frame.
    pub const fn value(&self) -> Vec3 {
        self.value
    }

    /// Learns from an acceleration in m/s² from which the error has been removed already; `up` is a unit vector.
    #[inline]
    pub fn update(&mut self, acceleration: Vec3, up: Vec3, foot: Foot) {
        let along = acceleration.dot(up);
        let level_squared = acceleration.dot(acceleration) - along * along;
        if foot == Foot::Quiet
            && level_squared < TEACHES_UP_TO_SQUARED * self.limit_squared
            && along * along < LIMIT_ALONG * LIMIT_ALONG
        {
            self.weight = (self.weight + self.period).lesser(self.memory);
            self.value += acceleration * (self.period / self.weight);
            let along = self.value.dot(up);
            let level = self.value + up * -along;
            let square = level.dot(level);
            if square > self.limit_squared {
                let along = along.lesser(LIMIT_ALONG).greater(-LIMIT_ALONG);
                self.value = up * along + level * sqrt(self.limit_squared / square);
            }
        } else {
            self.weight = self.start;
            self.value += self.value * -self.forget;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::params::StillnessParams;
    use super::*;

    const PARAMS: GravityErrorParams = StillnessParams::DEFAULT.gravity_error;

    /// Feeds a foot whose accelerometer reads `offset` m/s² too much along x, for some milliseconds.
    fn feed(error: &mut GravityError, offset: f32, foot: Foot, ms: u32) {
        for _ in 0..ms {
            let left = Vec3::new(offset, 0.0, 0.0) - error.value();
            error.update(left, Vec3::new(0.0, 0.0, 1.0), foot);
        }
    }

    fn taught(offset: f32) -> GravityError {
        let mut error = GravityError::new(&PARAMS, 1000.0);
        feed(&mut error, offset, Foot::Quiet, 2_000);
        error
    }

    #[test]
    fn gravity_residual_is_learnt_from_a_quiet_foot() {
        let offset = 0.8 * PARAMS.limit;
        let found = taught(offset).value().x / offset;
        // A mean over the 2 s and the duration credited to their beginning with an error of zero.
        let mean = 2.0 / (2.0 + PARAMS.start);
        assert!((found - mean).abs() < 1.0e-3, "{found}, not {mean}");
    }

    #[test]
    fn large_acceleration_is_ignored_and_error_is_limited() {
        assert_eq!(taught(1.25 * PARAMS.limit).value(), Vec3::ZERO);
        let held = taught(1.19 * PARAMS.limit).value().length();
        assert!((held / PARAMS.limit - 1.0).abs() < 1.0e-3, "{held}");
    }

    #[test]
    fn error_decays_with_its_time_constant_in_motion() {
        let mut error = taught(0.5 * PARAMS.limit);
        let before = error.value().x;
        feed(
            &mut error,
            0.9 * PARAMS.limit,
            Foot::Moving,
            (PARAMS.forgetting * 1.0e3) as u32,
        );
        let left = error.value().x / before;
        assert!((left - 0.368).abs() < 0.01, "{left}");
    }
}
