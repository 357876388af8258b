//! The gyroscope's bias, learnt at rest, and followed in a walk where the inclination shows that it has moved.
//!
//! A gyroscope at rest shows its bias, but a robot that turns slowly and steadily looks much the same. Three criteria
//! distinguish them:
//!
//! * A turn about anything but the vertical moves gravity through the sensor, and so is no [rest](crate::rest).
//! * Temperature moves a bias slowly and not far. So a known bias is followed only within a narrow gate, which opens as
//!   fast as temperature moves the bias and no further.
//! * A bias is present in every rest and a turn is not. So a rate that contradicts the known bias must have been seen
//!   at rest for twice as long as the known bias itself.
//!
//! Two turns about the vertical are still taken for a bias: one slower than the gate, and one that lasts for minutes
//! and twice as long as all rest before it. They cost heading, which is not observed anyway, and not inclination.
//!
//! # Before the first rest, and between rests
//!
//! A foot that walks before its first rest, as after a dip of its supply, learns from the corrections of its
//! inclination, because a bias needs repeated correction, whereas an impact does not. The next rest replaces that bias.
//! If the corrections of a walk contradict the bias of the last rest, they are followed in the same way, since shocks can
//! move a bias by more than temperature does. Only a rest observes the part about the vertical.
//!
//! In a rest of half a second a shank can lean so slowly that its force shows nothing, at the rate of a bias. So after
//! less than a second of rest the corrections are followed as well, while the foot certainly stands. They are not
//! followed if the inclination was lost after the rest, because they then find the inclination again.
//!
//! # Large rates
//!
//! At the first rest after power-up no bias is known, and any rate up to [`RestParams::bias_limit`] is accepted. A
//! larger rate is probably a turn. It is accepted once it has stayed the same for minutes.
//!
//! A rate at rest that has not been accepted for five seconds is [reported](crate::ContactEstimator::excess_bias),
//! whether it is pending or too large, because either the gyroscope is beyond its data sheet, or the ground turns. A
//! bias at the limit of what is followed in a walk is reported, too.

use crate::math::Order;
use crate::rest::{RestParams, Stillness};
use crate::units::DEGREE;
use crate::vector::Vec3;

/// Largest distance from the known bias at which a rest is accepted at once, rad/s.
const GATE: f32 = 0.3 * DEGREE;

/// Growth of the gate, rad/s per s, since a rest last lay inside [`GATE`]: the drift of a
/// MEMS gyroscope's bias with temperature while a board warms up.
const GATE_GROWTH: f32 = 0.0005 * DEGREE;

/// Largest opening of the gate, rad/s: 30 °C at the LSM6DSOX's typical 0.01 °/s per °C.
const LARGEST_OPENING: f32 = 0.3 * DEGREE;

/// Factor by which the rests that contradict the known bias must exceed the rests that it is based on.
const CONTRADICTION: f32 = 2.0;

/// Least duration of the rests that contradict the known bias, s. A bias that was learnt in a turn at power-up is thus
/// corrected within minutes of rest.
const LEAST_CONTRADICTION: f32 = 240.0;

/// Longest rest that the known bias is credited with, s. An f32 can count up to twice this value in steps of 0.1 ms.
const LONGEST_KNOWN: f32 = 900.0;

/// Largest usual bias per axis, rad/s: twice the LSM6DSOX's typical zero-rate level. A larger one may be a turn at
/// power-up.
const USUAL: f32 = 2.0 * DEGREE;

/// Least duration of the rests that contradict an unusual bias, s. It replaces [`LEAST_CONTRADICTION`];
/// [`CONTRADICTION`] applies as well.
const LEAST_CONTRADICTION_OF_UNUSUAL: f32 = 20.0;

/// Largest multiple of [`RestParams::bias_limit`] at which a rate is still accepted as a bias, once it has been the
/// same for as long as would contradict a known bias.
const BEYOND_LIMIT: f32 = 4.0;

/// Duration of a rate beyond the limit, without a known bias, until it is reported, s.
const REPORTED_AFTER: f32 = 5.0;

/// Duration of rest from which the bias is known, s.
const KNOWN_AFTER: f32 = 0.5;

/// Time constant, s, with which the bias follows the corrections of the inclination: twice the default time constant of
/// these corrections in motion, so that the two together do not oscillate.
const CORRECTIONS_TIME_CONSTANT: f32 = 10.0;

