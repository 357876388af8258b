//! Stillness and motion of one foot, and their learning.
//!
//! The amplitudes of a foot in stance and in swing differ from robot to robot by a factor of a hundred. They are
//! learnt while it walks, each sample with the weight of its own probability:
//!
//! ```text
//! u = ½ ln(|a|² + noise²)
//! still  ← still  + w (u − still)             w = M·S·dt / (observed + prior)
//! width  ← width  + w (|u − still| − width)
//! moving ← moving + w' (u − moving)           w' = (1 − M)·dt / (observed' + prior)
//! edge = still + min(widths · width, part of the way · (moving − still))
//! ```
//!
//! M is the mean mass and S the probability that the foot does not slide: a slide teaches neither class. Of
//! each stance only the beginning teaches, since a foot that stands for a minute would otherwise narrow its idea of
//! stillness, and call the stances of the walk after it unstable.

use super::constants::Constants;
use super::learnt::{Learnt, SETTLED_AFTER};
use crate::logarithm::ln;
use crate::order::Order;

/// Least distance between the classes, of the logarithm: with classes that coincide nothing would be still.
const LEAST_DISTANCE: f32 = 0.3;

/// The two classes, as natural logarithms of m/s², and the time that they were observed for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Classes {
    still: f32,
    moving: f32,
    width: f32,
    still_seconds: f32,
    moving_seconds: f32,
}

impl Classes {
    /// The classes of `learnt`, or those before any observation.
    pub fn new(constants: &Constants, learnt: Option<&Learnt>) -> Self {
        match learnt {
            None => Self {
                still: ln(constants.still),
                moving: ln(constants.moving),
                width: constants.width,
                still_seconds: 0.0,
                moving_seconds: 0.0,
            },
            Some(learnt) => Self {
                // No amplitude lies below the noise.
                still: learnt.still.greater(ln(constants.noise)),
                moving: learnt.moving,
                width: learnt.width,
                still_seconds: learnt.still_seconds.lesser(SETTLED_AFTER),
                moving_seconds: learnt.moving_seconds.lesser(SETTLED_AFTER),
            }
            .apart(),
        }
    }

    /// Mean logarithm of the amplitude in motion.
    pub const fn moving(&self) -> f32 {
        self.moving
    }

    /// Upper end of stillness.
    pub fn edge(&self, constants: &Constants) -> f32 {
        let part = constants.part_of_the_way * (self.moving - self.still);
        self.still + (constants.widths * self.width).lesser(part)
    }

    /// Learns stillness from the logarithm of an amplitude, for a time in s times the probability of stillness.
    pub fn learn_still(&mut self, constants: &Constants, u: f32, seconds: f32) {
        self.still_seconds = (self.still_seconds + seconds).lesser(constants.memory);
        let weight = seconds / (self.still_seconds + constants.prior);
        let difference = u - self.still;
        self.width += weight * (difference.abs() - self.width);
        self.still += weight * difference;
        *self = self.apart();
    }

    /// Learns motion likewise.
    pub fn learn_motion(&mut self, constants: &Constants, u: f32, seconds: f32) {
        self.moving_seconds = (self.moving_seconds + seconds).lesser(constants.memory);
        let weight = seconds / (self.moving_seconds + constants.prior);
        self.moving += weight * (u - self.moving);
        *self = self.apart();
    }

    /// Lets what was learnt count as no more than one stance and one swing.
    pub fn doubt(&mut self, constants: &Constants) {
        self.still_seconds = self.still_seconds.lesser(constants.stance);
        self.moving_seconds = self.moving_seconds.lesser(constants.stance);
    }

    fn apart(self) -> Self {
        Self { moving: self.moving.greater(self.still + LEAST_DISTANCE), ..self }
    }

    /// What was learnt, with the slide's share of it.
    pub const fn learnt(&self, speed: f32) -> Learnt {
        Learnt {
            still: self.still,
            moving: self.moving,
            width: self.width,
            speed,
            still_seconds: self.still_seconds,
            moving_seconds: self.moving_seconds,
        }
    }
}
