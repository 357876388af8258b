//! Attitude: a complementary filter that finds up, so that gravity can be removed, and the gyroscope's bias.
//!
//! | step | here |
//! |---|---|
//! | The gyroscope carries the orientation from sample to sample. | `Strapdown` |
//! | Its bias is learnt at rest, and followed in a walk. | [`gyro_bias`](crate::gyro_bias) |
//! | The accelerometer, low-passed in the almost inertial frame that this gives, pulls the inclination towards gravity. | `Inclination` |
//! | A sample counts more the quieter the foot is. | [`Quietness`](crate::rest) |
//!
//! Heading is not observed: it starts at zero and drifts with the gyroscope.
//!
//! A foot puts these requirements on the filter:
//!
//! * An impact must not tilt the estimate. Impacts are short, and their integral is the change of velocity, which is
//!   bounded. So in motion all samples have the same weight and are averaged over seconds. Any selection among them
//!   would leave a bias.
//! * The tilt must settle in a stance of a few tenths of a second. So in quiet the filter's time runs up to
//!   [`AttitudeParams::quiet_gain`] times faster.
//! * Samples get lost. In a gap of up to a second the foot is assumed to turn at the mean of the rates on both sides, for
//!   a tenth of a second at most, and the doubt about up grows with the difference between the two rates. After a longer
//!   gap, or a turn of a radian, up has to be found again.
//! * The first samples may be wrong, as a stale reading or an impact is. So the filter restarts with a sample that
//!   contradicts them.
//! * A clipped accelerometer sample is never used, because the true force is unknown. After clipping, the estimate is
//!   trusted less until it has settled again.
//!
//! Low-passing in the inertial frame is the idea of VQF (Laidig and Seel, *VQF: Highly accurate IMU orientation
//! estimation with bias estimation and magnetic disturbance rejection*, 2023).

use crate::gyro_bias::{BiasCoefficients, BiasEstimator};
use crate::math::{Order, inverse_root, sqrt};
use crate::rest::{
    LongRest, LongRestCoefficients, Quietness, QuietnessCoefficients, RestParams, Stillness,
};
use crate::sample::{AngularRate, Continuity, ImuSample, Saturation, Step, Timestamp, Validity};
use crate::units::{DEGREE, STANDARD_GRAVITY};
use crate::vector::{Quaternion, Vec3};

/// Time within the sample period to which a gyroscope sample refers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GyroTiming {
    /// A sample is the mean over the sample period that ends with it, as from a sensor whose
    /// low-pass filter fits the rate. This is a delay of half a period.
    PeriodMean,
    /// A sample is the rate this many seconds before its timestamp: 0 for an ideal simulated
    /// gyroscope.
    Delay(f32),
}

/// Parameters of the attitude filter. Times are in seconds; the result does not depend on the sample rate.
///
/// The defaults serve every sensor, robot and rate. They were chosen on the six BROAD trials, the GO1 recordings and a
/// simulated foot together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeParams {
    /// Time to which a gyroscope sample refers.
    ///
    /// Default: the mean over a period, as behind a low-pass filter at a third of the rate.
    pub gyro_timing: GyroTiming,
    /// Time constant of the inclination correction while the foot moves, s.
    ///
    /// A smaller value follows a drifting gyroscope sooner and is tilted more by the forces of a stride. Default: 5 s;
    /// 4 to 6 s give the same. VQF uses 3 s, and has its corner at √2/3 rad/s where this filter has it at 2/5.
    pub motion_time_constant: f32,
    /// Factor by which the correction is faster while the foot is perfectly quiet.
    ///
    /// Default: 200, with which the tilt settles within a short stance. With 30 it is too slow for a foot on a
    /// mattress; 600 costs accuracy in the hand.
    pub quiet_gain: f32,
    /// Deviation of the acceleration from its mean over 40 ms that still counts as quiet, m/s².
    ///
    /// Default: 0.025 g, a dozen times the sensor's noise of 2 mg. With more, flat sliding passes for quiet.
    pub quiet_acceleration: f32,
    /// Angular rate that still counts as quiet, rad/s.
    ///
    /// Default: 3 °/s, above the trembling of a loaded leg and far below a swing.
    pub quiet_rate: f32,
    /// Rest detection and bias estimation.
    pub rest: RestParams,
}

impl Default for AttitudeParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl AttitudeParams {
    /// For every sensor, robot and rate; each field states its default and the reason.
    pub const DEFAULT: Self = Self {
        gyro_timing: GyroTiming::PeriodMean,
        motion_time_constant: 5.0,
        quiet_gain: 200.0,
        quiet_acceleration: 0.025 * STANDARD_GRAVITY,
        quiet_rate: 3.0 * DEGREE,
        rest: RestParams::DEFAULT,
    };
}

/// Whether up is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Alignment {
    /// Up is not known yet. A few samples of quiet are enough to find it; without quiet it takes a second of averaging.
    #[default]
    Searching,
    /// The inclination has settled, and no gap has invalidated it since.
    Aligned,
}

/// Longest time between samples, s, across which the gyroscope can be integrated for a foot that swings; three sample
/// periods at low rates. A longer time is a gap, across which the turn is a guess.
///
/// The table has the RMS of the tilt in the stances of simulated feet that lose 5 % of their samples in bursts. It grows
/// with the burst, because the rate changes meanwhile. It was measured once, and `host-tests/tests/attitude.rs` bounds
/// 10 and 20 ms:
///
/// | burst | walk | trot | run |
/// |---|---|---|---|
/// | none | 0.04° | 0.09° | 0.4° |
/// | 10 ms | 0.07° | 0.2° | 0.5° |
/// | 20 ms | 0.2° | 0.7° | 1.1° |
/// | 30 ms | 0.3° | 1.4° | 2.5° |
/// | 40 ms | 1.0° | 3.7° | 4.1° |
const LONGEST_STEP: f32 = 0.03;

/// Longest gap, s, across which the turn is guessed from the two samples on either side.
///
/// A leg swings back, so the guess is a fair one. If up had to be found again, P would be 0 for most of a second
/// after each gap.
const LONGEST_GUESS: f32 = 1.0;

/// Longest time for which a foot keeps turning in a gap, s.
///
/// A swing is over soon. Longer turns are wrong by more than no turn at all.
const LONGEST_TURN: f32 = 0.1;

/// Least length of the first sample's specific force, m/s². A shorter one is free fall and has no direction.
const LEAST_FIRST_FORCE: f32 = 0.05 * STANDARD_GRAVITY;

/// Time after the first sample in which the filter may restart, s. Later, a sample that contradicts those before it
/// just means motion.
const LAST_RESTART: f32 = 0.3;

