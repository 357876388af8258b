//! Rest detection: the IMU is still. Rest is not contact: a foot that hangs still or lies in a box is at rest as well.
//!
//! # One definition
//!
//! A foot rests while the means of its motion are small and do not change. x is the acceleration or the rate of turn:
//!
//! ```text
//! short = mean of x over tens of milliseconds        the noise of the sensor and the hum of a motor average out
//! long  = mean of x over the time that rest must last
//! rest: |short| and |short − long| are within their limits for the time that rest must last
//! ```
//!
//! `BriefRest` averages *short* once more, over the same time, before it subtracts *long*.
//!
//! Both conditions are needed. A sway accelerates least where it is fastest: |short| is small there, but it changes. A
//! foot that slides off at a steady acceleration does not change, but |short| is large.
//!
//! The estimator asks three questions about rest. The attitude filter asks the first two, and the self-calibrating
//! estimate the third:
//!
//! | type | question | signals | short, long | answer after | used for |
//! |---|---|---|---|---|---|
//! | `LongRest` | Has the foot rested for longer than most stances? | force, rate | 25 ms, 0.5 s | [`RestParams::duration`], 1.5 s | [gyroscope bias](crate::gyro_bias), gravity |
//! | `Quietness` | How much is this accelerometer sample worth? | force, rate | newest sample, 40 ms | a few samples | weight of the sample in the [inclination](crate::attitude) |
//! | `BriefRest` | Has the foot stood for a stance? | linear acceleration, rate | 26 ms, [`Constants::stance`] | 0.2 s | evidence of [stable contact](crate::self_calibrating) |
//!
//! Only `BriefRest` needs gravity and bias to be removed, and only it can require that |short| is small. The first two
//! serve to find them, and so compare the raw force and rate with their own means. Programs on a host judge a stretch of
//! samples as a whole; their limits are multiples of [`SENSOR_NOISE`], too.
//!
//! # Limits in units of the sensor's noise
//!
//! The mean over τ of samples with the standard deviation σ and the period dt has the standard deviation σ √(dt/2τ): 0.14
//! σ for 25 ms at 1 kHz, 0.03 σ for 0.5 s. With [`SENSOR_NOISE`]:
//!
//! | test | limit | its multiple of the statistic's standard deviation |
//! |---|---|---|
//! | `LongRest`, change of the mean | 0.5 m/s², 2 °/s | 180, 210 |
//! | `LongRest`, change of the long mean | 0.03 m/s² | 34 |
//! | `Quietness`, deviation of a sample | 0.245 m/s², 3 °/s | 12, 44 |
//! | `BriefRest`, mean | 0.2 m/s², 0.05 rad/s | 72, 300 |
//! | `BriefRest`, change of the mean | 0.12 m/s², 0.015 rad/s | 60, 130 |
//!
//! All are far beyond any level of significance: in a test of 20 s not even five times the noise ends a rest. Limits at
//! five standard deviations would call no robot at rest, since a leg under load trembles and its motors hum. What the
//! limits decide is which slow motions pass for rest. `docs/design/rest.md` has these, and the alternatives.

use core::ops::RangeInclusive;

use crate::constants::Constants;
use crate::math::Order;
use crate::sample::{Continuity, Step};
use crate::units::{DEGREE, STANDARD_GRAVITY};
use crate::vector::Vec3;

/// Noise of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation of the specific force along an axis, m/s².
    pub force: f32,
    /// Standard deviation of the angular rate about an axis, rad/s.
    pub rate: f32,
}

/// Noise of one sample of an LSM6DSOX at rest, behind its filters at 333 Hz: 2 mg and 0.07 °/s.
///
/// No estimate depends on it. It is the unit in which limits of rest are stated.
pub const SENSOR_NOISE: SensorNoise = SensorNoise { force: 0.02, rate: 0.0012 };

/// Largest motion of gravity through a sensor at rest, m/s². It corresponds to 0.2°, the effect of a turn of 0.2 °/s in
/// the last second of a rest, and is far above the noise of the mean.
pub const LARGEST_SWAY: f32 = 0.03;

