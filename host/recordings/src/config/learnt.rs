//! Learnt values of a foot in reports, under the names of their keys.

use estimator_core::Learnt;
use estimator_core::stillness::Classes;
use serde::Serialize;

/// Values of a foot's [`Learnt`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LearntValues {
    /// Stillness that was learnt from, s.
    pub still_seconds: f32,
    /// Motion that was learnt from, s.
    pub moving_seconds: f32,
    /// How long the foot has run since it last learnt anything, s.
    pub idle_seconds: f32,
    /// Acceleration without gravity.
    pub acceleration: ClassesValues,
    /// Angular rate.
    pub rate: ClassesValues,
    /// Leaky mean of the acceleration.
    pub velocity: ClassesValues,
}

/// [`Classes`] of one quantity: natural logarithms of amplitudes in m/s² or rad/s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClassesValues {
    /// Mean in stillness.
    pub still: f32,
    /// Mean in motion.
    pub moving: f32,
    /// Mean deviation in stillness.
    pub width: f32,
}

impl From<Learnt> for LearntValues {
    fn from(of: Learnt) -> Self {
        Self {
            still_seconds: of.still_seconds,
            moving_seconds: of.moving_seconds,
            idle_seconds: of.idle_seconds,
            acceleration: of.acceleration.into(),
            rate: of.rate.into(),
            velocity: of.velocity.into(),
        }
    }
}

impl From<Classes> for ClassesValues {
    fn from(of: Classes) -> Self {
        let Classes {
            still,
            moving,
            width,
        } = of;
        Self {
            still,
            moving,
            width,
        }
    }
}