/// Duration of stillness from the first sample on after which the mean force of this time is taken for up, s.
///
/// The ripple of a motor may shake a leg by 0.5 m/s² and more. Each sample then counts as one in motion, and the
/// inclination takes up to a second to settle. The mean over this time is off by less than 1° from 30 Hz on.
const STILL_FROM_THE_START: f32 = 0.15;

/// Least time between two steps in which the bias follows the corrections of the inclination, s. A step costs a
/// rotation of the frame, and the bias moves slowly.
const FOLLOWS_EVERY: f32 = 0.02;

/// Number of steps of [`FOLLOWS_EVERY`] in a stance, 0.2 s in all, after which a correction is that of a standing foot.
/// Earlier corrections find the inclination that was lost in the swing or in the hand, and show no bias.
const STOOD: u8 = 10;

/// Validated [`AttitudeParams`] in the form used by the filter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeCoefficients {
    /// Sample period, s.
    period: f32,
    /// Longest time between samples that is integrated over, s; see [`LONGEST_STEP`].
    longest_step: f32,
    /// Longest gap across which the turn is guessed, s; see [`LONGEST_GUESS`].
    longest_guess: f32,
    /// Delay of the gyroscope, s.
    gyro_delay: f32,
    inclination: InclinationCoefficients,
    quietness: QuietnessCoefficients,
    rest: LongRestCoefficients,
    bias: BiasCoefficients,
}

impl AttitudeCoefficients {
    /// Coefficients of checked parameters at a sample rate, Hz.
    pub fn new(params: &AttitudeParams, sample_rate: f32) -> Self {
        Self {
            period: 1.0 / sample_rate,
            longest_step: LONGEST_STEP.greater(3.5 / sample_rate),
            longest_guess: LONGEST_GUESS.greater(3.5 / sample_rate),
            gyro_delay: match params.gyro_timing {
                GyroTiming::PeriodMean => 0.5 / sample_rate,
                GyroTiming::Delay(delay) => delay,
            },
            inclination: InclinationCoefficients::new(params.motion_time_constant),
            quietness: QuietnessCoefficients::new(
                params.quiet_gain,
                params.quiet_acceleration,
                params.quiet_rate,
            ),
            rest: LongRestCoefficients::new(&params.rest),
            bias: BiasCoefficients::new(&params.rest),
        }
    }
}

/// Estimates orientation and gyro bias, sample by sample.
#[derive(Clone, Debug)]
pub struct AttitudeFilter {
    coefficients: AttitudeCoefficients,
    previous: Option<Timestamp>,
    orientation: Quaternion,
    strapdown: Strapdown,
    quietness: Quietness,
    inclination: Inclination,
    rest: LongRest,
    bias: BiasEstimator,
    gravity: GravityMagnitude,
    /// Sum of the corrections of the inclination that the bias has yet to follow, rad, world frame.
    corrected: Vec3,
    /// Duration of these corrections, s.
    correcting: f32,
    /// Length of the newest correction, rad.
    newest_correction: f32,
    /// Whether the foot certainly stands.
    stands: bool,
    /// Steps in which the bias followed the corrections since the foot stands, up to [`STOOD`].
    steps_stood: u8,
    alignment: Alignment,
    /// Time since the very first sample, s, up to [`LAST_RESTART`]. A restart keeps it.
    age: f32,
}

impl AttitudeFilter {
    /// A filter without samples.
    #[inline(never)] // Its temporary values leave the stack.
    pub(crate) fn new(coefficients: AttitudeCoefficients) -> Self {
        Self {
            coefficients,
            previous: None,
            orientation: Quaternion::IDENTITY,
            strapdown: Strapdown::new(coefficients.gyro_delay),
            quietness: Quietness::new(coefficients.quietness),
            inclination: Inclination::new(coefficients.inclination),
            rest: LongRest::new(coefficients.rest),
            bias: BiasEstimator::new(coefficients.bias),
            gravity: GravityMagnitude::STANDARD,
            corrected: Vec3::ZERO,
            correcting: 0.0,
            newest_correction: 0.0,
            stands: false,
            steps_stood: 0,
            alignment: Alignment::Searching,
            age: 0.0,
        }
    }

    /// Processes the next sample. An invalid or stale sample carries no information; the time until
    /// the next valid one is bridged with the rate measured then.
    pub fn update(&mut self, sample: &ImuSample) {
        self.update_checked(&ImuSample { validity: sample.checked_validity(), ..*sample });
    }

    /// Like [`Self::update`], for a sample whose values have been checked.
    pub(crate) fn update_checked(&mut self, sample: &ImuSample) {
        let saturation = match sample.validity {
            Validity::Valid => None,
            Validity::Saturated(saturation) => Some(saturation),
            Validity::Stale | Validity::Invalid => return,
        };
        let force = sample.specific_force.0;
        let rate = sample.angular_rate.0;
        let has_force = !saturation.is_some_and(Saturation::includes_accelerometer);
        if has_force && self.age < LAST_RESTART && self.rest.is_contradicted(force) {
            *self = Self { age: self.age, ..Self::new(self.coefficients) };
        }
        if self.previous.is_none() && !(has_force && self.start(force, rate)) {
            return;
        }
        let elapsed_us = self
            .previous
            .replace(sample.timestamp)
            .and_then(|previous| sample.timestamp.micros_since(previous))
            .filter(|elapsed| *elapsed > 0);
        let step = self.step(elapsed_us);
        self.age = (self.age + step.seconds).lesser(LAST_RESTART);

        let turn = self.strapdown.turn(rate, self.bias.bias(), step);
        let spread_squared = match turn {
            Turn::By(increment) => {
                self.orientation = self.orientation.multiply(increment.turn).renormalised();
                if step.continuity == Continuity::Gap {
                    self.inclination.doubt_guess(increment.spread_squared);
                }
                increment.spread_squared
            }
            Turn::Unknown => {
                self.alignment = Alignment::Searching;
                self.quietness.forget();
                self.inclination.lose();
                0.0
            }
        };
        let force_world = self.orientation.rotate(force);
        let rate_magnitude = (rate - self.bias.bias()).length();
        let noise = self.quietness.update(force_world, rate_magnitude, step.seconds);

        self.inclination.grow_doubt(rate_magnitude, saturation, spread_squared, step.seconds);
        if has_force {
            // The sample after a gap does not stand for the force in the gap.
            let seconds = step.seconds.lesser(self.coefficients.longest_step);
            let correction = self.inclination.correct(force_world, noise, seconds);
            self.orientation = correction.apply(self.orientation);
            self.quietness.turn_frame(correction.vector());
            self.newest_correction = correction.vector().length();
            if self.alignment == Alignment::Aligned {
                let Vec3 { x, y, .. } = correction.vector();
                self.corrected.x += x;
                self.corrected.y += y;
                self.correcting += step.seconds;
            }
        }
        // A clipped force counts here as well: the end of the range is closer to the force of an impact than 0 is.
        if self.alignment == Alignment::Aligned && step.continuity == Continuity::Continuous {
            self.gravity.observe_motion(force_world.z, step.seconds);
        }
        if self.inclination.has_settled() {
            self.alignment = Alignment::Aligned;
        } else {
            self.bias.forget_corrections();
        }
        let stillness = self.rest.update(force, rate, step);
        if let Some((force, seconds)) = self.rest.force_from_the_start() {
            self.gravity.observe_start(force.length());
            if seconds >= STILL_FROM_THE_START && self.alignment == Alignment::Searching {
                self.align_with(force);
            }
        }
        if stillness == Stillness::Rest {
            self.gravity.observe_rest(self.rest.mean_force().length(), step.seconds);
        }
        self.bias.update(stillness, self.rest.mean_rate(), step.seconds);
        if self.correcting >= FOLLOWS_EVERY {
            self.follow_corrections();
        }
    }

