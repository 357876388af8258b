//! Stillness and motion of one foot: two classes of amplitudes per quantity, and their learning.
//!
//! A quantity's amplitudes in stillness and in motion differ from robot to robot by a factor
//! of a hundred, so they are learnt while the foot walks, from all samples, each weighted by the
//! probability with which it belongs to a class:
//!
//! ```text
//! u ← ½ ln(x² + floor²)
//! still  ← still  + w₀ (u − still)            w₀ = P·dt / seconds of stillness
//! width  ← width  + w₀ (|u − still| − width)
//! moving ← moving + w₁ (u − moving)           w₁ = (1 − P)·dt / seconds of motion
//! ```
//!
//! Safeguards against divergence:
//! * Only the beginning of each stance is learnt from ([`StillnessParams::stance`]), and the
//!   same holds for a motion ([`StillnessParams::motion`]): only a foot that steps is learnt from. An hour of
//!   standing, of being carried, of hanging in a vibrating robot counts like a fraction of a second.
//! * The edge of stillness lies between the classes: a number of widths above stillness, and at most a
//!   part of the way to motion.
//! * A foot that finds no stillness for longer grows its still class back to the prior, never beyond:
//!   so the state learnt on another robot cannot keep this one from being found still. A foot that finds
//!   hardly any motion shrinks both classes back to near the prior, where they are larger.
//! * A foot that never swings as strongly as it did, or never is calm between, does not walk: it hangs, is
//!   carried or is shaken. It is not learnt from, however often it is called stable
//!   ([`EvidenceParams`](super::EvidenceParams)); but where it rests between, its motion is learnt.
//!   After some seconds of that, both classes shrink back to near the prior, where they are larger: a swing may
//!   be strong for this foot, and weak compared with the state learnt from another.
//! * State learnt before a start weighs like a few steps, so that some more steps can outweigh it.
//!
//! [`StillnessParams::stance`]: super::StillnessParams::stance
//! [`StillnessParams::motion`]: super::StillnessParams::motion

use super::evidence::Shown;
use super::learnt::{Classes, Learnt, OLDEST, SETTLED_AFTER};
use super::params::{Constants, EvidenceParams};
use super::quantity::{Edge, PerQuantity, QuantityCoefficients};
use super::stride::{Stride, StrideCoefficients};
use crate::logarithm::{exp, ln};
use crate::order::Order;

/// Largest distance of the logarithm above the prior, for a foot that finds hardly any motion: a factor of 1.5.
const MARGIN: f32 = 0.4;

/// Time without swing or rest, s, after which the classes return to near the prior.
const SHOWS_NOTHING: f32 = 5.0;

/// Least distance between the classes, of the logarithm.
const LEAST_DISTANCE: f32 = 0.3;

impl Classes {
    // Called three times a sample: not inlined, so that the foot's flash holds it once.
    #[inline(never)]
    fn learn_still(&mut self, u: f32, weight: f32) {
        let difference = u - self.still;
        self.width += weight * (difference.abs() - self.width);
        self.still += weight * difference;
    }

    /// Moves the classes one step back to the prior.
    #[inline(never)]
    fn relax(&mut self, prior: &Self, share: f32, relaxation: Relaxation) {
        match relaxation {
            Relaxation::Grow => {
                self.still += share * (prior.still - self.still).greater(0.0);
                self.width += share * (prior.width - self.width).greater(0.0);
            }
            Relaxation::Shrink => {
                self.still += share * (prior.still + MARGIN - self.still).lesser(0.0);
                self.width += share * (prior.width - self.width).lesser(0.0);
                self.moving += share * (prior.moving + MARGIN - self.moving).lesser(0.0);
            }
        }
    }

    /// Keeps motion at least [`LEAST_DISTANCE`] above stillness: with classes that coincide the quantity would
    /// have no influence, whatever the foot does.
    fn apart(self) -> Self {
        Self {
            moving: self.moving.greater(self.still + LEAST_DISTANCE),
            ..self
        }
    }

