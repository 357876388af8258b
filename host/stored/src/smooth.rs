//! Smooth times of rows whose stamps jitter. Between gaps the rows are spaced like their samples, and gaps stay.
//!
//! The displacement of a row is its stamp minus its place at a constant period. Jitter changes the displacement from row to
//! row, the sensor's clock changes it slowly, and a gap changes it at once. Each row gets the median displacement of the
//! rows around it. The median follows a clock and a step, and hardly jitters. A long gap separates the rows on both sides.

use std::ops::Range;

use crate::rate::roundest;

/// Number of rows before and after a row whose displacements are used for it.
const NEIGHBOURS: usize = 50;

/// Share of the steps that are usual, from the shortest on.
const USUAL_SHARE: f64 = 0.99;

/// A step is a gap if it is at least this multiple of the longest usual step.
const GAP_STEPS: f64 = 2.0;

/// A gap has at least this number of periods.
const LEAST_GAP_PERIODS: f64 = 4.0;

/// Longest pause of a receiver after which the waiting rows may arrive together, µs.
const LONGEST_STALL_US: f64 = 10.0e6;

/// Result of smoothing.
pub struct Smoothed {
    /// Time of each row, µs; `None` for a row left out because its part of the recording overlaps another.
    pub times_us: Vec<Option<i64>>,
    /// Rate of the rows between gaps, Hz.
    pub rate: f64,
    /// Number of gaps.
    pub gaps: usize,
}

/// Smooths times in µs; `None` if they do not advance.
pub fn smoothed(stamps_us: &[i64]) -> Option<Smoothed> {
    let usual = Usual::of(stamps_us)?;
    let first_us = *stamps_us.first()?;
    let displaced = |period_us: f64| {
        let places = stamps_us.iter().enumerate();
        let mut displacements: Vec<f64> = places
            .map(|(row, stamp_us)| (stamp_us - first_us) as f64 - row as f64 * period_us)
            .collect();
        let parts = parts(&mut displacements, period_us, usual.gap_us);
        (displacements, parts)
    };
    // The usual period ignores the pause of a receiver, but not the rows that arrived at once after it.
    let (displacements, parts) = displaced(usual.period_us);
    let period_us = usual.period_us + drift(&displacements, &parts);
    let (displacements, parts) = displaced(period_us);
    let mut times_us = vec![None; stamps_us.len()];
    let mut smooth_parts = Vec::with_capacity(parts.len());
    for part in parts {
        let mut newest_us = f64::NEG_INFINITY;
        let medians = running_medians(&displacements[part.clone()]);
        for (row, median) in part.clone().zip(medians) {
            // The median may fall, but rows stay in order.
            let time_us = row as f64 * period_us + median;
            newest_us = time_us.max(newest_us + period_us / 2.0);
            times_us[row] = Some(first_us + newest_us.round() as i64);
        }
        smooth_parts.push(part);
    }
    let kept = longest_chain(&smooth_parts, &times_us);
    let gaps = kept.iter().filter(|is_kept| **is_kept).count().saturating_sub(1);
    for (part, is_kept) in smooth_parts.into_iter().zip(kept) {
        if !is_kept {
            times_us[part].fill(None);
        }
    }
    Some(Smoothed { times_us, rate: usual.rate_of(period_us), gaps })
}

/// Mean change of the displacement from row to row within parts, µs.
fn drift(displacements: &[f64], parts: &[Range<usize>]) -> f64 {
    let long = parts.iter().filter(|part| part.len() >= 4 * NEIGHBOURS);
    let (change, rows) = long.fold((0.0, 0), |(change, rows), part| {
        let part = &displacements[part.clone()];
        let level = |rows: &[f64]| median(&sorted(rows));
        let first = level(&part[..NEIGHBOURS]);
        let last = level(&part[part.len() - NEIGHBOURS..]);
        (change + last - first, rows + part.len() - NEIGHBOURS)
    });
    if rows == 0 { 0.0 } else { change / rows as f64 }
}

/// Values in ascending order.
fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// Usual steps between rows.
struct Usual {
    period_us: f64,
    /// Step from which there is a gap.
    gap_us: f64,
    /// Deviation up to which another period fits the times, µs.
    uncertainty_us: f64,
}