    /// Lets the bias follow the newest corrections of the inclination.
    fn follow_corrections(&mut self) {
        let turn = self.orientation.conjugate().rotate(self.corrected);
        self.steps_stood = if self.stands { (self.steps_stood + 1).min(STOOD) } else { 0 };
        self.bias.follow(turn, self.correcting, self.steps_stood == STOOD);
        self.corrected = Vec3::ZERO;
        self.correcting = 0.0;
    }

    /// Returns the time to integrate over: the nominal period for the first sample and if the
    /// clock stood still or was set back.
    fn step(&self, elapsed_us: Option<u64>) -> Step {
        let AttitudeCoefficients { period, longest_step, longest_guess, .. } = self.coefficients;
        // More than 32 bits of µs are a gap in any case; 64-bit arithmetic is a library call on a microcontroller.
        let short = |elapsed: u64| u32::try_from(elapsed).unwrap_or(u32::MAX);
        let seconds = elapsed_us.map_or(period, |elapsed| short(elapsed) as f32 * 1.0e-6);
        let (seconds, continuity) = if seconds <= longest_step {
            (seconds, Continuity::Continuous)
        } else if seconds <= longest_guess {
            (seconds, Continuity::Gap)
        } else {
            (period, Continuity::Interrupted)
        };
        Step { seconds, continuity }
    }

    /// Takes the first direction of up from one sample's force; returns whether the sample had one.
    fn start(&mut self, force: Vec3, rate: Vec3) -> bool {
        match Quaternion::from_up(force) {
            Some(orientation) if force.length() >= LEAST_FIRST_FORCE => {
                self.orientation = orientation;
                self.strapdown.start(rate);
                self.quietness.start(force.length());
                true
            }
            _ => false,
        }
    }

    /// Takes the direction of a mean force for up.
    fn align_with(&mut self, force: Vec3) {
        if let Some(orientation) = Quaternion::from_up(force) {
            self.orientation = orientation;
            self.inclination.restart();
            self.alignment = Alignment::Aligned;
        }
    }

    /// Returns whether up is known.
    #[must_use]
    pub const fn alignment(&self) -> Alignment {
        self.alignment
    }

    /// Orientation, sensor → world, at the newest sample.
    #[must_use]
    pub const fn orientation(&self) -> Quaternion {
        self.orientation
    }

    /// Angle by which the newest sample corrected up, rad.
    pub(crate) const fn newest_correction(&self) -> f32 {
        self.newest_correction
    }

    /// Records whether the foot certainly stands. Until the first call the filter assumes that it does not.
    pub(crate) const fn set_stands(&mut self, stands: bool) {
        self.stands = stands;
    }

    /// Length of gravity as this accelerometer reads it, m/s².
    pub(crate) const fn gravity(&self) -> f32 {
        self.gravity.value()
    }

    /// Angular rate, rad/s, that is not accepted as the bias. It is the rate of a rest that has not been accepted for five
    /// seconds, or else the bias once the corrections of a walk have led beyond its limit for as long. `None` if there is
    /// no such rate.
    #[must_use]
    pub fn excess_bias(&self) -> Option<AngularRate> {
        self.bias.excess(self.rest.mean_rate()).map(AngularRate)
    }

    /// Length of the mean specific force of a rest that lasts, m/s²; `None` outside of one.
    #[must_use]
    pub fn force_at_rest(&self) -> Option<f32> {
        self.rest.force_at_rest()
    }

    /// Length of the mean specific force, m/s², if no foot can have it: see
    /// [`ContactEstimator::implausible_force`](crate::ContactEstimator::implausible_force).
    #[must_use]
    pub fn implausible_force(&self) -> Option<f32> {
        self.rest.implausible_force()
    }

    /// Estimated gyroscope bias, rad/s. Before the first rest it is only the part that the
    /// corrections of the inclination show.
    #[must_use]
    pub const fn gyro_bias(&self) -> AngularRate {
        AngularRate(self.bias.bias())
    }

    /// Estimated gyroscope bias, rad/s; `None` before the first rest.
    #[must_use]
    pub fn known_bias(&self) -> Option<AngularRate> {
        self.bias.is_known().then(|| self.gyro_bias())
    }
}

/// Square of the largest rotation that is integrated within one step, rad². Beyond it the series does not hold, and at
/// such rates one sample does not determine the orientation.
const LARGEST_TURN_SQUARED: f32 = 1.0;

/// Rotation between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Turn {
    /// The sensor turned by this much, in its own frame.
    By(Increment),
    /// The rotation is unknown.
    Unknown,
}

/// A rotation and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Increment {
    /// Rotation from the sensor's axes at this sample to its axes at the previous sample.
    turn: Quaternion,
    /// Square of the difference between two turns, rad²: that of a rate that changed right after the previous sample, and
    /// that of a rate that changed right before this sample.
    spread_squared: f32,
}

/// Strapdown integration of the angular rate to a small rotation.
#[derive(Clone, Debug)]
struct Strapdown {
    /// Delay of the gyroscope, s.
    gyro_delay: f32,
    /// Rate of the previous sample, rad/s.
    previous_rate: Vec3,
}

impl Strapdown {
    const fn new(gyro_delay: f32) -> Self {
        Self { gyro_delay, previous_rate: Vec3::ZERO }
    }

    const fn start(&mut self, rate: Vec3) {
        self.previous_rate = rate;
    }

