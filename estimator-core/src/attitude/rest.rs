//! Rest detection, and estimation of the gyroscope's bias at rest.
//!
//! Rest is the IMU being still; it is not contact. A gyroscope at rest shows its bias, but a
//! robot that turns slowly and steadily looks much the same. Three criteria distinguish them:
//!
//! * A turn about anything but the vertical moves gravity through the sensor, which rules out rest.
//! * Temperature moves a bias slowly and not far, so a known bias is followed only within a
//!   narrow gate, which opens as fast as temperature does and no further.
//! * A bias is present in every rest and a turn is not: a rate that contradicts the known bias must have
//!   been seen at rest for twice as long as the known bias itself.
//!
//! The remaining ambiguity is a steady turn about the vertical: one slower than the gate, and one that lasts
//! for minutes and twice as long as all rest before it. It costs heading, which is not observed
//! anyway, and not inclination.
//!
//! A foot that walks before its first rest, as after a dip of its supply, learns from the corrections
//! of its inclination: a bias needs repeated correction, an impact does not. Rest replaces that. Where the
//! corrections of a walk contradict the bias of the last rest, it is followed in the same way: a bias can move by more
//! than temperature moves it. Only a rest observes the part about the vertical.
//!
//! At the first rest after power-up no bias is known, and the rate of the gyroscope is accepted up
//! to [`RestParams::bias_limit`]. A larger rate is probably a turn, but one that stays the same for
//! minutes is accepted as a bias.
//!
//! A rate at rest that has not been accepted for five seconds is reported, whether it is
//! pending or too large to be accepted: the gyroscope is beyond its data sheet, or the
//! ground turns. So is a bias at the limit of what is followed in a walk.

use super::gravity::Gravity;
use crate::order::Order;
use crate::step::{Continuity, Step};
use crate::units::{DEGREE, STANDARD_GRAVITY};
use crate::vector::Vec3;

/// Time constant of the means that deviations are measured from, s.
const MEAN_TIME_CONSTANT: f32 = 0.5;

/// Time constant of the means whose deviations are measured, s: the noise of a sensor and the hum of a motor are no
/// motion of the foot.
const SHORT_TIME_CONSTANT: f32 = 0.025;

/// Time after a start in which a sample may contradict those before it, s: wrong samples are few.
const BEGINNING: f32 = 0.1;

/// Distance of its force from the mean of theirs, m/s².
const CONTRADICTING: f32 = 0.5 * STANDARD_GRAVITY;

/// Largest motion of gravity through the sensor in a rest, m/s²: 0.2°, as a turn of 0.2 °/s causes in
/// the last second of a rest's least duration. Far above the noise of the mean.
const LARGEST_SWAY: f32 = 0.03;

/// Largest distance from the known bias at which a rest is accepted at once, rad/s.
const GATE: f32 = 0.3 * DEGREE;

/// Growth of the gate, rad/s per s, since a rest last lay inside [`GATE`]: the drift of a
/// MEMS gyroscope's bias with temperature while a board warms up.
const GATE_GROWTH: f32 = 0.0005 * DEGREE;

/// Largest opening of the gate, rad/s: 30 °C at the LSM6DSOX's typical 0.01 °/s per °C.
const LARGEST_OPENING: f32 = 0.3 * DEGREE;

/// Factor by which a rest that contradicts the known bias must exceed the rest that the
/// known bias is based on, …
const CONTRADICTION: f32 = 2.0;

/// … its least duration, s: a bias that was learnt in a turn at power-up is corrected within
/// minutes of rest, …
const LEAST_CONTRADICTION: f32 = 240.0;

/// … and the longest rest that the known bias is credited with, s. An f32 can count up to twice
/// this value in steps of 0.1 ms.
const LONGEST_KNOWN: f32 = 900.0;

/// Largest usual bias per axis, rad/s: twice the LSM6DSOX's typical zero-rate
/// level.
const USUAL: f32 = 2.0 * DEGREE;

/// Least duration of a rest that contradicts an unusual bias, s, which may be a turn at power-up;
/// the rest must also be twice as long as the one that the bias is based on.
const LEAST_CONTRADICTION_OF_UNUSUAL: f32 = 20.0;

/// Largest multiple of the limit at which a rate is still accepted as a bias,
/// once it has been the same for as long as would contradict a known bias.
const BEYOND_LIMIT: f32 = 4.0;

