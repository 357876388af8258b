//! The estimator: one sample in, one [`ContactEstimate`] out.

use crate::config::Config;
use crate::estimate::ContactEstimate;
use crate::flags::Flag;
use crate::learnt::Learnt;
use crate::phase::Load;
use crate::pipeline::{Motion, Pipeline};
use crate::sample::{AngularRate, ImuSample, Timestamp};
use crate::self_calibrating::{SelfCalibrating, Up};
use crate::stream::Stream;
use crate::velocity::VelocitySigma;

/// The contact estimator of one foot: attitude filter, model of stillness and decision.
#[derive(Clone, Debug)]
pub struct ContactEstimator {
    pipeline: Pipeline,
    model: SelfCalibrating,
}

// The size must fit the MCU of any foot; the compiler checks it.
const _: () = assert!(size_of::<ContactEstimator>() < 1024);

impl ContactEstimator {
    /// An estimator without samples.
    #[must_use]
    #[inline(never)] // Built where the caller keeps it, without a copy on the stack if the compiler can.
    pub fn new(config: &Config, stream: Stream) -> Self {
        Self {
            pipeline: Pipeline::new(config, stream),
            model: SelfCalibrating::new(&config.self_calibrating(stream)),
        }
    }

    /// Processes the next sample, and the load on the foot at that time if it is known.
    ///
    /// Causal, O(1), and total: any bits are accepted, and the result is never NaN.
    // Kept as a separate function in every program, so that its cost can be measured.
    #[inline(never)]
    pub fn update(&mut self, sample: &ImuSample, load: Option<Load>) -> ContactEstimate {
        let mut reading = self.pipeline.read(sample);
        // The limits are the probabilities before a short gap, or those after a longer gap. A short gap has no other
        // effect, whereas a longer gap counts as up to a few windows of unreliable samples.
        let limits = (reading.missing > 0).then(|| self.model.account_for(reading.missing));
        let mut probabilities = match reading.motion {
            Motion::Known(acceleration, rate) => {
                let up = self.up();
                self.model.push(acceleration, rate, up)
            }
            Motion::Unreliable | Motion::NoAttitude => self.model.push_doubt(),
        };
        if let Some(limits) = &limits {
            probabilities.limit(limits);
        }
        if !self.model.is_settled() {
            reading.flags = reading.flags.with(Flag::Settling);
        }
        if self.model.is_unproven(self.pipeline.threshold()) {
            reading.flags = reading.flags.with(Flag::Unproven);
        }
        if !self.model.is_full() {
            reading.flags = reading.flags.with(Flag::WindowNotFull);
        }
        let standing = if self.model.stands() { probabilities.stable } else { 0.0 };
        self.pipeline.learn_in_stance(&reading, standing);
        self.pipeline.conclude(&reading, probabilities, self.model.mean_acceleration(), load)
    }

    fn up(&self) -> Up {
        match self.pipeline.estimated_up() {
            Some(direction) => {
                Up { direction, correction: Some(self.pipeline.attitude.newest_correction()) }
            }
            None => Up::Z,
        }
    }

    pub(crate) const fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    /// Zero-velocity measurement of the newest sample, as in [`ContactEstimate::velocity_sigma`];
    /// [`VelocitySigma::MOST`] before the first sample.
    #[must_use]
    pub const fn velocity_sigma(&self) -> VelocitySigma {
        self.pipeline.velocity_sigma
    }

    /// Angular rate, rad/s, frame of the foot, that is not accepted as the gyroscope's bias. It is the rate of a rest
    /// that has not been accepted for five seconds, or else the bias once the corrections of a walk have led beyond its
    /// limit for as long. `None` if there is no such rate, and with [`Gravity::Removed`](crate::Gravity::Removed).
    ///
    /// Either the gyroscope is beyond its data sheet, or the ground turns.
    #[must_use]
    pub fn excess_bias(&self) -> Option<AngularRate> {
        self.pipeline.attitude.excess_bias()
    }

