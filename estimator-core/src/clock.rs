//! Times of a clock that glitches, before they reach the estimator.

use crate::sample::Timestamp;
use crate::stream::Stream;

/// Longest step that an estimator bridges by itself, µs: half of its window.
const BRIDGED_US: u64 = 13_000;

/// Presumed time of the newest sample of a first read, µs. It is so late that all samples of the read have later times
/// than 0.
const FIRST_US: u64 = 1 << 62;

/// Bridge over single timestamps that jump and come back.
///
/// A clock may give one sample a time 100 ms late, and the next one the right time. To an estimator this is a gap, and then
/// a time that is not later than the one before. So the estimator forgets that the foot stands, and waits until it has seen
/// the foot stand again. The bridge gives such a sample no time, so that you leave it out, and to the estimator one sample is
/// missing. The next sample shows whether the time has come back. If it has not, the gap or the new time is real, and the
/// estimator gets the whole of it with the readings of both sides.
///
/// Samples that were read at once, such as from a sensor's FIFO, share one reading of the clock, so that if it has jumped,
/// all of them are in doubt. [`begin_read`](Self::begin_read) tells the bridge how many they are. Without it, the second of
/// them would confirm the jump of the first.
///
/// Times without a jump pass unchanged, and so do gaps that the estimator bridges itself. A clock of 32 bits may start again
/// from 0. Differences of stamps are taken modulo 2⁶⁴.
///
/// ```
/// use estimator_core::clock::Bridge;
/// use estimator_core::{Stream, Timestamp};
///
/// let mut bridge = Bridge::new(Stream::KILOHERTZ);
/// let stamps = [1_000, 2_000, 103_000, 4_000, 5_000].map(Timestamp::from_micros);
/// let times = stamps.map(|stamp| bridge.next(stamp).map(Timestamp::as_micros));
/// assert_eq!(times, [Some(1_000), Some(2_000), None, Some(4_000), Some(5_000)]);
/// ```
#[derive(Clone, Debug)]
pub struct Bridge {
    period_us: u64,
    /// Samples of the newest read that are still to come.
    of_read: u32,
    /// State after the first sample.
    state: Option<State>,
}

/// State of a [`Bridge`].
#[derive(Clone, Debug)]
struct State {
    /// Stamp of the newest sample, µs.
    stamp_us: u64,
    /// Step from the previous stamp to the newest one, µs; 0 unless the newest was accepted as later.
    step_us: u64,
    /// Number of consecutive samples in doubt, up to the newest sample.
    doubted: u32,
    /// Further samples that have their time from the same reading of the clock as the first one in doubt.
    unconfirmed: u32,
    /// Stamp before the samples in doubt, µs. If none is in doubt, stamp before the newest one if samples are missing
    /// between them.
    before_jump_us: Option<u64>,
    /// Newest time that the estimator got, µs.
    given_us: u64,
    /// Difference between the estimator's time and the stamp, µs, modulo 2⁶⁴. It is not 0 once a clock was set back.
    offset_us: u64,
}

impl Bridge {
    /// Bridge for the samples of a stream.
    #[must_use]
    pub fn new(stream: Stream) -> Self {
        Self { period_us: stream.period_us(), of_read: 0, state: None }
    }

    /// Announces that the next `count` samples were read at once.
    pub fn begin_read(&mut self, count: u32) {
        self.of_read = count;
    }