/// Duration of rest, s, from which the bias does not follow the corrections of a standing foot. With 2 or 5 s no figure of
/// a robot changes.
const BRIEF_REST: f32 = 1.0;

/// Time constant, s, with which the bias follows the corrections of a foot that stands after a brief rest. The wrong bias
/// tilts up within seconds, so this time is shorter than [`CORRECTIONS_TIME_CONSTANT`]. It can be, because no swing
/// disturbs the corrections.
/// With 1 s a robot that was put down has a worse bias, with 5 s one that crawls has more false slips.
const STANDING_TIME_CONSTANT: f32 = 2.0;

/// Mean rate of the corrections, rad/s, above which they replace the bias of the last rest: more than temperature can
/// move the bias.
const CONTRADICTED: f32 = GATE + LARGEST_OPENING;

/// Largest rate of a correction that can show a bias, rad/s: ten times the largest bias that is followed. A faster
/// correction finds an inclination that was lost, as after turns that the gyroscope did not measure.
const LARGEST_CORRECTION_RATE: f32 = 60.0 * DEGREE;

/// Time after a loss of the inclination in which its corrections do not count, s. They find the inclination again, and
/// show no bias.
const FOUND_AFTER: f32 = 5.0;

/// Observation that the bias is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// The last rest.
    Rest,
    /// The corrections of the inclination, until the next rest.
    Corrections,
}

/// [`BiasEstimator`]'s part of [`RestParams`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct BiasCoefficients {
    /// rad/s.
    limit: f32,
    /// s.
    time_constant: f32,
}

impl BiasCoefficients {
    /// Coefficients of checked parameters.
    pub const fn new(params: &RestParams) -> Self {
        Self { limit: params.bias_limit, time_constant: params.bias_time_constant }
    }
}

/// Estimates the gyroscope's bias from the mean rates of rests and from the corrections of the inclination.
#[derive(Clone, Debug)]
pub(crate) struct BiasEstimator {
    coefficients: BiasCoefficients,
    /// The estimate, rad/s, sensor frame.
    bias: Vec3,
    /// The estimate as the last rest has left it, rad/s.
    rested: Vec3,
    source: Source,
    /// Duration of rest that the bias is based on, s, up to the time constant. It is the length of the mean, and 0
    /// before the first rest.
    learnt: f32,
    /// Duration of rest that the bias is based on, s, up to [`LONGEST_KNOWN`]. A contradiction must last longer, by the
    /// factor [`CONTRADICTION`].
    known: f32,
    /// Duration of rest that has contradicted the bias since a rest last agreed with it, s.
    contradicted: f32,
    /// Current opening of the gate beyond [`GATE`], rad/s.
    opening: f32,
    /// Duration of a rate beyond the limit in this rest while no bias is known, s.
    excessive: f32,
    /// Mean error of the bias by the corrections of the inclination, rad/s.
    error: Vec3,
    /// Remaining time in which corrections do not count, s.
    uncounted: f32,
    /// Whether a rest has found the inclination since it was last lost.
    has_rested_since_loss: bool,
    /// Duration of corrections that lead beyond the largest followed bias, s.
    unfollowed: f32,
}

impl BiasEstimator {
    pub(crate) const fn new(coefficients: BiasCoefficients) -> Self {
        Self {
            coefficients,
            bias: Vec3::ZERO,
            rested: Vec3::ZERO,
            source: Source::Corrections,
            learnt: 0.0,
            known: 0.0,
            contradicted: 0.0,
            opening: 0.0,
            excessive: 0.0,
            error: Vec3::ZERO,
            uncounted: 0.0,
            has_rested_since_loss: false,
            unfollowed: 0.0,
        }
    }

    /// The estimated bias, rad/s.
    pub(crate) const fn bias(&self) -> Vec3 {
        self.bias
    }

    /// Returns whether the bias was observed at rest.
    pub(crate) fn is_known(&self) -> bool {
        self.learnt > 0.0
    }

    /// Processes the result of rest detection, and the mean rate, rad/s, over `dt` seconds.
    pub(crate) fn update(&mut self, stillness: Stillness, mean_rate: Vec3, dt: f32) {
        self.opening = (self.opening + GATE_GROWTH * dt).lesser(LARGEST_OPENING);
        match stillness {
            Stillness::Moving => self.excessive = 0.0,
            Stillness::Brief => {}
            Stillness::Rest => self.learn(mean_rate, dt),
        }
    }