/// Parameters of `LongRest` and of the bias estimation that follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestParams {
    /// Duration of stillness that counts as rest, s; half a second is enough for a sensor that has not moved since its
    /// first sample.
    ///
    /// It is longer than most stances, so that a walk hardly counts as rest. Default: 1.5 s, as VQF.
    pub duration: f32,
    /// Largest deviation of the mean specific force over 25 ms from that over 0.5 s at rest, m/s².
    ///
    /// Default: 0.5 m/s², as VQF.
    pub acceleration: f32,
    /// Largest deviation of the mean angular rate over 25 ms from that over 0.5 s at rest, rad/s.
    ///
    /// Default: 2 °/s, as VQF; thirty times the noise of an LSM6DSOX.
    pub rate: f32,
    /// Largest bias per axis that is accepted at the first rest, rad/s, and largest change of it that is followed in a
    /// walk. Up to four times as much is accepted after four minutes of rest. With 0 the bias is not estimated.
    ///
    /// Default: 6 °/s, the LSM6DSOX's typical zero-rate level of 1 °/s and 5 °/s more, which other parts may have.
    pub bias_limit: f32,
    /// Time constant of the bias estimate at rest, s.
    ///
    /// Default: 4 s, which averages the noise to 0.002 °/s and follows temperature.
    pub bias_time_constant: f32,
}

impl Default for RestParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl RestParams {
    /// For every sensor, robot and rate; each field states its default and the reason.
    pub const DEFAULT: Self = Self {
        duration: 1.5,
        acceleration: 0.5,
        rate: 2.0 * DEGREE,
        bias_limit: 6.0 * DEGREE,
        bias_time_constant: 4.0,
    };
}

/// Stillness of the sensor as of the newest sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stillness {
    /// The sensor moves, or may have moved since the previous sample.
    Moving,
    /// The sensor is still, but for less than a rest.
    Brief,
    /// The sensor has been still for long enough to be at rest.
    Rest,
}

/// [`LongRest`]'s part of [`RestParams`]. Limits are squared if they are compared with squares.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LongRestCoefficients {
    /// s.
    duration: f32,
    /// (m/s²)².
    acceleration_squared: f32,
    /// (rad/s)².
    rate_squared: f32,
}

impl LongRestCoefficients {
    /// Coefficients of checked parameters.
    pub const fn new(params: &RestParams) -> Self {
        Self {
            duration: params.duration,
            acceleration_squared: params.acceleration * params.acceleration,
            rate_squared: params.rate * params.rate,
        }
    }
}

/// Detects rest that lasts longer than most stances, from the raw force and rate.
///
/// The sensor is still while the means of force and rate over 25 ms stay near those over 0.5 s, and while gravity does
/// not move through the sensor. The last condition excludes every turn but one about the vertical.
#[derive(Clone, Debug)]
pub(crate) struct LongRest {
    coefficients: LongRestCoefficients,
    /// Means over [`Self::LONG_MEAN`], m/s² and rad/s.
    mean_force: Vec3,
    mean_rate: Vec3,
    /// Means over [`Self::SHORT_MEAN`].
    short_force: Vec3,
    short_rate: Vec3,
    /// Time since the first sample, s, up to [`Self::BEGINNING`].
    age: f32,
    /// Whether the sensor has moved since the first sample.
    has_moved: bool,
    /// Duration of stillness so far, s, up to [`RestParams::duration`].
    still: f32,
    /// Long mean of the force when this stillness had lasted for [`Self::LONG_MEAN`].
    first_force: Vec3,
}

impl LongRest {
    /// Time constant of the means that deviations are measured from, s.
    const LONG_MEAN: f32 = 0.5;

    /// Time constant of the means whose deviations are measured, s. Without it, noise of 0.01 rad/s or the hum of a
    /// motor keeps the bias from being learnt.
    const SHORT_MEAN: f32 = 0.025;

    /// Duration of stillness since the first sample that counts as rest, s. No stance begins with the first sample.
    /// Until the bias is known it tilts the estimate of up, by a degree in half a second.
    const FROM_THE_START: f32 = 0.5;