    /// Returns the time of the next sample for the estimator, which is later than the time before. A repeated stamp gives
    /// a repeated time, so that the estimator rejects the sample. Returns `None` if the stamp has jumped. In that case leave
    /// the sample out.
    pub fn next(&mut self, stamp: Timestamp) -> Option<Timestamp> {
        let stamp_us = stamp.as_micros();
        let (period_us, gap_us) = (self.period_us, self.gap_us());
        let longest_us = self.longest_us();
        self.of_read = self.of_read.saturating_sub(1);
        let Some(state) = &mut self.state else {
            self.state = Some(State {
                stamp_us,
                step_us: 0,
                doubted: 0,
                unconfirmed: 0,
                before_jump_us: None,
                given_us: stamp_us,
                offset_us: 0,
            });
            return Some(stamp);
        };
        if state.unconfirmed > 0 {
            state.unconfirmed -= 1;
            state.doubted = state.doubted.saturating_add(1);
            state.stamp_us = stamp_us;
            return None;
        }
        let step_us = later_by(stamp_us, state.stamp_us);
        // A quarter is the jitter of a read, as in the estimator.
        let missing = u64::from(state.doubted.max(1) + state.doubted / 4);
        let due_us = (missing + 1) * period_us + gap_us;
        let has_returned = state
            .before_jump_us
            .and_then(|before_us| later_by(stamp_us, before_us))
            .is_some_and(|step_us| step_us < due_us);
        // If a step is no longer than the previous one, the samples come at another rate than declared.
        let longest_us = longest_us.max(state.step_us.saturating_add(period_us));
        let low_step_us = u64::from(stamp_us.wrapping_sub(state.stamp_us) as u32);
        let has_started_again = step_us.is_none() && low_step_us > 0 && low_step_us < longest_us;
        let follows = has_started_again || step_us.is_some_and(|step_us| step_us < longest_us);
        // Two readings of the clock in a row do not jump by accident, each to a later time.
        let is_confirmed = state.doubted > 0 && step_us.is_some();
        if stamp_us == state.stamp_us {
            return Some(Timestamp::from_micros(state.given_us));
        }
        if has_returned || follows || is_confirmed {
            let is_gap = !has_returned && step_us.is_some_and(|step_us| step_us >= gap_us);
            state.before_jump_us = is_gap.then_some(state.stamp_us);
            state.step_us = step_us.unwrap_or(0);
            let continued_us = stamp_us.wrapping_add(state.offset_us);
            // Otherwise the clock was set back, or the estimator has the time of a small jump that came back.
            let ahead_us = later_by(continued_us, state.given_us).unwrap_or(period_us);
            state.given_us = state.given_us.wrapping_add(ahead_us);
            state.offset_us = state.given_us.wrapping_sub(stamp_us);
            state.doubted = 0;
        } else {
            state.before_jump_us = Some(state.stamp_us);
            state.step_us = 0;
            state.doubted = 1;
            state.unconfirmed = self.of_read;
        }
        state.stamp_us = stamp_us;
        (state.doubted == 0).then_some(Timestamp::from_micros(state.given_us))
    }

    /// Returns the time that [`Self::next`] would give this stamp if it did not jump, without recording the stamp. If the
    /// clock was set back, it is `due` periods after the newest time. Before the first sample it is a time far from 0.
    #[must_use]
    pub fn presumed(&self, stamp: Timestamp, due: u32) -> Timestamp {
        let Some(state) = &self.state else { return Timestamp::from_micros(FIRST_US) };
        let continued_us = stamp.as_micros().wrapping_add(state.offset_us);
        let is_later = later_by(continued_us, state.given_us).is_some();
        let due_us = state.given_us.wrapping_add(u64::from(due).wrapping_mul(self.period_us));
        Timestamp::from_micros(if is_later { continued_us } else { due_us })
    }

    /// Shortest step between two samples, µs, that shows a missing sample. The estimator has the same limit.
    const fn gap_us(&self) -> u64 {
        2 * self.period_us - self.period_us / 4
    }

    /// Shortest step that is a jump, µs.
    const fn longest_us(&self) -> u64 {
        let missing_us = if BRIDGED_US > self.period_us { BRIDGED_US } else { self.period_us };
        missing_us + self.gap_us()
    }
}