    /// Learns from the mean rate of a rest, rad/s.
    // Not inlined, because few samples are at rest.
    #[inline(never)]
    fn learn(&mut self, mean_rate: Vec3, dt: f32) {
        let limit = self.coefficients.limit;
        let is_beyond_limit = limit > 0.0 && !mean_rate.is_within(limit);
        self.excessive = if is_beyond_limit && self.learnt == 0.0 {
            (self.excessive + dt).lesser(REPORTED_AFTER)
        } else {
            0.0
        };
        if !mean_rate.is_within(BEYOND_LIMIT * limit) {
            return;
        }
        let gate = GATE + self.opening;
        // A rest at the rate of the last rest undoes everything that corrections have changed since.
        let since_rest = mean_rate - self.rested;
        if self.learnt > 0.0 && since_rest.dot(since_rest) < gate * gate {
            self.bias = self.rested;
        }
        let error = mean_rate - self.bias;
        let distance_squared = error.dot(error);
        let is_within_limit = mean_rate.is_within(limit);
        let contradicts = self.learnt > KNOWN_AFTER && distance_squared >= gate * gate;
        if contradicts || (self.learnt == 0.0 && !is_within_limit) {
            let least = if contradicts && is_within_limit && !self.bias.is_within(USUAL) {
                LEAST_CONTRADICTION_OF_UNUSUAL
            } else {
                LEAST_CONTRADICTION
            };
            self.contradicted += dt;
            if self.contradicted < (CONTRADICTION * self.known).greater(least) {
                return;
            }
            self.learnt = 0.0;
            self.known = 0.0;
        }
        self.contradicted = 0.0;
        self.learnt = (self.learnt + dt).lesser(self.coefficients.time_constant);
        self.known = (self.known + dt).lesser(LONGEST_KNOWN);
        self.bias += error * (dt / self.learnt);
        self.rested = self.bias;
        self.source = Source::Rest;
        self.error = Vec3::ZERO;
        self.has_rested_since_loss = true;
        self.unfollowed = 0.0;
        if distance_squared < GATE * GATE {
            self.opening = 0.0;
        }
    }

    /// Processes the rotation, rad, sensor frame, by which the inclination was corrected over the last `dt` seconds.
    /// `stands` tells whether the foot certainly stands, and has stood until its inclination settled.
    ///
    /// The mean of repeated corrections is the error of the bias. The bias follows it up to [`RestParams::bias_limit`]
    /// from the bias of the last rest.
    pub(crate) fn follow(&mut self, turn: Vec3, dt: f32, stands: bool) {
        if !turn.is_within(LARGEST_CORRECTION_RATE * dt) {
            return self.forget_corrections();
        }
        // After hours a period is too small to change this number, which is negative by then.
        self.uncounted -= dt;
        if self.uncounted <= 0.0 {
            self.error += (turn + self.error * dt) * (-1.0 / CORRECTIONS_TIME_CONSTANT);
        }
        if self.error.dot(self.error) > CONTRADICTED * CONTRADICTED {
            self.source = Source::Corrections;
        }
        let is_found = self.has_rested_since_loss || self.uncounted <= 0.0;
        let share = match self.source {
            Source::Corrections => 1.0 / CORRECTIONS_TIME_CONSTANT,
            Source::Rest if stands && self.known < BRIEF_REST && is_found => {
                1.0 / STANDING_TIME_CONSTANT
            }
            Source::Rest => {
                self.unfollowed = 0.0;
                return;
            }
        };
        let limit = self.coefficients.limit;
        let shift = self.bias - turn * share - self.rested;
        let limited = |value: f32| value.greater(-limit).lesser(limit);
        self.bias = self.rested + Vec3::new(limited(shift.x), limited(shift.y), limited(shift.z));
        self.unfollowed = if limit > 0.0 && !shift.is_within(limit) {
            (self.unfollowed + dt).lesser(REPORTED_AFTER)
        } else {
            0.0
        };
    }

    /// Forgets the error so far, and ignores corrections for [`FOUND_AFTER`], while the inclination is found again.
    pub(crate) const fn forget_corrections(&mut self) {
        self.error = Vec3::ZERO;
        self.has_rested_since_loss = false;
        self.uncounted = FOUND_AFTER;
    }