    /// Time after the first sample in which a sample may contradict the earlier ones, s.
    const BEGINNING: f32 = 0.1;

    /// Plausible lengths of the force at rest, m/s²: gravity, and the errors of an accelerometer. A larger error of its
    /// scale leaves the foot in doubt for good.
    const AT_REST: RangeInclusive<f32> = 0.88 * STANDARD_GRAVITY..=1.12 * STANDARD_GRAVITY;

    /// Plausible lengths of the mean over [`Self::LONG_MEAN`], m/s². The mean differs from gravity by the change of
    /// speed in that time, and leaves this range after a free fall of 0.9 s.
    const MEAN: RangeInclusive<f32> = 1.5..=60.0;

    /// Largest mean rate of a sensor that does not turn, rad/s: the zero-rate level of most gyroscopes.
    const LARGEST_ZERO_RATE: f32 = 6.0 * DEGREE;

    /// Distance of a force from the short mean that contradicts it, m/s².
    const CONTRADICTING: f32 = 0.5 * STANDARD_GRAVITY;

    pub(crate) const fn new(coefficients: LongRestCoefficients) -> Self {
        Self {
            coefficients,
            mean_force: Vec3::ZERO,
            mean_rate: Vec3::ZERO,
            short_force: Vec3::ZERO,
            short_rate: Vec3::ZERO,
            age: 0.0,
            has_moved: false,
            still: 0.0,
            first_force: Vec3::ZERO,
        }
    }

    /// Processes a sample: specific force in m/s² and angular rate in rad/s, sensor frame.
    pub(crate) fn update(&mut self, force: Vec3, rate: Vec3, step: Step) -> Stillness {
        let dt = step.seconds;
        // All means begin as plain means of the samples so far. Otherwise the first sample of a vibration would stay in
        // the long ones.
        let begins = self.age < Self::SHORT_MEAN;
        let gain = |time_constant: f32| dt / (if begins { self.age } else { time_constant } + dt);
        let (long, short) = (gain(Self::LONG_MEAN), gain(Self::SHORT_MEAN));
        self.age = (self.age + dt).lesser(Self::BEGINNING);
        self.mean_force += (force - self.mean_force) * long;
        self.mean_rate += (rate - self.mean_rate) * long;
        self.short_force += (force - self.short_force) * short;
        self.short_rate += (rate - self.short_rate) * short;
        let force_deviation = self.short_force - self.mean_force;
        let rate_deviation = self.short_rate - self.mean_rate;

        let is_still = step.continuity != Continuity::Interrupted
            && force_deviation.dot(force_deviation) <= self.coefficients.acceleration_squared
            && rate_deviation.dot(rate_deviation) <= self.coefficients.rate_squared
            && !self.sways();
        if !is_still {
            self.has_moved = true;
            self.still = 0.0;
            return Stillness::Moving;
        }
        if step.continuity == Continuity::Gap {
            // A foot that walks has moved in the gap, a foot that rests has not. So a gap takes its time from a rest,
            // but does not end it.
            self.still = (self.still - dt).greater(0.0);
            return Stillness::Brief;
        }
        self.still = (self.still + dt).lesser(self.coefficients.duration);
        if self.still < Self::LONG_MEAN {
            self.first_force = self.mean_force;
        }
        let least = if self.has_moved {
            self.coefficients.duration
        } else {
            self.coefficients.duration.lesser(Self::FROM_THE_START)
        };
        if self.still >= least { Stillness::Rest } else { Stillness::Brief }
    }

    /// Returns whether gravity has moved through the sensor since the stillness began.
    fn sways(&self) -> bool {
        let sway = self.mean_force - self.first_force;
        // The mean has to settle first.
        self.still >= Self::LONG_MEAN && sway.dot(sway) > LARGEST_SWAY * LARGEST_SWAY
    }

    /// Mean force, m/s², of a sensor that has been still since its first sample and does not turn, and the duration of
    /// that stillness, s; `None` once it has moved.
    pub(crate) fn force_from_the_start(&self) -> Option<(Vec3, f32)> {
        let rate = self.mean_rate;
        let is_still =
            !self.has_moved && rate.dot(rate) < Self::LARGEST_ZERO_RATE * Self::LARGEST_ZERO_RATE;
        is_still.then_some((self.mean_force, self.still))
    }

