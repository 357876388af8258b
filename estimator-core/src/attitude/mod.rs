//! Attitude: a complementary filter whose result allows gravity and gyro bias to be removed.
//!
//! The gyroscope carries the orientation from sample to sample (`attitude::strapdown`); the
//! accelerometer, low-passed in the almost inertial frame that this gives, pulls its inclination
//! towards gravity (`attitude::inclination`), with a weight that depends on how quiet the foot is
//! (`attitude::quietness`); and the gyro's bias is learnt while the foot is at rest ([`rest`]).
//! Heading is not observed: it starts at zero and drifts with the gyro.
//!
//! Requirements on a foot, and how they are met:
//!
//! * An impact must not tilt the estimate. Impacts are short and their integral is the change of
//!   velocity, which is bounded: so in motion all samples weigh the same and are averaged over
//!   seconds. Any selection among them would leave a bias.
//! * In a stance of a few tenths of a second the tilt must settle. So in quiet the filter's time
//!   runs up to [`AttitudeParams::quiet_gain`] times faster.
//! * Samples get lost. Across up to half a second the foot turns at the mean of the rates on both sides; doubt
//!   grows with the difference between them. After more than that, or a turn of a radian, up has to be found again.
//! * The first samples may be wrong, as a stale reading or an impact is. So the filter starts again with a sample that
//!   contradicts them.
//! * A clipped accelerometer sample says nothing and is never used; after clipping, the estimate
//!   is trusted less until it has settled again.
//!
//! Low-passing in the inertial frame is the idea of VQF (Laidig and Seel, *VQF: Highly accurate
//! IMU orientation estimation with bias estimation and magnetic disturbance rejection*, 2023).

mod gravity;
mod inclination;
mod params;
mod quietness;
pub mod rest;
mod strapdown;

use crate::order::Order;
use crate::sample::{AngularRate, ImuSample, Saturation, Timestamp, Validity};
use crate::step::{Continuity, Step};
use crate::units::STANDARD_GRAVITY;
use crate::vector::{Quaternion, Vec3};
use inclination::Inclination;
use quietness::Quietness;
use rest::BiasEstimator;
use strapdown::{Strapdown, Turn};

pub(crate) use params::AttitudeCoefficients;
pub use params::{AttitudeParams, GyroTiming};

/// Least length of the first sample's specific force, as a part of g: less is free fall and has
/// no direction.
const LEAST_FIRST_FORCE: f32 = 0.05 * STANDARD_GRAVITY;

/// Time after the first sample in which a sample may start the filter again, s: a foot that moves is no fault.
const LAST_BEGINNING: f32 = 0.3;

/// Least time between two steps in which the bias follows the corrections of the inclination, s.
const FOLLOWS_EVERY: f32 = 0.02;

/// Whether up is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Alignment {
    /// Not yet: hold still. A few samples of quiet are enough; without quiet it takes a second of averaging.
    #[default]
    Searching,
    /// The inclination has settled, and no gap has invalidated it since.
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
    /// Sum of the corrections of the inclination that the bias has yet to follow, rad, world frame.
    corrected: Vec3,
    /// Duration of these corrections, s.
    correcting: f32,
    /// Length of the newest correction, rad.
    newest: f32,
    alignment: Alignment,
    /// Time since the first sample of all, s, up to [`LAST_BEGINNING`].
    begun: f32,
}

