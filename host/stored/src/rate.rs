//! Rate and order of the times of rows.
//!
//! The sample rate of a `csv` follows from the times between its rows, unless it is given. Times that are not in order
//! are repaired: the fewest possible rows are left out, all rows are spaced by their mean rate, or the times are
//! smoothed (`smooth`).

use options::TimeUnit;
use samples::steps::{Steps, median};

use crate::error::{InputError, Problem};

/// Largest deviation of a given sample rate from the rate of the times, as a fraction. The clock of a sensor may be
/// wrong by some per cent; a rate in another unit is far outside.
const RATE_TOLERANCE: f64 = 0.1;

/// [`RATE_TOLERANCE`] for times that scatter. A true rate lies within it, whereas a rate in another unit is far outside.
const SCATTERED_TOLERANCE: f64 = 0.2;

/// Share of steps shorter than half the usual step from which times scatter, because they are times of arrival.
const SCATTERED_SHARE: f64 = 0.05;

/// Multiple of the usual step beyond which a step counts as a gap, in times that scatter.
const GAP_STEPS: u64 = 20;

/// Maximum number of periods in a step. A longer step is a gap, whose number of periods is uncertain.
const MOST_PERIODS: u64 = 3;

/// Returns the given sample rate in Hz, or the rate of the times.
///
/// # Errors
/// They differ by more than the tolerance of the times, or neither is known.
pub fn sample_rate(steps: &Steps, given: Option<f32>, file: &str) -> Result<f32, InputError> {
    match (measured_rate(steps), given) {
        (Some(Measured { rate, tolerance }), Some(given)) if !agree(rate, given, tolerance) => {
            Err(InputError::of_file(file, conflict(rate, given, tolerance)))
        }
        (_, Some(given)) => Ok(given),
        (Some(Measured { rate, .. }), None) => Ok(rate as f32),
        (None, None) => {
            Err(InputError::of_file(file, Problem::UnknownSampleRate { time_column: None }))
        }
    }
}

/// Returns the given rate in Hz, or the rate of the times.
///
/// # Errors
/// They differ by more than a fifth.
pub fn rate_near(measured: f64, given: Option<f32>, file: &str) -> Result<f64, InputError> {
    match given {
        Some(given) if !agree(measured, given, SCATTERED_TOLERANCE) => {
            Err(InputError::of_file(file, conflict(measured, given, SCATTERED_TOLERANCE)))
        }
        given => Ok(given.map_or(measured, f64::from)),
    }
}

/// Sample rate in Hz of increasing times, µs, checked against the given rate, if any, as for a column `t`.
///
/// # Errors
/// The rates differ by more than 10 %, or 20 % if the times scatter, or neither is known.
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
    pub newest_us: Option<i64>,
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
    /// The rates differ by more than 10 %, or 20 % if the times scatter, or neither is known.
    pub fn rate(&self, given: Option<f32>) -> Result<f32, InputError> {
        sample_rate(&self.steps, given, "t")
    }
}

/// Returns whether a given rate, Hz, differs from the measured rate by at most `tolerance`, a fraction of the
/// measured rate.
fn agree(measured: f64, given: f32, tolerance: f64) -> bool {
    (f64::from(given) - measured).abs() <= tolerance * measured
}

/// Plausible rates of sensors, Hz.
pub const PLAUSIBLE_RATES: std::ops::RangeInclusive<f64> = 10.0..=1.0e5;

/// Returns the largest unit below the second in which this step between rows makes a plausible rate of a sensor.
#[must_use]
pub fn unit_of_step(step: f64) -> Option<TimeUnit> {
    let is_plausible = |unit: &TimeUnit| PLAUSIBLE_RATES.contains(&(unit.per_second() / step));
    TimeUnit::COMMON.into_iter().skip(1).find(is_plausible)
}

