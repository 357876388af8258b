//! The stride that a foot is in: whether it has swung as strongly as it usually does, and was calm before.

use super::evidence::LONGEST;
use super::params::EvidenceParams;
use crate::logarithm::exp;
use crate::order::Order;

/// Time in which the peak falls by one, of the logarithm, s.
const PEAK_FALLS: f32 = 2.0;

/// Time constant of the mean that the peak is one of, s.
const PEAK_TIME_CONSTANT: f32 = 0.2;

/// P below this leaves no doubt about the motion.
const SWINGS: f32 = 0.2;

/// What a sample rate makes of the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StrideCoefficients {
    pub params: EvidenceParams,
    /// Time between samples, s.
    period: f32,
    /// Share of the newest sample in the mean that shows calm.
    newest_calm: f32,
    /// The same of the mean that shows the strength of a swing.
    newest_slow: f32,
}

impl StrideCoefficients {
    pub fn new(params: EvidenceParams, period: f32) -> Self {
        Self {
            params,
            period,
            newest_calm: 1.0 - exp(-period / params.calm_time_constant),
            newest_slow: 1.0 - exp(-period / PEAK_TIME_CONSTANT),
        }
    }
}

/// The stride that a foot is in, as far as its acceleration shows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stride {
    /// Mean logarithm of the acceleration, over the mean of motion.
    mean: f32,
    /// The same over [`PEAK_TIME_CONSTANT`].
    slow: f32,
    /// The highest that `slow` was lately, at least 0: so that a foot is found calm, too, of which the motion is
    /// greater than what was learnt of another.
    peak: f32,
    /// Time since the foot was calm, s.
    since_calm: f32,
    /// Time since it swung, s.
    pub since_swing: f32,
}

impl Stride {
    /// A foot that has just been switched on: what it shows first is learnt, as if it had swung.
    pub const START: Self = Self {
        mean: 0.0,
        slow: 0.0,
        peak: 0.0,
        since_calm: 0.0,
        since_swing: 0.0,
    };

    /// Takes in the logarithm of an acceleration over the mean of motion, of a sample that is stable with
    /// a probability. A swing is no lower than `margin` below that mean.
    pub fn push(&mut self, of: &StrideCoefficients, over_mean: f32, margin: f32, stable: f32) {
        let EvidenceParams { calm, stride, .. } = of.params;
        self.mean += (over_mean - self.mean) * of.newest_calm;
        self.slow += (over_mean - self.slow) * of.newest_slow;
        self.peak = (self.peak - of.period / PEAK_FALLS)
            .greater(self.slow)
            .greater(0.0);
        self.since_calm = match self.mean < self.peak - calm {
            true => 0.0,
            false => (self.since_calm + of.period).lesser(LONGEST),
        };
        let swings = stable < SWINGS && over_mean > -margin && self.since_calm < stride;
        self.since_swing = match swings {
            true => 0.0,
            false => (self.since_swing + of.period).lesser(LONGEST),
        };
    }
}