    /// Learnt classes as a start: no amplitude lies below the floor, so no still class may wait there.
    fn as_start(self, floor: f32) -> Self {
        let still = self.still.greater(ln(floor));
        Self { still, ..self }.apart()
    }
}

impl Learnt {
    /// Upper end of stillness for acceleration (m/s²), rate (rad/s) and leaky mean of the acceleration
    /// (m/s²), with these constants.
    #[must_use]
    pub fn edges(&self, constants: &Constants) -> [f32; 3] {
        // The result does not depend on the sample rate.
        let coefficients = LearnerCoefficients::new(constants, 1.0);
        let learner = Learner::new(&coefficients, Some(*self));
        let edges = learner.edges();
        [edges.acceleration, edges.rate, edges.velocity].map(|edge| exp(edge.at))
    }
}

/// Coefficients of learning at a sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct LearnerCoefficients {
    pub quantities: PerQuantity<QuantityCoefficients>,
    /// Time between samples, s.
    period: f32,
    part_of_the_way: f32,
    least_width: f32,
    largest_width: f32,
    prior: f32,
    memory: f32,
    /// Longest stance that is learnt from, samples.
    stance: u32,
    motion: u32,
    /// Share by which classes return to the prior with a sample.
    relax: f32,
    /// Share of the newest sample in the mean over [`SHARE_TIME`].
    newest: f32,
    stride: StrideCoefficients,
}

impl LearnerCoefficients {
    pub fn new(constants: &Constants, sample_rate: f32) -> Self {
        let params = constants.params();
        let [acceleration, rate, velocity] = constants.priors();
        let samples = |seconds: f32| crate::root::rounded(seconds * sample_rate);
        let period = 1.0 / sample_rate;
        Self {
            quantities: PerQuantity {
                acceleration: QuantityCoefficients::new(&params.acceleration, acceleration),
                rate: QuantityCoefficients::new(&params.rate, rate),
                velocity: QuantityCoefficients::new(&params.velocity, velocity),
            },
            period,
            part_of_the_way: params.part_of_the_way,
            least_width: params.least_width,
            largest_width: params.largest_width,
            prior: params.prior,
            memory: params.memory,
            stance: samples(params.stance),
            motion: samples(params.motion),
            relax: period / params.relaxation,
            newest: (period / SHARE_TIME).lesser(1.0),
            stride: StrideCoefficients::new(params.evidence, period),
        }
    }

    /// Upper end of stillness for a quantity.
    #[inline(never)]
    fn edge(&self, classes: &Classes, quantity: &QuantityCoefficients) -> Edge {
        let width = self.limited(classes.width);
        let distance = classes.moving - classes.still;
        let above_still = (quantity.edge * width).lesser(self.part_of_the_way * distance);
        let ratio = distance * quantity.inverse_separation;
        let square = ratio * ratio;
        // A quantity whose classes coincide has no influence.
        let say = square * square / (1.0 + square * square);
        Edge {
            at: classes.still + above_still,
            floor: 1.0 - (1.0 - quantity.indifference) * say,
        }
    }

    fn limited(&self, width: f32) -> f32 {
        // A width is never NaN: it is a mean of differences of logarithms, which are finite.
        width.greater(self.least_width).lesser(self.largest_width)
    }
}

/// Duration of stillness or motion so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Stretch {
    /// Samples with P > 0.5.
    Still(u32),
    /// Samples without.
    Moving(u32),
}

/// Longest period, s, at which the edges are updated in turn: classes hardly change in a few milliseconds.
const SLOWEST_BY_TURNS: f32 = 0.0021;

/// Quantity whose edge is updated next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Turn {
    Acceleration,
    Rate,
    Velocity,
}

/// Direction in which classes return to the prior while nothing is learnt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Relaxation {
    /// The still class up to the prior.
    Grow,
    /// Both classes down to the prior.
    Shrink,
}