impl AttitudeFilter {
    /// A filter without samples.
    pub(crate) fn with_coefficients(coefficients: AttitudeCoefficients) -> Self {
        Self {
            coefficients,
            previous: None,
            orientation: Quaternion::IDENTITY,
            strapdown: Strapdown::new(coefficients.gyro_delay),
            quietness: Quietness::new(coefficients.quietness),
            inclination: Inclination::new(coefficients.inclination),
            bias: BiasEstimator::new(coefficients.rest),
            corrected: Vec3::ZERO,
            correcting: 0.0,
            newest: 0.0,
            alignment: Alignment::Searching,
            begun: 0.0,
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
        if has_force && self.begun < LAST_BEGINNING && self.bias.is_contradicted(force) {
            *self = Self { begun: self.begun, ..Self::with_coefficients(self.coefficients) };
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
        self.begun = (self.begun + step.seconds).lesser(LAST_BEGINNING);

        let turn = self.strapdown.turn(rate, self.bias.bias(), step);
        let spread_squared = match turn {
            Turn::By(increment) => {
                self.orientation = self.orientation.multiply(increment.turn).renormalised();
                if step.continuity == Continuity::Gap {
                    self.inclination.doubt_guess();
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
            let correction = self.inclination.correct(force_world, noise, step.seconds);
            self.orientation = correction.apply(self.orientation);
            self.quietness.turn_frame(correction);
            self.newest = correction.vector().length();
            if self.alignment == Alignment::Aligned {
                let Vec3 { x, y, .. } = correction.vector();
                self.corrected.x += x;
                self.corrected.y += y;
                self.correcting += step.seconds;
            }
        }
        // The end of the range is nearer to the force of an impact than none.
        if self.alignment == Alignment::Aligned && step.continuity == Continuity::Continuous {
            self.bias.gravity.walk(force_world.z, step.seconds);
        }
        match self.inclination.has_settled() {
            true => self.alignment = Alignment::Aligned,
            false => self.bias.forget_corrections(),
        }
        self.bias.update(force, rate, step);
        if self.correcting >= FOLLOWS_EVERY {
            self.follow();
        }
    }

    /// Lets the bias follow the newest corrections of the inclination.
    fn follow(&mut self) {
        let turn = self.orientation.conjugate().rotate(self.corrected);
        self.bias.follow(turn, self.correcting);
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

    /// Angle by which the newest sample corrected up, rad.
    pub(crate) const fn newest_correction(&self) -> f32 {
        self.newest
    }

    /// Gravity as this accelerometer reads it at rest, m/s².
    pub(crate) const fn gravity(&self) -> f32 {
        self.bias.gravity.value()
    }

    /// The angular rate at rest, rad/s, that is too large to be learnt as a bias; `None` if there is
    /// no such rate.
    #[must_use]
    pub fn excess_bias(&self) -> Option<AngularRate> {
        self.bias.excess().map(AngularRate)
    }

    /// Length of the mean specific force of a rest that lasts, m/s²; `None` outside of one.
    #[must_use]
    pub fn force_at_rest(&self) -> Option<f32> {
        self.bias.force()
    }

    /// Estimated gyroscope bias, rad/s. Before the first rest, the part of it inferred from the
    /// corrections of the inclination.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;
    use crate::sample::SpecificForce;
    use crate::units::DEGREE;

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
    fn it_aligns_within_20_ms_of_quiet() {
        let mut filter = filter();
        let aligned = (0..1_000).position(|ms| {
            filter.update(&sample(ms, LEVEL, Validity::Valid));
            filter.alignment() == Alignment::Aligned
        });
        assert!(aligned.is_some_and(|ms| (1..20).contains(&ms)), "{aligned:?} ms");
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
    fn a_stale_or_invalid_sample_changes_nothing() {
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
    fn alignment_is_lost_in_a_gap_of_more_than_half_a_second() {
        let mut filter = settled();
        filter.update(&sample(1_400, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Aligned);
        filter.update(&sample(2_000, LEVEL, Validity::Valid));
        assert_eq!(filter.alignment(), Alignment::Searching);
        for ms in 2_001..2_201 {
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
        let mut filter = settled();
        for ms in 2_000..3_000 {
            filter.update(&sample(ms, -LEVEL, Validity::Valid));
        }
        assert!(tilt(&filter) > 179.0, "{}°", tilt(&filter));
    }

    #[test]
    fn a_few_periods_at_a_low_rate_are_not_a_gap() {
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