/// Duration of a rate beyond the limit, without a known bias, until it is reported, s.
const REPORTED_AFTER: f32 = 5.0;

/// Duration of rest from which the bias is known, s.
const KNOWN_AFTER: f32 = 0.5;

/// Duration of stillness since the first sample that counts as rest, s: no stance begins
/// so. Until the bias is known it tilts the estimate of up, by a degree in half a second.
const REST_FROM_THE_START: f32 = 0.5;

/// Time constant, s, with which the bias follows the corrections of the inclination: twice that of the
/// corrections in motion, so that the two together do not oscillate.
const CORRECTIONS_TIME_CONSTANT: f32 = 10.0;

/// Mean rate of the corrections, rad/s, from which a bias known from a rest is followed on: as far as temperature opens
/// the gate.
const CONTRADICTED: f32 = GATE + LARGEST_OPENING;

/// Largest rate of a correction that can show a bias, rad/s: ten times the largest bias that is followed. A faster one
/// finds an inclination that was lost, as after turns that the gyroscope did not measure.
const LARGEST_CORRECTION_RATE: f32 = 60.0 * DEGREE;

/// Time after a loss of the inclination in which its corrections do not count, s: it has then been found again.
const FOUND_AFTER: f32 = 5.0;

/// Observation that the bias is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// The last rest.
    Rest,
    /// The corrections of the inclination, until the next rest.
    Corrections,
}

/// Parameters of rest detection and bias estimation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestParams {
    /// Duration of stillness that counts as rest, s. From the first sample on, half a second is enough.
    pub duration: f32,
    /// Largest deviation of the acceleration from its mean at rest, m/s².
    pub acceleration: f32,
    /// Largest deviation of the angular rate from its mean at rest, rad/s.
    pub rate: f32,
    /// Largest bias per axis that is accepted at the first rest, rad/s, and largest change of it that is followed in a
    /// walk; with 0 the bias is not estimated. Up to four times as much is accepted after four minutes of rest.
    pub bias_limit: f32,
    /// Time constant of the bias estimate at rest, s.
    pub bias_time_constant: f32,
}

impl Default for RestParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl RestParams {
    /// | field | value | reason |
    /// |---|---|---|
    /// | `duration` | 1.5 s | longer than a stance, so that walking never counts (as VQF); half a second is enough for a sensor that has not moved since the start |
    /// | `acceleration` | 0.5 m/s² | as VQF |
    /// | `rate` | 2 °/s | as VQF; thirty times the sensor's noise |
    /// | `bias_limit` | 6 °/s | the LSM6DSOX's typical zero-rate level of 1 °/s and 5 °/s more, which other parts may have |
    /// | `bias_time_constant` | 4 s | averages the noise to 0.002 °/s, follows temperature |
    pub const DEFAULT: Self = Self {
        duration: 1.5,
        acceleration: 0.5,
        rate: 2.0 * DEGREE,
        bias_limit: 6.0 * DEGREE,
        bias_time_constant: 4.0,
    };
}

/// Limits of stillness.
#[derive(Clone, Copy, Debug)]
struct Stillness {
    /// Largest deviation of the acceleration from its mean, squared, (m/s²)².
    acceleration_squared: f32,
    /// Largest deviation of the angular rate from its mean, squared, (rad/s)².
    rate_squared: f32,
}

/// Validated [`RestParams`] in the form used by the estimator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestCoefficients {
    duration: f32,
    stillness: Stillness,
    bias_limit: f32,
    bias_time_constant: f32,
}

impl RestCoefficients {
    /// Coefficients of checked parameters.
    pub const fn new(params: &RestParams) -> Self {
        Self {
            duration: params.duration,
            stillness: Stillness {
                acceleration_squared: params.acceleration * params.acceleration,
                rate_squared: params.rate * params.rate,
            },
            bias_limit: params.bias_limit,
            bias_time_constant: params.bias_time_constant,
        }
    }
}