/// Returns the problem that a given rate contradicts the rate of the times, with the unit in which both would agree.
fn conflict(measured: f64, given: f32, tolerance: f64) -> Problem {
    let mut units = TimeUnit::ALL.into_iter().skip(1);
    let meant = units.find(|unit| agree(unit.per_second() * measured, given, tolerance));
    Problem::SampleRateConflict { measured, given, meant }
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
/// Rows may be displaced by up to a fraction of a period, like samples that wait for a sensor with its own clock. The
/// rate is the inverse of the mean period, with an uncertainty given by the displacement of the rows. The roundest rate
/// within it is chosen.
///
/// A step is one period if no row can be missing. A late row, whose step is long and whose next step is short, then
/// changes nothing. A longer step counts as the nearest number of periods. If times scatter, each step is a period, and
/// a step is a gap only if it is many times as long as the usual step. Short and long steps are kept, because without
/// them the mean would be the usual step.
fn measured_rate(steps: &Steps) -> Option<Measured> {
    let mut sorted = steps.sorted();
    let median = median(&sorted)?;
    let is_short = |(step, _): &&(u64, u64)| 2 * step < median;
    let short: u64 = sorted.iter().filter(is_short).map(|(_, count)| count).sum();
    let scatters = short as f64 >= SCATTERED_SHARE * steps.total() as f64;
    let periods_of = |step: u64| {
        // As in the estimator, a row that is up to three quarters of a period late is not a missing one.
        let is_one = scatters || 4 * step < 7 * median;
        if is_one { 1 } else { (step + median / 2) / median.max(1) }
    };
    sorted.retain(|(step, _)| {
        if scatters { *step < GAP_STEPS * median } else { periods_of(*step) <= MOST_PERIODS }
    });
    let displacements =
        || sorted.iter().map(|(step, _)| *step as f64 - (periods_of(*step) * median) as f64);
    let displacement = displacements().reduce(f64::max)? - displacements().reduce(f64::min)?;
    let kept: u64 = sorted.iter().map(|(_, count)| count).sum();
    let runs = (steps.total() - kept + 1) as f64;
    let periods: u64 = sorted.iter().map(|(step, count)| periods_of(*step) * count).sum();
    let periods = periods.max(1) as f64;
    let mean = sorted.iter().map(|(step, count)| step * count).sum::<u64>() as f64 / periods;
    let uncertainty = runs * displacement / periods;
    let rate =
        roundest(1.0e6 / (mean + uncertainty), 1.0e6 / mean, 1.0e6 / (mean - uncertainty).max(1.0));
    let tolerance = if scatters { SCATTERED_TOLERANCE } else { RATE_TOLERANCE };
    Some(Measured { rate, tolerance })
}

/// The roundest number from `lowest` to `highest`: the multiple nearest to `rate` of the largest power of ten
/// that has such a multiple. `rate` itself if there is none.
pub fn roundest(lowest: f64, rate: f64, highest: f64) -> f64 {
    [1.0e4, 1.0e3, 1.0e2, 1.0e1, 1.0]
        .into_iter()
        .map(|unit| (rate / unit).round() * unit)
        .find(|round| *round > 0.0 && (lowest..=highest).contains(round))
        .unwrap_or(rate)
}

/// Flags of the rows to keep so that times advance and the fewest possible rows are left out: the longest
/// increasing subsequence (patience sorting).
pub fn longest_increase(times_us: &[i64]) -> Vec<bool> {
    // For each length, the row with the earliest time at which a sequence of that length can end.
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = Vec::with_capacity(times_us.len());
    for (row, time) in times_us.iter().enumerate() {
        let length = ends.partition_point(|end| times_us[*end] < *time);
        before.push(length.checked_sub(1).map(|shorter| ends[shorter]));
        if length == ends.len() {
            ends.push(row);
        } else {
            ends[length] = row;
        }
    }
    let mut kept = vec![false; times_us.len()];
    let mut row = ends.last().copied();
    while let Some(this) = row {
        kept[this] = true;
        row = before[this];
    }
    kept
}

/// Returns the number of rows that are left out because their stamps jitter. Such a row is in the wrong order, not
/// repeated, and close to the rows around it.
pub fn jittering(times_us: &[i64], kept: &[bool]) -> usize {
    let mut steps = Steps::default();
    let mut newest_us = None;
    let rows = || times_us.iter().copied().zip(kept.iter().copied());
    for (time_us, _) in rows().filter(|(_, is_kept)| *is_kept) {
        if let Some(before_us) = newest_us.replace(time_us) {
            steps.add(time_us.abs_diff(before_us));
        }
    }
    let near_us = GAP_STEPS.saturating_mul(median(&steps.sorted()).unwrap_or_default());
    let mut before_us = None;
    let mut count = 0;
    for (time_us, is_kept) in rows() {
        if is_kept {
            before_us = Some(time_us);
        } else if let Some(before_us) = before_us {
            count += usize::from(time_us != before_us && time_us.abs_diff(before_us) < near_us);
        }
    }
    count
}

/// Step below which rows arrive together, µs. No sensor is read at such a rate.
const LEAST_STEP_US: u64 = 100;

/// Step from which the clock jumps, µs, if it is also [`UNUSUAL`].
const JUMP_US: u64 = 1_000_000;

/// Multiple of the usual step from which a step is unusual.
const UNUSUAL: u64 = 20;

/// Mean rate in Hz of rows that arrive in batches: the roundest within the uncertainty, which is one batch. Jumps
/// of the clock, forward over a gap or back after a restart, are excluded.
pub fn mean_rate(times_us: &[i64]) -> Option<f64> {
    let steps = || times_us.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
    let mut seen = Steps::default();
    steps()
        .map(i64::unsigned_abs)
        .filter(|step| *step >= LEAST_STEP_US)
        .for_each(|step| seen.add(step));
    let usual = median(&seen.sorted()).unwrap_or(0);
    let jump = JUMP_US.max(usual.saturating_mul(UNUSUAL));
    let (mut span, mut periods, mut longest) = (0_i64, 0_u64, 0);
    let mut is_after_jump = false;
    for step in steps() {
        let size = step.unsigned_abs();
        // Rows that arrive at once after a jump were taken during the jump, so they are excluded with it.
        is_after_jump = size > jump || (is_after_jump && size < usual / 4);
        if !is_after_jump {
            span += step;
            periods += 1;
            longest = longest.max(step);
        }
    }
    if periods == 0 || span <= 0 {
        return None;
    }
    let (periods, batch) = (periods as f64, longest as f64);
    let span = span as f64;
    // Remaining gaps are not batches; they must not make every rate possible.
    let batch = batch.min(span / 20.0);
    let rate = |span: f64| 1.0e6 * periods / span;
    Some(roundest(rate(span + batch), rate(span), rate(span - batch)))
}

/// Number of rows that are more than half a period away from their place, counted from the first row at `rate` in Hz.
pub fn moved(times_us: &[i64], rate: f64) -> usize {
    let Some(first) = times_us.first() else {
        return 0;
    };
    let period_us = 1.0e6 / rate;
    let is_elsewhere = |(row, time): &(usize, &i64)| {
        let place = *first as f64 + *row as f64 * period_us;
        (**time as f64 - place).abs() > 0.5 * period_us
    };
    times_us.iter().enumerate().filter(is_elsewhere).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::SmallRng;
    use rand::{RngExt, SeedableRng};

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
        // The median is 1003 µs, because few short steps compensate small delays.
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
        // Delays from 0 to 3 ms of samples at 1 kHz, in order. Many samples arrive together with the previous one, and
        // there is a gap of 2 s.
        let mut random = SmallRng::seed_from_u64(1);
        let mut newest = 0;
        let times: Vec<u64> = (0..20_000)
            .map(|tick: u64| {
                let sent = 1000 * tick + if tick < 9000 { 0 } else { 2_000_000 };
                newest = (sent + random.random_range(0..3000)).max(newest + 20);
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
    fn given_rate_within_ten_percent_of_the_times_takes_precedence() {
        let times = [0, 10_000, 20_000];
        for given in [90.1, 99.1, 109.9] {
            assert_eq!(sample_rate(&steps(&times), Some(given), "x").unwrap(), given);
        }
        for given in [89.9, 110.1] {
            assert!(sample_rate(&steps(&times), Some(given), "x").is_err(), "{given}");
        }
    }

    #[test]
    fn jittered_rates_of_a_sensor_are_not_rounded_to_others() {
        let mut random = SmallRng::seed_from_u64(1);
        // Rates of the LSM6DSOX, with the time of arrival late by up to a share of a period.
        for rate in [104.0, 208.0, 416.0, 833.0, 1_666.0] {
            for share in [0.05, 0.3, 0.6] {
                let times: Vec<u64> = (0..5_000)
                    .map(|k| {
                        let late: f64 = random.random_range(0.0..share);
                        ((f64::from(k) + late) * 1.0e6 / rate) as u64
                    })
                    .collect();
                let measured = measured_rate(&steps(&times)).expect("a rate").rate;
                assert!((measured / rate - 1.0).abs() < 2.0e-3, "{rate}, {share}: {measured}");
                assert_eq!(
                    sample_rate(&steps(&times), Some(rate as f32), "x").unwrap(),
                    rate as f32
                );
            }
        }
    }

    fn kept(times: &[i64]) -> Vec<i64> {
        let kept = longest_increase(times);
        times.iter().zip(kept).filter(|(_, kept)| *kept).map(|(time, _)| *time).collect()
    }

    #[test]
    fn fewest_possible_rows_are_left_out() {
        assert_eq!(kept(&[]), [0; 0]);
        assert_eq!(kept(&[0, 1, 2, 3]), [0, 1, 2, 3]);
        assert_eq!(kept(&[0, 1, 1, 2]), [0, 1, 2]);
        // A single row far ahead is left out, not all rows up to its time.
        assert_eq!(kept(&[0, 1, 900, 2, 3, 4]), [0, 1, 2, 3, 4]);
        assert_eq!(kept(&[5, 6, 7, 0, 8, 9]), [5, 6, 7, 8, 9]);
        // If the clock restarts, the longer part of the rows is kept.
        assert_eq!(kept(&[8, 9, 0, 1, 2]), [0, 1, 2]);
    }

    #[test]
    fn batches_have_the_rate_of_their_rows() {
        // Ten rows at once every 10 ms.
        let times: Vec<i64> = (0..1000).map(|row| row / 10 * 10_000).collect();
        assert_eq!(mean_rate(&times), Some(1000.0));
        assert_eq!(mean_rate(&[7]), None);
        assert_eq!(mean_rate(&[7, 7]), None);
    }

    #[test]
    fn clock_jump_does_not_change_the_rate() {
        let steady = |rows: std::ops::Range<i64>, start: i64| rows.map(move |k| start + 1000 * k);
        let rate = |parts: [std::ops::Range<i64>; 2], starts: [i64; 2]| {
            let [first, second] = parts;
            let times: Vec<i64> =
                steady(first, starts[0]).chain(steady(second, starts[1])).collect();
            mean_rate(&times)
        };
        let ten_seconds = 10_000_000;
        for starts in [[0, ten_seconds], [0, -ten_seconds], [0, 1_700_000_000_000_000]] {
            assert_eq!(rate([0..5000, 0..9000], starts), Some(1000.0), "{starts:?}");
        }
        // A batch of 2 s is not a jump.
        let batches: Vec<i64> = (0..200_000).map(|row| row / 2000 * 2_000_000).collect();
        assert_eq!(mean_rate(&batches), Some(1000.0));
        // Rows of 3 s that arrived late, all at once.
        let late: Vec<i64> = steady(0..14_000, 0)
            .map(|time| match time {
                5_000_000..8_000_000 => 8_000_000,
                _ => time,
            })
            .collect();
        assert_eq!(mean_rate(&late), Some(1000.0));
        // Batches with a gap.
        let gap = |row: i64| row / 10 * 10_000 + if row < 5000 { 0 } else { 9_000_000 };
        assert_eq!(mean_rate(&(0..14_000).map(gap).collect::<Vec<_>>()), Some(1000.0));
        // A single row far ahead, and back.
        let mut far: Vec<i64> = steady(0..5000, 0).collect();
        far[3000] = 1_000_000_000_000;
        assert_eq!(mean_rate(&far), Some(1000.0));
        // Decreasing times have no rate.
        assert_eq!(mean_rate(&[3000, 2000, 1000]), None);
    }

    #[test]
    fn row_counts_as_moved_from_half_a_period_on() {
        assert_eq!(moved(&[0, 1_000, 2_400, 3_000], 1000.0), 0);
        assert_eq!(moved(&[0, 0, 0, 3_000], 1000.0), 2);
    }

    #[test]
    fn median_is_that_of_all_steps() {
        let mut steps = Steps::default();
        assert_eq!(median(&steps.sorted()), None);
        for step in [5, 1, 9, 5, 7, 1] {
            steps.add(step);
        }
        assert_eq!(steps.total(), 6);
        assert_eq!(steps.sorted(), [(1, 2), (5, 2), (7, 1), (9, 1)]);
        assert_eq!(median(&steps.sorted()), Some(5));
    }
}
