//! Sample rate of a `csv`: that of the times between its rows, or the given one.

use crate::input::error::InputError;
use crate::steps::{Steps, median};

/// Largest deviation of a given sample rate from that of the times, as a fraction.
const RATE_TOLERANCE: f64 = 0.01;

/// The same where times scatter: a true rate lies within it, one in another unit far outside.
const SCATTERED_TOLERANCE: f64 = 0.2;

/// Share of steps of less than half the usual one from which times scatter: they are times of arrival.
const SCATTERED_SHARE: f64 = 0.05;

/// Multiple of the usual step from which a step is a gap in times that scatter.
const GAP_STEPS: u64 = 20;

/// Sample rate in Hz on which times and hint agree.
pub(super) fn sample_rate(
    steps: &Steps,
    given: Option<f32>,
    file: &str,
) -> Result<f32, InputError> {
    match (measured_rate(steps), given) {
        (Some(Measured { rate, tolerance }), Some(given)) if !agree(rate, given, tolerance) => {
            Err(InputError::SampleRateConflict {
                file: file.to_owned(),
                measured: rate,
                given,
                in_milliseconds: agree(1.0e3 * rate, given, tolerance),
            })
        }
        (_, Some(given)) => Ok(given),
        (Some(Measured { rate, .. }), None) => Ok(rate as f32),
        (None, None) => {
            Err(InputError::UnknownSampleRate { file: file.to_owned(), time_column: None })
        }
    }
}

/// Sample rate in Hz of increasing times, µs, checked against the given rate, if any, as for a column `t`.
///
/// # Errors
/// The rates differ by more than 1 %, or neither is known.
pub fn rate_of_times(times_us: &[i64], given: Option<f32>) -> Result<f32, InputError> {
    let mut times = TimesSoFar::default();
    times_us.iter().for_each(|time_us| times.add(*time_us));
    times.rate(given)
}

/// Increasing times and their rate.
#[derive(Default)]
pub struct TimesSoFar {
    steps: Steps,
    /// Newest time, µs; `None` before the first.
    pub(super) newest_us: Option<i64>,
}

impl TimesSoFar {
    /// Adds the next time, µs.
    pub fn add(&mut self, time_us: i64) {
        if let Some(before_us) = self.newest_us.replace(time_us) {
            self.steps.add(before_us.abs_diff(time_us));
        }
    }

    /// Sample rate in Hz of the times, checked against the given rate, if any, as for a column `t`.
    ///
    /// # Errors
    /// The rates differ by more than 1 %, or neither is known.
    pub fn rate(&self, given: Option<f32>) -> Result<f32, InputError> {
        sample_rate(&self.steps, given, "t")
    }
}

fn agree(measured: f64, given: f32, tolerance: f64) -> bool {
    (f64::from(given) - measured).abs() <= tolerance * measured
}

/// Rate of times.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Measured {
    /// Hz.
    rate: f64,
    /// Largest deviation of a given rate from it, as a fraction.
    tolerance: f64,
}

/// Rate of the steps between rows, gaps excluded.
///
/// Rows may be displaced by up to a fraction of a period, like samples that wait for a sensor with its own clock.
/// The rate is the inverse of the mean step, with an uncertainty given by the displacement of the rows; the
/// roundest rate within it is chosen. Where times scatter, a step is a gap only if it is many times as long as the usual one:
/// without the short and the long ones the mean would be that of the middle.
fn measured_rate(steps: &Steps) -> Option<Measured> {
    let mut sorted = steps.sorted();
    let median = median(&sorted)?;
    let is_short = |(step, _): &&(u64, u64)| 2 * step < median;
    let short: u64 = sorted.iter().filter(is_short).map(|(_, count)| count).sum();
    let scatters = short as f64 >= SCATTERED_SHARE * steps.total() as f64;
    sorted.retain(|(step, _)| match scatters {
        true => *step < GAP_STEPS * median,
        false => 2 * step.abs_diff(median) <= median,
    });
    let (shortest, longest) = (sorted.first()?.0, sorted.last()?.0);
    let kept: u64 = sorted.iter().map(|(_, count)| count).sum();
    let runs = (steps.total() - kept + 1) as f64;
    let count = kept as f64;
    let mean = sorted.iter().map(|(step, count)| step * count).sum::<u64>() as f64 / count;
    let uncertainty = runs * (longest - shortest) as f64 / count;
    let rate =
        roundest(1.0e6 / (mean + uncertainty), 1.0e6 / mean, 1.0e6 / (mean - uncertainty).max(1.0));
    let tolerance = if scatters { SCATTERED_TOLERANCE } else { RATE_TOLERANCE };
    Some(Measured { rate, tolerance })
}

