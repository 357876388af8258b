//! The self-calibrating estimate: the paper's kernel mass on a logarithmic scale, with limits that
//! are learnt from the foot.
//!
//! Three quantities distinguish a standing foot from a moving one: its acceleration, its angular rate,
//! and the leaky mean of its acceleration, which is small under shaking and large in a swing. Each is
//! judged by the logarithm of its amplitude, since robots differ by factors:
//!
//! ```text
//! u    = ½ ln(x² + floor²)
//! edge = between the foot's own stillness and motion, see `stillness::classes`
//! mass = Φ((edge − u)/h)                    the kernel's mass below the edge, in closed form
//! M    ← M + (mass − M)·(1 − exp(−dt/τ))    mean over the last τ; of the leaky mean, the newest
//! P    = Π [f + (1 − f)·M] · no slide · evidence      f: the share that a quantity cannot take away
//! ```
//!
//! The same classes judge parts of the motion: motion across up and turns about it (tangential),
//! motion along up and tilting (vertical), and motion on each axis of the sensor alone. A part's
//! amplitude is at most that of the whole, so its probability is at least that of the whole.
//!
//! | step | module |
//! |---|---|
//! | residual of gravity, removed | `stillness::gravity_error` |
//! | stillness and motion learnt from this foot | `stillness::classes` |
//! | stored form of the learnt state | `stillness::learnt` |
//! | speed gained along the ground | `stillness::slide` |
//! | evidence that a foot stands, and whether it walks | `stillness::evidence`, `stillness::stride` |
//! | tangential, vertical and each axis alone | `stillness::parts` |
//! | constants | `stillness::params` |

mod classes;
mod evidence;
mod gravity_error;
mod learnt;
mod params;
mod parts;
mod quantity;
mod slide;
mod stride;

pub use learnt::{Classes, LOGARITHM, Learnt, MOST_SECONDS, OLDEST, SETTLED_AFTER};
pub use params::{
    Constants, EvidenceParams, GravityErrorParams, Learning, QuantityParams, SlideParams,
    StillnessParams,
};
pub use slide::{FULL_RATE as SLIDE_FULL_RATE, slide_weight};

use classes::{Learner, LearnerCoefficients};
use evidence::{Evidence, Shown};
use gravity_error::{Foot, GravityError};
use parts::{Motion, Parts};
use quantity::{Edge, PerQuantity, QuantityCoefficients};
use slide::Slide;

use crate::axis::PerAxis;
use crate::erf::erf;
use crate::logarithm::{exp, ln};
use crate::order::Order;
use crate::probability::Probabilities;
use crate::range::ParamsError;
use crate::root::{rounded, sqrt};
use crate::sample::{AngularRate, LinearAcceleration};
use crate::units::STANDARD_GRAVITY;
use crate::vector::Vec3;
use crate::window::Filling;

/// Checked inputs of a self-calibrating estimate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StillnessConfig {
    constants: Constants,
    learning: Learning,
    learnt: Option<Learnt>,
    sample_rate: f32,
}

impl StillnessConfig {
    /// Checks the fields that the constants' own type has not checked already.
    pub fn new(
        constants: &Constants,
        learning: Learning,
        learnt: Option<Learnt>,
        sample_rate: f32,
    ) -> Result<Self, ParamsError> {
        if let Some(learnt) = &learnt {
            learnt.validate()?;
        }
        Ok(Self {
            constants: *constants,
            learning,
            learnt,
            sample_rate,
        })
    }
}

/// Values that do not change from sample to sample.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Coefficients {
    learning: Learning,
    learner: LearnerCoefficients,
    /// Limit of an acceleration in the leaky mean, m/s²; its square follows.
    impact: f32,
    impact_squared: f32,
    /// Share of mass from which the foot counts as quiet.
    quiet: f32,
    /// Share of the newest mass in its mean.
    newest: f32,
    /// Share of the newest acceleration in the leaky mean.
    leak: f32,
    /// Samples until the means have settled.
    window: u32,
}

