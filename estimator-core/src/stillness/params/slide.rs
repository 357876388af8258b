//! The constants of the slide test.

use super::all_in_range;
use crate::range::ParamsError;

/// Limits of a slide, and the learning of the foot's own limit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SlideParams {
    /// Least speed along the ground that counts, m/s. 1e-4 to 1.
    pub speed: f32,
    /// Largest factor of the usual speed in the limit. 0 to 100.
    pub spread: f32,
    /// Usual speed at which the factor is 1, m/s; it grows with the usual speed up to `spread`. 1e-5 to 1.
    pub shaking: f32,
    /// Lever of a rate beyond `rate` in the limit, m/s per rad/s. 0 to 10.
    pub lever: f32,
    /// Rate up to which the foot does not roll: noise and trembling, rad/s. 0 to 10.
    pub rate: f32,
    /// Largest rate beyond `rate` with which the foot rolls, rad/s. 0 to 10.
    pub largest_rate: f32,
    /// Time constant of the mean rate, s. 1e-4 to 1.
    pub turn_time_constant: f32,
    /// Limit of an acceleration in the sum, m/s². 0.1 to 1000.
    pub impact: f32,
    /// Time constant of the speed, s. 1e-3 to 10.
    pub time_constant: f32,
    /// The same while the foot moves according to the other quantities, s. 1e-3 to 10.
    pub moving_time_constant: f32,
    /// Time constant of the sum from which the usual speed is learnt, s. 1e-3 to 10.
    pub shake_time_constant: f32,
    /// Limit of the speed, as a multiple of the slide's limit. 1 to 10.
    pub limit: f32,
    /// Speed that is usual in a stance, before anything is learnt, m/s. 1e-4 to 0.2.
    pub usual: f32,
    /// Quantile of the speeds in stances that counts as usual. 0 to 1.
    pub quantile: f32,
    /// Size of the learning steps, as a factor. 0 to 10.
    pub gain: f32,
    /// Weight of the usual speed before anything is learnt, s of stance. 1e-3 to 100.
    pub prior: f32,
    /// Memory of the usual speed, s of stance. 0.01 to 1000.
    pub memory: f32,
    /// Time in each stance from which the usual speed is learnt, s. 0 to 10.
    pub learn_from: f32,
    /// Time in each stance until which the usual speed is learnt, s. 0.01 to 100.
    pub learn_until: f32,
}

impl SlideParams {
    pub(super) const fn check(&self) -> Result<(), ParamsError> {
        all_in_range(&[
            ("stillness.slide.speed", self.speed, 1.0e-4, 1.0),
            ("stillness.slide.spread", self.spread, 0.0, 100.0),
            ("stillness.slide.shaking", self.shaking, 1.0e-5, 1.0),
            ("stillness.slide.lever", self.lever, 0.0, 10.0),
            ("stillness.slide.rate", self.rate, 0.0, 10.0),
            ("stillness.slide.largest_rate", self.largest_rate, 0.0, 10.0),
            (
                "stillness.slide.turn_time_constant",
                self.turn_time_constant,
                1.0e-4,
                1.0,
            ),
            ("stillness.slide.impact", self.impact, 0.1, 1.0e3),
            (
                "stillness.slide.time_constant",
                self.time_constant,
                1.0e-3,
                10.0,
            ),
            (
                "stillness.slide.moving_time_constant",
                self.moving_time_constant,
                1.0e-3,
                10.0,
            ),
            (
                "stillness.slide.shake_time_constant",
                self.shake_time_constant,
                1.0e-3,
                10.0,
            ),
            ("stillness.slide.limit", self.limit, 1.0, 10.0),
            ("stillness.slide.usual", self.usual, 1.0e-4, 0.2),
            ("stillness.slide.quantile", self.quantile, 0.0, 1.0),
            ("stillness.slide.gain", self.gain, 0.0, 10.0),
            ("stillness.slide.prior", self.prior, 1.0e-3, 100.0),
            ("stillness.slide.memory", self.memory, 0.01, 1.0e3),
            ("stillness.slide.learn_from", self.learn_from, 0.0, 10.0),
            ("stillness.slide.learn_until", self.learn_until, 0.01, 100.0),
        ])
    }
}