    /// Returns the rotation since the previous sample.
    ///
    /// Assumes that the rate is linear between samples, and that a sample is the rate at `gyro_delay` before its
    /// timestamp. This gives the trapezoidal rule shifted by the delay. With a delay of half a period it becomes the
    /// rectangle rule. Across a gap, the rate is integrated over at most [`LONGEST_TURN`].
    fn turn(&mut self, rate: Vec3, bias: Vec3, step: Step) -> Turn {
        let change = rate - self.previous_rate;
        self.previous_rate = rate;
        let seconds = match step.continuity {
            Continuity::Gap => step.seconds.lesser(LONGEST_TURN),
            Continuity::Continuous | Continuity::Interrupted => step.seconds,
        };
        let angle = (rate - bias) * seconds + change * (self.gyro_delay - 0.5 * seconds);
        if step.continuity == Continuity::Interrupted || angle.dot(angle) > LARGEST_TURN_SQUARED {
            return Turn::Unknown;
        }
        let spread = change * step.seconds;
        Turn::By(Increment {
            turn: Quaternion::from_small_rotation(angle),
            spread_squared: spread.dot(spread),
        })
    }
}

/// Time constant of the correction right after the start, s: the first second is a running mean.
const START_TIME_CONSTANT: f32 = 0.1;

/// Growth of doubt with the angular rate, s/rad, because the error of a gyroscope's scale grows with the rate.
const RATE_DOUBT: f32 = 0.1;

/// Time constant of the correction after clipped accelerometer samples, s.
const ACCELEROMETER_CLIPPED: f32 = 1.0;

/// Time for which the accelerometer must clip to have its full effect on the doubt, s.
///
/// Clipped samples are left out, so the mean of a stride lacks the force that stopped the foot. A runner's landing,
/// which clips for a few ms, must not pull the filter towards that mean. A foot that clips for longer has hit something
/// that its gyroscope may not have followed.
const ACCELEROMETER_CLIPPING_TIME: f32 = 0.2;

/// Growth of doubt with the square of the angle that a turn may be wrong by, 1/(s rad²).
///
/// It is small, since a moving foot has no force that could correct the angle. With 50 and samples lost in bursts of 10
/// ms, the forces of a run's landings once tilted the estimate by 7° instead of 0.5°.
const TURN_DOUBT: f32 = 1.0;

/// Time constant of the correction after a gap with [`TURN_GUESS_SPREAD`], s. The turn in it is a guess, but a better
/// one than the mean of a part of a stride.
const TURN_GUESSED: f32 = 1.0;

/// Angle, rad, from which a wrong turn in a gap has its full effect. A swinging leg reaches it after 0.1 to 0.2 s. A
/// foot that turns slowly must not reach it, because the doubt would let its acceleration pass for a tilt.
const TURN_GUESS_SPREAD: f32 = 1.0;

/// Time constant of the correction after clipped gyroscope samples or an unknown turn, s.
const TURN_UNKNOWN: f32 = 0.3;

/// Time for which the gyroscope must clip to have its full effect on the doubt, s. A single clipped sample does little.
const GYROSCOPE_CLIPPING_TIME: f32 = 0.02;

/// Largest correction within one step, rad.
const LARGEST_CORRECTION: f32 = 0.25;

/// Time constant of the correction, s, from which the inclination counts as settled, because the forces of a stride have
/// then been averaged. It exceeds [`ACCELEROMETER_CLIPPED`], so that clipping unsettles the inclination.
const SETTLED_TIME_CONSTANT: f32 = 1.1;

#[derive(Clone, Copy, Debug)]
struct InclinationCoefficients {
    /// Growth of doubt with time, 1/s².
    growth: f32,
}

impl InclinationCoefficients {
    fn new(motion_time_constant: f32) -> Self {
        Self { growth: 1.0 / (motion_time_constant * motion_time_constant) }
    }
}

/// Inclination correction: a low-pass of the specific force in the world frame, with a variable gain.
///
/// A second-order Butterworth low-pass runs in its own time, which passes faster the more a sample is worth. A scalar
/// Riccati equation weighs the doubt, which grows with time and turning, against the evidence of the sample. Position,
/// speed and gain of the low-pass are all in that time, so a change of gain leaves no momentum behind.
///
/// ```text
/// D ← D + (1 + 0.1 |ω|) dt/T²              doubt, 1/s; T: time constant in motion
/// e = D dt/noise;  D ← D/(1 + e)
/// k = 2e/(1 + e)                           step of the filter's own time
/// s ← (s + (F − L) k)/(1 + √2 k + k²)      F: force, L: low-passed force, world frame
/// L ← L + s k
/// ```
///
/// Then the world is turned so that L points up.
#[derive(Clone, Debug)]
struct Inclination {
    coefficients: InclinationCoefficients,
    /// Doubt about the inclination: 1 over the time constant of the correction, 1/s.
    doubt: f32,
    /// The low-passed specific force, world frame, m/s².
    force: Vec3,
    /// Rate of change of the low-passed force in the filter's own time, m/s².
    speed: Vec3,
}

impl Inclination {
    /// Low-passed force of a foot that does not accelerate.
    const UPRIGHT: Vec3 = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);

    const fn new(coefficients: InclinationCoefficients) -> Self {
        Self {
            coefficients,
            doubt: 1.0 / START_TIME_CONSTANT,
            force: Self::UPRIGHT,
            speed: Vec3::ZERO,
        }
    }

    /// Forgets the forces so far, because the world was turned upright by other means. The doubt stays.
    const fn restart(&mut self) {
        self.force = Self::UPRIGHT;
        self.speed = Vec3::ZERO;
    }

    /// Increases the doubt over a step of `dt` s, in which the foot's turn may be wrong by an angle whose
    /// square is `spread_squared`, rad².
    fn grow_doubt(
        &mut self,
        rate_magnitude: f32,
        saturation: Option<Saturation>,
        spread_squared: f32,
        dt: f32,
    ) {
        self.doubt += TURN_DOUBT * spread_squared;
        self.doubt += (1.0 + RATE_DOUBT * rate_magnitude) * dt * self.coefficients.growth;
        if saturation.is_some_and(Saturation::includes_accelerometer) {
            self.raise_towards(ACCELEROMETER_CLIPPED, dt / ACCELEROMETER_CLIPPING_TIME);
        }
        if saturation.is_some_and(Saturation::includes_gyroscope) {
            self.raise_towards(TURN_UNKNOWN, dt / GYROSCOPE_CLIPPING_TIME);
        }
        self.doubt = self.doubt.lesser(1.0 / START_TIME_CONSTANT);
    }

    /// Marks up as lost, so that it has to settle again.
    fn lose(&mut self) {
        self.raise_towards(TURN_UNKNOWN, 1.0);
    }

    /// Doubts up after a guessed turn that may be wrong by an angle whose square is `spread_squared`, rad².
    fn doubt_guess(&mut self, spread_squared: f32) {
        let share = sqrt(spread_squared) * (1.0 / TURN_GUESS_SPREAD);
        self.raise_towards(TURN_GUESSED, share.lesser(1.0));
    }

    /// Adds `share` of the doubt that belongs to `time_constant`, up to all of it.
    fn raise_towards(&mut self, time_constant: f32, share: f32) {
        let whole = 1.0 / time_constant;
        let raised = (self.doubt + share * whole).lesser(whole);
        self.doubt = self.doubt.greater(raised);
    }

    /// Processes the specific force of a sample with the relative `noise` and returns the
    /// correction that brings the low-passed force upright.
    fn correct(&mut self, force_world: Vec3, noise: f32, dt: f32) -> Correction {
        let evidence = self.doubt * dt / noise;
        self.doubt /= 1.0 + evidence;
        // One step of implicit Euler, stable at any gain.
        let step = 2.0 * evidence / (1.0 + evidence);
        let damping = 1.0 / (1.0 + core::f32::consts::SQRT_2 * step + step * step);
        self.speed = (self.speed + (force_world - self.force) * step) * damping;
        self.force += self.speed * step;

        let correction = Correction::upright(self.force);
        self.force = correction.turn(self.force);
        self.speed = correction.turn(self.speed);
        correction
    }

    /// Returns whether the inclination has settled.
    fn has_settled(&self) -> bool {
        self.doubt * SETTLED_TIME_CONSTANT <= 1.0
    }
}