/// The estimate and its learnt state.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Stillness {
    coefficients: Coefficients,
    learner: Learner,
    gravity_error: GravityError,
    slide: Slide,
    evidence: Evidence,
    /// Factor of the probability by slide and evidence.
    believed: f32,
    /// The leaky mean of the acceleration, m/s², sensor frame.
    velocity: Vec3,
    /// Mean masses of the whole motion.
    acceleration: f32,
    rate: f32,
    parts: Parts,
    /// Samples in the means.
    filled: u32,
    probabilities: Probabilities,
    lesson: Lesson,
}

/// Remaining work for the newest sample after its probability is known.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Lesson {
    state: LessonState,
    motion: Motion,
    /// Logarithms of the amplitudes.
    logarithms: PerQuantity<f32>,
    /// Probability of stillness with which the sample is learnt.
    stable: f32,
}

/// Whether a lesson is pending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum LessonState {
    Due,
    Over,
}

/// Probabilities while up is unknown: neither yes nor no.
const UP_UNKNOWN: Probabilities = Probabilities {
    axes: PerAxis::splat(0.5),
    tangential: 0.5,
    vertical: 0.5,
    stable: 0.5,
};

impl Stillness {
    pub fn new(config: &StillnessConfig) -> Self {
        let &StillnessConfig {
            ref constants,
            learning,
            learnt,
            sample_rate,
        } = config;
        let params = constants.params();
        let share = |time_constant: f32| {
            1.0 - exp(-1.0 / (time_constant * sample_rate).greater(parts::LEAST_WINDOW))
        };
        let learner = LearnerCoefficients::new(constants, sample_rate);
        Self {
            learner: Learner::new(&learner, learnt),
            gravity_error: GravityError::new(&params.gravity_error, sample_rate),
            slide: Slide::new(params.slide, sample_rate),
            evidence: Evidence::new(params.evidence, sample_rate),
            believed: 1.0,
            velocity: Vec3::ZERO,
            acceleration: 0.0,
            rate: 0.0,
            parts: Parts::new(params.window, sample_rate),
            filled: 0,
            probabilities: Probabilities::default(),
            lesson: Lesson {
                state: LessonState::Over,
                motion: Motion::default(),
                logarithms: PerQuantity::default(),
                stable: 0.0,
            },
            coefficients: Coefficients {
                learning,
                learner,
                impact: params.impact,
                impact_squared: params.impact * params.impact,
                quiet: params.gravity_error.quiet,
                newest: share(params.window),
                leak: share(params.leak),
                window: rounded(params.window * sample_rate).max(1),
            },
        }
    }

    /// Probabilities of the newest sample; 0 before the first.
    pub const fn probabilities(&self) -> Probabilities {
        self.probabilities
    }

    /// The window's time constant in samples, at least 1.
    pub const fn window(&self) -> u32 {
        self.coefficients.window
    }

    /// Residual of gravity, m/s², sensor frame.
    pub const fn gravity_error(&self) -> Vec3 {
        self.gravity_error.value()
    }

    /// State learnt from the foot.
    pub fn learnt(&self) -> Learnt {
        self.learner.learnt(&self.coefficients.learner)
    }

    /// Returns whether enough steps were observed.
    pub fn is_settled(&self) -> bool {
        self.learner.is_settled()
    }