/// `rate`, or the nearest multiple of the largest power of ten that has a multiple from `lowest` to `highest`.
pub(super) fn roundest(lowest: f64, rate: f64, highest: f64) -> f64 {
    [1.0e4, 1.0e3, 1.0e2, 1.0e1, 1.0]
        .into_iter()
        .map(|unit| (rate / unit).round() * unit)
        .find(|round| *round > 0.0 && (lowest..=highest).contains(round))
        .unwrap_or(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps between times, µs.
    fn steps(times: &[u64]) -> Steps {
        let mut steps = Steps::default();
        for pair in times.windows(2) {
            steps.add(pair[1] - pair[0]);
        }
        steps
    }

    #[test]
    fn rate_excludes_gaps() {
        let times = [0, 3_500, 7_000, 90_000, 93_500];
        let Measured { rate, .. } = measured_rate(&steps(&times)).unwrap();
        assert!((rate - 285.714).abs() < 1e-3, "{rate}");
        assert_eq!(measured_rate(&steps(&times[..1])), None);
    }

    #[test]
    fn rows_waiting_for_sensor_edges_have_the_tick_rate() {
        for period in [146, 150, 153, 155] {
            for rows in [50, 500, 5_000] {
                let edge = |tick: u64| (tick * 1000).next_multiple_of(period);
                let times: Vec<_> = (0..rows).map(edge).collect();
                let rate = measured_rate(&steps(&times)).map(|measured| measured.rate);
                assert_eq!(rate, Some(1000.0), "{period} µs, {rows} rows");
            }
        }
    }

    #[test]
    fn jitter_does_not_bias_the_rate() {
        // Few short steps compensate small delays: the median is 1003 µs.
        let times: Vec<_> = [1003, 1003, 1003, 991]
            .into_iter()
            .cycle()
            .take(4000)
            .scan(0, |now, step| {
                *now += step;
                Some(*now)
            })
            .collect();
        let Measured { rate, .. } = measured_rate(&steps(&times)).unwrap();
        assert!((rate - 1000.0).abs() < 0.01, "{rate}");
    }

    #[test]
    fn times_of_arrival_have_their_mean_rate_or_the_given_one() {
        // Delays from 0 to 3 ms of samples at 1 kHz, in order: many arrive with the one before, and there is a gap of 2 s.
        let mut random = 1_u64;
        let mut newest = 0;
        let times: Vec<u64> = (0..20_000)
            .map(|tick: u64| {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let sent = 1000 * tick + if tick < 9000 { 0 } else { 2_000_000 };
                newest = (sent + (random >> 33) % 3000).max(newest + 20);
                newest
            })
            .collect();
        let steps = steps(&times);
        let rate = sample_rate(&steps, None, "x").unwrap();
        assert!((rate - 1000.0).abs() < 2.0, "{rate}");
        assert_eq!(sample_rate(&steps, Some(990.0), "x").unwrap(), 990.0);
        assert!(sample_rate(&steps, Some(500.0), "x").is_err());
    }

    #[test]
    fn nan_rate_agrees_with_no_times() {
        let times = [0, 10_000, 20_000];
        assert!(sample_rate(&steps(&times), Some(f32::NAN), "x").is_err());
    }

    #[test]
    fn rate_within_one_percent_of_the_times_is_accepted() {
        let times = [0, 10_000, 20_000];
        assert_eq!(sample_rate(&steps(&times), Some(100.9), "x").unwrap(), 100.9);
        assert!(sample_rate(&steps(&times), Some(101.1), "x").is_err());
    }
}