    /// Times of `count` samples that were read at once, such as from a sensor's FIFO: oldest first, the last at
    /// `newest`. [`Self::update`] needs a time of its own for each sample; samples that share one are invalid.
    ///
    /// The samples lie evenly between the newest samples of the previous read and of this read. If this time is too
    /// long for `count` samples, some are missing before them, and the times are one period apart, as in the first read.
    ///
    /// ```
    /// # use estimator_core::{ContactEstimator, ImuSample, Params, Stream, Timestamp};
    /// # let mut estimator = ContactEstimator::new(&Params::DEFAULT.validate()?, Stream::KILOHERTZ);
    /// # let (fifo, read_at) = ([ImuSample::default(); 8], Timestamp::from_micros(8_000));
    /// let times = estimator.batch_timestamps(read_at, fifo.len());
    /// for (sample, timestamp) in fifo.iter().zip(times) {
    ///     let estimate = estimator.update(&ImuSample { timestamp, ..*sample }, None);
    /// #   assert_eq!(estimate.timestamp, timestamp);
    /// }
    /// # Ok::<(), estimator_core::ParamsError>(())
    /// ```
    pub fn batch_timestamps(
        &self,
        newest: Timestamp,
        count: usize,
    ) -> impl ExactSizeIterator<Item = Timestamp> + DoubleEndedIterator + use<> {
        self.pipeline.batch_timestamps(newest, count)
    }

    /// Length of the mean specific force, m/s², if no foot can have it; `None` while it is plausible or unknown, and
    /// with [`Gravity::Removed`](crate::Gravity::Removed).
    ///
    /// A value shows that the readings have another unit, such as 1 in g or 1,000 in mg, that the full scale is not
    /// the assumed one, or that the scale is wrong. It is given for a mean outside of 8.6 to 11 m/s² at rest, or outside of 1.5 to 60 m/s² over
    /// half a second. For the latter a foot would have to fall for 0.9 s, or to become 25 m/s faster.
    #[must_use]
    pub fn implausible_force(&self) -> Option<f32> {
        self.pipeline.attitude.implausible_force()
    }

    /// Length of the mean specific force while the foot is at rest, m/s²; `None` while it is not.
    ///
    /// A value far from 9.8 m/s² shows that the full scale of the accelerometer is not the assumed one.
    #[must_use]
    pub fn force_at_rest(&self) -> Option<f32> {
        self.pipeline.attitude.force_at_rest()
    }

    /// Bias of the gyroscope, rad/s, frame of the foot, as in [`ContactEstimate::gyro_bias`]; `None` until the foot has
    /// been at rest, and with [`Gravity::Removed`](crate::Gravity::Removed).
    #[must_use]
    pub fn gyro_bias(&self) -> Option<AngularRate> {
        self.pipeline.attitude.known_bias()
    }

    /// State learnt so far. Store it, and pass it to [`Params::learnt`] for a warm start.
    ///
    /// [`Params::learnt`]: crate::Params::learnt
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        self.model.learnt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::Constants;
    use crate::estimate::Probabilities;
    use crate::flags::Flags;
    use crate::params::Params;
    use crate::phase::{Decision, Phase};
    use crate::sample::{LinearAcceleration, Saturation, SpecificForce, Validity};
    use crate::stream::Gravity;
    use crate::units::STANDARD_GRAVITY;
    use crate::vector::Vec3;
    use std::vec;
    use std::vec::Vec;

    const GRAVITY_FREE: Stream = Stream::KILOHERTZ.with_gravity(Gravity::Removed);

    fn estimator(stream: Stream) -> ContactEstimator {
        ContactEstimator::new(&Params::DEFAULT.validate().expect("the defaults"), stream)
    }

    fn at_rest(micros: u64) -> ImuSample {
        ImuSample { timestamp: Timestamp::from_micros(micros), ..ImuSample::default() }
    }

    /// Feeds a gravity-free foot at rest for `samples` ms, starting at 0.
    fn rested(stream: Stream, samples: u64) -> ContactEstimator {
        let mut estimator = estimator(stream);
        for ms in 0..samples {
            estimator.update(&at_rest(ms * 1000), None);
        }
        estimator
    }