/// Small rotation of the world frame about a horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Correction {
    /// Angle about world x, rad.
    x: f32,
    /// Angle about world y, rad.
    y: f32,
}

impl Correction {
    /// The rotation that takes `force` towards world z.
    fn upright(force: Vec3) -> Self {
        // The small number keeps the inverse of a vanishing force finite.
        let inverse = inverse_root(force.dot(force) + 1.0e-6);
        let (x, y) = (force.y * inverse, -force.x * inverse);
        let largest = x.abs().greater(y.abs());
        if force.z < 0.0 && largest < LARGEST_CORRECTION {
            // Upside down, where the sine of the tilt is small again, any axis leads out.
            return Self { x: LARGEST_CORRECTION, y: 0.0 };
        }
        let share = if largest > LARGEST_CORRECTION { LARGEST_CORRECTION / largest } else { 1.0 };
        Self { x: x * share, y: y * share }
    }

    /// Returns the orientation after the rotation of the world frame.
    fn apply(self, orientation: Quaternion) -> Quaternion {
        let (x, y) = (0.5 * self.x, 0.5 * self.y);
        let turn = Quaternion { w: 1.0 - 0.5 * (x * x + y * y), x, y, z: 0.0 };
        turn.multiply(orientation).renormalised()
    }

    /// The rotation as a vector, rad, world frame.
    const fn vector(self) -> Vec3 {
        Vec3::new(self.x, self.y, 0.0)
    }

    /// Returns a world-frame vector after the rotation, to first order.
    fn turn(self, vector: Vec3) -> Vec3 {
        vector.turned(self.vector())
    }
}

/// Length of gravity as the accelerometer reads it.
///
/// At rest, gravity is the length of the mean force. The same holds while the sensor has been still since its first
/// sample, because with an accelerometer that is off by 40 mg on each axis, a standing foot would otherwise seem to
/// accelerate by up to 0.7 m/s² for its first second. In motion before the first rest, gravity is the mean force along
/// up, since a foot that walks gains no speed on average. A NAO's accelerometer reads 8 % too little, so without this mean
/// the stances of a walk that begins before any rest would be missed.
#[derive(Clone, Copy, Debug)]
struct GravityMagnitude {
    /// m/s².
    value: f32,
    /// Whether it was observed at rest.
    at_rest: bool,
}

impl GravityMagnitude {
    /// Least and largest value, m/s². A NAO's accelerometer reads 9.06.
    const RANGE: (f32, f32) = (0.9 * STANDARD_GRAVITY, 1.1 * STANDARD_GRAVITY);

    /// Time constant at rest, s.
    const REST_TIME_CONSTANT: f32 = 0.2;

    /// Time constant before the first rest, s.
    const MOTION_TIME_CONSTANT: f32 = 5.0;

    /// The standard value, until a sample is observed.
    const STANDARD: Self = Self { value: STANDARD_GRAVITY, at_rest: false };

    /// m/s².
    const fn value(self) -> f32 {
        self.value
    }

    /// Takes the mean force of a sensor that has been still since its first sample, m/s². It has no effect after the
    /// first rest.
    fn observe_start(&mut self, force: f32) {
        if !self.at_rest {
            self.set(force);
        }
    }

    /// Processes the mean force of `dt` seconds of rest, m/s².
    fn observe_rest(&mut self, force: f32, dt: f32) {
        self.at_rest = true;
        self.approach(force, dt / (Self::REST_TIME_CONSTANT + dt));
    }

    /// Processes the force along up of `dt` seconds of motion, m/s². It has no effect after the first rest.
    fn observe_motion(&mut self, upward: f32, dt: f32) {
        if !self.at_rest {
            self.approach(upward, dt / Self::MOTION_TIME_CONSTANT);
        }
    }

    fn approach(&mut self, reading: f32, share: f32) {
        self.set(self.value + (reading - self.value) * share);
    }

