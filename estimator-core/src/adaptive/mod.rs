//! The self-calibrating estimate: the paper's kernel mass on a logarithmic scale, with limits that are learnt from the
//! foot.
//!
//! The amplitude of the acceleration tells a standing foot from a moving one. It is judged by its logarithm, since robots
//! differ by factors, and a landing is one large sample among small ones:
//!
//! ```text
//! u = ½ ln(|a|² + noise²)
//! m = Φ((edge − u)/h)                        the kernel's mass below the edge, in closed form
//! M ← M + (m − M)·(1 − exp(−dt/τ))           mean over the last τ
//! P = M · S · E                              S: no slide; E: evidence that the foot stands
//! ```
//!
//! The same edge judges parts of the motion: across up (tangential), along up (vertical), and along each axis alone. A
//! part's amplitude is at most that of the whole, so its probability is at least that of the whole.
//!
//! | step | module |
//! |---|---|
//! | stillness and motion learnt from this foot | `adaptive::classes` |
//! | speed gained along the ground | `adaptive::slide` |
//! | evidence that a foot stands: it has rested, or landed | `adaptive::evidence`, `adaptive::rest`, `adaptive::landing` |
//! | stored form of the learnt state | `adaptive::learnt` |
//! | constants | `adaptive::constants` |

mod classes;
mod constants;
mod evidence;
mod landing;
mod learnt;
mod rest;
mod slide;

pub use constants::Constants;
pub use learnt::{AMPLITUDE, Learnt, MOST_SECONDS, SETTLED_AFTER, SPEED};

use classes::Classes;
use evidence::{Evidence, Reading};
use slide::Slide;

use crate::axis::PerAxis;
use crate::erf::erf;
use crate::kde::window::Filling;
use crate::logarithm::{exp, ln};
use crate::order::Order;
use crate::probability::Probabilities;
use crate::range::ParamsError;
use crate::root::rounded;
use crate::sample::{AngularRate, LinearAcceleration};
use crate::vector::Vec3;

/// Whether the classes follow the foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Learning {
    /// They do.
    #[default]
    On,
    /// They keep the state of the start.
    Frozen,
}

/// Least time constant of the mean mass, samples: with less, as at 50 Hz, the mean would be the newest sample.
const LEAST_WINDOW: f32 = 2.0;

/// Number of windows of doubt that a longer gap counts as: less than 5 % is left of any probability.
const GAP_WINDOWS: u32 = 3;

/// Probability above which the foot is more probably still than not.
const STILL: f32 = 0.5;

/// Checked inputs of a self-calibrating estimate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdaptiveConfig {
    constants: Constants,
    learning: Learning,
    learnt: Option<Learnt>,
    sample_rate: f32,
}

impl AdaptiveConfig {
    /// Checks what was learnt.
    pub fn new(
        constants: &Constants,
        learning: Learning,
        learnt: Option<Learnt>,
        sample_rate: f32,
    ) -> Result<Self, ParamsError> {
        if let Some(learnt) = &learnt {
            learnt.validate()?;
        }
        Ok(Self { constants: *constants, learning, learnt, sample_rate })
    }
}

/// The parts of a motion that are judged: all of it, across up, along up, and along the three axes.
const PARTS: usize = 6;

/// Up, and how it is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Up {
    /// Unit vector, frame of the foot.
    pub direction: Vec3,
    /// Angle by which the newest sample corrected it, rad, if it is estimated.
    pub correction: Option<f32>,
}

impl Up {
    /// z, known.
    pub const Z: Self = Self { direction: Vec3::new(0.0, 0.0, 1.0), correction: None };
}