    /// The flags except [`Flag::Settling`], which a foot at rest keeps.
    fn but_settling(flags: Flags) -> Vec<Flag> {
        flags.iter().filter(|f| *f != Flag::Settling).collect()
    }

    #[test]
    fn foot_is_unproven_until_it_has_rested() {
        let mut estimator = estimator(GRAVITY_FREE);
        let mut proven = None;
        for ms in 0..600 {
            let estimate = estimator.update(&at_rest(ms * 1000), None);
            if !estimate.flags.contains(Flag::Unproven) {
                proven = proven.or(Some(ms));
            } else {
                assert!(estimate.probabilities.stable <= 0.5, "{estimate:?}");
                assert_eq!(estimate.decision, Decision::NotStable);
            }
            if ms == 599 {
                assert_eq!(estimate.decision, Decision::Stable);
            }
        }
        let rest = (1.0e3 * Constants::DEFAULT.stance) as u64;
        assert!(proven.is_some_and(|ms| (rest - 1..rest + 150).contains(&ms)), "{proven:?}");
    }

    /// A foot that moves up and down for `half` ms each, by `force` m/s².
    fn shaken(ms: u64, half: u64, force: f32) -> ImuSample {
        let z = if (ms / half).is_multiple_of(2) { force } else { -force };
        ImuSample { specific_force: SpecificForce(Vec3::new(0.0, 0.0, z)), ..at_rest(ms * 1000) }
    }

    /// Too little for a swing, and too much for rest.
    const SWAY: f32 = 0.5;

    /// Half a period in which a foot that sways rises by 6 cm, ms.
    const SLOW: u64 = 500;

    #[test]
    fn foot_that_trembles_after_a_rest_still_stands() {
        let mut estimator = rested(GRAVITY_FREE, 600);
        for ms in 600..20_000 {
            // In each sway the foot rises by 1 mm.
            let estimate = estimator.update(&shaken(ms, 50, SWAY), None);
            assert_eq!(estimate.decision, Decision::Stable, "{estimate:?}");
        }
    }

    #[test]
    fn foot_that_turns_after_a_rest_still_stands() {
        let mut estimator = rested(GRAVITY_FREE, 600);
        for ms in 600..20_000_u64 {
            // A shank that leans to and fro over its foot never rests.
            let rate = if (ms / 1_000).is_multiple_of(2) { 0.2 } else { -0.2 };
            let angular_rate = AngularRate(Vec3::new(0.0, rate, 0.0));
            let estimate =
                estimator.update(&ImuSample { angular_rate, ..at_rest(ms * 1000) }, None);
            assert_eq!(estimate.decision, Decision::Stable, "{estimate:?}");
        }
    }

    #[test]
    fn foot_that_turns_after_a_gap_is_not_proven_to_stand() {
        let mut estimator = rested(GRAVITY_FREE, 600);
        let angular_rate = AngularRate(Vec3::new(0.0, 0.2, 0.0));
        let last = (700..4_000)
            .map(|ms| estimator.update(&ImuSample { angular_rate, ..at_rest(ms * 1000) }, None));
        assert!(last.last().is_some_and(|last| last.flags.contains(Flag::Unproven)));
    }