    fn set(&mut self, value: f32) {
        let (least, largest) = Self::RANGE;
        self.value = value.greater(least).lesser(largest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::SpecificForce;

    const LEVEL: Vec3 = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);

    fn at_rate(sample_rate: f32) -> AttitudeFilter {
        AttitudeFilter::new(AttitudeCoefficients::new(&AttitudeParams::DEFAULT, sample_rate))
    }

    fn filter() -> AttitudeFilter {
        at_rate(1_000.0)
    }

    fn sample(ms: u64, force: Vec3, validity: Validity) -> ImuSample {
        ImuSample {
            timestamp: Timestamp::from_micros(ms * 1000),
            specific_force: SpecificForce(force),
            angular_rate: AngularRate(Vec3::ZERO),
            validity,
        }
    }

    /// A filter after one second at rest, level.
    fn settled() -> AttitudeFilter {
        let mut filter = filter();
        for ms in 0..1_000 {
            filter.update(&sample(ms, LEVEL, Validity::Valid));
        }
        assert_eq!(filter.alignment(), Alignment::Aligned);
        filter
    }

    /// Tilt of the estimate against level, degrees.
    fn tilt(filter: &AttitudeFilter) -> f32 {
        let up = filter.orientation().up();
        libm::atan2f(libm::hypotf(up.x, up.y), up.z) / DEGREE
    }

    #[test]
    fn filter_aligns_within_20_ms_of_quiet() {
        let mut filter = filter();
        let aligned = (0..1_000).position(|ms| {
            filter.update(&sample(ms, LEVEL, Validity::Valid));
            filter.alignment() == Alignment::Aligned
        });
        assert!(aligned.is_some_and(|ms| (1..20).contains(&ms)), "{aligned:?} ms");
    }

    /// A force along z of length `force`, m/s², with the ripple of a motor along x: up to 1.5 m/s², at 60 Hz and above.
    fn shaken(ms: u64, force: f32) -> Vec3 {
        let ripple = [0.5, -0.3, 1.5, -0.9, 0.2, -1.2, 0.4, -0.2];
        Vec3::new(ripple[ms as usize % ripple.len()], 0.0, force)
    }

    #[test]
    fn ripple_of_a_motor_delays_up_by_no_more_than_a_fifth_of_a_second() {
        let mut filter = filter();
        let known = (0..1_000).position(|ms| {
            filter.update(&sample(ms, shaken(ms, STANDARD_GRAVITY), Validity::Valid));
            filter.alignment() == Alignment::Aligned
        });
        assert!(known.is_some_and(|ms| ms < 200), "{known:?}");
        assert!(tilt(&filter) < 1.0, "{}", tilt(&filter));
    }

    #[test]
    fn still_sensor_knows_its_gravity_from_the_start() {
        for force in [9.1, 10.5] {
            let mut filter = filter();
            for ms in 0..20 {
                filter.update(&sample(ms, Vec3::new(0.0, 0.0, force), Validity::Valid));
                assert!((filter.gravity() - force).abs() < 1.0e-3, "{force}: {}", filter.gravity());
            }
        }
    }

    #[test]
    fn clipped_or_falling_first_sample_does_not_start_the_filter() {
        let clipped = Validity::Saturated(Saturation::Accelerometer);
        for (force, validity) in [
            (Vec3::new(100.0, 0.0, 0.0), clipped),
            (Vec3::new(0.4, 0.0, 0.0), Validity::Valid),
            (Vec3::ZERO, Validity::Valid),
        ] {
            let mut filter = filter();
            filter.update(&sample(0, force, validity));
            assert_eq!(filter.orientation(), Quaternion::IDENTITY);
            filter.update(&sample(1, Vec3::new(STANDARD_GRAVITY, 0.0, 0.0), Validity::Valid));
            assert!((tilt(&filter) - 90.0).abs() < 1.0, "{}", tilt(&filter));
        }
    }

    #[test]
    fn up_is_right_at_once_after_wrong_first_samples() {
        for wrong in [1, 3, 10] {
            let mut filter = filter();
            for ms in 0..=wrong {
                let force = if ms < wrong { Vec3::new(20.0, 0.0, -5.0) } else { LEVEL };
                filter.update(&sample(ms, force, Validity::Valid));
            }
            assert!(tilt(&filter) < 0.1, "{}° after {wrong}", tilt(&filter));
        }
    }

    #[test]
    fn stale_or_invalid_sample_changes_nothing() {
        for validity in [Validity::Stale, Validity::Invalid] {
            let mut filter = settled();
            let before = filter.orientation();
            filter.update(&sample(1_000, Vec3::new(50.0, 0.0, 0.0), validity));
            assert_eq!(filter.orientation(), before);
        }
    }

    #[test]
    fn implausible_force_of_a_valid_sample_is_ignored() {
        for x in [f32::NAN, f32::INFINITY, 1.0e6] {
            let mut filter = settled();
            let before = filter.orientation();
            filter.update(&sample(1_000, Vec3::new(x, 0.0, 0.0), Validity::Valid));
            assert_eq!(filter.orientation(), before, "{x}");
        }
    }

    #[test]
    fn clipped_force_is_never_used() {
        let push = Vec3::new(156.9, 0.0, 156.9);
        let clipped = Validity::Saturated(Saturation::Accelerometer);
        for (validity, expected) in [(clipped, true), (Validity::Valid, false)] {
            let mut filter = settled();
            let before = filter.orientation();
            filter.update(&sample(1_000, push, validity));
            assert_eq!(filter.orientation() == before, expected, "{validity:?}");
        }
    }

    #[test]
    fn alignment_is_lost_in_a_gap_of_more_than_a_second() {
        let mut filter = settled();
        filter.update(&sample(1_900, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Aligned);
        filter.update(&sample(3_000, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Searching);
        for ms in 3_001..3_201 {
            filter.update(&sample(ms, LEVEL, Validity::Valid));
        }
        assert_eq!(filter.alignment(), Alignment::Aligned);
    }

    /// Reading of a sensor that swings about x by half a radian and back in half a second.
    fn swinging(ms: u64) -> ImuSample {
        let speed = 4.0 * core::f32::consts::PI;
        let phase = speed * (ms - 1_000) as f32 * 1.0e-3;
        let angle = 0.25 * (1.0 - libm::cosf(phase));
        ImuSample {
            angular_rate: AngularRate(Vec3::new(0.25 * speed * libm::sinf(phase), 0.0, 0.0)),
            ..sample(
                ms,
                Vec3::new(0.0, libm::sinf(angle), libm::cosf(angle)) * STANDARD_GRAVITY,
                Validity::Valid,
            )
        }
    }

    /// Angle between the estimate of up and the reading of a sensor without linear acceleration, degrees.
    fn error(filter: &AttitudeFilter, sample: &ImuSample) -> f32 {
        let up = filter.orientation().up();
        let force = sample.specific_force.0;
        libm::atan2f(up.cross(force).length(), up.dot(force)) / DEGREE
    }

    #[test]
    fn up_is_kept_in_a_swing_with_half_of_its_samples_lost() {
        let mut filter = settled();
        for sample in (1_000..1_500).filter(|ms| ms % 20 < 10).map(swinging) {
            filter.update(&sample);
            assert_eq!(filter.alignment(), Alignment::Aligned);
            let error = error(&filter, &sample);
            assert!(error < 0.2, "{error}° at {:?}", sample.timestamp);
        }
    }

    #[test]
    fn turn_in_a_gap_is_guessed_from_the_rates_on_both_sides() {
        let mut filter = settled();
        for sample in (1_000..1_120).map(swinging) {
            filter.update(&sample);
        }
        let after = swinging(1_180);
        // The foot turned by 8°.
        assert!(error(&filter, &after) > 8.0);
        filter.update(&after);
        assert_eq!(filter.alignment(), Alignment::Aligned);
        assert!(error(&filter, &after) < 1.0, "{}°", error(&filter, &after));
    }

    #[test]
    fn repeated_timestamp_counts_as_one_period() {
        let mut filter = filter();
        for _ in 0..3_000 {
            filter.update(&sample(0, LEVEL, Validity::Valid));
        }
        assert_eq!(filter.alignment(), Alignment::Aligned);
        assert_eq!(filter.gyro_bias().0, Vec3::ZERO);
    }

    #[test]
    fn stance_of_a_fifth_of_a_second_corrects_a_brief_rest() {
        // A foot without bias leans at 0.5 °/s while it seems to rest. Then its body moves, and the foot stands for these
        // parts of each fifth of a second.
        for (stands_ms, expected) in [(200, 0.0), (160, 0.5)] {
            let mut filter = filter();
            for ms in 200..1_000 {
                let angular_rate = AngularRate(Vec3::new(0.5 * DEGREE, 0.0, 0.0));
                filter.update(&ImuSample { angular_rate, ..sample(ms, LEVEL, Validity::Valid) });
            }
            let bias = filter.gyro_bias().0.x / DEGREE;
            assert!((bias - 0.5).abs() < 0.02, "{bias} °/s");
            for ms in 1_000..31_000 {
                filter.update(&swinging(ms));
                filter.set_stands(ms % 200 < stands_ms);
            }
            let bias = filter.gyro_bias().0.x / DEGREE;
            assert!((bias - expected).abs() < 0.1, "{bias} °/s with {stands_ms} ms");
        }
    }

    #[test]
    fn gyro_bias_of_5_dps_is_removed_after_two_seconds_of_rest() {
        let bias = Vec3::new(5.0, 5.0, -5.0) * DEGREE;
        let mut filter = filter();
        for ms in 0..2_000 {
            filter.update(&ImuSample {
                angular_rate: AngularRate(bias),
                ..sample(ms, LEVEL, Validity::Valid)
            });
        }
        let error = (filter.gyro_bias().0 - bias).length() / DEGREE;
        assert!(error < 0.01, "{error} °/s");
        assert!(tilt(&filter) < 0.1, "{}°", tilt(&filter));
    }

    #[test]
    fn accelerometer_bias_of_0_3_does_not_prevent_alignment() {
        for bias in [0.3, -0.3] {
            let mut filter = filter();
            for ms in 0..200 {
                let force = LEVEL + Vec3::new(bias, bias, bias);
                filter.update(&sample(ms, force, Validity::Valid));
            }
            assert_eq!(filter.alignment(), Alignment::Aligned);
            // The angle whose tangent is 0.3·√2 / 9.8 is 2.5°.
            assert!((tilt(&filter) - 2.5).abs() < 0.1, "{}°", tilt(&filter));
        }
    }

    #[test]
    fn sensor_turned_over_in_a_gap_realigns_within_a_second() {
        // Across the first gap the turn is guessed.
        for after in [1_500, 2_500] {
            let mut filter = settled();
            for ms in after..after + 1_000 {
                filter.update(&sample(ms, -LEVEL, Validity::Valid));
            }
            assert!(tilt(&filter) > 179.0, "{}° after {after} ms", tilt(&filter));
        }
    }

    #[test]
    fn few_periods_at_a_low_rate_are_not_a_gap() {
        let mut filter = at_rate(20.0);
        for k in 0..100 {
            filter.update(&sample(50 * k, LEVEL, Validity::Valid));
        }
        filter.update(&sample(50 * 102, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Aligned);
    }

    const STEP: Step = Step { seconds: 0.001, continuity: Continuity::Continuous };

    #[test]
    fn constant_rate_turns_by_rate_less_bias_times_time() {
        let mut strapdown = Strapdown::new(0.0);
        strapdown.start(Vec3::new(0.0, 0.0, 2.0));
        let turn = strapdown.turn(Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.0, 0.0, 0.5), STEP);
        let Turn::By(increment) = turn else {
            panic!("{turn:?}");
        };
        // Half of 1.5 rad/s · 1 ms.
        assert!((increment.turn.z - 0.75e-3).abs() < 1e-9, "{increment:?}");
        assert_eq!(increment.spread_squared, 0.0);
    }

    #[test]
    fn delay_of_half_a_period_gives_the_rectangle_rule() {
        let mut strapdown = Strapdown::new(0.5e-3);
        strapdown.start(Vec3::ZERO);
        let turn = strapdown.turn(Vec3::new(1.0, 0.0, 0.0), Vec3::ZERO, STEP);
        let increment = Increment {
            turn: Quaternion::from_small_rotation(Vec3::new(1.0e-3, 0.0, 0.0)),
            spread_squared: 1.0e-3 * 1.0e-3,
        };
        assert_eq!(turn, Turn::By(increment));
    }

    #[test]
    fn turn_across_a_gap_uses_the_mean_of_both_rates() {
        let mut strapdown = Strapdown::new(0.0);
        strapdown.start(Vec3::new(1.0, 0.0, 0.0));
        let gap = Step { seconds: 0.05, continuity: Continuity::Gap };
        let turn = strapdown.turn(Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO, gap);
        let Turn::By(increment) = turn else {
            panic!("{turn:?}");
        };
        // Half of 2 rad/s · 50 ms.
        assert!((increment.turn.x - 0.05).abs() < 1e-4, "{increment:?}");
        assert!((increment.spread_squared - 0.01).abs() < 1e-6, "{increment:?}");
    }

    #[test]
    fn foot_turns_for_at_most_a_tenth_of_a_second_in_a_gap() {
        let mut strapdown = Strapdown::new(0.0);
        strapdown.start(Vec3::new(1.0, 0.0, 0.0));
        let gap = Step { seconds: 0.5, continuity: Continuity::Gap };
        let turn = strapdown.turn(Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO, gap);
        let Turn::By(increment) = turn else {
            panic!("{turn:?}");
        };
        // Half of 2 rad/s · 0.1 s.
        assert!((increment.turn.x - 0.1).abs() < 1e-3, "{increment:?}");
        assert!((increment.spread_squared - 1.0).abs() < 1e-6, "{increment:?}");
    }

    #[test]
    fn turn_is_unknown_after_interruption_or_impossible_rate() {
        let mut strapdown = Strapdown::new(0.0);
        let interruption = Step { seconds: 0.001, continuity: Continuity::Interrupted };
        assert_eq!(strapdown.turn(Vec3::ZERO, Vec3::ZERO, interruption), Turn::Unknown);
        let spin = Vec3::new(0.0, 999.0, 999.0);
        strapdown.start(spin);
        assert_eq!(strapdown.turn(spin, Vec3::ZERO, STEP), Turn::Unknown);
    }

    const DT: f32 = 0.001;

    fn inclination() -> Inclination {
        Inclination::new(InclinationCoefficients::new(5.0))
    }

    /// An inclination after a minute of level motion.
    fn inclination_in_motion() -> Inclination {
        let mut inclination = inclination();
        for _ in 0..60_000 {
            inclination.grow_doubt(0.0, None, 0.0, DT);
            inclination.correct(LEVEL, 1.0, DT);
        }
        inclination
    }

    /// Time constant, s, by which the next sample in motion would be followed: a force that is tilted by an angle is
    /// corrected by the angle times (2 dt / time constant)².
    fn time_constant(inclination: &Inclination) -> f32 {
        let tilt = 0.1;
        let force = LEVEL + Vec3::new(tilt * STANDARD_GRAVITY, 0.0, 0.0);
        let correction = inclination.clone().correct(force, 1.0, DT).vector().length();
        2.0 * DT * libm::sqrtf(tilt / correction)
    }

    fn assert_time_constant(inclination: &Inclination, expected: f32) {
        let found = time_constant(inclination);
        assert!((found / expected - 1.0).abs() < 0.03, "{found} s instead of {expected} s");
    }

    #[test]
    fn correction_turns_the_force_towards_up() {
        let tilted = Vec3::new(1.0, -0.5, 9.7);
        let turned = Correction::upright(tilted).turn(tilted);
        assert!(turned.x.abs() < 0.02 && turned.y.abs() < 0.02, "{turned:?}");
    }

    #[test]
    fn time_constant_in_steady_motion_is_the_configured_one() {
        assert_time_constant(&inclination_in_motion(), 5.0);
    }

    #[test]
    fn tilt_in_motion_decays_as_in_a_butterworth_filter() {
        let mut inclination = inclination_in_motion();
        let mut tilt = 0.1;
        let halved = (0..10_000).position(|_| {
            inclination.grow_doubt(0.0, None, 0.0, DT);
            let force = LEVEL + Vec3::new(tilt * STANDARD_GRAVITY, 0.0, 0.0);
            tilt -= inclination.correct(force, 1.0, DT).vector().length();
            tilt < 0.05
        });
        // A corner of 2/5 rad/s halves a step in 1.433 of its radians.
        let seconds = halved.expect("it decays") as f32 * DT;
        assert!((seconds - 1.433 * 5.0 / 2.0).abs() < 0.1, "{seconds} s");
    }

    #[test]
    fn clipping_shortens_the_time_constant_down_to_a_limit() {
        for (saturation, limit) in [(Saturation::Accelerometer, 1.0), (Saturation::Gyroscope, 0.3)]
        {
            let mut inclination = inclination_in_motion();
            for _ in 0..400 {
                inclination.grow_doubt(0.0, Some(saturation), 0.0, DT);
            }
            assert_time_constant(&inclination, limit);
        }
    }

    #[test]
    fn clipping_does_not_lengthen_the_time_constant_of_a_start() {
        let mut inclination = inclination();
        let before = time_constant(&inclination);
        inclination.grow_doubt(0.0, Some(Saturation::Both), 0.0, DT);
        assert_eq!(time_constant(&inclination), before);
    }

    #[test]
    fn uncertain_turn_shortens_the_time_constant() {
        let mut longer = time_constant(&inclination_in_motion());
        for spread_squared in [0.01, 0.04, 0.2] {
            let mut inclination = inclination_in_motion();
            inclination.grow_doubt(0.0, None, spread_squared, DT);
            let found = time_constant(&inclination);
            assert!(found < longer, "{found} s with {spread_squared} rad²");
            longer = found;
        }
    }

    #[test]
    fn guessed_turn_leaves_more_doubt_than_motion_and_less_than_unknown() {
        let [mut guessed, mut lost] = [inclination_in_motion(), inclination_in_motion()];
        guessed.doubt_guess(2.0 * 2.0);
        lost.lose();
        assert_time_constant(&guessed, 1.0);
        assert_time_constant(&lost, 0.3);
    }

    #[test]
    fn guessed_turn_of_a_foot_at_a_steady_rate_leaves_no_doubt() {
        let mut inclination = inclination_in_motion();
        inclination.doubt_guess(0.0);
        assert_time_constant(&inclination, 5.0);
        inclination.doubt_guess(0.5 * 0.5);
        assert_time_constant(&inclination, 1.0 / 0.7);
    }

    #[test]
    fn inclination_settles_in_quiet_or_after_a_second_of_motion() {
        let settled_after = |noise: f32| {
            let mut inclination = inclination();
            let samples = (0..3_000).position(|_| {
                inclination.correct(LEVEL, noise, DT);
                inclination.has_settled()
            });
            samples.expect("it settles")
        };
        let quiet = settled_after(1.0 / 200.0);
        assert!((1..20).contains(&quiet), "{quiet} ms");
        let moving = settled_after(1.0);
        assert!(moving > 990, "{moving} ms");
    }

    #[test]
    fn correction_turns_orientation_and_vectors_alike() {
        for (x, y) in [(0.1, 0.0), (0.0, -0.1), (0.15, 0.2)] {
            let up = Correction { x, y }.apply(Quaternion::IDENTITY).up();
            // World z, seen from a sensor that was turned by (x, y).
            assert!((up.y - libm::sinf(libm::hypotf(x, y)) * x / libm::hypotf(x, y)).abs() < 1e-3);
            assert!((up.x + libm::sinf(libm::hypotf(x, y)) * y / libm::hypotf(x, y)).abs() < 1e-3);
            assert!((up.length() - 1.0).abs() < 1e-4, "{up:?}");
        }
    }

    #[test]
    fn gravity_is_the_mean_force_of_a_walk_until_the_first_rest() {
        let mut gravity = GravityMagnitude::STANDARD;
        let walk = |gravity: &mut GravityMagnitude| {
            for k in 0..20_000 {
                let swing = 5.0 * libm::sinf(10.0 * k as f32 * DT);
                gravity.observe_motion(9.06 + swing, DT);
            }
            gravity.value()
        };
        assert!((walk(&mut gravity) - 9.06).abs() < 0.15);
        (0..4_000).for_each(|_| gravity.observe_rest(9.81, DT));
        assert!((gravity.value() - 9.81).abs() < 0.01);
        assert!((walk(&mut gravity) - 9.81).abs() < 0.01);
        (0..40_000).for_each(|_| gravity.observe_rest(8.0, DT));
        assert_eq!(gravity.value(), 0.9 * STANDARD_GRAVITY);
    }
}