    /// Processes one sample's motion, with gravity, its [error](Self::gravity_error) and bias removed; `up`
    /// is the unit vector that points up, sensor frame.
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        rate: AngularRate,
        up: Vec3,
    ) -> Probabilities {
        self.finish();
        let Coefficients {
            ref learner,
            impact,
            impact_squared,
            quiet,
            newest,
            leak,
            ..
        } = self.coefficients;
        let (a, w) = (acceleration.0, rate.0);
        let square = a.dot(a);
        let capped = match square > impact_squared {
            true => a * (impact / sqrt(square)),
            false => a,
        };
        self.velocity += (capped - self.velocity) * leak;
        let motion = &mut self.lesson.motion;
        *motion = Motion {
            acceleration: a,
            rate: w,
            velocity: self.velocity,
            up,
            squares: PerQuantity {
                acceleration: square,
                rate: w.dot(w),
                velocity: self.velocity.dot(self.velocity),
            },
        };

        let edges = self.learner.edges();
        let quantities = &learner.quantities;
        let logarithms = PerQuantity {
            acceleration: amplitude(
                motion.squares.acceleration,
                quantities.acceleration.floor_squared,
            ),
            rate: amplitude(motion.squares.rate, quantities.rate.floor_squared),
            velocity: amplitude(motion.squares.velocity, quantities.velocity.floor_squared),
        };
        self.lesson.logarithms = logarithms;
        // Until the window has passed, the means cover the samples so far.
        self.filled = self.filled.saturating_add(1);
        let newest = newest.greater(1.0 / self.filled as f32);
        let mass_of_acceleration = mass(
            logarithms.acceleration,
            &edges.acceleration,
            &quantities.acceleration,
        );
        self.acceleration += (mass_of_acceleration - self.acceleration) * newest;
        self.rate += (mass(logarithms.rate, &edges.rate, &quantities.rate) - self.rate) * newest;
        let velocity = mass(logarithms.velocity, &edges.velocity, &quantities.velocity);

        let foot = match self.acceleration * velocity > quiet {
            true => Foot::Quiet,
            false => Foot::Moving,
        };
        self.gravity_error.update(a, up, foot);
        let still = heard(self.acceleration, &edges.acceleration)
            * heard(self.rate, &edges.rate)
            * heard(velocity, &edges.velocity);
        let along = up * a.dot(up);
        self.believed = self.slide.push(a - along, still) * self.evidence.factor();
        self.probabilities = self.combine(still);
        self.lesson.stable = self.probabilities.stable;
        self.lesson.state = LessonState::Due;
        self.probabilities
    }

    /// Judges the parts of the newest sample's motion and learns from it. The next sample would do so
    /// first; calling it earlier moves the work behind the transmission of the probability.
    #[inline(never)]
    pub fn finish(&mut self) {
        let Lesson {
            state,
            motion,
            logarithms,
            stable,
        } = &mut self.lesson;
        if *state == LessonState::Over {
            return;
        }
        *state = LessonState::Over;
        let learner = &self.coefficients.learner;
        let edges = self.learner.edges();
        self.parts
            .push(motion, edges, &learner.quantities, self.filled);
        self.learner.stride(learner, logarithms, *stable);
        let shown = match self.learner.shows(learner, logarithms) {
            Shown::Rest if !self.slide.is_slow() => Shown::Nothing,
            shown => shown,
        };
        self.evidence.push(shown);
        self.slide.learn(*stable);
        self.slide.roll(motion.squares.rate);
        match self.coefficients.learning {
            Learning::On => {
                let since_rest = self.evidence.since_rest();
                self.learner
                    .update(learner, logarithms, *stable, since_rest);
                self.learner.follow(learner);
            }
            Learning::Frozen => self.learner.rest(),
        }
    }

    /// Combines the three quantities, the slide and the evidence; also for the parts.
    fn combine(&self, still: f32) -> Probabilities {
        let believed = self.believed;
        let stable = still * believed;
        // A part that is not due may lag behind, and is never less still than the whole.
        let (tangential, vertical, axes) = self.parts.probabilities();
        Probabilities {
            axes: axes.map(|p| p.greater(stable)),
            tangential: (tangential * believed).greater(stable),
            vertical: vertical.greater(stable),
            stable,
        }
    }

    /// Processes one sample of a foot while up is unknown: its whole specific force, m/s², and
    /// angular rate. A force that differs from gravity in size counts as motion; turns are observed anyway.
    /// The direction of the motion is unknown, so the probability is at most [`UP_UNKNOWN`].
    pub fn push_unaligned(&mut self, force: Vec3, rate: AngularRate) -> Probabilities {
        // Up is taken along the force, however the sensor is mounted.
        let length = force.length();
        let up = match length > 0.0 {
            true => force * (1.0 / length),
            false => Vec3::new(0.0, 0.0, 1.0),
        };
        let beyond_gravity = up * (length - STANDARD_GRAVITY);
        self.push(LinearAcceleration(beyond_gravity), rate, up);
        self.probabilities.limit(&UP_UNKNOWN);
        self.probabilities
    }

    /// Processes an unreliable sample, or one at the end of the sensor's range: it counts as one in
    /// motion, and is not learnt from. Its contribution to the speed of a slide is limited anyway.
    #[inline(never)]
    pub fn push_doubt(&mut self) -> Probabilities {
        self.finish();
        let newest = self.coefficients.newest;
        let share = 1.0 - newest;
        self.acceleration *= share;
        self.rate *= share;
        self.parts.scale(share);
        self.probabilities = self.probabilities.scaled(share);
        self.probabilities
    }

    /// Returns whether the means cover a whole window.
    pub const fn filling(&self) -> Filling {
        if self.filled >= self.coefficients.window {
            Filling::Full
        } else {
            Filling::Partial
        }
    }
}

