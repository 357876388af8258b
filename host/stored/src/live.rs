//! Times of a live stream: kept as they are, or smoothed while they jitter around a steady rate.
//!
//! A file is smoothed with the rows before and after each row. A live stream has only the rows before, so its clock
//! follows the stamps with a small part of each error. No sample is delayed.

use std::collections::VecDeque;

/// Number of steps by which the stream is judged.
const JUDGED: usize = 100;

/// Deviation of a step from the mean beyond which it is uneven, as a fraction, and the number of uneven steps in each
/// half of the judged ones from which times jitter.
const UNEVEN: f64 = 0.25;
const LEAST_UNEVEN: usize = 3;

/// Multiple of the mean step beyond which a step is a gap.
const GAP_STEPS: f64 = 4.0;

/// Largest change of the mean step between both halves of the judged steps at a steady rate, as a fraction.
const STEADY: f64 = 0.1;

/// Part of the error of a smooth time that the next one corrects.
const FOLLOWED: f64 = 0.05;

/// Times of a live stream.
#[derive(Clone, Debug, Default)]
pub struct LiveTimes {
    newest_us: Option<i64>,
    steps_us: VecDeque<f64>,
    /// Newest smooth time, µs, while times are smoothed.
    smooth_us: Option<f64>,
    /// Newest time that was returned, µs.
    given_us: i64,
}

impl LiveTimes {
    /// Returns the time of the sample with this stamp, µs. Times increase as long as stamps do.
    pub fn time_us(&mut self, stamp_us: i64) -> i64 {
        let Some(before_us) = self.newest_us.replace(stamp_us) else {
            self.given_us = stamp_us;
            return stamp_us;
        };
        let step_us = (stamp_us - before_us) as f64;
        if self.is_gap(step_us) {
            *self = Self { newest_us: Some(stamp_us), given_us: stamp_us, ..Self::default() };
            return stamp_us;
        }
        self.steps_us.push_back(step_us);
        if self.steps_us.len() > JUDGED {
            self.steps_us.pop_front();
        }
        let time_us = match self.period_us() {
            Some(period_us) => {
                let from_us = self.smooth_us.unwrap_or(before_us as f64);
                let expected_us = from_us + period_us;
                let smooth_us = expected_us + FOLLOWED * (stamp_us as f64 - expected_us);
                self.smooth_us = Some(smooth_us);
                smooth_us.round() as i64
            }
            None => {
                self.smooth_us = None;
                stamp_us
            }
        };
        self.given_us = if stamp_us > before_us { time_us.max(self.given_us + 1) } else { time_us };
        self.given_us
    }

    /// Returns whether times are smoothed now.
    #[must_use]
    pub const fn is_smoothing(&self) -> bool {
        self.smooth_us.is_some()
    }

    fn is_gap(&self, step_us: f64) -> bool {
        let mean_us = mean(self.steps_us.iter().copied());
        step_us <= 0.0 || mean_us.is_some_and(|mean_us| step_us > GAP_STEPS * mean_us)
    }

    /// Mean step, µs, if the stamps jitter around a steady rate.
    fn period_us(&self) -> Option<f64> {
        if self.steps_us.len() < JUDGED {
            return None;
        }
        let mean_us = mean(self.steps_us.iter().copied())?;
        let half = |from| self.steps_us.iter().skip(from).take(JUDGED / 2).copied();
        let [first, second] = [0, JUDGED / 2].map(|from| mean(half(from)).unwrap_or(mean_us));
        let is_uneven = |step_us: &f64| (step_us - mean_us).abs() > UNEVEN * mean_us;
        let is_jittering = |from| half(from).filter(is_uneven).count() >= LEAST_UNEVEN;
        let is_steady = (first - second).abs() < STEADY * mean_us;
        (is_steady && is_jittering(0) && is_jittering(JUDGED / 2)).then_some(mean_us)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps of samples at 55 Hz, each up to 5 ms late.
    fn jittering(rows: i64) -> impl Iterator<Item = (i64, i64)> {
        (0..rows).map(|row| (18_000 * row, 18_000 * row + row * 7_919 % 10_000 - 5_000))
    }

    #[test]
    fn jitter_of_a_live_stream_is_smoothed_after_the_first_samples() {
        let mut times = LiveTimes::default();
        let mut newest_us = i64::MIN;
        for (true_us, stamp_us) in jittering(1000) {
            let time_us = times.time_us(stamp_us);
            assert!(time_us > newest_us);
            newest_us = time_us;
            if true_us > 18_000 * 200 {
                assert!((time_us - true_us).abs() < 2_000, "{time_us}, {true_us}");
            }
        }
        assert!(times.is_smoothing());
    }

    #[test]
    fn steady_stamps_are_unchanged() {
        let mut times = LiveTimes::default();
        for row in 0..1000 {
            let stamp_us = 2_000 * row + row % 200;
            assert_eq!(times.time_us(stamp_us), stamp_us);
        }
    }

    #[test]
    fn gap_and_change_of_the_rate_stay_in_a_live_stream() {
        let mut times = LiveTimes::default();
        let mut last = 0;
        for (_, stamp_us) in jittering(300) {
            last = stamp_us;
            times.time_us(stamp_us);
        }
        let after_us = last + 700_000;
        assert_eq!(times.time_us(after_us), after_us);
        for row in 1..400 {
            let stamp_us =
                after_us + if row < 200 { 10_000 * row } else { 1_000_000 + 5_000 * row };
            assert_eq!(times.time_us(stamp_us), stamp_us);
        }
    }
}