/// Detects rest and learns the gyroscope's bias at rest only.
#[derive(Clone, Debug)]
pub(crate) struct BiasEstimator {
    coefficients: RestCoefficients,
    mean_force: Vec3,
    mean_rate: Vec3,
    /// Means over [`SHORT_TIME_CONSTANT`].
    short_force: Vec3,
    short_rate: Vec3,
    /// Time since the first sample, s, up to [`BEGINNING`].
    age: f32,
    /// The mean force when this stillness began and the mean had settled.
    first_force: Vec3,
    /// Duration of stillness so far, s.
    still: f32,
    /// Duration of rest that the bias is based on, s, up to the time constant: length of the mean.
    learnt: f32,
    /// Duration of rest that the bias is based on, s, up to [`LONGEST_KNOWN`]: a contradiction must
    /// last as long.
    known: f32,
    /// Duration of rest that has contradicted the bias since a rest last agreed with it, s.
    contradicted: f32,
    /// Current opening of the gate, rad/s.
    opening: f32,
    /// Duration of a rate beyond the limit in this rest while no bias is known, s.
    excessive: f32,
    /// Duration of corrections that lead beyond the largest followed bias, s.
    unfollowed: f32,
    bias: Vec3,
    /// The bias as the last rest has left it, rad/s.
    rested: Vec3,
    source: Source,
    /// Mean error of the bias by the corrections of the inclination, rad/s.
    error: Vec3,
    /// Time in which corrections still show no bias, s.
    uncounted: f32,
    pub(super) gravity: Gravity,
    /// Whether the sensor has moved since the first sample.
    has_moved: bool,
}

impl BiasEstimator {
    pub(crate) const fn new(coefficients: RestCoefficients) -> Self {
        Self {
            coefficients,
            mean_force: Vec3::ZERO,
            mean_rate: Vec3::ZERO,
            short_force: Vec3::ZERO,
            short_rate: Vec3::ZERO,
            age: 0.0,
            first_force: Vec3::ZERO,
            still: 0.0,
            learnt: 0.0,
            known: 0.0,
            contradicted: 0.0,
            opening: 0.0,
            excessive: 0.0,
            unfollowed: 0.0,
            bias: Vec3::ZERO,
            rested: Vec3::ZERO,
            source: Source::Corrections,
            error: Vec3::ZERO,
            uncounted: 0.0,
            gravity: Gravity::STANDARD,
            has_moved: false,
        }
    }

    /// Processes a sample: specific force in m/s² and angular rate in rad/s, sensor frame.
    pub(crate) fn update(&mut self, force: Vec3, rate: Vec3, step: Step) {
        let RestCoefficients { duration, stillness, .. } = self.coefficients;
        let dt = step.seconds;
        // All means begin as those of the samples so far, or vibration would leave its first value in the long ones.
        let begins = self.age < SHORT_TIME_CONSTANT;
        let gain = |time_constant: f32| dt / (if begins { self.age } else { time_constant } + dt);
        let (long, short) = (gain(MEAN_TIME_CONSTANT), gain(SHORT_TIME_CONSTANT));
        self.age = (self.age + dt).lesser(BEGINNING);
        self.mean_force += (force - self.mean_force) * long;
        self.mean_rate += (rate - self.mean_rate) * long;
        self.short_force += (force - self.short_force) * short;
        self.short_rate += (rate - self.short_rate) * short;
        let force_deviation = self.short_force - self.mean_force;
        let rate_deviation = self.short_rate - self.mean_rate;

        self.opening = (self.opening + GATE_GROWTH * dt).lesser(LARGEST_OPENING);
        let still = step.continuity != Continuity::Interrupted
            && force_deviation.dot(force_deviation) <= stillness.acceleration_squared
            && rate_deviation.dot(rate_deviation) <= stillness.rate_squared
            && !self.sways();
        if !still {
            self.has_moved = true;
            self.still = 0.0;
            self.excessive = 0.0;
            return;
        }
        if step.continuity == Continuity::Gap {
            // It tells nothing: a foot that walks has moved in it.
            self.still = (self.still - dt).greater(0.0);
            return;
        }
        self.still = (self.still + dt).lesser(duration);
        if self.still < MEAN_TIME_CONSTANT {
            self.first_force = self.mean_force;
        }
        let least = match self.has_moved {
            true => duration,
            false => duration.lesser(REST_FROM_THE_START),
        };
        if self.still >= least {
            self.gravity.rest(self.mean_force.length(), dt);
            self.learn(dt);
        }
    }

    /// Returns whether a force shows, soon enough, that the first samples were wrong.
    pub(crate) fn is_contradicted(&self, force: Vec3) -> bool {
        self.age < BEGINNING && (force - self.short_force).length() > CONTRADICTING
    }