/// Learns the classes.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Learner {
    classes: PerQuantity<Classes>,
    still_seconds: f32,
    moving_seconds: f32,
    stretch: Stretch,
    stride: Stride,
    /// Share of the last seconds in which the foot was still.
    still_share: f32,
    /// Upper end of stillness, as of the quantity's last update.
    edges: PerQuantity<Edge>,
    turn: Turn,
    /// Age at the start, s, and the samples since then that were not learnt from.
    idle_before: f32,
    idle: u32,
}

/// Share of stillness in the last seconds above which a foot finds hardly any motion:
/// it stands, or takes its swing for a stance, as after a trot, whose motion was larger.
const HARDLY_ANY_MOTION: f32 = 0.7;

/// Time constant of the share of stillness, s: two strides.
const SHARE_TIME: f32 = 2.0;

/// Largest weight of the state learnt before a start, s of each class.
const BEFORE_THE_START: f32 = SETTLED_AFTER;

/// Probability above which the foot is more probably still than not.
const STILL: f32 = 0.5;

impl Learner {
    /// Creates a learner from the constants alone, or with the state learnt before.
    pub fn new(coefficients: &LearnerCoefficients, learnt: Option<Learnt>) -> Self {
        let quantities = &coefficients.quantities;
        let prior = quantities.map(|quantity| quantity.prior);
        let (classes, seconds, idle_before) = match learnt {
            None => (prior, (0.0, 0.0), 0.0),
            Some(learnt) => (
                PerQuantity {
                    acceleration: learnt.acceleration.as_start(quantities.acceleration.floor),
                    rate: learnt.rate.as_start(quantities.rate.floor),
                    velocity: learnt.velocity.as_start(quantities.velocity.floor),
                },
                (
                    learnt.still_seconds.lesser(BEFORE_THE_START),
                    learnt.moving_seconds.lesser(BEFORE_THE_START),
                ),
                learnt.idle_seconds,
            ),
        };
        let mut learner = Self {
            classes,
            still_seconds: seconds.0,
            moving_seconds: seconds.1,
            stretch: Stretch::Still(0),
            stride: Stride::START,
            still_share: 0.0,
            edges: PerQuantity::default(),
            turn: Turn::Acceleration,
            idle_before,
            idle: 0,
        };
        for turn in [Turn::Acceleration, Turn::Rate, Turn::Velocity] {
            learner.place_edge(coefficients, turn);
        }
        learner
    }

    pub fn learnt(&self, coefficients: &LearnerCoefficients) -> Learnt {
        let idle = self.idle_before + self.idle as f32 * coefficients.period;
        let PerQuantity {
            acceleration,
            rate,
            velocity,
        } = self.classes.map(Classes::limited);
        Learnt {
            acceleration,
            rate,
            velocity,
            still_seconds: self.still_seconds,
            moving_seconds: self.moving_seconds,
            idle_seconds: idle.lesser(OLDEST),
        }
    }

    /// Returns whether enough was observed: see [`SETTLED_AFTER`].
    pub fn is_settled(&self) -> bool {
        self.still_seconds >= SETTLED_AFTER && self.moving_seconds >= SETTLED_AFTER
    }

    /// Updates the stride with a sample with these logarithms of amplitudes that is still with
    /// probability `stable`.
    pub fn stride(
        &mut self,
        coefficients: &LearnerCoefficients,
        logarithms: &PerQuantity<f32>,
        stable: f32,
    ) {
        let EvidenceParams {
            swing, first_swing, ..
        } = coefficients.stride.params;
        let margin = match self.is_settled() {
            true => swing,
            false => first_swing,
        };
        let moving = self.classes.acceleration.moving;
        self.stride.push(
            &coefficients.stride,
            logarithms.acceleration - moving,
            margin,
            stable,
        );
    }