    #[test]
    fn foot_that_hangs_after_a_rest_is_unproven_again() {
        // All samples, one of two, one of fourteen.
        for every in [1, 2, 14] {
            let mut estimator = rested(GRAVITY_FREE, 600);
            let estimates = (600..4_000).step_by(every).map(|ms| {
                // Invalid where the evidence lapses.
                let validity = match ms {
                    2_390..2_430 => Validity::Invalid,
                    _ => Validity::Valid,
                };
                let sample = ImuSample { validity, ..shaken(ms, SLOW, SWAY) };
                let estimate = estimator.update(&sample, None);
                let p = estimate.probabilities.stable;
                assert!(p <= 0.5 || !estimate.flags.contains(Flag::Unproven), "{estimate:?}");
                (ms, estimate)
            });
            let estimates: Vec<_> = estimates.collect();
            let is_unproven = |estimate: &ContactEstimate| estimate.flags.contains(Flag::Unproven);
            let lapses = estimates.iter().find(|(_, estimate)| is_unproven(estimate));
            let lapses = lapses.map(|(ms, _)| *ms);
            let evidence = 600 + (1.0e3 * Constants::DEFAULT.evidence) as u64;
            let expected = evidence..evidence + 150;
            assert!(lapses.is_some_and(|ms| expected.contains(&ms)), "1 of {every}: {lapses:?}");
            let stands = |(ms, last): &(u64, ContactEstimate)| {
                *ms < evidence && last.decision == Decision::Stable
            };
            assert!(estimates.iter().any(stands));
            for (ms, last) in estimates.iter().filter(|(ms, _)| *ms > evidence + 300) {
                assert!(is_unproven(last), "1 of {every}, {ms} ms: {last:?}");
                assert_eq!(last.decision, Decision::NotStable);
            }
        }
    }

    #[test]
    fn moving_foot_without_evidence_is_not_unproven() {
        let mut estimator = rested(GRAVITY_FREE, 600);
        // Later it has forgotten its stand.
        for ms in 600..9_000 {
            let (half, force) = if ms < 3_000 { (SLOW, SWAY) } else { (100, 20.0) };
            let estimate = estimator.update(&shaken(ms, half, force), Some(Load(100.0)));
            if ms == 2_999 {
                assert!(estimate.flags.contains(Flag::Unproven), "{estimate:?}");
                assert_eq!(estimate.phase, Phase::Unknown);
            }
            if ms > 3_100 {
                assert_eq!(but_settling(estimate.flags), [], "{ms} ms");
                assert_eq!(estimate.phase, Phase::Slip, "{ms} ms");
            }
        }
    }

    #[test]
    fn foot_that_never_walked_can_be_stable_and_is_settling() {
        let mut estimator = rested(GRAVITY_FREE, 600_000);
        let estimate = estimator.update(&at_rest(600_000_000), None);
        assert_eq!(estimate.decision, Decision::Stable);
        assert_eq!(estimate.flags, Flags::NONE.with(Flag::Settling));
    }

    #[test]
    fn doubtful_samples_have_probability_zero_and_their_flag() {
        for (validity, flag) in [
            (Validity::Saturated(Saturation::Both), Flag::Saturated),
            (Validity::Stale, Flag::Stale),
            (Validity::Invalid, Flag::InvalidSample),
        ] {
            let mut estimator = rested(GRAVITY_FREE, 600);
            // Each window of doubt leaves 1/e.
            let windows = (8.0e3 * Constants::DEFAULT.window) as u64;
            for ms in 600..600 + windows {
                let sample = ImuSample { validity, ..at_rest(ms * 1000) };
                let estimate = estimator.update(&sample, None);
                assert_eq!(but_settling(estimate.flags), [flag]);
                assert_eq!(estimate.decision, Decision::NotStable);
                assert_eq!(estimate.probabilities, Probabilities::default());
            }
            let after = estimator.update(&at_rest((600 + windows) * 1000), None);
            // One valid sample of a window.
            assert!((0.0..0.05).contains(&after.probabilities.stable), "{after:?}");
        }
    }

    #[test]
    fn gap_in_time_raises_its_flag_and_jitter_does_not() {
        for (elapsed, flags) in [
            (1_000, Flags::NONE),
            (1_749, Flags::NONE),
            (1_750, Flags::NONE.with(Flag::TimeGap)),
            (48_000, Flags::NONE.with(Flag::TimeGap)),
        ] {
            let estimate = rested(GRAVITY_FREE, 600).update(&at_rest(599_000 + elapsed), None);
            assert_eq!(estimate.flags, flags.with(Flag::Settling), "{elapsed} µs");
        }
    }