    /// Returns whether gravity has moved through the sensor since the stillness began.
    fn sways(&self) -> bool {
        let sway = self.mean_force - self.first_force;
        // At the beginning the mean has yet to settle.
        self.still >= MEAN_TIME_CONSTANT && sway.dot(sway) > LARGEST_SWAY * LARGEST_SWAY
    }

    // Not inlined: few samples are at rest.
    #[inline(never)]
    fn learn(&mut self, dt: f32) {
        let limit = self.coefficients.bias_limit;
        let beyond = limit > 0.0 && !self.mean_rate.is_within(limit);
        self.excessive = if beyond && self.learnt == 0.0 {
            (self.excessive + dt).lesser(REPORTED_AFTER)
        } else {
            0.0
        };
        if !self.mean_rate.is_within(BEYOND_LIMIT * limit) {
            return;
        }
        let gate = GATE + self.opening;
        let since_rest = self.mean_rate - self.rested;
        if self.learnt > 0.0 && since_rest.dot(since_rest) < gate * gate {
            self.bias = self.rested;
        }
        let error = self.mean_rate - self.bias;
        let distance_squared = error.dot(error);
        let within_limit = self.mean_rate.is_within(self.coefficients.bias_limit);
        let contradicts = self.learnt > KNOWN_AFTER && distance_squared >= gate * gate;
        if contradicts || (self.learnt == 0.0 && !within_limit) {
            let least = if contradicts && within_limit && !self.bias.is_within(USUAL) {
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
        self.learnt = (self.learnt + dt).lesser(self.coefficients.bias_time_constant);
        self.known = (self.known + dt).lesser(LONGEST_KNOWN);
        self.bias += error * (dt / self.learnt);
        self.rested = self.bias;
        self.source = Source::Rest;
        self.error = Vec3::ZERO;
        if distance_squared < GATE * GATE {
            self.opening = 0.0;
        }
    }

    /// The rate at rest, rad/s, that is too large to be learnt as a bias, or the bias beyond which the
    /// corrections of the inclination still lead; `None` if there is neither.
    pub(crate) fn excess(&self) -> Option<Vec3> {
        let rate = match self.excessive >= REPORTED_AFTER {
            true => self.mean_rate,
            false => self.bias,
        };
        let seconds = self.excessive.greater(self.unfollowed);
        (seconds >= REPORTED_AFTER).then_some(rate)
    }

    /// Length of the mean specific force of a rest that lasts, m/s²; `None` outside of one.
    pub(crate) fn force(&self) -> Option<f32> {
        (self.still >= self.coefficients.duration).then(|| self.mean_force.length())
    }

    /// Returns whether the bias was observed at rest.
    pub(crate) fn is_known(&self) -> bool {
        self.learnt > 0.0
    }

    /// Processes the rotation, rad, sensor frame, by which the inclination was corrected over the last `dt`
    /// seconds. The mean of repeated corrections is the error of the bias; it is followed up to the largest accepted
    /// distance from the bias of the last rest.
    pub(crate) fn follow(&mut self, turn: Vec3, dt: f32) {
        if !turn.is_within(LARGEST_CORRECTION_RATE * dt) {
            return self.forget_corrections();
        }
        let step = turn * (-1.0 / CORRECTIONS_TIME_CONSTANT);
        // Ends where a period no longer takes from it, after hours.
        self.uncounted -= dt;
        if self.uncounted <= 0.0 {
            self.error += step - self.error * (dt / CORRECTIONS_TIME_CONSTANT);
        }
        if self.error.dot(self.error) > CONTRADICTED * CONTRADICTED {
            self.source = Source::Corrections;
        }
        if self.source == Source::Rest {
            return;
        }
        let limit = self.coefficients.bias_limit;
        let shift = self.bias + step - self.rested;
        let limited = |value: f32| value.greater(-limit).lesser(limit);
        self.bias = self.rested + Vec3::new(limited(shift.x), limited(shift.y), limited(shift.z));
        self.unfollowed = match limit > 0.0 && !shift.is_within(limit) {
            true => (self.unfollowed + dt).lesser(REPORTED_AFTER),
            false => 0.0,
        };
    }

    /// Forgets the error so far, and for [`FOUND_AFTER`] all that comes: the inclination has to be found again, and its
    /// corrections show no bias.
    pub(crate) const fn forget_corrections(&mut self) {
        self.error = Vec3::ZERO;
        self.uncounted = FOUND_AFTER;
    }

    /// The estimated bias, rad/s.
    pub(crate) const fn bias(&self) -> Vec3 {
        self.bias
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.001;
    const UP: Vec3 = Vec3::new(0.0, 0.0, 9.81);

    fn estimator() -> BiasEstimator {
        BiasEstimator::new(RestCoefficients::new(&RestParams::DEFAULT))
    }

    /// Feeds a constant rate about x, in °/s, for some seconds and returns the bias in °/s.
    fn feed(estimator: &mut BiasEstimator, rate: f32, seconds: f32) -> f32 {
        let step = Step { seconds: DT, continuity: Continuity::Continuous };
        for _ in 0..(seconds / DT) as u32 {
            estimator.update(UP, Vec3::new(rate * DEGREE, 0.0, 0.0), step);
        }
        estimator.bias().x / DEGREE
    }

    fn assert_near(actual: f32, expected: f32, tolerance: f32) {
        assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected}");
    }

    #[test]
    fn bias_is_learnt_at_rest() {
        assert_near(feed(&mut estimator(), 0.5, 10.0), 0.5, 0.01);
    }

    #[test]
    fn bias_is_not_learnt_before_the_rest_duration() {
        let mut estimator = estimator();
        assert_near(feed(&mut estimator, 0.5, 0.49), 0.0, 0.0);
        jolt(&mut estimator);
        assert_near(feed(&mut estimator, 0.5, 1.4), 0.0, 0.0);
    }

    #[test]
    fn bias_is_known_after_half_a_second_of_initial_stillness() {
        let mut estimator = estimator();
        assert_near(feed(&mut estimator, 5.0, 0.55), 5.0, 0.1);
    }

    /// Feeds 50 ms of a foot that is moved.
    fn jolt(estimator: &mut BiasEstimator) {
        let step = Step { seconds: DT, continuity: Continuity::Continuous };
        for _ in 0..50 {
            estimator.update(UP * 1.5, Vec3::new(0.5 * DEGREE, 0.0, 0.0), step);
        }
    }

    #[test]
    fn noise_of_a_rate_and_hum_of_a_motor_are_rest() {
        let mut estimator = estimator();
        let step = Step { seconds: DT, continuity: Continuity::Continuous };
        jolt(&mut estimator);
        for k in 0..10_000 {
            // At 90 Hz, and a rate that jumps by eight degrees a second from sample to sample.
            let hum = 0.7 * libm::sinf(565.5 * k as f32 * DT);
            let noise = [4.0, -4.0][k % 2];
            let rate = Vec3::new((1.5 + noise) * DEGREE, 0.0, 0.0);
            estimator.update(UP + Vec3::new(0.0, hum, 0.0), rate, step);
        }
        assert!(estimator.is_known());
        assert_near(estimator.bias().x / DEGREE, 1.5, 0.02);
    }

    #[test]
    fn gaps_take_their_time_from_a_rest() {
        let rested = |gap_seconds: f32, continuity: Continuity| {
            let mut estimator = estimator();
            let gap = Step { seconds: gap_seconds, continuity };
            for _ in 0..10 {
                estimator.update(UP, Vec3::new(0.5 * DEGREE, 0.0, 0.0), gap);
                feed(&mut estimator, 0.5, 0.4);
            }
            estimator.bias().x / DEGREE
        };
        assert_near(rested(0.1, Continuity::Gap), 0.5, 0.01);
        assert_near(rested(0.4, Continuity::Gap), 0.0, 0.0);
        assert_near(rested(0.001, Continuity::Interrupted), 0.0, 0.0);
    }

    #[test]
    fn bias_of_5_dps_is_accepted_at_the_first_rest() {
        assert_near(feed(&mut estimator(), 5.0, 6.0), 5.0, 0.1);
    }

    #[test]
    fn rate_beyond_the_limit_is_a_bias_only_after_minutes() {
        let mut estimator = estimator();
        assert_near(feed(&mut estimator, 8.0, 230.0), 0.0, 0.0);
        assert_near(feed(&mut estimator, 8.0, 20.0), 8.0, 0.02);
        // It is then a bias like any other.
        assert_near(feed(&mut estimator, 8.1, 60.0), 8.1, 0.02);
    }

    #[test]
    fn rate_of_four_times_the_limit_is_never_a_bias() {
        assert_near(feed(&mut estimator(), 25.0, 600.0), 0.0, 0.0);
    }

    #[test]
    fn rate_beyond_the_limit_is_reported_until_it_is_known() {
        for rate in [8.0, 15.0, 30.0, 100.0] {
            let mut estimator = estimator();
            feed(&mut estimator, rate, 5.4);
            assert_eq!(estimator.excess(), None, "{rate}");
            feed(&mut estimator, rate, 0.2);
            let excess = estimator.excess().expect("reported").x / DEGREE;
            assert_near(excess, rate, 0.01);
            feed(&mut estimator, rate, 240.0);
            assert_eq!(estimator.excess().is_none(), rate < 24.0, "{rate}");
            // It is not reported while the foot moves.
            jolt(&mut estimator);
            assert_eq!(estimator.excess(), None, "{rate}");
        }
    }

    #[test]
    fn bias_within_the_limit_and_later_turn_are_not_reported() {
        let mut estimator = estimator();
        feed(&mut estimator, 5.9, 60.0);
        assert_eq!(estimator.excess(), None);
        feed(&mut estimator, 30.0, 60.0);
        assert_eq!(estimator.excess(), None);
        assert_near(estimator.bias().x / DEGREE, 5.9, 0.02);
    }

    #[test]
    fn a_limit_of_zero_keeps_the_bias_from_being_estimated() {
        let params = RestParams { bias_limit: 0.0, ..RestParams::DEFAULT };
        let mut estimator = BiasEstimator::new(RestCoefficients::new(&params));
        assert_near(feed(&mut estimator, 0.5, 600.0), 0.0, 0.0);
        assert_eq!(estimator.excess(), None);
    }

    #[test]
    fn turn_learnt_at_power_up_is_corrected_in_half_a_minute() {
        let mut estimator = estimator();
        feed(&mut estimator, 4.5, 5.0);
        assert_near(feed(&mut estimator, 0.5, 30.0), 0.5, 0.02);
    }

    #[test]
    fn unusual_bias_known_for_a_minute_outlasts_an_equal_turn() {
        let mut estimator = estimator();
        feed(&mut estimator, 4.0, 60.0);
        assert_near(feed(&mut estimator, 3.0, 60.0), 4.0, 0.05);
    }

    #[test]
    fn a_slow_steady_turn_of_minutes_is_not_learnt() {
        for turn in [0.7, 1.0, 1.5, -1.0] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 20.0);
            assert_near(feed(&mut estimator, 0.1 + turn, 220.0), 0.1, 0.05);
            // Every rest in between restarts the count.
            feed(&mut estimator, 0.1, 5.0);
            assert_near(feed(&mut estimator, 0.1 + turn, 220.0), 0.1, 0.05);
        }
    }

