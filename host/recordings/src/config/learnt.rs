//! Learnt values of a foot in reports, under the names of their keys.

use estimator_core::Learnt;
use serde::Serialize;

/// Values of a foot's [`Learnt`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LearntValues {
    /// Mean of the logarithm of the acceleration in stances, ln(m/s²).
    pub still: f32,
    /// Mean of the logarithm of the acceleration in swings, ln(m/s²).
    pub moving: f32,
    /// Logarithm of the speed that accelerations along the ground add up to in stances, ln(m/s).
    pub speed: f32,
    /// Stillness that was learnt from, s.
    pub still_seconds: f32,
    /// Motion that was learnt from, s.
    pub moving_seconds: f32,
}

impl From<Learnt> for LearntValues {
    fn from(of: Learnt) -> Self {
        let Learnt { still, moving, speed, still_seconds, moving_seconds } = of;
        Self { still, moving, speed, still_seconds, moving_seconds }
    }
}
