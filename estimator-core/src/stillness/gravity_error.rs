//! What gravity's removal leaves: the acceleration that a quiet foot still shows.
//!
//! A tilt error of one degree leaves 0.17 m/s² along the ground, and an accelerometer's bias stays
//! where no rest has taught it. Both hardly change within a stance, nor from one to the next, and a
//! foot that is quiet has no acceleration: the mean over the quiet stretch is the error, and is taken
//! out of every sample.
//!
//! What is learnt first counts most, and without quiet it is forgotten. A push that stays looks like
//! a tilt, as it does to anyone who stands on a platform that speeds up: it is taken for an error
//! after some tenths of a second, up to [`GravityErrorParams::limit`].

use super::params::GravityErrorParams;
use crate::order::Order;
use crate::vector::Vec3;

/// A sample teaches up to this many limits, squared.
const TEACHES_UP_TO_SQUARED: f32 = 1.44;

/// Whether the foot is quiet, as far as shaking goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Foot {
    Quiet,
    Moving,
}

/// Follows the error.
#[derive(Clone, Copy, Debug)]
pub(super) struct GravityError {
    /// m/s², sensor frame.
    value: Vec3,
    /// s.
    period: f32,
    start: f32,
    memory: f32,
    /// Share that is forgotten with each sample without quiet.
    forget: f32,
    /// Square of the largest error.
    limit_squared: f32,
    /// Length of the quiet stretch so far and of its start, s; at most `memory`.
    weight: f32,
}

impl GravityError {
    /// Nothing learnt yet. `sample_rate` in Hz.
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

    /// m/s², sensor frame.
    pub const fn value(&self) -> Vec3 {
        self.value
    }

    /// Learns from an acceleration in m/s² from which the error has been taken already.
    #[inline]
    pub fn update(&mut self, acceleration: Vec3, foot: Foot) {
        let square = acceleration.dot(acceleration);
        if foot == Foot::Quiet && square < TEACHES_UP_TO_SQUARED * self.limit_squared {
            self.weight = (self.weight + self.period).lesser(self.memory);
            self.value += acceleration * (self.period / self.weight);
            let square = self.value.dot(self.value);
            if square > self.limit_squared {
                self.value = self.value * crate::root::sqrt(self.limit_squared / square);
            }
        } else {
            self.weight = self.start;
            self.value += self.value * -self.forget;
        }
    }
}
