//! Which way is up: a complementary filter that lets gravity and gyro bias be taken out.
//!
//! The gyroscope carries the orientation from sample to sample (`attitude::strapdown`); the
//! accelerometer, low-passed in the almost inertial frame that this gives, pulls its inclination
//! towards gravity (`attitude::inclination`); how much a sample may pull depends on how quiet the foot is
//! (`attitude::quietness`); and the gyro's bias is learnt where the foot is at rest ([`crate::rest`]).
//! Heading is not observed: it starts at zero and drifts with the gyro.
//!
//! What matters on a foot, and what is done about it:
//!
//! * An impact must not tilt the estimate. Impacts are short and their integral is the change of
//!   velocity, which is bounded: so in motion all samples weigh the same and are averaged over
//!   seconds. Any selection among them would leave a bias.
//! * In a stance of a few tenths of a second the tilt must settle. So in quiet the filter's time
//!   runs up to [`AttitudeParams::quiet_gain`] times faster.
//! * A clipped accelerometer sample says nothing and is never used; after clipping, the estimate
//!   is trusted less until it has settled again.
//!
//! Low-passing in the inertial frame is the idea of VQF (Laidig and Seel, *VQF: Highly accurate
//! IMU orientation estimation with bias estimation and magnetic disturbance rejection*, 2023).

mod inclination;
mod quietness;
mod strapdown;

use crate::params::{DEGREE, ParamsError, STANDARD_GRAVITY, in_range};
use crate::rest::{BiasEstimator, RestCoefficients, RestParams};
use crate::sample::{AngularRate, ImuSample, Saturation, Timestamp, Validity};
use crate::vector::{Quaternion, Vec3};
use inclination::{Inclination, InclinationCoefficients};
use quietness::{Quietness, QuietnessCoefficients};
use strapdown::{Strapdown, Turn};

/// Time between samples, µs, from which on it is a gap: too long to integrate the gyroscope
/// across, for a foot that swings. At low rates it is three sample periods.
pub const SHORTEST_GAP_US: u64 = 10_000;

/// Least length of the first sample's specific force, as a part of g: less is free fall and has
/// no direction.
const LEAST_FIRST_FORCE: f32 = 0.05 * STANDARD_GRAVITY;

/// When, within the time between two samples, the gyroscope measured what a sample says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GyroTiming {
    /// A sample is the mean over the sample period that ends with it, as from a sensor whose
    /// low-pass filter fits the rate: half a period of delay.
    PeriodMean,
    /// A sample is the rate this many seconds before its timestamp; 0 to 0.05. 0 for an ideal
    /// simulated gyroscope.
    Delay(f32),
}

/// What can be set in the attitude filter. Times are in seconds; the result does not depend on
/// the sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeParams {
    /// When the gyroscope measured what a sample says.
    pub gyro_timing: GyroTiming,
    /// Time constant of the inclination correction while the foot moves, s; 0.1 to 100.
    pub motion_time_constant: f32,
    /// How many times faster the correction is where the foot is perfectly quiet; 1 to 10 000.
    pub quiet_gain: f32,
    /// Deviation of the acceleration from its short mean that still counts as quiet, m/s²;
    /// 0.001 to 10. A few times the sensor's noise.
    pub quiet_acceleration: f32,
    /// Angular rate that still counts as quiet, rad/s; 0.0001 to 1.
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
    /// The same for every sensor, robot and rate. Chosen on the six BROAD trials, the GO1
    /// recordings and a simulated foot together.
    ///
    /// | field | value | reason |
    /// |---|---|---|
    /// | `gyro_timing` | period mean | what a low-pass at a third of the rate makes of a gyroscope |
    /// | `motion_time_constant` | 5 s | 4 to 6 s give the same; VQF uses 3 s with √2/3 where this has 2/5 rad/s |
    /// | `quiet_gain` | 200 | tilt settles within a short stance; 30 is too slow for a foot on a mattress, 600 costs accuracy in the hand |
    /// | `quiet_acceleration` | 0.025 g | a dozen times the sensor's noise of 2 mg; more lets flat sliding pass for rest |
    /// | `quiet_rate` | 3 °/s | above what a loaded leg trembles, far below a swing |
    pub const DEFAULT: Self = Self {
        gyro_timing: GyroTiming::PeriodMean,
        motion_time_constant: 5.0,
        quiet_gain: 200.0,
        quiet_acceleration: 0.025 * STANDARD_GRAVITY,
        quiet_rate: 3.0 * DEGREE,
        rest: RestParams::DEFAULT,
    };

    pub(crate) fn validate(&self, sample_rate: f32) -> Result<AttitudeCoefficients, ParamsError> {
        in_range(
            "attitude.motion_time_constant",
            self.motion_time_constant,
            0.1,
            100.0,
        )?;
        in_range("attitude.quiet_gain", self.quiet_gain, 1.0, 1.0e4)?;
        in_range(
            "attitude.quiet_acceleration",
            self.quiet_acceleration,
            1.0e-3,
            10.0,
        )?;
        in_range("attitude.quiet_rate", self.quiet_rate, 1.0e-4, 1.0)?;
        let gyro_delay = match self.gyro_timing {
            GyroTiming::PeriodMean => 0.5 / sample_rate,
            GyroTiming::Delay(delay) => {
                in_range("attitude.gyro_timing", delay, 0.0, 0.05)?;
                delay
            }
        };
        Ok(AttitudeCoefficients {
            period: 1.0 / sample_rate,
            longest_step: (SHORTEST_GAP_US as f32 * 1.0e-6).max(3.5 / sample_rate),
            gyro_delay,
            inclination: InclinationCoefficients::new(self.motion_time_constant),
            quietness: QuietnessCoefficients::new(
                self.quiet_gain,
                self.quiet_acceleration,
                self.quiet_rate,
            ),
            rest: self.rest.validate()?,
        })
    }
}

