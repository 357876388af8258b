//! Whether times jitter around a steady rate, because a computer took them and not the sensor.

use samples::steps::{Steps, median};

/// Deviation of a step from the mean from which it is uneven, as a fraction of the mean.
const UNEVEN: f64 = 0.25;

/// Share of uneven steps from which times jitter. Measured once: at most 0.001 where a sensor gave the stamps, and
/// 0.11 to 0.21 for a GO1 and a NAO, whose computers took the times.
const LEAST_SHARE: f64 = 0.05;

/// Multiple of the usual step from which a step is a gap.
const GAP_STEPS: u64 = 4;

/// Number of steps in a block. The mean step of a block shows changes of the rate, and hardly jitters.
const BLOCK: u32 = 100;

/// Largest deviation of a block's mean step from the mean step of all blocks, as a fraction, at a steady rate.
const STEADY: f64 = 0.1;

/// Shortest and longest mean step of the blocks of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evenness {
    /// Sum of the current block's steps, µs, and their number.
    sum_us: u64,
    count: u32,
    /// Sums of the shortest and the longest block, µs.
    extremes_us: Option<(u64, u64)>,
}

impl Evenness {
    /// Adds a step, µs.
    pub fn add(&mut self, step_us: u64) {
        self.sum_us = self.sum_us.saturating_add(step_us);
        self.count += 1;
        if self.count == BLOCK {
            let sum_us = self.sum_us;
            let (least, most) = self.extremes_us.unwrap_or((sum_us, sum_us));
            self.extremes_us = Some((least.min(sum_us), most.max(sum_us)));
            (self.sum_us, self.count) = (0, 0);
        }
    }

    /// Returns whether all blocks have about this mean step, µs; false without a whole block.
    fn is_steady_around(&self, mean_us: f64) -> bool {
        self.extremes_us.is_some_and(|extremes_us| {
            let [least, most] =
                [extremes_us.0, extremes_us.1].map(|sum| sum as f64 / f64::from(BLOCK));
            least > (1.0 - STEADY) * mean_us && most < (1.0 + STEADY) * mean_us
        })
    }
}

/// Returns whether times with these steps jitter around a steady rate, without gaps.
pub fn jitters(steps: &Steps, evenness: &Evenness) -> bool {
    let sorted = steps.sorted();
    let (Some(median_us), Some((longest_us, _))) = (median(&sorted), sorted.last()) else {
        return false;
    };
    let total = steps.total() as f64;
    let mean_us = sorted.iter().map(|(step, count)| (step * count) as f64).sum::<f64>() / total;
    let is_uneven = |step: u64| (step as f64 - mean_us).abs() > UNEVEN * mean_us;
    let uneven: u64 =
        sorted.iter().filter(|(step, _)| is_uneven(*step)).map(|(_, count)| count).sum();
    *longest_us < GAP_STEPS * median_us.max(1)
        && uneven as f64 >= LEAST_SHARE * total
        && evenness.is_steady_around(mean_us)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(steps_us: impl Iterator<Item = u64>) -> bool {
        let (mut steps, mut evenness) = (Steps::default(), Evenness::default());
        for step_us in steps_us {
            steps.add(step_us);
            evenness.add(step_us);
        }
        jitters(&steps, &evenness)
    }

    /// Steps of 18 ms on average, in whole parts of 3.85 ms.
    fn of_a_computer(rows: usize) -> impl Iterator<Item = u64> {
        [5, 5, 5, 4, 5, 5, 3, 5, 5, 4, 6, 5]
            .into_iter()
            .cycle()
            .take(rows)
            .map(|parts| parts * 3_846)
    }

    #[test]
    fn stamps_of_a_computer_jitter_and_those_of_a_sensor_do_not() {
        assert!(judged(of_a_computer(600)));
        assert!(!judged((0..600).map(|k| 4_998 + k % 200)));
        assert!(!judged(std::iter::repeat_n(10_000, 600)));
    }

    #[test]
    fn gap_or_a_change_of_the_rate_is_no_jitter() {
        assert!(!judged(of_a_computer(300).chain([100_000]).chain(of_a_computer(300))));
        let faster = of_a_computer(300).map(|step| step * 2 / 3);
        assert!(!judged(of_a_computer(300).chain(faster)));
        assert!(!judged(std::iter::repeat_n(10_000, 300).chain(std::iter::repeat_n(5_000, 300))));
    }
}