    #[test]
    fn gap_of_half_a_window_is_bridged_and_a_longer_one_lowers_p() {
        let resting = |gap_ms: u64| {
            let mut estimator = rested(GRAVITY_FREE, 600);
            let before = estimator.update(&at_rest(600_000), None).probabilities.stable;
            let after = estimator.update(&at_rest((600 + gap_ms) * 1000), None);
            assert!(after.flags.contains(Flag::TimeGap));
            (before, after.probabilities.stable)
        };
        let (before, after) = resting(14);
        assert!(before > 0.9 && after <= before, "{before}, {after}");
        assert!(after > before - 1.0e-3, "{before}, {after}");
        let (_, after) = resting(15);
        assert!(after < 0.7, "{after}");
        let (_, after) = resting(500);
        assert!(after < 0.2, "{after}");
    }

    #[test]
    fn bridging_never_raises_the_probability() {
        let mut estimator = estimator(GRAVITY_FREE);
        let mut before = 0.0;
        for k in 0..4_000_u64 {
            // Swings, lands and rests repeatedly, and loses up to thirty samples before every
            // second one.
            let push = if k % 300 < 150 { 8.0 } else { 0.0 };
            let gap = k / 2 * 7919 % 16;
            let sample = ImuSample {
                specific_force: SpecificForce(Vec3::new(push, 0.0, 0.0)),
                ..at_rest((k / 2 * 17 + gap + k % 2) * 1000)
            };
            let after = estimator.update(&sample, None);
            if after.flags.contains(Flag::TimeGap) {
                assert!(after.probabilities.stable <= before, "{k}");
            }
            before = after.probabilities.stable;
        }
    }

    #[test]
    fn resting_foot_stays_stable_with_a_sample_lost_now_and_then() {
        let mut estimator = rested(GRAVITY_FREE, 600);
        for ms in (600..1_500).filter(|ms| ms % 15 != 0) {
            let estimate = estimator.update(&at_rest(ms * 1000), Some(Load(100.0)));
            assert_eq!(estimate.decision, Decision::Stable, "{ms} ms");
            assert_eq!(estimate.phase, Phase::Stance, "{ms} ms");
        }
    }

    #[test]
    fn no_timestamp_overflows_anything() {
        for (first, second) in [(0, u64::MAX), (0, 1 << 63), (u64::MAX, 0), (1, u64::MAX - 1)] {
            for stream in [GRAVITY_FREE, Stream::KILOHERTZ] {
                let mut estimator = estimator(stream);
                estimator.update(&at_rest(first), None);
                let flags = estimator.update(&at_rest(second), None).flags;
                let expected = if second > first { Flag::TimeGap } else { Flag::InvalidSample };
                assert!(flags.contains(expected), "{first}, {second}: {flags:?}");
            }
        }
    }

    /// Feeds a level foot at rest with a gyro bias (rad/s) about x, once a millisecond.
    fn lying(estimator: &mut ContactEstimator, from_ms: u64, ms: u64) -> ContactEstimate {
        let mut estimate = ContactEstimate::default();
        for ms in from_ms..from_ms + ms {
            let sample = ImuSample {
                specific_force: SpecificForce(Vec3::new(0.0, 0.0, STANDARD_GRAVITY)),
                angular_rate: AngularRate(Vec3::new(0.01, 0.0, 0.0)),
                ..at_rest(ms * 1000)
            };
            estimate = estimator.update(&sample, None);
        }
        estimate
    }

    #[test]
    fn bias_is_removed_from_the_rate_at_rest() {
        let estimate = lying(&mut estimator(Stream::KILOHERTZ), 0, 12_000);
        assert!((estimate.gyro_bias.0.x - 0.01).abs() < 1e-4, "{estimate:?}");
        assert!(estimate.angular_rate.0.x.abs() < 1e-4, "{estimate:?}");
        assert_eq!(estimate.decision, Decision::Stable);
    }