/// Validated [`AttitudeParams`] in the form the filter computes with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeCoefficients {
    /// s.
    period: f32,
    /// s.
    longest_step: f32,
    /// s.
    gyro_delay: f32,
    inclination: InclinationCoefficients,
    quietness: QuietnessCoefficients,
    rest: RestCoefficients,
}

/// Whether up is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Alignment {
    /// Not yet: hold still. A fifth of a second of quiet is enough; without any, it takes some
    /// seconds of averaging.
    #[default]
    Searching,
    /// The inclination has settled, and has not been lost in a gap since.
    Aligned,
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
    bias: BiasEstimator,
    alignment: Alignment,
}

impl AttitudeFilter {
    /// A filter that has seen nothing yet.
    #[must_use]
    pub fn new<const CAPACITY: usize>(config: &crate::Config<CAPACITY>) -> Self {
        let coefficients = config.attitude;
        Self {
            coefficients,
            previous: None,
            orientation: Quaternion::IDENTITY,
            strapdown: Strapdown::new(coefficients.gyro_delay),
            quietness: Quietness::new(coefficients.quietness),
            inclination: Inclination::new(coefficients.inclination),
            bias: BiasEstimator::new(coefficients.rest),
            alignment: Alignment::Searching,
        }
    }

    /// Takes in the next sample. One that is invalid or stale says nothing, and the time until
    /// the next good one is bridged with the rate measured then.
    pub fn update(&mut self, sample: &ImuSample) {
        let saturation = match sample.checked_validity() {
            Validity::Valid => None,
            Validity::Saturated(saturation) => Some(saturation),
            Validity::Stale | Validity::Invalid => return,
        };
        let force = sample.specific_force.0;
        let rate = sample.angular_rate.0;
        if self.previous.is_none() && !self.start(force, rate, saturation) {
            return;
        }
        let elapsed_us = self
            .previous
            .replace(sample.timestamp)
            .and_then(|previous| sample.timestamp.micros_since(previous));
        let step = self.step(elapsed_us);

        let turn = self.strapdown.turn(rate, self.bias.bias(), step);
        match turn {
            Turn::By(increment) => {
                self.orientation = self.orientation.multiply(increment).renormalised();
            }
            Turn::Unknown => {
                self.alignment = Alignment::Searching;
                self.quietness.forget();
            }
        }
        let force_world = self.orientation.rotate(force);
        let rate_magnitude = (rate - self.bias.bias()).length();
        let noise =
            self.quietness
                .update(force_world, force.length(), rate_magnitude, step.seconds);

        self.inclination
            .grow_doubt(rate_magnitude, saturation, turn, step.seconds);
        if !saturation.is_some_and(Saturation::includes_accelerometer) {
            let correction = self.inclination.correct(force_world, noise, step.seconds);
            self.orientation = correction.apply(self.orientation);
            self.quietness.turn_frame(correction);
        }
        if self.inclination.has_settled(step.seconds) {
            self.alignment = Alignment::Aligned;
        }
        self.bias.update(force, rate, step);
    }

    /// The time to integrate over. It is the nominal period for the first sample and where the
    /// clock was set back.
    fn step(&self, elapsed_us: Option<u64>) -> Step {
        let AttitudeCoefficients {
            period,
            longest_step,
            ..
        } = self.coefficients;
        // More than 32 bits of µs are a gap, however much more. They take a microcontroller a call.
        let short = |elapsed: u64| u32::try_from(elapsed).unwrap_or(u32::MAX);
        let seconds = elapsed_us.map_or(period, |elapsed| short(elapsed) as f32 * 1.0e-6);
        Step {
            seconds: seconds.min(longest_step),
            continuity: if seconds <= longest_step {
                Continuity::Continuous
            } else {
                Continuity::Gap
            },
        }
    }