/// The estimate and its learnt state.
#[derive(Clone, Debug)]
pub(crate) struct Adaptive {
    constants: Constants,
    learning: Learning,
    /// Time between samples, s.
    period: f32,
    /// Share of the newest mass in its mean.
    newest: f32,
    /// 1/(h√2) for the kernel's bandwidth h.
    inverse_scale: f32,
    /// Samples until the means have settled, and in them so far.
    window: u32,
    filled: u32,
    classes: Classes,
    slide: Slide,
    evidence: Evidence,
    /// Samples missing before the next one, in a gap that is bridged.
    bridged: f32,
    /// Mean mass of each part.
    masses: [f32; PARTS],
    /// Whether the foot is in a stance, and for how long so far, s.
    in_stance: bool,
    stance: f32,
    /// Whether it was in one since the last landing.
    stood: bool,
    probabilities: Probabilities,
}

impl Adaptive {
    pub fn new(config: &AdaptiveConfig) -> Self {
        let &AdaptiveConfig { constants, learning, ref learnt, sample_rate } = config;
        let period = 1.0 / sample_rate;
        let newest = 1.0 - exp(-1.0 / (constants.window * sample_rate).greater(LEAST_WINDOW));
        let learnt = learnt.as_ref();
        Self {
            constants,
            learning,
            period,
            newest,
            inverse_scale: core::f32::consts::FRAC_1_SQRT_2 / constants.bandwidth,
            window: rounded(constants.window * sample_rate).max(1),
            filled: 0,
            classes: Classes::new(&constants, learnt),
            slide: Slide::new(
                &constants,
                period,
                learnt.map(|learnt| (learnt.speed, learnt.still_seconds.lesser(SETTLED_AFTER))),
            ),
            evidence: Evidence::new(&constants, period),
            bridged: 0.0,
            masses: [0.0; PARTS],
            in_stance: true,
            stance: 0.0,
            stood: true,
            probabilities: Probabilities::default(),
        }
    }

    /// State learnt from the foot.
    pub fn learnt(&self) -> Learnt {
        self.classes.learnt(self.slide.usual()).limited()
    }

    /// Returns whether enough steps were observed.
    pub fn is_settled(&self) -> bool {
        self.classes.learnt(self.slide.usual()).is_settled()
    }

    /// Returns whether evidence alone keeps the probability at or below a threshold.
    pub fn is_unproven(&self, threshold: f32) -> bool {
        !self.evidence.is_given() && self.probabilities.stable > threshold * self.evidence.factor()
    }