    #[test]
    fn excess_rate_at_rest_is_reported_with_gravity_included() {
        for (stream, reported) in [(Stream::KILOHERTZ, true), (GRAVITY_FREE, false)] {
            let mut estimator = estimator(stream);
            for ms in 0..6_000 {
                let sample = ImuSample {
                    specific_force: SpecificForce(Vec3::new(0.0, 0.0, STANDARD_GRAVITY)),
                    angular_rate: AngularRate(Vec3::new(0.0, 0.0, 0.5)),
                    ..at_rest(ms * 1000)
                };
                estimator.update(&sample, None);
            }
            let excess = estimator.excess_bias().map(|rate| rate.0.z);
            assert_eq!(excess.is_some(), reported, "{excess:?}");
            assert!(excess.is_none_or(|rate| (rate - 0.5).abs() < 1.0e-3));
        }
    }

    #[test]
    fn implausible_force_affects_neither_up_nor_motion() {
        for x in [f32::NAN, f32::INFINITY, 1.0e6] {
            let mut estimator = estimator(Stream::KILOHERTZ);
            let before = lying(&mut estimator, 0, 1_000);
            let sample = ImuSample {
                specific_force: SpecificForce(Vec3::new(x, 0.0, 0.0)),
                ..at_rest(1_000_000)
            };
            let estimate = estimator.update(&sample, None);
            assert!(estimate.flags.contains(Flag::InvalidSample), "{x}");
            assert_eq!(estimate.orientation, before.orientation, "{x}");
            assert_eq!(estimate.linear_acceleration, LinearAcceleration::default());
        }
    }

    #[test]
    fn long_gap_restarts_the_search_for_up() {
        let mut estimator = estimator(Stream::KILOHERTZ);
        lying(&mut estimator, 0, 1_000);
        let after = lying(&mut estimator, 2_100, 1);
        assert!(after.flags.contains(Flag::AttitudeNotInitialised), "{after:?}");
        assert!(after.probabilities.stable <= 0.5);
        let settled = lying(&mut estimator, 2_101, 300);
        assert_eq!(but_settling(settled.flags), []);
        assert_eq!(settled.decision, Decision::Stable);
    }

    #[test]
    fn slow_slide_is_detected_by_its_speed() {
        let mut estimator = estimator(GRAVITY_FREE);
        let mut estimate = ContactEstimate::default();
        for ms in 0..700 {
            // 15 mm/s after 100 ms, and on.
            let push = if ms >= 600 { 0.15 } else { 0.0 };
            let sample = ImuSample {
                specific_force: SpecificForce(Vec3::new(0.0, push, 0.0)),
                ..at_rest(ms * 1000)
            };
            estimate = estimator.update(&sample, None);
            assert!(!(400..600).contains(&ms) || estimate.decision == Decision::Stable);
        }
        assert_eq!(estimate.decision, Decision::NotStable);
    }

    #[test]
    fn foot_without_noise_has_probability_one_for_ever() {
        // The means of the first half second decay until they are denormal numbers.
        let mut estimator = estimator(GRAVITY_FREE);
        for ms in 0..60_000_u64 {
            let push = if ms < 500 { 0.01 } else { 0.0 };
            let sample = ImuSample {
                timestamp: Timestamp::from_micros(1_000 * ms),
                specific_force: SpecificForce(Vec3::new(push, 0.0, 0.0)),
                ..ImuSample::default()
            };
            let stable = estimator.update(&sample, None).probabilities.stable;
            assert!(ms < 1_000 || stable > 0.9, "{ms} ms: {stable}");
        }
    }

    #[test]
    fn clock_set_back_costs_one_sample() {
        let mut estimator = rested(GRAVITY_FREE, 600);
        let flags = [5_000, 6_000, 7_000].map(|t| estimator.update(&at_rest(t), None).flags);
        let flags = flags.map(but_settling);
        assert_eq!(flags, [vec![Flag::InvalidSample], vec![], vec![]]);
    }

    #[test]
    fn probability_is_zero_until_up_is_known() {
        let sample = ImuSample {
            specific_force: SpecificForce(Vec3::new(0.0, 0.0, STANDARD_GRAVITY)),
            ..at_rest(0)
        };
        let estimate = estimator(Stream::KILOHERTZ).update(&sample, None);
        assert!(estimate.flags.contains(Flag::AttitudeNotInitialised));
        assert_eq!(estimate.probabilities.stable, 0.0);
        assert_eq!(estimate.decision, Decision::NotStable);
    }

