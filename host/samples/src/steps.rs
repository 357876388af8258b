//! Counts of the steps between the times of samples.

use std::collections::HashMap;

/// Counts of each step, µs.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    counts: HashMap<u64, u64>,
}

impl Steps {
    /// Counts a step.
    pub fn add(&mut self, step_us: u64) {
        *self.counts.entry(step_us).or_default() += 1;
    }

    /// Returns the number of steps.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.values().sum()
    }

    /// Returns the steps in ascending order, µs, with their counts.
    #[must_use]
    pub fn sorted(&self) -> Vec<(u64, u64)> {
        let mut steps: Vec<_> = self.counts.iter().map(|(step, n)| (*step, *n)).collect();
        steps.sort_unstable();
        steps
    }
}

/// Returns the median step, µs; for an even number the later of the two middle ones; `None` without steps.
#[must_use]
pub fn median(sorted: &[(u64, u64)]) -> Option<u64> {
    let total: u64 = sorted.iter().map(|(_, count)| count).sum();
    let mut before = 0;
    sorted.iter().find_map(|(step, count)| {
        before += count;
        (before > total / 2).then_some(*step)
    })
}
