//! Clocks that jump, and rows that arrive in batches.

use estimator_core::Timestamp;
use samples::steps::{Steps, median};

use crate::finding::Finding;

/// Step from which the clock jumps, s, if it is also [`UNUSUAL`].
const JUMP_S: f64 = 1.0;

/// Multiple of the median step from which a step is unusual.
const UNUSUAL: f64 = 20.0;

/// Collects the steps between samples.
#[derive(Default)]
pub(crate) struct ClockCheck {
    newest: Option<Timestamp>,
    steps: Steps,
}

impl ClockCheck {
    pub(crate) fn add(&mut self, now: Timestamp) {
        let before = self.newest.replace(now);
        if let Some(step) = before.and_then(|before| now.micros_since(before)) {
            self.steps.add(step);
        }
    }

    /// Findings about the times.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let sorted = self.steps.sorted();
        let Some(median_us) = median(&sorted) else {
            return Vec::new();
        };
        let total = self.steps.total() as f64;
        let sum: u64 = sorted.iter().map(|(step, count)| step * count).sum();
        let mean_us = sum as f64 / total;
        let jump_us = (1.0e6 * JUMP_S).max(UNUSUAL * median_us as f64);
        let jumps = sorted.iter().filter(|(step, _)| *step as f64 > jump_us);
        let count: u64 = jumps.map(|(_, count)| count).sum();
        let mut findings = Vec::new();
        if count > 0 {
            let longest_us = sorted.last().map_or(0, |(step, _)| *step);
            findings.push(Finding::ClockJumps {
                count: usize::try_from(count).unwrap_or(usize::MAX),
                longest_s: longest_us as f64 / 1.0e6,
            });
        }
        let short = sorted.iter().filter(|(step, _)| (*step as f64) < 0.25 * mean_us);
        let share = short.map(|(_, count)| count).sum::<u64>() as f64 / total;
        if share > 1.0 / 3.0 && count == 0 {
            findings.push(Finding::Batches { share });
        }
        findings
    }
}

#[cfg(test)]
mod tests {

    use crate::check;
    use crate::fixtures::{found, with_times};

    #[test]
    fn clock_jump_is_found_but_short_gap_is_not() {
        let gap =
            |length_us: u64| with_times(move |k| 5_000 * k + if k < 900 { 0 } else { length_us });
        assert_eq!(found(&gap(5_000_000)), ["clock_jumps"]);
        assert_eq!(found(&gap(500_000)), [""; 0]);
        assert_eq!(
            check(&gap(5_000_000))[0].to_string(),
            "the clock jumps once, by up to 5.0 s: samples are missing, or times rate"
        );
    }

    #[test]
    fn batches_are_found_but_jitter_is_not() {
        let batches = with_times(|k| k / 10 * 50_000 + k % 10);
        assert_eq!(found(&batches), ["batches"]);
        let jitter = with_times(|k| 5_000 * k + (k * 7919) % 3_000);
        assert_eq!(found(&jitter), [""; 0]);
    }
}