    /// Returns whether a force shows that the first samples were wrong, as a stale reading or an impact is.
    pub(crate) fn is_contradicted(&self, force: Vec3) -> bool {
        self.age < Self::BEGINNING && (force - self.short_force).length() > Self::CONTRADICTING
    }

    /// Mean specific force over half a second, m/s², sensor frame.
    pub(crate) const fn mean_force(&self) -> Vec3 {
        self.mean_force
    }

    /// Mean angular rate over half a second, rad/s, sensor frame.
    pub(crate) const fn mean_rate(&self) -> Vec3 {
        self.mean_rate
    }

    /// Length of the mean specific force, m/s², if no foot can have it.
    pub(crate) fn implausible_force(&self) -> Option<f32> {
        let force = self.mean_force.length();
        let at_rest = self.force_at_rest().is_some();
        let is_implausible = at_rest && !Self::AT_REST.contains(&force)
            || self.age >= Self::BEGINNING && !Self::MEAN.contains(&force);
        is_implausible.then_some(force)
    }

    /// Length of the mean specific force, m/s², once a rest has lasted for [`RestParams::duration`]; `None` otherwise.
    pub(crate) fn force_at_rest(&self) -> Option<f32> {
        (self.still >= self.coefficients.duration).then(|| self.mean_force.length())
    }
}

/// Coefficients of [`Quietness`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct QuietnessCoefficients {
    least_noise: f32,
    /// 1/(m/s²).
    inverse_acceleration: f32,
    /// s/rad.
    inverse_rate: f32,
}

impl QuietnessCoefficients {
    /// Coefficients of a gain in quiet, and of the deviation, m/s², and rate, rad/s, that still count as quiet.
    pub(crate) fn new(quiet_gain: f32, quiet_acceleration: f32, quiet_rate: f32) -> Self {
        Self {
            least_noise: 1.0 / quiet_gain,
            inverse_acceleration: 1.0 / quiet_acceleration,
            inverse_rate: 1.0 / quiet_rate,
        }
    }
}

/// Quietness of the foot, as the noise of an accelerometer sample that estimates up.
///
/// It is a weight and no decision. It follows an impact at once, and decays within a stance:
///
/// ```text
/// unrest = (deviation / quiet acceleration)² + (rate / quiet rate)²
/// noise  = min(1, (1 + unrest²) / quiet gain)
/// ```
#[derive(Clone, Debug)]
pub(crate) struct Quietness {
    coefficients: QuietnessCoefficients,
    /// Mean of the specific force over [`Self::MEAN_TIME_CONSTANT`], world frame, m/s².
    mean: Vec3,
    /// Envelope of the deviation from the mean, m/s².
    deviation: f32,
    /// Envelope of the angular rate, rad/s.
    rate: f32,
}

impl Quietness {
    /// Time constant of the mean that deviations are measured from, s. It is shorter than a stance, because from 0.1 s
    /// on, clipping of the gyroscope in the swing is not corrected in the stance.
    const MEAN_TIME_CONSTANT: f32 = 0.04;

    /// Time constant of the decay of both envelopes, s.
    const RELEASE_TIME_CONSTANT: f32 = 0.025;

    /// Largest deviation that counts, m/s²: an impact of 16 g decays as fast as one of half a g.
    const LARGEST_DEVIATION: f32 = 0.5 * STANDARD_GRAVITY;

    /// Largest angular rate that counts, rad/s.
    const LARGEST_RATE: f32 = 100.0 * DEGREE;

    /// A foot that is quiet until a sample shows otherwise.
    pub(crate) const fn new(coefficients: QuietnessCoefficients) -> Self {
        Self { coefficients, mean: Vec3::ZERO, deviation: 0.0, rate: 0.0 }
    }

    /// Starts the mean with a force of this length, m/s², that points up.
    pub(crate) const fn start(&mut self, force_magnitude: f32) {
        self.mean = Vec3::new(0.0, 0.0, force_magnitude);
    }