    /// Evidence in a sample with these logarithms of amplitudes, the newest of the stride.
    pub fn shows(
        &self,
        coefficients: &LearnerCoefficients,
        logarithms: &PerQuantity<f32>,
    ) -> Shown {
        let EvidenceParams { rest_margin, .. } = coefficients.stride.params;
        if self.stride.since_swing == 0.0 {
            return Shown::Swing;
        }
        let rests = |classes: &Classes, logarithm: f32| logarithm < classes.still + rest_margin;
        let PerQuantity {
            acceleration,
            rate,
            velocity,
        } = &self.classes;
        let all = rests(acceleration, logarithms.acceleration)
            && rests(rate, logarithms.rate)
            && rests(velocity, logarithms.velocity);
        match all {
            true => Shown::Rest,
            false => Shown::Nothing,
        }
    }

    /// Counts another sample that is not learnt from.
    pub const fn rest(&mut self) {
        self.idle = self.idle.saturating_add(1);
    }

    /// Upper end of stillness per quantity.
    pub const fn edges(&self) -> &PerQuantity<Edge> {
        &self.edges
    }

    fn place_edge(&mut self, coefficients: &LearnerCoefficients, turn: Turn) {
        let quantities = &coefficients.quantities;
        let (edge, classes, quantity) = match turn {
            Turn::Acceleration => (
                &mut self.edges.acceleration,
                &self.classes.acceleration,
                &quantities.acceleration,
            ),
            Turn::Rate => (&mut self.edges.rate, &self.classes.rate, &quantities.rate),
            Turn::Velocity => (
                &mut self.edges.velocity,
                &self.classes.velocity,
                &quantities.velocity,
            ),
        };
        *edge = coefficients.edge(classes, quantity);
    }

    /// Moves the edges to the current classes; at high sample rates one quantity with each sample.
    pub fn follow(&mut self, coefficients: &LearnerCoefficients) {
        if coefficients.period > SLOWEST_BY_TURNS {
            for turn in [Turn::Acceleration, Turn::Rate, Turn::Velocity] {
                self.place_edge(coefficients, turn);
            }
        } else {
            self.place_edge(coefficients, self.turn);
            self.turn = match self.turn {
                Turn::Acceleration => Turn::Rate,
                Turn::Rate => Turn::Velocity,
                Turn::Velocity => Turn::Acceleration,
            };
        }
    }

    /// Learns from a sample with these logarithms of amplitudes that is still with probability
    /// `stable`, of a foot that rested `since_rest` seconds ago.
    pub fn update(
        &mut self,
        coefficients: &LearnerCoefficients,
        logarithms: &PerQuantity<f32>,
        stable: f32,
        since_rest: f32,
    ) {
        self.stretch = match (stable > STILL, self.stretch) {
            (true, Stretch::Still(samples)) => Stretch::Still(samples.saturating_add(1)),
            (true, Stretch::Moving(_)) => Stretch::Still(1),
            (false, Stretch::Moving(samples)) => Stretch::Moving(samples.saturating_add(1)),
            (false, Stretch::Still(_)) => Stretch::Moving(1),
        };
        // After a long time in one class, a sample still teaches the other by its share.
        let (teaches_still, teaches_motion) = match self.stretch {
            Stretch::Still(samples) => (samples < coefficients.stance, true),
            Stretch::Moving(samples) => (true, samples < coefficients.motion),
        };
        let learns = coefficients.stride.params.learns;
        let walks = self.stride.since_swing < learns;
        // Also learns from a foot that rests between motions weaker than those learnt.
        let walks_weakly = self.is_settled() && since_rest < learns;
        let (teaches_still, teaches_motion) = (
            teaches_still && walks,
            teaches_motion && (walks || walks_weakly),
        );
        if teaches_still && teaches_motion {
            self.idle_before = 0.0;
            self.idle = 0;
        } else {
            self.rest();
        }
        if teaches_still {
            let share = stable * coefficients.period;
            self.still_seconds = (self.still_seconds + share).lesser(coefficients.memory);
            let weight = share / (self.still_seconds + coefficients.prior);
            for (classes, u) in self.each(logarithms) {
                classes.learn_still(u, weight);
            }
        }
        if teaches_motion {
            let share = (1.0 - stable) * coefficients.period;
            self.moving_seconds = (self.moving_seconds + share).lesser(coefficients.memory);
            let weight = share / (self.moving_seconds + coefficients.prior);
            for (classes, u) in self.each(logarithms) {
                classes.moving += weight * (u - classes.moving);
            }
        }
        match self.stretch {
            Stretch::Moving(samples) if walks && samples >= coefficients.motion => {
                self.relax(coefficients, Relaxation::Grow);
            }
            Stretch::Moving(_) | Stretch::Still(_) => {}
        }
        let still = if stable > STILL { 1.0 } else { 0.0 };
        self.still_share += (still - self.still_share) * coefficients.newest;
        let shows_nothing = self.stride.since_swing > SHOWS_NOTHING && since_rest > SHOWS_NOTHING;
        if self.still_share > HARDLY_ANY_MOTION || shows_nothing {
            self.relax(coefficients, Relaxation::Shrink);
        }
        for (classes, _) in self.each(logarithms) {
            *classes = classes.apart();
        }
    }