impl Usual {
    fn of(stamps_us: &[i64]) -> Option<Self> {
        let steps = || stamps_us.windows(2).map(|pair| (pair[1] - pair[0]) as f64);
        let sorted = sorted(&steps().map(f64::abs).collect::<Vec<_>>());
        let longest = *sorted.get((sorted.len() as f64 * USUAL_SHARE) as usize)?;
        let mean = |most: f64| {
            let usual = steps().filter(|step| step.abs() <= most);
            let (count, sum) =
                usual.fold((0_usize, 0.0), |(count, sum), step| (count + 1, sum + step));
            (count > 0 && sum > 0.0).then(|| (count as f64, sum / count as f64))
        };
        let (_, rough) = mean(longest)?;
        let gap_us = (GAP_STEPS * longest).max(LEAST_GAP_PERIODS * rough);
        let (count, period_us) = mean(gap_us)?;
        // Each part between gaps may be longer or shorter by a step.
        let parts = sorted.len() as f64 - count + 1.0;
        let uncertainty_us = (parts * longest / count).min(period_us / 20.0);
        Some(Self { period_us, gap_us, uncertainty_us })
    }

    /// Roundest rate that fits a period, Hz.
    fn rate_of(&self, period_us: f64) -> f64 {
        let [lowest, rate, highest] =
            [1.0, 0.0, -1.0].map(|sign| 1.0e6 / (period_us + sign * self.uncertainty_us));
        roundest(lowest, rate, highest)
    }
}

/// Returns the parts between gaps. Rows that waited for the receiver and then arrived together are not a gap. A row with
/// a wrong stamp is not a gap either. Such rows get the displacement of the rows before.
fn parts(displacements: &mut [f64], period_us: f64, gap_us: f64) -> Vec<Range<usize>> {
    let mut parts = Vec::new();
    let mut start = 0;
    let mut row = 1;
    while row < displacements.len() {
        let step_us = period_us + displacements[row] - displacements[row - 1];
        if step_us.abs() <= gap_us {
            row += 1;
            continue;
        }
        let newest = &displacements[start.max(row.saturating_sub(NEIGHBOURS))..row];
        let before = median(&sorted(newest));
        let late_us = displacements[row] - before;
        // The number of rows that arrived at once equals the number of periods in the pause.
        let waiting = 2.0 * late_us.abs().min(LONGEST_STALL_US) / period_us;
        let end = displacements.len().min(row + waiting as usize);
        let is_back = |now: &f64| late_us.signum() * (now - before) <= gap_us / 2.0;
        if let Some(count) = displacements[row..end].iter().position(is_back) {
            displacements[row..row + count].fill(before);
            row += count;
        } else {
            parts.push(start..row);
            start = row;
            row += 1;
        }
    }
    parts.push(start..displacements.len());
    parts
}

/// Median of each value and up to [`NEIGHBOURS`] on either side of it.
fn running_medians(values: &[f64]) -> impl Iterator<Item = f64> {
    let mut sorted: Vec<f64> = Vec::with_capacity(2 * NEIGHBOURS + 1);
    let mut window = 0..0;
    (0..values.len()).map(move |row| {
        let end = values.len().min(row + NEIGHBOURS + 1);
        let start = row.saturating_sub(NEIGHBOURS);
        while window.end < end {
            let at = sorted.partition_point(|other| *other < values[window.end]);
            sorted.insert(at, values[window.end]);
            window.end += 1;
        }
        while window.start < start {
            let at = sorted.partition_point(|other| *other < values[window.start]);
            sorted.remove(at);
            window.start += 1;
        }
        median(&sorted)
    })
}

/// Median of values in ascending order. There must be at least one value.
fn median(sorted: &[f64]) -> f64 {
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 {
        sorted[middle]
    } else {
        f64::midpoint(sorted[middle - 1], sorted[middle])
    }
}