    /// Ends quiet after an unknown turn, like an impact.
    pub(crate) const fn forget(&mut self) {
        self.deviation = Self::LARGEST_DEVIATION;
        self.rate = Self::LARGEST_RATE;
    }

    /// Processes a sample and returns its noise relative to one in motion: 1 for all samples in motion, down to
    /// 1/`quiet_gain` in perfect quiet.
    pub(crate) fn update(&mut self, force_world: Vec3, rate_magnitude: f32, dt: f32) -> f32 {
        let difference = force_world - self.mean;
        let distance = difference.length();
        let mut mean_gain = dt / (Self::MEAN_TIME_CONSTANT + dt);
        if distance > Self::LARGEST_DEVIATION {
            // An impact moves the mean by a bounded amount.
            mean_gain *= Self::LARGEST_DEVIATION / distance;
        }
        self.mean += difference * mean_gain;

        // The envelopes rise at once and decay.
        let release = dt / (Self::RELEASE_TIME_CONSTANT + dt);
        let follow =
            |envelope: f32, newest: f32| newest.greater(envelope + release * (newest - envelope));
        self.deviation = follow(self.deviation, distance.lesser(Self::LARGEST_DEVIATION));
        self.rate = follow(self.rate, rate_magnitude.lesser(Self::LARGEST_RATE));

        let deviation = self.deviation * self.coefficients.inverse_acceleration;
        let rate = self.rate * self.coefficients.inverse_rate;
        let unrest = deviation * deviation + rate * rate;
        ((1.0 + unrest * unrest) * self.coefficients.least_noise).lesser(1.0)
    }

    /// Turns the mean with the world frame, by a small rotation vector, rad.
    pub(crate) fn turn_frame(&mut self, rotation: Vec3) {
        self.mean = self.mean.turned(rotation);
    }
}

/// Detects rest for the duration of a stance, from motion without gravity and bias.
///
/// The means of acceleration and rate must stay small, and must not change. A sway accelerates least where it is
/// fastest: its acceleration is small there, but it changes. Without the test for changes a pendulum of 4 m and 5° is
/// stable for 93 % of the time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BriefRest {
    /// m/s².
    acceleration: SteadyMean,
    /// rad/s.
    rate: SteadyMean,
    /// Time at rest less the time without rest, s, from 0 to [`Constants::stance`].
    seconds: f32,
}

impl BriefRest {
    /// No rest so far.
    pub const NONE: Self =
        Self { acceleration: SteadyMean::ZERO, rate: SteadyMean::ZERO, seconds: 0.0 };

    /// Processes linear acceleration, m/s², and angular rate, rad/s, that lasted for some seconds and have this share
    /// in a mean over a window. Returns whether the foot has rested for longer than a stance.
    pub fn push(
        &mut self,
        constants: &Constants,
        acceleration: Vec3,
        rate: Vec3,
        seconds: f32,
        share: f32,
    ) -> bool {
        let acceleration_change = self.acceleration.push(constants, acceleration, seconds, share);
        let rate_change = self.rate.push(constants, rate, seconds, share);
        let is_within = |value: Vec3, limit: f32| value.dot(value) < limit * limit;
        let is_at_rest = !self.is_accelerated(constants)
            && is_within(self.rate.newest, constants.turn_noise)
            && is_within(acceleration_change, constants.rest_acceleration_change)
            && is_within(rate_change, constants.rest_rate_change);
        if is_at_rest {
            self.seconds = (self.seconds + seconds).lesser(constants.stance);
        } else {
            self.pass(seconds);
        }
        self.seconds >= constants.stance
    }

    /// Returns whether the mean acceleration is too large for rest.
    pub fn is_accelerated(&self, constants: &Constants) -> bool {
        let (mean, limit) = (self.acceleration.newest, constants.rest_acceleration);
        mean.dot(mean) >= limit * limit
    }

    /// Length of the mean acceleration over a window, m/s²; at most 2.
    pub fn mean_acceleration(&self) -> f32 {
        self.acceleration.newest.length()
    }