    /// Takes the first direction of up from one sample's force; tells whether there was one.
    fn start(&mut self, force: Vec3, rate: Vec3, saturation: Option<Saturation>) -> bool {
        let usable = !saturation.is_some_and(Saturation::includes_accelerometer)
            && force.length() >= LEAST_FIRST_FORCE;
        match Quaternion::from_up(force) {
            Some(orientation) if usable => {
                self.orientation = orientation;
                self.strapdown.start(rate);
                self.quietness.start(force.length());
                self.bias.start(force, rate);
                true
            }
            _ => false,
        }
    }

    /// Whether up is known.
    #[must_use]
    pub const fn alignment(&self) -> Alignment {
        self.alignment
    }

    /// Orientation, sensor → world, at the newest sample.
    #[must_use]
    pub const fn orientation(&self) -> Quaternion {
        self.orientation
    }

    /// Estimated gyroscope bias, rad/s. Zero until the sensor has been at rest.
    #[must_use]
    pub const fn gyro_bias(&self) -> AngularRate {
        AngularRate(self.bias.bias())
    }
}

/// The time from one sample to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// Seconds; in a gap, the longest step that would not have been one.
    pub(crate) seconds: f32,
    pub(crate) continuity: Continuity,
}

/// Whether one sample followed the other closely enough to integrate between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuity {
    Continuous,
    Gap,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;
    use crate::sample::SpecificForce;

    const LEVEL: Vec3 = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);

    fn filter() -> AttitudeFilter {
        AttitudeFilter::new(&Params::DEFAULT.validate::<64>().expect("the preset"))
    }

    fn sample(ms: u64, force: Vec3, validity: Validity) -> ImuSample {
        ImuSample {
            timestamp: Timestamp::from_micros(ms * 1000),
            specific_force: SpecificForce(force),
            angular_rate: AngularRate(Vec3::ZERO),
            validity,
        }
    }

    /// A filter that has lain level for a second.
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
    fn it_aligns_within_a_fifth_of_a_second_of_quiet() {
        let mut filter = filter();
        let aligned = (0..1_000).position(|ms| {
            filter.update(&sample(ms, LEVEL, Validity::Valid));
            filter.alignment() == Alignment::Aligned
        });
        assert!(
            aligned.is_some_and(|ms| (50..200).contains(&ms)),
            "{aligned:?} ms"
        );
    }

    #[test]
    fn a_first_sample_that_is_clipped_or_falling_does_not_start_it() {
        let clipped = Validity::Saturated(Saturation::Accelerometer);
        for (force, validity) in [
            (Vec3::new(100.0, 0.0, 0.0), clipped),
            (Vec3::new(0.4, 0.0, 0.0), Validity::Valid),
            (Vec3::ZERO, Validity::Valid),
        ] {
            let mut filter = filter();
            filter.update(&sample(0, force, validity));
            assert_eq!(filter.orientation(), Quaternion::IDENTITY);
            filter.update(&sample(
                1,
                Vec3::new(STANDARD_GRAVITY, 0.0, 0.0),
                Validity::Valid,
            ));
            assert!((tilt(&filter) - 90.0).abs() < 1.0, "{}", tilt(&filter));
        }
    }

    #[test]
    fn a_stale_or_invalid_sample_changes_nothing() {
        for validity in [Validity::Stale, Validity::Invalid] {
            let mut filter = settled();
            let before = filter.orientation();
            filter.update(&sample(1_000, Vec3::new(50.0, 0.0, 0.0), validity));
            assert_eq!(filter.orientation(), before);
        }
    }

    #[test]
    fn a_clipped_force_is_never_used() {
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
    fn after_a_gap_up_has_to_be_found_again() {
        let mut filter = settled();
        filter.update(&sample(1_011, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Searching);
        for ms in 1_012..1_212 {
            filter.update(&sample(ms, LEVEL, Validity::Valid));
        }
        assert_eq!(filter.alignment(), Alignment::Aligned);
    }

    #[test]
    fn a_sensor_that_turned_over_in_a_gap_is_right_again_within_a_second() {
        let mut filter = settled();
        for ms in 2_000..3_000 {
            filter.update(&sample(ms, -LEVEL, Validity::Valid));
        }
        assert!(tilt(&filter) > 179.0, "{}°", tilt(&filter));
    }

    #[test]
    fn at_low_rates_a_few_periods_are_no_gap() {
        let params = Params {
            sample_rate: 20.0,
            window: crate::WindowLength::Samples(2),
            ..Params::DEFAULT
        };
        let mut filter = AttitudeFilter::new(&params.validate::<64>().expect("valid"));
        for k in 0..100 {
            filter.update(&sample(50 * k, LEVEL, Validity::Valid));
        }
        filter.update(&sample(50 * 102, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Aligned);
    }
}