/// Flags of the parts to keep. Each part that is kept begins after the previous one, and as many rows as possible are
/// kept.
fn longest_chain(parts: &[Range<usize>], times_us: &[Option<i64>]) -> Vec<bool> {
    // For each part: the number of rows in the best chain that ends with it, and the part before it in that chain.
    let mut best: Vec<(usize, Option<usize>)> = Vec::with_capacity(parts.len());
    for (index, part) in parts.iter().enumerate() {
        let before = (0..index)
            .filter(|before| times_us[parts[*before].end - 1] < times_us[part.start])
            .max_by_key(|before| best[*before].0);
        let rows = before.map_or(0, |before| best[before].0);
        best.push((rows + part.len(), before));
    }
    let mut kept = vec![false; parts.len()];
    let mut last = (0..parts.len()).max_by_key(|index| best[*index].0);
    while let Some(index) = last {
        kept[index] = true;
        last = best[index].1;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::SmallRng;
    use rand::{RngExt, SeedableRng};

    /// Times of samples at 500 Hz with gaps before these rows, µs, each with its length.
    fn samples(rows: usize, gaps: &[(usize, i64)]) -> Vec<i64> {
        let late = |row: usize| -> i64 {
            gaps.iter().filter(|(from, _)| row >= *from).map(|(_, length)| length).sum()
        };
        (0..rows).map(|row| 7_000_000 + 2_000 * row as i64 + late(row)).collect()
    }

    /// Stamps with normal jitter of 1.5 ms.
    fn jittered(times: &[i64]) -> Vec<i64> {
        let mut random = SmallRng::seed_from_u64(1);
        // Sum of twelve uniform values: mean 6, deviation 1.
        let mut normal = || (0..12).map(|_| random.random_range(0.0..1.0)).sum::<f64>() - 6.0;
        times.iter().map(|time| time + (1_500.0 * normal()) as i64).collect()
    }

    /// Largest distance of a smooth time from the sample's, less the mean distance, µs.
    fn error_us(smooth: &Smoothed, times: &[i64]) -> f64 {
        let errors = || {
            smooth
                .times_us
                .iter()
                .zip(times)
                .map(|(smooth, time)| (smooth.expect("a time") - time) as f64)
        };
        let mean = errors().sum::<f64>() / times.len() as f64;
        errors().map(|error| (error - mean).abs()).fold(0.0, f64::max)
    }

    fn assert_advances(smooth: &Smoothed) {
        let times: Vec<i64> = smooth.times_us.iter().flatten().copied().collect();
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn jitter_is_smoothed_and_gaps_are_kept() {
        let times = samples(20_000, &[(3_000, 40_000), (9_000, 250_000), (15_000, 3_000_000)]);
        let smooth = smoothed(&jittered(&times)).unwrap();
        assert_advances(&smooth);
        assert_eq!((smooth.rate, smooth.gaps), (500.0, 3));
        // Stamps are up to 6 ms away.
        let error = error_us(&smooth, &times);
        assert!(error < 1_000.0, "{error}");
    }

    #[test]
    fn single_missing_row_is_kept_as_a_gap() {
        let times = samples(5_000, &[(2_500, 2_000)]);
        let smooth = smoothed(&times).unwrap();
        let error = error_us(&smooth, &times);
        assert!(error < 100.0, "{error}");
    }

    #[test]
    fn slow_clock_is_followed() {
        let times: Vec<i64> = (0..20_000).map(|row| 2_000 * row + row * row / 100_000).collect();
        let smooth = smoothed(&jittered(&times)).unwrap();
        let error = error_us(&smooth, &times);
        assert!(error < 1_200.0, "{error}");
    }

    #[test]
    fn rows_that_waited_for_a_stalled_receiver_leave_no_gap() {
        let times = samples(10_000, &[]);
        let mut stamps = jittered(&times);
        for stamp in &mut stamps[5_000..5_150] {
            *stamp = (*stamp).max(times[5_150]);
        }
        let smooth = smoothed(&stamps).unwrap();
        assert_eq!(smooth.gaps, 0);
        let error = error_us(&smooth, &times);
        assert!(error < 1_000.0, "{error}");
    }

    #[test]
    fn rows_in_batches_are_spaced() {
        let times = samples(10_000, &[(6_000, 500_000)]);
        let stamps: Vec<i64> =
            times.iter().enumerate().map(|(row, _)| times[row / 10 * 10]).collect();
        let smooth = smoothed(&stamps).unwrap();
        assert_eq!((smooth.rate, smooth.gaps), (500.0, 1));
        assert!(error_us(&smooth, &times) < 10_000.0);
        assert_advances(&smooth);
    }

    #[test]
    fn row_with_a_wrong_stamp_gets_its_place() {
        let times = samples(1_000, &[]);
        let mut stamps = jittered(&times);
        stamps[400] = 900_000_000;
        stamps[700] = 3;
        let smooth = smoothed(&stamps).unwrap();
        assert_eq!(smooth.gaps, 0);
        let error = error_us(&smooth, &times);
        assert!(error < 1_000.0, "{error}");
    }

    #[test]
    fn part_in_the_time_of_another_is_left_out() {
        let mut stamps = jittered(&samples(1_000, &[]));
        // The clock restarts.
        stamps[700..].iter_mut().for_each(|stamp| *stamp -= 8_000_000);
        let smooth = smoothed(&stamps).unwrap();
        assert_advances(&smooth);
        assert!(smooth.times_us[..700].iter().all(Option::is_some));
        assert!(smooth.times_us[700..].iter().all(Option::is_none));
    }

    #[test]
    fn times_that_do_not_advance_have_no_smooth_ones() {
        for stamps in [&[][..], &[7], &[7, 7, 7], &[9, 8, 7]] {
            assert!(smoothed(stamps).is_none(), "{stamps:?}");
        }
    }
}
