//! Constants of the evidence that a foot must show.

use super::all_in_range;
use crate::range::ParamsError;

/// Evidence that a foot must show from time to time to be called stable.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EvidenceParams {
    /// Required duration of rest, s. 0.01 to 10.
    pub rest: f32,
    /// Duration for which evidence is valid, s. 0.1 to 100.
    pub lasts: f32,
    /// Time constant with which the probability fades out and in, s. 1e-3 to 10.
    pub fading: f32,
    /// Largest distance of a resting sample above the mean of stillness, of the logarithm. 0 to 3.
    pub rest_margin: f32,
    /// Largest distance of a swing's acceleration below the mean of motion, of the logarithm. 0 to 10.
    pub swing: f32,
    /// The same until the classes have settled. 0 to 10.
    pub first_swing: f32,
    /// Least distance of a stride's mean acceleration below the mean of motion, of the logarithm.
    /// 0 to 10.
    pub calm: f32,
    /// Time constant of that mean, s. 1e-3 to 1.
    pub calm_time_constant: f32,
    /// Longest time after the foot was calm in which a swing counts, s. 0.1 to 100.
    pub stride: f32,
    /// Longest time after a swing in which the classes learn, s. 0.1 to 100.
    pub learns: f32,
}

impl EvidenceParams {
    pub(super) const fn check(&self) -> Result<(), ParamsError> {
        all_in_range(&[
            ("stillness.evidence.rest", self.rest, 0.01, 10.0),
            ("stillness.evidence.lasts", self.lasts, 0.1, 100.0),
            ("stillness.evidence.fading", self.fading, 1.0e-3, 10.0),
            ("stillness.evidence.rest_margin", self.rest_margin, 0.0, 3.0),
            ("stillness.evidence.swing", self.swing, 0.0, 10.0),
            (
                "stillness.evidence.first_swing",
                self.first_swing,
                0.0,
                10.0,
            ),
            ("stillness.evidence.calm", self.calm, 0.0, 10.0),
            (
                "stillness.evidence.calm_time_constant",
                self.calm_time_constant,
                1.0e-3,
                1.0,
            ),
            ("stillness.evidence.stride", self.stride, 0.1, 100.0),
            ("stillness.evidence.learns", self.learns, 0.1, 100.0),
        ])
    }
}