    /// The rate to report, rad/s; `None` if there is none. It is `mean_rate` during a rest whose rate is too large to
    /// be learnt as a bias, or else the bias while corrections of the inclination lead beyond the limit.
    pub(crate) fn excess(&self, mean_rate: Vec3) -> Option<Vec3> {
        let rate = if self.excessive >= REPORTED_AFTER { mean_rate } else { self.bias };
        let seconds = self.excessive.greater(self.unfollowed);
        (seconds >= REPORTED_AFTER).then_some(rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rest::{LongRest, LongRestCoefficients};
    use crate::sample::{Continuity, Step};

    const DT: f32 = 0.001;
    const UP: Vec3 = Vec3::new(0.0, 0.0, 9.81);

    const CONTINUOUS: Step = Step { seconds: DT, continuity: Continuity::Continuous };

    /// Rest detection, and the bias estimator behind it.
    struct Foot {
        rest: LongRest,
        bias: BiasEstimator,
    }

    impl Foot {
        fn new(params: &RestParams) -> Self {
            Self {
                rest: LongRest::new(LongRestCoefficients::new(params)),
                bias: BiasEstimator::new(BiasCoefficients::new(params)),
            }
        }

        fn update(&mut self, force: Vec3, rate: Vec3, step: Step) {
            let stillness = self.rest.update(force, rate, step);
            self.bias.update(stillness, self.rest.mean_rate(), step.seconds);
        }

        /// In a walk.
        fn follow(&mut self, turn: Vec3, dt: f32) {
            self.bias.follow(turn, dt, false);
        }

        fn bias(&self) -> Vec3 {
            self.bias.bias()
        }

        fn excess(&self) -> Option<Vec3> {
            self.bias.excess(self.rest.mean_rate())
        }

        fn is_known(&self) -> bool {
            self.bias.is_known()
        }
    }

    fn foot() -> Foot {
        Foot::new(&RestParams::DEFAULT)
    }

    /// Feeds a constant rate about x, in °/s, for some seconds and returns the bias in °/s.
    fn feed(foot: &mut Foot, rate: f32, seconds: f32) -> f32 {
        for _ in 0..(seconds / DT) as u32 {
            foot.update(UP, Vec3::new(rate * DEGREE, 0.0, 0.0), CONTINUOUS);
        }
        foot.bias().x / DEGREE
    }

    fn assert_near(actual: f32, expected: f32, tolerance: f32) {
        assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected}");
    }

    #[test]
    fn bias_is_learnt_at_rest() {
        assert_near(feed(&mut foot(), 0.5, 10.0), 0.5, 0.01);
    }

    #[test]
    fn bias_is_not_learnt_before_the_rest_duration() {
        let mut foot = foot();
        assert_near(feed(&mut foot, 0.5, 0.49), 0.0, 0.0);
        jolt(&mut foot);
        assert_near(feed(&mut foot, 0.5, 1.4), 0.0, 0.0);
    }

    #[test]
    fn bias_is_known_after_half_a_second_of_initial_stillness() {
        let mut foot = foot();
        assert_near(feed(&mut foot, 5.0, 0.55), 5.0, 0.1);
    }

    /// Feeds 50 ms of a foot that is moved.
    fn jolt(foot: &mut Foot) {
        for _ in 0..50 {
            foot.update(UP * 1.5, Vec3::new(0.5 * DEGREE, 0.0, 0.0), CONTINUOUS);
        }
    }

    #[test]
    fn noise_of_a_rate_and_hum_of_a_motor_are_rest() {
        let mut foot = foot();
        jolt(&mut foot);
        for k in 0..10_000 {
            // The hum is at 90 Hz, and the rate jumps by eight degrees a second from sample to sample.
            let hum = 0.7 * libm::sinf(565.5 * k as f32 * DT);
            let noise = [4.0, -4.0][k % 2];
            let rate = Vec3::new((1.5 + noise) * DEGREE, 0.0, 0.0);
            foot.update(UP + Vec3::new(0.0, hum, 0.0), rate, CONTINUOUS);
        }
        assert!(foot.is_known());
        assert_near(foot.bias().x / DEGREE, 1.5, 0.02);
    }

    #[test]
    fn gaps_take_their_time_from_a_rest() {
        let rested = |gap_seconds: f32, continuity: Continuity| {
            let mut foot = foot();
            let gap = Step { seconds: gap_seconds, continuity };
            for _ in 0..10 {
                foot.update(UP, Vec3::new(0.5 * DEGREE, 0.0, 0.0), gap);
                feed(&mut foot, 0.5, 0.4);
            }
            foot.bias().x / DEGREE
        };
        assert_near(rested(0.1, Continuity::Gap), 0.5, 0.01);
        assert_near(rested(0.4, Continuity::Gap), 0.0, 0.0);
        assert_near(rested(0.001, Continuity::Interrupted), 0.0, 0.0);
    }

    #[test]
    fn bias_of_5_dps_is_accepted_at_the_first_rest() {
        assert_near(feed(&mut foot(), 5.0, 6.0), 5.0, 0.1);
    }

    #[test]
    fn rate_beyond_the_limit_is_a_bias_only_after_minutes() {
        let mut foot = foot();
        assert_near(feed(&mut foot, 8.0, 230.0), 0.0, 0.0);
        assert_near(feed(&mut foot, 8.0, 20.0), 8.0, 0.02);
        // The rate is now a bias like any other, and is followed.
        assert_near(feed(&mut foot, 8.1, 60.0), 8.1, 0.02);
    }

    #[test]
    fn rate_of_four_times_the_limit_is_never_a_bias() {
        assert_near(feed(&mut foot(), 25.0, 600.0), 0.0, 0.0);
    }

    #[test]
    fn rate_beyond_the_limit_is_reported_until_it_is_known() {
        for rate in [8.0, 15.0, 30.0, 100.0] {
            let mut foot = foot();
            feed(&mut foot, rate, 5.4);
            assert_eq!(foot.excess(), None, "{rate}");
            feed(&mut foot, rate, 0.2);
            let excess = foot.excess().expect("reported").x / DEGREE;
            assert_near(excess, rate, 0.01);
            feed(&mut foot, rate, 240.0);
            assert_eq!(foot.excess().is_none(), rate < 24.0, "{rate}");
            // The rate is not reported while the foot moves.
            jolt(&mut foot);
            assert_eq!(foot.excess(), None, "{rate}");
        }
    }

    #[test]
    fn bias_within_the_limit_is_not_reported_nor_a_later_turn() {
        let mut foot = foot();
        feed(&mut foot, 5.9, 60.0);
        assert_eq!(foot.excess(), None);
        feed(&mut foot, 30.0, 60.0);
        assert_eq!(foot.excess(), None);
        assert_near(foot.bias().x / DEGREE, 5.9, 0.02);
    }

    #[test]
    fn bias_is_not_estimated_with_a_limit_of_zero() {
        let params = RestParams { bias_limit: 0.0, ..RestParams::DEFAULT };
        let mut foot = Foot::new(&params);
        assert_near(feed(&mut foot, 0.5, 600.0), 0.0, 0.0);
        assert_eq!(foot.excess(), None);
    }

    #[test]
    fn turn_learnt_at_power_up_is_corrected_in_half_a_minute() {
        let mut foot = foot();
        feed(&mut foot, 4.5, 5.0);
        assert_near(feed(&mut foot, 0.5, 30.0), 0.5, 0.02);
    }

    #[test]
    fn unusual_bias_known_for_a_minute_outlasts_an_equal_turn() {
        let mut foot = foot();
        feed(&mut foot, 4.0, 60.0);
        assert_near(feed(&mut foot, 3.0, 60.0), 4.0, 0.05);
    }

    #[test]
    fn slow_steady_turn_of_minutes_is_not_learnt() {
        for turn in [0.7, 1.0, 1.5, -1.0] {
            let mut foot = foot();
            feed(&mut foot, 0.1, 20.0);
            assert_near(feed(&mut foot, 0.1 + turn, 220.0), 0.1, 0.05);
            // Every rest in between restarts the count.
            feed(&mut foot, 0.1, 5.0);
            assert_near(feed(&mut foot, 0.1 + turn, 220.0), 0.1, 0.05);
        }
    }

    #[test]
    fn known_bias_outlasts_a_turn_of_twice_its_rests() {
        let mut foot = foot();
        feed(&mut foot, 0.1, 900.0);
        assert_near(feed(&mut foot, 1.1, 1700.0), 0.1, 0.03);
        assert_near(feed(&mut foot, 1.1, 200.0), 1.1, 0.01);
    }

    #[test]
    fn turn_that_moves_gravity_never_counts_as_rest() {
        for turn in [0.25, 0.5, 1.0, 1.9] {
            let mut foot = foot();
            feed(&mut foot, 0.1, 20.0);
            for k in 0..600_000 {
                let angle = turn * DEGREE * k as f32 * DT;
                let force = Vec3::new(0.0, 9.81 * libm::sinf(angle), 9.81 * libm::cosf(angle));
                let rate = Vec3::new((0.1 + turn) * DEGREE, 0.0, 0.0);
                foot.update(force, rate, CONTINUOUS);
            }
            assert_near(foot.bias().x / DEGREE, 0.1, 0.05);
        }
    }

    #[test]
    fn slow_drift_with_temperature_is_followed() {
        let mut foot = foot();
        feed(&mut foot, 0.0, 10.0);
        let mut rate = 0.0;
        for _ in 0..600 {
            rate += 0.001;
            feed(&mut foot, rate, 1.0);
        }
        assert_near(foot.bias().x / DEGREE, rate, 0.02);
    }

    #[test]
    fn bias_learnt_in_a_turn_is_corrected_by_rest() {
        let mut foot = foot();
        feed(&mut foot, 1.5, 20.0);
        assert_near(feed(&mut foot, 0.0, 600.0), 0.0, 0.02);
    }

    #[test]
    fn bias_before_rest_follows_inclination_corrections() {
        let mut foot = foot();
        // Correction of the tilt that a bias of 2 °/s about x leaves in a millisecond. A tenth of it is taken for bias.
        let turn = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        (0..1_000).for_each(|_| foot.follow(turn, DT));
        assert_near(foot.bias().x / DEGREE, 0.2, 1.0e-3);
        assert!(!foot.is_known());
        (0..100_000).for_each(|_| foot.follow(turn, DT));
        assert_near(foot.bias().x / DEGREE, 6.0, 1.0e-3);
        (0..100_000).for_each(|_| foot.follow(-turn, DT));
        assert_near(foot.bias().x / DEGREE, -6.0, 1.0e-3);
    }

    #[test]
    fn corrections_beyond_the_limit_are_reported() {
        let mut foot = foot();
        feed(&mut foot, 8.0, 250.0);
        // The limit counts from the known bias of 8 °/s, and not from zero.
        let turn = Vec3::new(-20.0 * DEGREE * DT, 0.0, 0.0);
        (0..2_000).for_each(|_| foot.follow(turn, DT));
        assert_eq!(foot.excess(), None);
        (0..10_000).for_each(|_| foot.follow(turn, DT));
        let excess = foot.excess().expect("reported").x / DEGREE;
        assert_near(excess, 14.0, 0.03);
        foot.follow(-turn, DT);
        assert_eq!(foot.excess(), None);
    }

    #[test]
    fn rest_that_is_learnt_ends_the_report_of_corrections() {
        let mut foot = foot();
        feed(&mut foot, 0.1, 10.0);
        let turn = Vec3::new(-20.0 * DEGREE * DT, 0.0, 0.0);
        (0..12_000).for_each(|_| foot.follow(turn, DT));
        assert!(foot.excess().is_some());
        // A rest at the rate of the first rest, after which no corrections contradict the bias.
        jolt(&mut foot);
        assert_near(feed(&mut foot, 0.1, 6.0), 0.1, 0.03);
        (0..1_000).for_each(|_| foot.follow(Vec3::ZERO, DT));
        assert_eq!(foot.excess(), None);
    }

    #[test]
    fn rest_at_the_rate_of_the_one_before_undoes_what_followed() {
        let turn = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        // A rest at the followed bias keeps it; one that contradicts both is not learnt from.
        for (rate, expected) in [(0.1, 0.1), (1.4, 1.4), (4.1, 1.39)] {
            let mut foot = foot();
            feed(&mut foot, 0.1, 10.0);
            jolt(&mut foot);
            (0..10_000).for_each(|_| foot.follow(turn, DT));
            assert_near(foot.bias().x / DEGREE, 1.39, 0.01);
            feed(&mut foot, rate, 6.0);
            assert_near(foot.bias().x / DEGREE, expected, 0.03);
        }
    }

    #[test]
    fn corrections_that_hardly_contradict_a_rest_are_not_followed() {
        let mut foot = foot();
        feed(&mut foot, 0.1, 10.0);
        let turn = Vec3::new(-0.5 * DEGREE * DT, 0.0, 0.0);
        (0..600_000).for_each(|_| foot.follow(turn, DT));
        assert_near(foot.bias().x / DEGREE, 0.1, 0.01);
    }

    #[test]
    fn creep_in_a_brief_rest_is_corrected_while_the_foot_stands() {
        // The foot leans at 0.5 °/s while it seems to rest, and has no bias.
        for (rest, stands, expected) in [(0.8, true, 0.07), (0.8, false, 0.5), (3.0, true, 0.5)] {
            let mut foot = foot();
            feed(&mut foot, 0.5, rest);
            assert_near(foot.bias().x / DEGREE, 0.5, 0.01);
            // The corrections undo what a wrong bias turns.
            (0..4_000).for_each(|_| foot.bias.follow(foot.bias() * DT, DT, stands));
            assert_near(foot.bias().x / DEGREE, expected, 0.01);
        }
    }

    #[test]
    fn correction_that_finds_lost_inclination_moves_no_brief_rest() {
        let mut foot = foot();
        feed(&mut foot, 0.5, 0.8);
        foot.bias.forget_corrections();
        let error = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        (0..4_900).for_each(|_| foot.bias.follow(error, DT, true));
        assert_near(foot.bias().x / DEGREE, 0.5, 0.01);
        // Then the corrections show the bias again.
        (0..4_100).for_each(|_| foot.bias.follow(foot.bias() * DT, DT, true));
        assert_near(foot.bias().x / DEGREE, 0.07, 0.01);
    }

    #[test]
    fn rest_after_a_loss_of_the_inclination_has_found_it() {
        let mut foot = foot();
        foot.bias.forget_corrections();
        feed(&mut foot, 0.5, 0.8);
        (0..4_000).for_each(|_| foot.bias.follow(foot.bias() * DT, DT, true));
        assert_near(foot.bias().x / DEGREE, 0.07, 0.01);
    }

    #[test]
    fn report_of_corrections_in_a_stance_ends_with_it() {
        let mut foot = foot();
        feed(&mut foot, 0.0, 0.8);
        // The turn is too slow to contradict the rest, but lasts so long that it leads beyond the limit.
        let turn = Vec3::new(-0.58 * DEGREE * DT, 0.0, 0.0);
        (0..30_000).for_each(|_| foot.bias.follow(turn, DT, true));
        assert!(foot.excess().is_some());
        foot.follow(Vec3::ZERO, DT);
        assert_eq!(foot.excess(), None);
    }

    #[test]
    fn correction_that_finds_lost_inclination_is_no_bias() {
        let mut foot = foot();
        feed(&mut foot, 0.1, 10.0);
        let error = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        let half_a_turn = Vec3::new(180.0 * DEGREE, 0.0, 0.0);
        foot.follow(half_a_turn, DT);
        // For five seconds the corrections still find the inclination.
        (0..4_900).for_each(|_| foot.follow(error, DT));
        assert_near(foot.bias().x / DEGREE, 0.1, 0.01);
        (0..10_000).for_each(|_| foot.follow(error, DT));
        assert_near(foot.bias().x / DEGREE, 1.37, 0.01);
        // Nor does the bias change if it already follows corrections.
        foot.follow(half_a_turn, DT);
        assert_near(foot.bias().x / DEGREE, 1.37, 0.01);
    }

    #[test]
    fn known_bias_follows_with_its_time_constant() {
        let mut foot = foot();
        feed(&mut foot, 0.1, 10.0);
        // After one time constant of 4 s behind a mean of 0.5 s: 1 − (4/e − 0.5/e⁸)/3.5 of the way.
        let moved = feed(&mut foot, 0.3, RestParams::DEFAULT.bias_time_constant) - 0.1;
        assert_near(moved, 0.2 * 0.5796, 0.001);
    }

    #[test]
    fn bias_moved_by_half_a_degree_is_followed_in_the_next_rest() {
        for (minutes, expected) in [(0, 0.1), (11, 0.6)] {
            let mut foot = foot();
            feed(&mut foot, 0.1, 10.0);
            (0..minutes * 1_200).for_each(|_| jolt(&mut foot));
            assert_near(feed(&mut foot, 0.6, 25.0), expected, 0.03);
        }
    }
}
