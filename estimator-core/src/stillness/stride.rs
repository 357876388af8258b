//! State of the current stride: whether the foot has swung as strongly as usual, and was calm before.

use super::evidence::LONGEST;
use super::params::EvidenceParams;
use crate::logarithm::exp;
use crate::order::Order;

/// Time in which the peak decays by one, of the logarithm, s.
const PEAK_FALLS: f32 = 2.0;

/// Time constant of the mean whose peak is tracked, s.
const PEAK_TIME_CONSTANT: f32 = 0.2;

/// Probability below which the foot is in motion without doubt.
const SWINGS: f32 = 0.2;

/// Coefficients of stride detection at a sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct StrideCoefficients {
    pub params: EvidenceParams,
    /// Time between samples, s.
    period: f32,
    /// Share of the newest sample in the mean that detects calm.
    newest_calm: f32,
    /// Share of the newest sample in the mean that measures the strength of a swing.
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

/// State of the current stride, as observed from the acceleration.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Stride {
    /// Mean logarithm of the acceleration, over the mean of motion.
    mean: f32,
    /// The same over [`PEAK_TIME_CONSTANT`].
    slow: f32,
    /// Recent maximum of `slow`, at least 0; lets a foot be found calm as well if its motion is
    /// larger than that learnt from another.
    peak: f32,
    /// Time since the foot was calm, s.
    since_calm: f32,
    /// Time since the foot swung, s.
    pub since_swing: f32,
}

impl Stride {
    /// State after power-up: the first samples are learnt from, as if the foot had swung.
    pub const START: Self = Self {
        mean: 0.0,
        slow: 0.0,
        peak: 0.0,
        since_calm: 0.0,
        since_swing: 0.0,
    };

    /// Processes the logarithm of an acceleration over the mean of motion, of a sample that is stable with
    /// a probability. A swing is at most `margin` below that mean.
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