    /// Returns whether the foot rises or sinks: along `up`, its mean acceleration over a stance is too large for rest.
    pub fn rises(&self, constants: &Constants, up: Vec3) -> bool {
        self.acceleration.usual.dot(up).abs() > constants.rest_acceleration
    }

    /// Subtracts a time in s without rest, or without a reliable sample. A gap of 30 ms each second must not end all
    /// rest.
    pub fn pass(&mut self, seconds: f32) {
        self.seconds = (self.seconds - seconds).greater(0.0);
    }
}

/// Means of a vector, frame of the foot, that show whether it is small and whether it changes.
#[derive(Clone, Copy, Debug)]
struct SteadyMean {
    /// Mean over a window.
    newest: Vec3,
    /// Mean over a window of `newest`.
    smooth: Vec3,
    /// Mean over a stance of `smooth`.
    usual: Vec3,
}

impl SteadyMean {
    /// Largest length that counts in the means, m/s² or rad/s, so that an impact decays soon.
    const LARGEST: f32 = 2.0;

    const ZERO: Self = Self { newest: Vec3::ZERO, smooth: Vec3::ZERO, usual: Vec3::ZERO };

    /// Processes a value. Returns the change of its mean within a stance.
    fn push(&mut self, constants: &Constants, value: Vec3, seconds: f32, share: f32) -> Vec3 {
        self.newest += (value.clipped(Self::LARGEST) - self.newest) * share;
        self.smooth += (self.newest - self.smooth) * share;
        let change = self.smooth - self.usual;
        self.usual += change * (seconds / (constants.stance + seconds));
        change
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.001;
    const UP: Vec3 = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);
    const CONTINUOUS: Step = Step { seconds: DT, continuity: Continuity::Continuous };

    fn long_rest() -> LongRest {
        LongRest::new(LongRestCoefficients::new(&RestParams::DEFAULT))
    }

    /// Seconds of stillness until `rest` is at rest, up to five.
    fn seconds_to_rest(rest: &mut LongRest) -> Option<f32> {
        (0..5_000)
            .position(|_| rest.update(UP, Vec3::ZERO, CONTINUOUS) == Stillness::Rest)
            .map(|samples| samples as f32 * DT)
    }

    #[test]
    fn half_a_second_from_the_start_is_a_long_rest() {
        let seconds = seconds_to_rest(&mut long_rest()).expect("rest");
        assert!((seconds - 0.5).abs() < 0.01, "{seconds} s");
    }

    #[test]
    fn long_rest_after_motion_needs_its_full_duration() {
        let mut rest = long_rest();
        seconds_to_rest(&mut rest);
        let jolt = (0..50).map(|_| rest.update(UP * 1.5, Vec3::ZERO, CONTINUOUS)).last();
        assert_eq!(jolt, Some(Stillness::Moving));
        let seconds = seconds_to_rest(&mut rest).expect("rest");
        // The mean has to settle after the jolt.
        assert!((1.5..4.0).contains(&seconds), "{seconds} s");
    }

    #[test]
    fn force_contradicts_the_first_samples_for_a_tenth_of_a_second() {
        let mut rest = long_rest();
        for ms in 0..200 {
            assert!(!rest.is_contradicted(UP) || ms == 0, "{ms} ms");
            if !(99..=101).contains(&ms) {
                assert_eq!(rest.is_contradicted(-UP), ms < 100, "{ms} ms");
            }
            rest.update(UP, Vec3::ZERO, CONTINUOUS);
        }
    }

    /// Milliseconds of an acceleration along x after which `rest` is or is not at rest, as `expected`.
    fn time_until(rest: &mut BriefRest, acceleration: f32, expected: bool) -> Option<usize> {
        let constants = Constants::DEFAULT;
        let share = DT / constants.window;
        let acceleration = Vec3::new(acceleration, 0.0, 0.0);
        (0..5_000)
            .position(|_| rest.push(&constants, acceleration, Vec3::ZERO, DT, share) == expected)
    }

