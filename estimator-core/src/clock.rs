//! Times of a clock that glitches, before they reach the estimator.

use crate::sample::Timestamp;
use crate::stream::Stream;

/// Longest step that an estimator bridges by itself, µs: half of its window.
const BRIDGED_US: u64 = 13_000;

/// Bridge over single timestamps that jump and come back.
///
/// A clock may give one sample a time 100 ms late, and the next one the right time. To an estimator this is a gap, and then
/// a time that is not later than the one before: it forgets that the foot stands, and waits until it has seen it
/// stand again. The bridge gives the estimator the time that was due, and says that this sample is in doubt. The next
/// sample shows whether the time has come back. If it has not, the gap or the new time is real, and the estimator gets it.
///
/// Times without a jump pass unchanged, and so do gaps that the estimator bridges itself.
///
/// ```
/// use estimator_core::clock::Bridge;
/// use estimator_core::{Stream, Timestamp};
///
/// let mut bridge = Bridge::new(Stream::KILOHERTZ);
/// let stamps = [1_000, 2_000, 103_000, 4_000, 5_000].map(Timestamp::from_micros);
/// let bridged = stamps.map(|stamp| bridge.next(stamp));
/// assert_eq!(bridged.map(|time| time.timestamp.as_micros()), [1_000, 2_000, 3_000, 4_000, 5_000]);
/// assert_eq!(bridged.map(|time| time.is_in_doubt), [false, false, true, false, false]);
/// ```
#[derive(Clone, Debug)]
pub struct Bridge {
    period_us: u64,
    /// State after the first sample.
    state: Option<State>,
}

/// State of a [`Bridge`].
#[derive(Clone, Debug)]
struct State {
    /// Stamp of the newest sample, µs.
    stamp_us: u64,
    /// Stamp before the newest one, if that is further on than one period; µs.
    before_jump_us: Option<u64>,
    /// Time that the estimator got for the newest sample, µs.
    given_us: u64,
    /// From stamps to the estimator's times, µs, modulo 2⁶⁴. It differs from 0 once a clock was set back.
    offset_us: u64,
}

/// Time for the estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bridged {
    /// Time to give to the estimator. It is later than the one before, unless the stamp is repeated.
    pub timestamp: Timestamp,
    /// Whether the stamp has jumped, so that the time is only presumed. Do not rely on the estimate of this sample.
    pub is_in_doubt: bool,
}

impl Bridge {
    /// Bridge for the samples of a stream.
    #[must_use]
    pub fn new(stream: Stream) -> Self {
        Self { period_us: stream.period_us(), state: None }
    }

    /// Returns the time of the next sample for the estimator. A stamp that equals the one before keeps its time, so that
    /// the estimator rejects the sample.
    pub fn next(&mut self, stamp: Timestamp) -> Bridged {
        let stamp_us = stamp.as_micros();
        let (gap_us, longest_us) = (self.gap_us(), self.longest_us());
        let due_us = 2 * self.period_us + gap_us;
        let Some(state) = &mut self.state else {
            self.state =
                Some(State { stamp_us, before_jump_us: None, given_us: stamp_us, offset_us: 0 });
            return Bridged { timestamp: stamp, is_in_doubt: false };
        };
        let follows = |from_us: u64, within_us: u64| {
            stamp_us.checked_sub(from_us).is_some_and(|step_us| step_us > 0 && step_us < within_us)
        };
        let next_us = state.given_us.saturating_add(self.period_us);
        let has_returned = state.before_jump_us.is_some_and(|before_us| follows(before_us, due_us));
        let is_in_doubt = if stamp_us == state.stamp_us {
            false
        } else if has_returned || follows(state.stamp_us, longest_us) {
            let is_gap = !has_returned && !follows(state.stamp_us, gap_us);
            state.before_jump_us = is_gap.then_some(state.stamp_us);
            state.given_us = match stamp_us.wrapping_add(state.offset_us) {
                continued_us if continued_us > state.given_us => continued_us,
                // The clock was set back, or the estimator has the time of a small jump that came back.
                _ => next_us,
            };
            state.offset_us = state.given_us.wrapping_sub(stamp_us);
            false
        } else {
            state.before_jump_us = Some(state.stamp_us);
            state.given_us = next_us;
            true
        };
        state.stamp_us = stamp_us;
        Bridged { timestamp: Timestamp::from_micros(state.given_us), is_in_doubt }
    }