    fn relax(&mut self, coefficients: &LearnerCoefficients, relaxation: Relaxation) {
        let share = coefficients.relax;
        let prior = coefficients.quantities.map(|quantity| quantity.prior);
        let classes = &mut self.classes;
        for (classes, prior) in [
            (&mut classes.acceleration, prior.acceleration),
            (&mut classes.rate, prior.rate),
            (&mut classes.velocity, prior.velocity),
        ] {
            classes.relax(&prior, share, relaxation);
        }
    }

    /// Each quantity's classes beside its logarithm.
    fn each(&mut self, logarithms: &PerQuantity<f32>) -> [(&mut Classes, f32); 3] {
        let PerQuantity {
            acceleration,
            rate,
            velocity,
        } = &mut self.classes;
        [
            (acceleration, logarithms.acceleration),
            (rate, logarithms.rate),
            (velocity, logarithms.velocity),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::params::StillnessParams;
    use super::*;

    const RATE: f32 = 1000.0;

    fn coefficients() -> LearnerCoefficients {
        LearnerCoefficients::new(&Constants::DEFAULT, RATE)
    }

    fn same(u: f32) -> PerQuantity<f32> {
        PerQuantity {
            acceleration: u,
            rate: u,
            velocity: u,
        }
    }

    /// Time since the foot rested, s: too long to be learnt from, and short enough not to doubt the state.
    const RESTED: f32 = 2.0;

    /// Feeds `seconds` of amplitudes with the logarithm `u` that are still with probability `stable`.
    fn feed(learner: &mut Learner, u: f32, stable: f32, seconds: f32) {
        for _ in 0..(seconds * RATE) as u32 {
            learner.stride(&coefficients(), &same(u), stable);
            learner.update(&coefficients(), &same(u), stable, RESTED);
        }
    }

    /// Returns the edges after they have been updated.
    fn edges(mut learner: Learner) -> PerQuantity<Edge> {
        (0..3).for_each(|_| learner.follow(&coefficients()));
        *learner.edges()
    }

    #[test]
    fn a_start_below_the_floor_begins_there() {
        let below = Classes {
            still: -9.0,
            moving: -9.0,
            width: 1.0,
        };
        let learnt = Learnt {
            velocity: below,
            ..Learnt::default()
        };
        let start = Learner::new(&coefficients(), Some(learnt)).classes;
        let floor = ln(StillnessParams::DEFAULT.velocity.floor);
        let expected = Classes {
            still: floor,
            moving: floor + LEAST_DISTANCE,
            ..below
        };
        assert_eq!(start.velocity, expected);
    }

    fn walked(steps: usize, still: f32, moving: f32) -> Learner {
        let mut learner = Learner::new(&coefficients(), None);
        for _ in 0..steps {
            feed(&mut learner, moving, 0.0, 0.3);
            feed(&mut learner, still, 1.0, 0.4);
        }
        learner
    }

    #[test]
    fn a_few_steps_teach_both_classes_and_settle_them() {
        let learnt = walked(5, -2.0, 1.5).learnt(&coefficients());
        assert!((learnt.acceleration.still + 2.0).abs() < 0.2, "{learnt:?}");
        assert!((learnt.acceleration.moving - 1.5).abs() < 0.2, "{learnt:?}");
        assert!(learnt.is_settled(), "{learnt:?}");
        assert!(!Learner::new(&coefficients(), None).is_settled());
    }

    #[test]
    fn motion_without_the_usual_swing_is_not_learnt() {
        let mut learner = walked(5, -2.0, 1.5);
        feed(&mut learner, 0.5, 0.0, 2.0);
        let before = learner.learnt(&coefficients());
        for _ in 0..100 {
            feed(&mut learner, 0.5, 0.0, 0.5);
            feed(&mut learner, -0.5, 1.0, 0.2);
        }
        let after = learner.learnt(&coefficients());
        assert_eq!(after.to_array()[..11], before.to_array()[..11]);
    }

    #[test]
    fn motion_that_is_never_calm_is_not_learnt() {
        let mut learner = walked(5, -2.0, 1.5);
        feed(&mut learner, 1.5, 0.0, 5.0);
        let before = learner.learnt(&coefficients());
        feed(&mut learner, 1.5, 0.4, 100.0);
        let after = learner.learnt(&coefficients());
        assert_eq!(after.to_array()[..11], before.to_array()[..11]);
    }

    #[test]
    fn an_hour_of_standing_teaches_no_more_than_one_stance() {
        let (mut brief, mut long) = (walked(5, -2.0, 1.5), walked(5, -2.0, 1.5));
        feed(&mut brief, -4.0, 1.0, StillnessParams::DEFAULT.stance);
        feed(&mut long, -4.0, 1.0, 3_600.0);
        let [brief, long] = [brief, long].map(|learner| learner.learnt(&coefficients()));
        assert_eq!(brief.acceleration, long.acceleration);
        assert_eq!(brief.still_seconds, long.still_seconds);
        assert!(long.idle_seconds > 3_590.0, "{long:?}");
    }

    #[test]
    fn an_hour_of_motion_teaches_no_more_than_one_swing() {
        let (mut brief, mut long) = (walked(5, -2.0, 1.5), walked(5, -2.0, 1.5));
        feed(&mut brief, 4.0, 0.0, StillnessParams::DEFAULT.motion);
        feed(&mut long, 4.0, 0.0, 3_600.0);
        let [brief, long] = [brief, long].map(|learner| learner.learnt(&coefficients()));
        assert_eq!(brief.acceleration.moving, long.acceleration.moving);
    }

    #[test]
    fn foot_without_stillness_grows_back_to_the_prior() {
        let coefficients = coefficients();
        let prior = coefficients.quantities.acceleration.prior;
        for still in [prior.still - 3.0, prior.still + 0.5] {
            let mut learner = walked(20, still, prior.moving);
            let before = learner.learnt(&coefficients).acceleration.still;
            // Calm in each stride, but never still enough.
            for _ in 0..600 {
                feed(&mut learner, prior.moving, 0.0, 0.7);
                feed(&mut learner, prior.moving - 2.5, 0.0, 0.3);
            }
            let after = learner.learnt(&coefficients).acceleration.still;
            assert!(
                (after - before.max(prior.still)).abs() < 0.01,
                "{before}, {after}"
            );
        }
    }

    #[test]
    fn foot_without_motion_shrinks_back_to_near_the_prior() {
        let coefficients = coefficients();
        let prior = coefficients.quantities.acceleration.prior;
        for larger in [2.0, -2.0] {
            let mut learner = walked(20, prior.still + larger, prior.moving + larger);
            let before = learner.learnt(&coefficients).acceleration;
            feed(&mut learner, before.still, 1.0, 600.0);
            let after = learner.learnt(&coefficients).acceleration;
            assert!(
                (after.still - before.still.min(prior.still + MARGIN)).abs() < 0.01,
                "{after:?}"
            );
            assert!(
                (after.moving - before.moving.min(prior.moving + MARGIN)).abs() < 0.01,
                "{after:?}"
            );
        }
    }

    #[test]
    fn the_edge_lies_between_the_classes() {
        for still in [-6.0, -2.0, 0.0, 1.5] {
            let learner = walked(20, still, 2.0);
            let Classes { still, moving, .. } = learner.learnt(&coefficients()).acceleration;
            let at = edges(learner).acceleration.at;
            assert!(still < at && at < moving, "{still}, {at}, {moving}");
        }
    }

    #[test]
    fn quantity_with_coinciding_classes_has_no_influence() {
        let mut learner = walked(50, 0.0, 0.0);
        for (classes, _) in learner.each(&same(0.0)) {
            classes.moving = classes.still;
        }
        let now = edges(learner);
        assert_eq!(now.rate.floor, 1.0);
        let far = edges(walked(50, -2.0, 3.0));
        let least = StillnessParams::DEFAULT.acceleration.indifference;
        assert!(far.acceleration.floor < least + 0.05, "{far:?}");
    }

    #[test]
    fn warm_start_restores_the_learnt_numbers() {
        let coefficients = coefficients();
        let learnt = walked(5, -1.0, 1.5).learnt(&coefficients);
        assert_eq!(Learnt::from_array(learnt.to_array()), learnt);
        let warm = Learner::new(&coefficients, Some(learnt)).learnt(&coefficients);
        assert_eq!(warm.to_array()[..9], learnt.to_array()[..9]);
        assert!(warm.is_settled() && warm.still_seconds == SETTLED_AFTER);
    }

    #[test]
    fn learnt_numbers_stay_within_their_limits() {
        let mut learner = Learner::new(&coefficients(), None);
        let mut seed = 1_u32;
        for _ in 0..200_000 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let u = (seed >> 8) as f32 / 1.0e6 - 8.0;
            let stable = (seed >> 9 & 0xff) as f32 / 255.0;
            learner.stride(&coefficients(), &same(u), stable);
            learner.update(&coefficients(), &same(u), stable, 0.0);
        }
        let learnt = learner.learnt(&coefficients());
        assert_eq!(learnt.validate(), Ok(()), "{learnt:?}");
    }

    #[test]
    fn motion_is_learnt_as_the_mean_over_its_seconds_and_the_priors() {
        let mut learner = Learner::new(&coefficients(), None);
        let prior = coefficients().quantities.acceleration.prior.moving;
        feed(&mut learner, prior + 1.0, 0.0, 0.4);
        let moved = learner.learnt(&coefficients()).acceleration.moving - prior;
        // The prior weighs like seconds of its own.
        let expected = 0.4 / (0.4 + StillnessParams::DEFAULT.prior);
        assert!((moved - expected).abs() < 0.01, "{moved} for {expected}");
    }

    #[test]
    fn classes_are_kept_apart_for_any_input() {
        let together = Classes {
            still: -1.0,
            moving: -1.0,
            width: 0.3,
        };
        let given = Learnt {
            acceleration: together,
            rate: together,
            velocity: together,
            ..Learnt::default()
        };
        let mut learner = Learner::new(&coefficients(), Some(given));
        for _ in 0..2 {
            let Learnt {
                acceleration,
                rate,
                velocity,
                ..
            } = learner.learnt(&coefficients());
            for classes in [acceleration, rate, velocity] {
                let distance = classes.moving - classes.still;
                assert!((distance - LEAST_DISTANCE).abs() < 1.0e-5, "{distance}");
            }
            // All samples at one amplitude.
            for _ in 0..20 {
                feed(&mut learner, -1.0, 0.0, 0.3);
                feed(&mut learner, -1.0, 1.0, 0.3);
            }
        }
    }
}
