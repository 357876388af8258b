//! Counts of the time steps between rows, so that a median does not need all of them in memory.

use std::collections::HashMap;

/// Counts of each step, µs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steps {
    counts: HashMap<u64, u64>,
}

impl Steps {
    pub(crate) fn add(&mut self, step_us: u64) {
        *self.counts.entry(step_us).or_default() += 1;
    }

    /// Number of steps.
    pub(crate) fn total(&self) -> u64 {
        self.counts.values().sum()
    }

    /// Steps in ascending order, µs, with their counts.
    pub(crate) fn sorted(&self) -> Vec<(u64, u64)> {
        let mut steps: Vec<_> = self.counts.iter().map(|(step, n)| (*step, *n)).collect();
        steps.sort_unstable();
        steps
    }
}

/// Median step, µs; of an even number the later of the two middle ones; `None` if there are no steps.
pub(crate) fn median(sorted: &[(u64, u64)]) -> Option<u64> {
    let total: u64 = sorted.iter().map(|(_, count)| count).sum();
    let mut before = 0;
    sorted.iter().find_map(|(step, count)| {
        before += count;
        (before > total / 2).then_some(*step)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