    /// Returns the time of a stamp for the estimator, as if it did not jump, without taking it.
    #[must_use]
    pub fn presumed(&self, stamp: Timestamp) -> Timestamp {
        let offset_us = self.state.as_ref().map_or(0, |state| state.offset_us);
        Timestamp::from_micros(stamp.as_micros().wrapping_add(offset_us))
    }

    /// Step from which on a sample is missing, µs, as in the estimator.
    const fn gap_us(&self) -> u64 {
        2 * self.period_us - self.period_us / 4
    }

    /// Step from which on it is a jump, µs.
    const fn longest_us(&self) -> u64 {
        let missing_us = if BRIDGED_US > self.period_us { BRIDGED_US } else { self.period_us };
        missing_us + self.gap_us()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactEstimator;
    use crate::params::Params;
    use crate::phase::Decision;
    use crate::sample::{ImuSample, SpecificForce};
    use crate::stream::Gravity;
    use crate::units::STANDARD_GRAVITY;
    use crate::vector::Vec3;
    use std::vec::Vec;

    /// Times for the estimator at 1 kHz, and places of the samples in doubt.
    fn bridged(stamps_ms: &[u64]) -> (Vec<u64>, Vec<usize>) {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let bridged = stamps_ms.iter().map(|ms| bridge.next(Timestamp::from_micros(1_000 * ms)));
        let bridged: Vec<Bridged> = bridged.collect();
        let times = bridged.iter().map(|time| time.timestamp.as_micros() / 1_000).collect();
        let doubts = bridged.iter().enumerate().filter(|(_, time)| time.is_in_doubt);
        (times, doubts.map(|(place, _)| place).collect())
    }

    #[test]
    fn stamps_without_a_jump_pass_unchanged() {
        for stamps in [&[7, 8, 9, 10][..], &[7, 8, 10, 11, 12], &[7, 8, 8, 8, 9], &[1, 15, 16, 30]]
        {
            assert_eq!(bridged(stamps), (stamps.to_vec(), Vec::new()));
        }
    }

    #[test]
    fn single_jump_costs_one_sample_in_either_direction() {
        for jump in [500, 200, 130, 60, 0] {
            let stamps = [100, 101, jump, 103, 104, 105];
            assert_eq!(bridged(&stamps), ((100..106).collect(), [2].to_vec()), "{jump}");
        }
    }

    #[test]
    fn small_jump_that_comes_back_goes_on() {
        let (times, doubts) = bridged(&[100, 101, 107, 103, 104, 105]);
        assert_eq!((times, doubts), ([100, 101, 107, 108, 109, 110].to_vec(), Vec::new()));
    }

    #[test]
    fn real_gap_arrives_one_sample_late() {
        let (times, doubts) = bridged(&[100, 101, 200, 201, 202]);
        assert_eq!((times, doubts), ([100, 101, 102, 201, 202].to_vec(), [2].to_vec()));
    }

    #[test]
    fn clock_that_is_set_back_costs_one_sample() {
        let (times, doubts) = bridged(&[900, 901, 5, 6, 7, 300, 9]);
        assert_eq!(times, [900, 901, 902, 903, 904, 905, 906]);
        assert_eq!(doubts, [2, 5]);
    }

    #[test]
    fn any_stamps_give_times_that_increase() {
        let mut bridge = Bridge::new(Stream::KILOHERTZ);
        let mut before = None;
        let mut state = 1_u64;
        for _ in 0..10_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Near 0, anywhere, or near the others.
            let stamp = match state >> 62 {
                0 => state >> 50,
                1 => state << 3,
                _ => 1 << 40 | state >> 52,
            };
            let time = bridge.next(Timestamp::from_micros(stamp)).timestamp;
            let is_later = before.is_none_or(|before| time >= before);
            assert!(is_later, "{before:?} {time:?}");
            before = Some(time);
        }
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
            let Bridged { timestamp, is_in_doubt } = if is_bridged {
                bridge.next(stamp)
            } else {
                Bridged { timestamp: stamp, is_in_doubt: false }
            };
            let specific_force = SpecificForce(Vec3::new(0.0, 0.0, STANDARD_GRAVITY));
            let sample = ImuSample { timestamp, specific_force, ..ImuSample::default() };
            let estimate = estimator.update(&sample, None);
            estimate.decision == Decision::Stable && !is_in_doubt
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