/// Logarithm of an amplitude given as its square.
#[inline(never)]
fn amplitude(square: f32, floor_squared: f32) -> f32 {
    0.5 * ln(square + floor_squared)
}

/// The kernel's mass below the edge at the logarithm of an amplitude.
#[inline(never)]
fn mass(logarithm: f32, edge: &Edge, quantity: &QuantityCoefficients) -> f32 {
    0.5 + 0.5 * erf((edge.at - logarithm) * quantity.inverse_scale)
}

/// The kernel's mass below the edge at an amplitude given as its square.
fn mass_of(square: f32, edge: &Edge, quantity: &QuantityCoefficients) -> f32 {
    mass(amplitude(square, quantity.floor_squared), edge, quantity)
}

/// Factor of the probability for a quantity with this mean mass.
fn heard(mass: f32, edge: &Edge) -> f32 {
    edge.floor + (1.0 - edge.floor) * mass
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f32 = 1000.0;
    const UP: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    fn stillness() -> Stillness {
        let config = StillnessConfig::new(&Constants::DEFAULT, Learning::On, None, RATE);
        Stillness::new(&config.expect("the default"))
    }

    fn push(stillness: &mut Stillness, acceleration: Vec3, rate: Vec3) -> Probabilities {
        stillness.push(LinearAcceleration(acceleration), AngularRate(rate), UP)
    }

    /// A walk of `steps` strides at `RATE`, with `size` times the amplitudes of a typical
    /// robot; returns the least P in mid-stance and the largest in mid-swing of the last stride.
    fn walk(stillness: &mut Stillness, steps: usize, size: f32) -> (f32, f32) {
        let (mut least, mut greatest) = (1.0_f32, 0.0_f32);
        for step in 0..steps {
            for k in 0..700 {
                let wave = libm::sinf(k as f32 * 0.021) + 0.3 * libm::sinf(k as f32 * 0.13);
                let swings = k < 300;
                let a = match swings {
                    true => Vec3::new(wave, -0.4 * wave, 1.0) * (8.0 * size),
                    false => Vec3::new(0.0, 0.0, 0.1 * size * wave),
                };
                let p = push(stillness, a, a * 0.2).stable;
                if step + 1 == steps && (50..280).contains(&k) {
                    greatest = greatest.max(p);
                }
                if step + 1 == steps && k >= 400 {
                    least = least.min(p);
                }
            }
        }
        (least, greatest)
    }

    #[test]
    fn stance_and_swing_separate_within_five_steps_at_every_size() {
        for size in [0.3, 0.5, 1.0, 2.0, 4.0] {
            let (stance, swing) = walk(&mut stillness(), 5, size);
            assert!(stance > 0.6 && swing < 0.4, "{size}: {stance}, {swing}");
        }
    }

    #[test]
    fn foot_is_not_still_in_the_millisecond_of_touchdown() {
        let mut stillness = stillness();
        walk(&mut stillness, 5, 1.0);
        let before = stillness.probabilities().stable;
        let after = push(&mut stillness, Vec3::new(60.0, 0.0, 80.0), Vec3::ZERO).stable;
        assert!(after < 0.9 * before, "{before}, {after}");
    }

    #[test]
    fn every_part_of_the_motion_is_at_least_as_still_as_the_whole() {
        let mut stillness = stillness();
        let mut seed = 7_u32;
        for k in 0..50_000 {
            let mut random = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed >> 8) as f32 / 8_388_608.0 - 1.0
            };
            let size = if k % 700 < 300 { 8.0 } else { 0.2 };
            let a = Vec3::new(random(), random(), random()) * size;
            let w = Vec3::new(random(), random(), random()) * (0.3 * size);
            let p = push(&mut stillness, a, w);
            let parts = p.axes.to_array().into_iter();
            for part in parts.chain([p.tangential, p.vertical]) {
                assert!((0.0..=1.0).contains(&part), "{k}: {p:?}");
                assert!(part >= p.stable - 1.0e-5, "{k}: {p:?}");
            }
        }
    }

    #[test]
    fn horizontal_motion_lowers_only_the_tangential_probability() {
        for (direction, slides) in [(Vec3::new(8.0, 0.0, 0.0), true), (UP * 8.0, false)] {
            let mut stillness = stillness();
            walk(&mut stillness, 5, 1.0);
            let mut p = Probabilities::default();
            for k in 0..40 {
                let sign = if k % 4 < 2 { 1.0 } else { -1.0 };
                p = push(&mut stillness, direction * sign, Vec3::ZERO);
            }
            let (moving, other) = match slides {
                true => (p.tangential, p.vertical),
                false => (p.vertical, p.tangential),
            };
            assert!(moving < 0.6 && other > 0.9, "{p:?}");
        }
    }

    #[test]
    fn frozen_learning_keeps_the_probability_of_a_motion() {
        let config = StillnessConfig::new(&Constants::DEFAULT, Learning::Frozen, None, RATE);
        let mut stillness = Stillness::new(&config.expect("the default"));
        let before = stillness.learnt();
        walk(&mut stillness, 20, 0.2);
        stillness.finish();
        let after = stillness.learnt();
        assert_eq!(before.to_array()[..11], after.to_array()[..11]);
        assert!((after.idle_seconds - 14.0).abs() < 1.0e-3, "{after:?}");
    }

    #[test]
    fn the_estimate_hardly_depends_on_the_sample_rate() {
        let at = |rate: f32| {
            let config = StillnessConfig::new(&Constants::DEFAULT, Learning::On, None, rate);
            let mut stillness = Stillness::new(&config.expect("the default"));
            let mut sum = 0.0;
            let samples = (7.0 * rate) as u32;
            for k in 0..samples {
                let t = k as f32 / rate;
                let wave = libm::sinf(40.0 * t);
                let a = match t % 0.7 < 0.3 {
                    true => Vec3::new(8.0, 0.0, 8.0 * wave),
                    false => Vec3::new(0.0, 0.0, 0.15 * wave),
                };
                sum += push(&mut stillness, a, a * 0.2).stable;
            }
            sum / samples as f32
        };
        let reference = at(1000.0);
        for rate in [100.0, 200.0, 500.0, 2000.0] {
            assert!(
                (at(rate) - reference).abs() < 0.06,
                "{rate} Hz: {}, {reference}",
                at(rate)
            );
        }
    }

    #[test]
    fn amplitude_is_a_natural_logarithm_limited_by_the_floor() {
        let near = |found: f32, expected: f32| assert!((found - expected).abs() < 1.0e-5);
        near(amplitude(4.0, 0.0), libm::logf(2.0));
        near(amplitude(9.0, 16.0), libm::logf(5.0));
        near(amplitude(0.0, 0.01), libm::logf(0.1));
    }
}