    #[test]
    fn foot_has_rested_briefly_after_a_stance() {
        let mut rest = BriefRest::NONE;
        let stance = (Constants::DEFAULT.stance / DT) as usize;
        let rested = time_until(&mut rest, 0.0, true).expect("rest");
        assert!((stance - 1..=stance + 1).contains(&rested), "{rested} ms");
        let moved = time_until(&mut rest, 10.0, false).expect("motion");
        assert!(moved < 10, "{moved} ms");
        // A motion as short as this one takes only its own time from the rest.
        let again = time_until(&mut rest, 0.0, true).expect("rest");
        assert!(again < 10, "{again} ms");
    }

    #[test]
    fn steady_acceleration_above_the_limit_is_no_brief_rest() {
        let limit = Constants::DEFAULT.rest_acceleration;
        assert!(time_until(&mut { BriefRest::NONE }, 0.9 * limit, true).is_some());
        assert_eq!(time_until(&mut { BriefRest::NONE }, 1.1 * limit, true), None);
    }

    /// A generator of noise of five times [`SENSOR_NOISE`]: force in m/s², rate in rad/s.
    fn noise() -> impl FnMut() -> (Vec3, Vec3) {
        let mut state = 1_u32;
        let mut even = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0 - 0.5
        };
        // The sum of twelve evenly distributed numbers has a standard deviation of 1.
        let mut gaussian = move || (0..12).map(|_| even()).sum::<f32>();
        move || {
            let mut vector =
                |deviation: f32| Vec3::new(gaussian(), gaussian(), gaussian()) * (5.0 * deviation);
            (vector(SENSOR_NOISE.force), vector(SENSOR_NOISE.rate))
        }
    }

    #[test]
    fn five_times_the_noise_of_the_sensor_ends_no_rest() {
        let (constants, mut noise) = (Constants::DEFAULT, noise());
        let (mut brief, mut long) = (BriefRest::NONE, long_rest());
        for ms in 0..20_000 {
            let (force, rate) = noise();
            let has_rested = brief.push(&constants, force, rate, DT, DT / constants.window);
            assert!(has_rested || ms < 300, "{ms} ms");
            let stillness = long.update(UP + force, rate, CONTINUOUS);
            assert!(stillness == Stillness::Rest || ms < 600, "{ms} ms");
        }
    }

    fn quietness() -> Quietness {
        let mut quietness = Quietness::new(QuietnessCoefficients::new(200.0, 0.25, 3.0 * DEGREE));
        quietness.start(STANDARD_GRAVITY);
        quietness
    }

    /// Feeds a level foot at rest and returns the noise of the last sample.
    fn settle(quietness: &mut Quietness, seconds: f32) -> f32 {
        let steps = (seconds / DT) as u32;
        (0..steps).fold(1.0, |_, _| quietness.update(UP, 0.0, DT))
    }

    #[test]
    fn perfect_quiet_reaches_the_least_noise_within_a_stance() {
        let noise = settle(&mut quietness(), 0.25);
        assert!((noise * 200.0 - 1.0).abs() < 0.02, "{noise}");
    }

    #[test]
    fn first_sample_of_an_impact_has_little_weight() {
        let mut quietness = quietness();
        settle(&mut quietness, 1.0);
        let impact = Vec3::new(60.0, 0.0, 30.0);
        assert_eq!(quietness.update(impact, 0.0, DT), 1.0);
    }

    #[test]
    fn smoothly_turning_foot_is_not_quiet() {
        let mut quietness = quietness();
        settle(&mut quietness, 1.0);
        let noise = (0..200).fold(0.0, |_, _| quietness.update(UP, 0.5, DT));
        assert_eq!(noise, 1.0);
    }

    #[test]
    fn foot_is_as_quiet_after_a_hard_impact_as_after_a_light_one() {
        let noise_after = |force: f32| {
            let mut quietness = quietness();
            settle(&mut quietness, 1.0);
            quietness.update(UP + Vec3::new(force, 0.0, 0.0), 0.0, DT);
            settle(&mut quietness, 0.1)
        };
        let light = noise_after(0.5 * STANDARD_GRAVITY);
        assert!(light < 0.5, "{light}");
        for force in [STANDARD_GRAVITY, 156.0] {
            let hard = noise_after(force);
            assert!((hard / light - 1.0).abs() < 1.0e-4, "{hard} instead of {light}");
        }
    }
}