    #[test]
    fn steady_push_is_detected_before_it_is_learnt_as_gravity() {
        // The default removes gravity by itself. To an accelerometer a constant push is a tilt,
        // so the foot is found sliding, and later called stable again. Less than 0.17 m/s² may be a false idea of up.
        for push in [0.25, 0.3, 1.0] {
            let mut estimator = estimator(Stream::KILOHERTZ);
            let decisions: Vec<_> = (0..4_000)
                .map(|ms| {
                    let push = if ms >= 2_000 { push } else { 0.0 };
                    let sample = ImuSample {
                        specific_force: SpecificForce(Vec3::new(push, 0.0, STANDARD_GRAVITY)),
                        ..at_rest(ms * 1000)
                    };
                    estimator.update(&sample, None).decision
                })
                .collect();
            assert_eq!(decisions[1_999], Decision::Stable);
            let moving = &decisions[2_060..2_200];
            assert!(moving.iter().all(|d| *d == Decision::NotStable), "{push}");
            assert_eq!(decisions.last(), Some(&Decision::Stable), "{push}");
        }
    }

    /// Times in µs of the samples of a read.
    fn batch(estimator: &ContactEstimator, newest: u64, count: usize) -> Vec<u64> {
        let times = estimator.batch_timestamps(Timestamp::from_micros(newest), count);
        times.map(Timestamp::as_micros).collect()
    }

    #[test]
    fn samples_of_a_read_lie_evenly_after_those_of_the_one_before() {
        let mut estimator = estimator(GRAVITY_FREE);
        assert_eq!(batch(&estimator, 9_000, 4), [6_000, 7_000, 8_000, 9_000]);
        assert_eq!(batch(&estimator, 9_000, 0), []);
        estimator.update(&at_rest(9_000), None);
        for (newest, expected) in [
            (13_000, [10_000, 11_000, 12_000, 13_000]),
            (12_200, [9_800, 10_600, 11_400, 12_200]),
            (14_600, [10_400, 11_800, 13_200, 14_600]),
            // Samples are missing before these.
            (100_000, [97_000, 98_000, 99_000, 100_000]),
            // The clock was set back.
            (9_000, [6_000, 7_000, 8_000, 9_000]),
            (2_000, [0, 0, 1_000, 2_000]),
        ] {
            assert_eq!(batch(&estimator, newest, 4), expected, "{newest}");
        }
    }

    #[test]
    fn batch_of_any_size_ends_at_its_newest_time() {
        let estimator = rested(GRAVITY_FREE, 10);
        for newest in [0, 1, 9_000, 9_001, u64::MAX] {
            for count in [1, 2, usize::MAX] {
                let mut times = estimator.batch_timestamps(Timestamp::from_micros(newest), count);
                assert_eq!(times.len(), count.min(u32::MAX as usize));
                assert_eq!(times.next_back(), Some(Timestamp::from_micros(newest)), "{count}");
            }
        }
    }

    /// Motion of a foot that walks, at each ms.
    fn walking(ms: u64) -> ImuSample {
        let (phase, wave) = (ms % 600, (ms * 7 % 13) as f32 / 13.0 - 0.5);
        let swing = if phase < 150 { 6.0 } else { -6.0 };
        let x = if ms > 1_000 && phase < 300 { swing } else { 0.1 };
        let rate = if ms > 1_000 && phase < 300 { 2.0 * wave } else { 0.02 * wave };
        ImuSample {
            timestamp: Timestamp::from_micros(1_000 * ms),
            specific_force: SpecificForce(Vec3::new(x + wave, 0.0, STANDARD_GRAVITY)),
            angular_rate: AngularRate(Vec3::new(0.0, rate, 0.0)),
            ..ImuSample::default()
        }
    }