    /// Processes one sample's motion, with gravity and bias removed.
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        rate: AngularRate,
        up: Up,
    ) -> Probabilities {
        let (a, turn) = (acceleration.0, rate.0.length());
        let square = a.dot(a);
        let Up { direction, correction } = up;
        let upright = a.dot(direction);

        let edge = self.classes.edge(&self.constants);
        // Until the window has passed, the means cover the samples so far.
        let newest = match self.filled < self.window {
            true => {
                self.filled += 1;
                self.newest.greater(1.0 / self.filled as f32)
            }
            false => self.newest,
        };
        // Rounding may leave a slightly negative square, which the noise covers.
        let parts = [
            square,
            square - upright * upright,
            upright * upright,
            a.x * a.x,
            a.y * a.y,
            a.z * a.z,
        ];
        let logarithms = parts.map(|part| self.amplitude(part));
        for (mean, u) in self.masses.iter_mut().zip(logarithms) {
            *mean += (mass(edge, u, self.inverse_scale) - *mean) * newest;
        }
        let [logarithm, ..] = logarithms;

        let [whole, ..] = self.masses;
        let moving = self.classes.moving();
        let tilt = match correction {
            Some(_) => self.constants.noise,
            None => 0.0,
        };
        let level = a - direction * upright;
        let slides_not = self.slide.push(&self.constants, level, turn, moving, tilt);
        let still = whole * slides_not;
        let samples = 1.0 + core::mem::take(&mut self.bridged);
        self.evidence.push(
            &self.constants,
            &Reading {
                acceleration: a,
                logarithm,
                rate: rate.0,
                correction: correction.unwrap_or(0.0),
                still,
                samples,
                seconds: self.period * samples,
                share: (self.newest * samples).lesser(1.0),
            },
        );
        self.probabilities = self.combine(slides_not);
        self.learn(logarithm, whole);
        self.probabilities
    }

    /// Combines the masses, the slide and the evidence. Turns are not judged: the probabilities about an axis are 1.
    fn combine(&self, slides_not: f32) -> Probabilities {
        let evidence = self.evidence.factor();
        let [whole, tangential, vertical, x, y, z] = self.masses;
        let stable = whole * slides_not * evidence;
        // The means of parts may round below that of the whole.
        Probabilities {
            axes: PerAxis::from_array(
                [x, y, z, 1.0, 1.0, 1.0].map(|p| (p * evidence).greater(stable)),
            ),
            tangential: (tangential * slides_not * evidence).greater(stable),
            vertical: (vertical * evidence).greater(stable),
            stable,
        }
    }

    /// Learns from a sample with this logarithm of its amplitude and the mean mass `whole`.
    fn learn(&mut self, logarithm: f32, whole: f32) {
        let in_stance = whole > STILL;
        self.stance = match in_stance == self.in_stance {
            true => (self.stance + self.period).lesser(2.0 * self.constants.stance),
            false => 0.0,
        };
        self.in_stance = in_stance;
        let walks = self.evidence.walks(&self.constants);
        let learns = walks || self.evidence.is_given();
        if self.learning == Learning::Frozen || !learns {
            return;
        }
        self.stood |= in_stance;
        if self.evidence.lands_evidently() {
            // Limits at which no stance follows a landing do not fit: they are of another gait or robot.
            if !self.stood {
                self.classes.doubt(&self.constants);
                self.slide.doubt(&self.constants);
            }
            self.stood = false;
        }
        // A foot that stands for a minute would forget its motion, and take its own quiet for that of all stances.
        // One that rests by turns, but lands no more, may walk so slowly that its swings pass for stances. One that only
        // turns may stand.
        let begins = !in_stance || self.stance < self.constants.stance;
        let is_slow = !walks && self.evidence.is_accelerated(&self.constants);
        if begins || is_slow || self.evidence.fell_within(self.constants.lesson) {
            self.classes.learn(&self.constants, logarithm, self.period);
        }
        if begins && walks {
            // Slides teach as stances do: a foot whose stances all count as slides must find out.
            self.slide.learn(&self.constants, whole * self.period);
        }
    }

    /// Processes an unreliable sample, one at the end of the sensor's range, or one while up is unknown: it counts as one in
    /// motion, and is not learnt from.
    pub fn push_doubt(&mut self) -> Probabilities {
        self.fade(self.newest);
        let samples = 1.0 + core::mem::take(&mut self.bridged);
        self.evidence.pass(self.period * samples);
        self.probabilities
    }

    /// Accounts for missing samples. A gap of half a window takes nothing from the probabilities.
    pub fn account_for(&mut self, missing: u64) -> Probabilities {
        if missing > u64::from(self.window / 2).max(1) {
            for _ in 0..missing.min((GAP_WINDOWS * self.window).into()) {
                self.fade(self.newest);
            }
            self.evidence.pass(missing as f32 * self.period);
        } else {
            self.bridged = missing as f32;
        }
        self.probabilities
    }

    /// Takes a share of all probabilities away.
    fn fade(&mut self, share: f32) {
        let rest = 1.0 - share;
        self.masses = self.masses.map(|mass| mass * rest);
        self.probabilities = self.probabilities.scaled(rest);
    }

    /// Returns whether the means cover a whole window.
    pub const fn filling(&self) -> Filling {
        if self.filled >= self.window { Filling::Full } else { Filling::Partial }
    }

    /// Logarithm of an amplitude given as its square.
    fn amplitude(&self, square: f32) -> f32 {
        0.5 * ln(square + self.constants.noise * self.constants.noise)
    }
}

/// The kernel's mass below the edge at the logarithm of an amplitude, for 1/(h√2) of its bandwidth h.
fn mass(edge: f32, u: f32, inverse_scale: f32) -> f32 {
    0.5 + 0.5 * erf((edge - u) * inverse_scale)
}
