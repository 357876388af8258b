//! Keys of the learnt values of a foot: a warm start.

use estimator_core::Learnt;
use estimator_core::stillness::Classes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Values of a foot's [`Learnt`]. Numbers read back as the same f32.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
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
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ClassesValues {
    /// Mean in stillness.
    pub still: f32,
    /// Mean in motion.
    pub moving: f32,
    /// Mean deviation in stillness.
    pub width: f32,
}

impl From<LearntValues> for Learnt {
    fn from(values: LearntValues) -> Self {
        Self {
            acceleration: values.acceleration.into(),
            rate: values.rate.into(),
            velocity: values.velocity.into(),
            still_seconds: values.still_seconds,
            moving_seconds: values.moving_seconds,
            idle_seconds: values.idle_seconds,
        }
    }
}

impl From<Learnt> for LearntValues {
    fn from(learnt: Learnt) -> Self {
        let Learnt {
            acceleration,
            rate,
            velocity,
            still_seconds,
            moving_seconds,
            idle_seconds,
        } = learnt;
        Self {
            still_seconds,
            moving_seconds,
            idle_seconds,
            acceleration: acceleration.into(),
            rate: rate.into(),
            velocity: velocity.into(),
        }
    }
}

impl From<Classes> for ClassesValues {
    fn from(classes: Classes) -> Self {
        let Classes {
            still,
            moving,
            width,
        } = classes;
        Self {
            still,
            moving,
            width,
        }
    }
}

impl From<ClassesValues> for Classes {
    fn from(values: ClassesValues) -> Self {
        Self {
            still: values.still,
            moving: values.moving,
            width: values.width,
        }
    }
}