/// Returns by how much one stamp is later than another, µs, if it is.
fn later_by(stamp_us: u64, than_us: u64) -> Option<u64> {
    let step_us = stamp_us.wrapping_sub(than_us);
    (step_us > 0 && step_us <= u64::MAX / 2).then_some(step_us)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactEstimator;
    use crate::params::Params;
    use crate::phase::Decision;
    use crate::sample::{AngularRate, ImuSample, SpecificForce};
    use crate::stream::Gravity;
    use crate::units::STANDARD_GRAVITY;
    use crate::vector::{Quaternion, Vec3};
    use std::vec::Vec;

    /// Times for the estimator at 1 kHz, ms.
    fn bridged(stamps_ms: &[u64]) -> Vec<Option<u64>> {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let times = stamps_ms.iter().map(|ms| bridge.next(Timestamp::from_micros(1_000 * ms)));
        times.map(|time| time.map(|time| time.as_micros() / 1_000)).collect()
    }

    #[test]
    fn stamps_without_a_jump_pass_unchanged() {
        for stamps in [&[7, 8, 9, 10][..], &[7, 8, 10, 11, 12], &[7, 8, 8, 8, 9], &[1, 15, 16, 30]]
        {
            let unchanged: Vec<_> = stamps.iter().copied().map(Some).collect();
            assert_eq!(bridged(stamps), unchanged);
        }
    }

    #[test]
    fn single_jump_costs_one_sample_in_either_direction() {
        for jump in [500, 200, 130, 60, 0] {
            let times = bridged(&[100, 101, jump, 103, 104]);
            assert_eq!(times, [Some(100), Some(101), None, Some(103), Some(104)], "{jump}");
        }
    }

    #[test]
    fn small_jump_that_comes_back_goes_on() {
        let times = bridged(&[100, 101, 107, 103, 104, 105]);
        assert_eq!(times, [100, 101, 107, 108, 109, 110].map(Some));
    }

    #[test]
    fn real_gap_costs_its_first_sample() {
        let times = bridged(&[100, 101, 200, 201, 202]);
        assert_eq!(times, [Some(100), Some(101), None, Some(201), Some(202)]);
    }

    #[test]
    fn clock_that_is_set_back_costs_one_sample() {
        let times = bridged(&[900, 901, 5, 6, 7, 300, 9]);
        assert_eq!(times[..3], [Some(900), Some(901), None]);
        assert_eq!(times[3..], [Some(902), Some(903), None, Some(905)]);
    }

    /// Whether each sample of these reads of eight has a time, by the time of their newest sample; ms.
    fn accepted_reads(newest_ms: &[u64]) -> Vec<[bool; 8]> {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let reads = newest_ms.iter().map(|newest_ms| {
            bridge.begin_read(8);
            core::array::from_fn(|sample| {
                let stamp_us = (1_000 * newest_ms).wrapping_sub(1_000 * (7 - sample as u64));
                bridge.next(Timestamp::from_micros(stamp_us)).is_some()
            })
        });
        reads.collect()
    }

    #[test]
    fn read_whose_time_jumps_is_left_out_as_a_whole() {
        let (accepted, left_out) = ([true; 8], [false; 8]);
        for jumped in [140, 1_040, 20] {
            let reads = accepted_reads(&[108, 116, jumped, 132, 140]);
            assert_eq!(reads, [accepted, accepted, left_out, accepted, accepted], "{jumped}");
        }
        // The read after it may be late.
        let reads = accepted_reads(&[108, 116, 300, 134, 142]);
        assert_eq!(reads, [accepted, accepted, left_out, accepted, accepted]);
        // A gap, and a clock that was set back, are confirmed by the next read.
        for read in [500, 8] {
            let reads = accepted_reads(&[108, 116, read, read + 8, read + 16]);
            assert_eq!(reads, [accepted, accepted, left_out, accepted, accepted], "{read}");
        }
    }

    #[test]
    fn clock_of_32_bits_starts_again_without_a_doubt() {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let stamps = (0..6_u64).map(|sample| ((1 << 32) - 2_500 + 1_000 * sample) % (1 << 32));
        let times: Vec<_> =
            stamps.map(|stamp| bridge.next(Timestamp::from_micros(stamp))).collect();
        let first_us = (1 << 32) - 2_500;
        let expected = (0..6).map(|sample| Some(Timestamp::from_micros(first_us + 1_000 * sample)));
        assert_eq!(times, expected.collect::<Vec<_>>());
    }

    #[test]
    fn samples_at_a_lower_rate_are_doubted_once() {
        let times = bridged(&[0, 20, 40, 60, 80]);
        assert_eq!(times, [Some(0), None, Some(40), Some(60), Some(80)]);
    }

    #[test]
    fn clock_that_passes_its_end_goes_on() {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let stamps = (0..6_u64).map(|sample| (u64::MAX - 2_500).wrapping_add(1_000 * sample));
        for stamp in stamps.map(Timestamp::from_micros) {
            assert_eq!(bridge.next(stamp), Some(stamp));
        }
    }

    #[test]
    fn any_other_stamp_is_later_or_in_doubt() {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let (mut stamp_before, mut time_before) = (None, None);
        let mut state = 1_u64;
        let mut doubts = 0;
        for _ in 0..10_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Stamps near 0, at any place, or near the other stamps.
            let stamp = match state >> 62 {
                0 => state >> 50,
                1 => state << 3,
                _ => 1 << 40 | state >> 52,
            };
            doubts += 1;
            if let Some(time) = bridge.next(Timestamp::from_micros(stamp)) {
                let time_us = time.as_micros();
                let is_later = time_before.is_none_or(|before| later_by(time_us, before).is_some());
                assert!(is_later || stamp_before == Some(stamp), "{stamp}: {time:?}");
                time_before = Some(time_us);
                doubts = 0;
            }
            assert!(doubts < 30, "{doubts} samples in doubt in a row");
            stamp_before = Some(stamp);
        }
    }

    /// Orientation of a foot that turned at 5 rad/s one way and then the other, with a gap of 60 ms between.
    fn orientation_after_a_gap(is_bridged: bool) -> Quaternion {
        let config = Params::DEFAULT.validate().expect("the defaults");
        let mut estimator = ContactEstimator::new(&config, Stream::KILOHERTZ);
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let mut orientation = Quaternion::IDENTITY;
        for ms in (0..3_100_u64).filter(|ms| !(3_021..3_080).contains(ms)) {
            let angle = match ms {
                0..3_000 => 0.0,
                3_000..3_050 => 0.005 * (ms - 3_000) as f32,
                _ => 0.25 - 0.005 * (ms - 3_050) as f32,
            };
            let rate = match ms {
                0..3_000 => 0.0,
                3_000..3_050 => 5.0,
                _ => -5.0,
            };
            let stamp = Timestamp::from_micros(1_000 * ms);
            let time = if is_bridged { bridge.next(stamp) } else { Some(stamp) };
            let Some(timestamp) = time else { continue };
            let force = [libm::sinf(angle), libm::cosf(angle)].map(|part| part * STANDARD_GRAVITY);
            let specific_force = SpecificForce(Vec3::new(0.0, force[0], force[1]));
            let angular_rate = AngularRate(Vec3::new(rate, 0.0, 0.0));
            let sample =
                ImuSample { timestamp, specific_force, angular_rate, ..ImuSample::default() };
            orientation = estimator.update(&sample, None).orientation;
        }
        orientation
    }

    #[test]
    fn turn_in_a_gap_is_guessed_as_without_the_bridge() {
        let [bridged, as_stamped] = [true, false].map(orientation_after_a_gap);
        let angle_rad = 2.0 * (bridged.x - as_stamped.x).abs();
        assert!(angle_rad < 0.02, "{bridged:?} instead of {as_stamped:?}");
    }

    /// Share of samples at which a foot that stands is stable, if each 250th stamp jumps by 100 ms.
    fn stable_share(jump_us: i64, is_bridged: bool) -> f32 {
        let config = Params::DEFAULT.validate().expect("the defaults");
        let stream = Stream::new(1_000.0, Gravity::Included).expect("a rate");
        let mut estimator = ContactEstimator::new(&config, stream);
        let mut bridge = Bridge::new(stream);
        let stable = (0..10_000_u64).filter(|sample| {
            let right_us = 1_000_000 + 1_000 * sample;
            let has_jump = sample % 250 == 249;
            let stamp = right_us.saturating_add_signed(if has_jump { jump_us } else { 0 });
            let stamp = Timestamp::from_micros(stamp);
            let time = if is_bridged { bridge.next(stamp) } else { Some(stamp) };
            let Some(timestamp) = time else { return false };
            let specific_force = SpecificForce(Vec3::new(0.0, 0.0, STANDARD_GRAVITY));
            let sample = ImuSample { timestamp, specific_force, ..ImuSample::default() };
            let estimate = estimator.update(&sample, None);
            estimate.decision == Decision::Stable
        });
        stable.count() as f32 / 10_000.0
    }

    #[test]
    fn standing_foot_stays_stable_if_stamps_jump() {
        for jump_us in [100_000, -100_000, 5_000, -5_000] {
            let [as_stamped, bridged] =
                [false, true].map(|is_bridged| stable_share(jump_us, is_bridged));
            assert!(bridged > 0.95, "{jump_us} µs: {as_stamped}, bridged {bridged}");
            assert!(as_stamped < 0.95, "{jump_us} µs: {as_stamped}");
        }
    }
}