    #[test]
    fn reads_of_a_fifo_have_the_estimate_of_single_samples() {
        const READ: u64 = 8;
        let mut single = estimator(Stream::KILOHERTZ);
        let expected: Vec<_> = (0..8_000).map(|ms| single.update(&walking(ms), None)).collect();
        for (late_us, bound) in [(0, 1.0e-6), (900, 0.02), (2_500, 0.05)] {
            let mut batched = estimator(Stream::KILOHERTZ);
            let mut sum = 0.0;
            for read in 0..8_000 / READ {
                let samples: Vec<_> = (0..READ).map(|k| walking(READ * read + k)).collect();
                let late = read * 7_919 % 10 * late_us / 10;
                let newest = 1_000 * (READ * read + READ - 1) + late;
                let times = batched.batch_timestamps(Timestamp::from_micros(newest), samples.len());
                for (k, (sample, timestamp)) in (0..).zip(samples.iter().zip(times)) {
                    let estimate = batched.update(&ImuSample { timestamp, ..*sample }, None);
                    assert!(!estimate.flags.contains(Flag::InvalidSample), "{newest}");
                    assert!(!estimate.flags.contains(Flag::TimeGap), "{newest}");
                    let of_single: ContactEstimate = expected[(READ * read) as usize + k];
                    let error = estimate.probabilities.stable - of_single.probabilities.stable;
                    sum += error * error;
                }
            }
            let rmse = crate::math::sqrt(sum / 8_000.0);
            assert!(rmse < bound, "{late_us} µs: {rmse}");
        }
        // With the time of the read alone, seven of eight are invalid.
        let mut shared = estimator(Stream::KILOHERTZ);
        let invalid = (0..8_000).filter(|ms| {
            let timestamp = Timestamp::from_micros(1_000 * (ms / READ * READ + READ - 1));
            let estimate = shared.update(&ImuSample { timestamp, ..walking(*ms) }, None);
            estimate.flags.contains(Flag::InvalidSample)
        });
        assert_eq!(invalid.count(), 7_000);
    }

    #[test]
    fn readings_in_another_unit_are_implausible_and_those_of_a_walk_are_not() {
        for (factor, is_implausible) in
            [(1.0, false), (1.0 / STANDARD_GRAVITY, true), (1_000.0 / STANDARD_GRAVITY, true)]
        {
            let mut estimator = estimator(Stream::KILOHERTZ);
            let mut found = None;
            for ms in 0..8_000 {
                let mut sample = walking(ms);
                sample.specific_force.0 = sample.specific_force.0 * factor;
                estimator.update(&sample, None);
                found = found.or(estimator.implausible_force());
            }
            assert_eq!(found.is_some(), is_implausible, "{factor}: {found:?}");
            let near =
                found.is_none_or(|force| (force / factor / STANDARD_GRAVITY - 1.0).abs() < 0.3);
            assert!(near, "{factor}: {found:?}");
        }
        // Without gravity the unit stays unknown.
        let mut free = estimator(GRAVITY_FREE);
        (0..4_000).for_each(|ms| {
            free.update(&walking(ms), None);
        });
        assert_eq!(free.implausible_force(), None);
    }

    #[test]
    fn scale_that_leaves_a_foot_in_doubt_is_implausible_at_rest() {
        for (factor, is_implausible) in
            [(0.75, true), (0.85, true), (0.95, false), (1.05, false), (1.15, true), (1.25, true)]
        {
            let mut estimator = estimator(Stream::KILOHERTZ);
            for ms in 0..4_000 {
                let force = SpecificForce(Vec3::new(0.0, 0.0, factor * STANDARD_GRAVITY));
                let sample = ImuSample { specific_force: force, ..at_rest(1_000 * ms) };
                estimator.update(&sample, None);
            }
            assert_eq!(estimator.implausible_force().is_some(), is_implausible, "{factor}");
            let at_rest = estimator.force_at_rest().expect("a rest");
            assert!((at_rest / (factor * STANDARD_GRAVITY) - 1.0).abs() < 1.0e-3, "{at_rest}");
        }
    }

    #[test]
    fn repeated_timestamp_makes_the_sample_invalid() {
        let estimate = rested(GRAVITY_FREE, 600).update(&at_rest(599_000), None);
        assert!(estimate.flags.contains(Flag::InvalidSample));
    }
}