    #[test]
    fn the_longer_a_bias_is_known_the_longer_a_turn_has_to_last() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.1, 900.0);
        assert_near(feed(&mut estimator, 1.1, 1700.0), 0.1, 0.03);
        assert_near(feed(&mut estimator, 1.1, 200.0), 1.1, 0.01);
    }

    #[test]
    fn turn_that_moves_gravity_never_counts_as_rest() {
        for turn in [0.25, 0.5, 1.0, 1.9] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 20.0);
            let step = Step { seconds: DT, continuity: Continuity::Continuous };
            for k in 0..600_000 {
                let angle = turn * DEGREE * k as f32 * DT;
                let force = Vec3::new(0.0, 9.81 * libm::sinf(angle), 9.81 * libm::cosf(angle));
                let rate = Vec3::new((0.1 + turn) * DEGREE, 0.0, 0.0);
                estimator.update(force, rate, step);
            }
            assert_near(estimator.bias().x / DEGREE, 0.1, 0.05);
        }
    }

    #[test]
    fn slow_drift_with_temperature_is_followed() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.0, 10.0);
        let mut rate = 0.0;
        for _ in 0..600 {
            rate += 0.001;
            feed(&mut estimator, rate, 1.0);
        }
        assert_near(estimator.bias().x / DEGREE, rate, 0.02);
    }

    #[test]
    fn bias_learnt_in_a_turn_is_corrected_by_rest() {
        let mut estimator = estimator();
        feed(&mut estimator, 1.5, 20.0);
        assert_near(feed(&mut estimator, 0.0, 600.0), 0.0, 0.02);
    }

    #[test]
    fn bias_before_rest_follows_inclination_corrections() {
        let mut estimator = estimator();
        // Tilt in a millisecond at a rate about x of 2 °/s, corrected by the opposite.
        let turn = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        (0..1_000).for_each(|_| estimator.follow(turn, DT));
        assert_near(estimator.bias().x / DEGREE, 2.0 / CORRECTIONS_TIME_CONSTANT, 1.0e-3);
        assert!(!estimator.is_known());
        (0..100_000).for_each(|_| estimator.follow(turn, DT));
        assert_near(estimator.bias().x / DEGREE, 6.0, 1.0e-3);
        (0..100_000).for_each(|_| estimator.follow(-turn, DT));
        assert_near(estimator.bias().x / DEGREE, -6.0, 1.0e-3);
    }

    #[test]
    fn corrections_beyond_the_limit_are_reported() {
        let mut estimator = estimator();
        feed(&mut estimator, 8.0, 250.0);
        // From a known bias, as far as the limit lies from zero.
        let turn = Vec3::new(-20.0 * DEGREE * DT, 0.0, 0.0);
        (0..2_000).for_each(|_| estimator.follow(turn, DT));
        assert_eq!(estimator.excess(), None);
        (0..10_000).for_each(|_| estimator.follow(turn, DT));
        let excess = estimator.excess().expect("reported").x / DEGREE;
        assert_near(excess, 14.0, 0.03);
        estimator.follow(-turn, DT);
        assert_eq!(estimator.excess(), None);
    }

    #[test]
    fn rest_at_the_rate_of_the_one_before_undoes_what_followed() {
        let turn = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        // A rest at the followed bias keeps it; one that contradicts both is not learnt from.
        for (rate, expected) in [(0.1, 0.1), (1.4, 1.4), (4.1, 1.39)] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 10.0);
            jolt(&mut estimator);
            (0..10_000).for_each(|_| estimator.follow(turn, DT));
            assert_near(estimator.bias().x / DEGREE, 1.39, 0.01);
            feed(&mut estimator, rate, 6.0);
            assert_near(estimator.bias().x / DEGREE, expected, 0.03);
        }
    }

    #[test]
    fn corrections_that_hardly_contradict_a_rest_are_not_followed() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.1, 10.0);
        let turn = Vec3::new(-0.5 * DEGREE * DT, 0.0, 0.0);
        (0..600_000).for_each(|_| estimator.follow(turn, DT));
        assert_near(estimator.bias().x / DEGREE, 0.1, 0.01);
    }

    #[test]
    fn correction_that_finds_lost_inclination_is_no_bias() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.1, 10.0);
        let error = Vec3::new(-2.0 * DEGREE * DT, 0.0, 0.0);
        let half_a_turn = Vec3::new(180.0 * DEGREE, 0.0, 0.0);
        estimator.follow(half_a_turn, DT);
        // What follows still finds the inclination, for five seconds.
        (0..4_900).for_each(|_| estimator.follow(error, DT));
        assert_near(estimator.bias().x / DEGREE, 0.1, 0.01);
        (0..10_000).for_each(|_| estimator.follow(error, DT));
        assert_near(estimator.bias().x / DEGREE, 1.37, 0.01);
        // Nor does a bias that is followed already take part of it.
        estimator.follow(half_a_turn, DT);
        assert_near(estimator.bias().x / DEGREE, 1.37, 0.01);
    }

    #[test]
    fn known_bias_follows_with_its_time_constant() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.1, 10.0);
        // After one time constant of 4 s behind a mean of 0.5 s: 1 − (4/e − 0.5/e⁸)/3.5 of the way.
        let moved = feed(&mut estimator, 0.3, RestParams::DEFAULT.bias_time_constant) - 0.1;
        assert_near(moved, 0.2 * 0.5796, 0.001);
    }

    #[test]
    fn bias_moved_by_half_a_degree_is_followed_in_the_next_rest() {
        for (minutes, expected) in [(0, 0.1), (11, 0.6)] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 10.0);
            (0..minutes * 1_200).for_each(|_| jolt(&mut estimator));
            assert_near(feed(&mut estimator, 0.6, 25.0), expected, 0.03);
        }
    }
}
