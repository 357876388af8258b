//! Stillness and motion of one foot, and their learning.
//!
//! The amplitudes of a foot in stance and in swing differ from robot to robot by a factor of a hundred. While it walks,
//! each of its logarithms u is counted, in seconds, and what is older than the memory is forgotten. The counts are
//! split where the two parts lie farthest apart for their seconds (Otsu, 1979), whatever the parts were before:
//!
//! ```text
//! s(k)  seconds at lowest + k·step, each u shared between the two nearest
//! split = the k with the largest w₀ w₁ (moving − still)²    still, moving: means below and above; w₀, w₁: seconds
//! edge  = still + part of the way · (moving − still)
//! ```

use super::constants::Constants;
use super::learnt::{Learnt, SETTLED_AFTER};
use crate::logarithm::ln;
use crate::order::Order;

/// Number of logarithms that are counted, …
const COUNTS: usize = 13;

/// … and their distance: amplitudes that differ by a factor of 1.6. They reach from the noise to 220 times that.
const STEP: f32 = 0.45;

/// Share of the counts that is kept where they exceed the memory. At 1 kHz that is one sample in a hundred, which is not
/// counted, so that none takes longer than others.
const KEPT: f32 = 15.0 / 16.0;

/// Product of the seconds of two parts, s², below which one of them is a rounding error.
const NOTHING: f32 = 1.0e-5;

/// Least distance between the classes, of the logarithm: with classes that coincide nothing would be still.
const LEAST_DISTANCE: f32 = 0.3;

/// The two classes, as natural logarithms of m/s², and the amplitudes that they are the parts of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Classes {
    /// Logarithm that the first count is of.
    lowest: f32,
    /// Seconds of each logarithm.
    counts: [f32; COUNTS],
    /// Their sum, and the sum of each times its place.
    seconds: f32,
    moment: f32,
    still: f32,
    moving: f32,
    /// Time that each class was observed for, s.
    still_seconds: f32,
    moving_seconds: f32,
}

impl Classes {
    /// The classes of `learnt`, or those before any observation.
    pub fn new(constants: &Constants, learnt: Option<&Learnt>) -> Self {
        let before = Learnt {
            still: ln(constants.still),
            moving: ln(constants.moving),
            ..Learnt::default()
        };
        let learnt = learnt.unwrap_or(&before);
        let lowest = ln(constants.noise);
        // No amplitude lies below the noise.
        let still = learnt.still.greater(lowest);
        let mut classes = Self {
            lowest,
            counts: [0.0; COUNTS],
            seconds: 0.0,
            moment: 0.0,
            still,
            moving: learnt.moving.greater(still + LEAST_DISTANCE),
            still_seconds: learnt.still_seconds.lesser(SETTLED_AFTER),
            moving_seconds: learnt.moving_seconds.lesser(SETTLED_AFTER),
        };
        classes.count(classes.still, classes.still_seconds + constants.prior);
        classes.count(classes.moving, classes.moving_seconds + constants.prior);
        classes
    }

    /// Mean logarithm of the amplitude in motion.
    pub const fn moving(&self) -> f32 {
        self.moving
    }

    /// Upper end of stillness.
    pub fn edge(&self, constants: &Constants) -> f32 {
        self.still + constants.part_of_the_way * (self.moving - self.still)
    }

    /// Learns from the logarithm of an amplitude that lasted for some seconds.
    pub fn learn(&mut self, constants: &Constants, u: f32, seconds: f32) {
        let class = match u < self.edge(constants) {
            true => &mut self.still_seconds,
            false => &mut self.moving_seconds,
        };
        *class = (*class + seconds).lesser(constants.memory);
        if self.seconds > constants.memory {
            self.forget(KEPT);
        } else {
            self.count(u, seconds);
            self.split();
        }
    }

    /// Lets what was learnt count as no more than one stance and one swing.
    pub fn doubt(&mut self, constants: &Constants) {
        self.still_seconds = self.still_seconds.lesser(constants.stance);
        self.moving_seconds = self.moving_seconds.lesser(constants.stance);
        let most = 2.0 * constants.stance;
        if self.seconds > most {
            self.forget(most / self.seconds);
        }
    }

    /// Leaves a share of what was counted.
    fn forget(&mut self, left: f32) {
        for count in &mut self.counts {
            *count *= left;
        }
        self.seconds *= left;
        self.moment *= left;
    }

    /// Counts seconds of a logarithm.
    fn count(&mut self, u: f32, seconds: f32) {
        const LAST: f32 = (COUNTS - 1) as f32;
        let place = ((u - self.lowest) * (1.0 / STEP)).greater(0.0).lesser(LAST);
        let before = place as usize;
        let share = place - before as f32;
        if let Some(count) = self.counts.get_mut(before) {
            *count += seconds * (1.0 - share);
        }
        if let Some(count) = self.counts.get_mut(before + 1) {
            *count += seconds * share;
        }
        self.seconds += seconds;
        self.moment += seconds * place;
    }

    /// Splits the counts into the classes: with s seconds below the split, and d the sum of those times their distance from
    /// the mean, where d²/(s · rest) is largest. Distances are in steps times all seconds.
    fn split(&mut self) {
        let all = self.seconds;
        let (mut s, mut d, mut distance) = (0.0, 0.0, -self.moment);
        let (mut best_s, mut best_d, mut best_square, mut best_w) = (0.0, 0.0, 0.0, 1.0);
        for &count in &self.counts {
            s += count;
            d += count * distance;
            distance += all;
            let w = s * (all - s);
            let square = d * d;
            if w > NOTHING && square * best_w > best_square * w {
                (best_s, best_d, best_square, best_w) = (s, d, square, w);
            }
        }
        if best_s > 0.0 {
            let at = |steps: f32| self.lowest + STEP * steps / all;
            self.still = at(self.moment + best_d / best_s);
            let moving = at(self.moment - best_d / (all - best_s));
            self.moving = moving.greater(self.still + LEAST_DISTANCE);
        }
    }

    /// What was learnt, with the slide's share of it.
    pub const fn learnt(&self, speed: f32) -> Learnt {
        Learnt {
            still: self.still,
            moving: self.moving,
            speed,
            still_seconds: self.still_seconds,
            moving_seconds: self.moving_seconds,
        }
    }
}
