//! Repair of times that are not in order.

use super::rate::roundest;
use crate::steps::{Steps, median};

/// Flags of the rows to keep so that times advance and the fewest possible rows are left out: the longest
/// increasing subsequence (patience sorting).
pub(super) fn longest_increase(times_us: &[i64]) -> Vec<bool> {
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

/// Step below which rows arrive together, µs: no sensor is read at this rate.
const LEAST_STEP_US: u64 = 100;

/// Step from which the clock jumps, µs, if it is also [`UNUSUAL`].
const JUMP_US: u64 = 1_000_000;

/// Multiple of the usual step from which a step is unusual.
const UNUSUAL: u64 = 20;

/// Mean rate in Hz of rows that arrive in batches: the roundest within the uncertainty, which is one batch. Jumps
/// of the clock, forward over a gap or back after a restart, are excluded.
pub(super) fn mean_rate(times_us: &[i64]) -> Option<f64> {
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
        // Rows that come at once after a jump were delayed: the jump is as long as they took.
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

/// Number of rows that are more than half a period away from their place at `rate` in Hz from the first.
pub(super) fn moved(times_us: &[i64], rate: f64) -> usize {
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
        // A clock that restarts keeps its longer part.
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
}
