//! Exact minimum, median and maximum of any number of values, in little memory: a count per value. Measurements of
//! each millisecond have only a few thousand different values.

use std::collections::BTreeMap;

use serde_json::{Value, json};

/// Count of each value.
#[derive(Clone, Debug, Default)]
pub struct Spread {
    counts: BTreeMap<u64, u64>,
    /// Sum of all values.
    pub(crate) sum: u64,
    /// Number of values.
    pub(crate) length: u64,
}

impl Spread {
    /// Adds a value.
    pub fn push(&mut self, value: u64) {
        *self.counts.entry(value).or_default() += 1;
        self.sum += value;
        self.length += 1;
    }

    /// Minimum.
    #[must_use]
    pub fn min(&self) -> Option<u64> {
        self.counts.first_key_value().map(|(&value, _)| value)
    }

    /// Maximum.
    #[must_use]
    pub fn max(&self) -> Option<u64> {
        self.counts.last_key_value().map(|(&value, _)| value)
    }

    /// Median, the upper of two.
    #[must_use]
    pub fn median(&self) -> Option<u64> {
        self.above(self.length / 2)
    }

    /// The least value that 99.9 % of the values do not exceed.
    #[must_use]
    pub fn nearly_longest(&self) -> Option<u64> {
        self.above((self.length * 999).div_ceil(1000).saturating_sub(1))
    }

    /// The value in order of size that has `count` values before it.
    fn above(&self, count: u64) -> Option<u64> {
        let mut before = 0;
        self.counts.iter().find_map(|(&value, &equal)| {
            before += equal;
            (before > count).then_some(value)
        })
    }

    /// Minimum, median and maximum for a report.
    #[must_use]
    pub fn min_median_max(&self) -> Value {
        match (self.min(), self.median(), self.max()) {
            (Some(min), Some(median), Some(max)) => {
                json!({ "min": min, "median": median, "max": max })
            }
            _ => Value::Null,
        }
    }

    /// Median, 99.9 % and maximum of times in ns for a report, µs.
    #[must_use]
    pub fn times_us(&self) -> Value {
        let us = |ns: u64| ns as f64 / 1.0e3;
        match (self.median(), self.nearly_longest(), self.max()) {
            (Some(median), Some(nearly_longest), Some(max)) => {
                json!({ "median": us(median), "p99_9": us(nearly_longest), "max": us(max) })
            }
            _ => Value::Null,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_that_of_the_sorted_values() {
        for length in 1..40_u64 {
            let values: Vec<u64> = (0..length).map(|i| i * 7919 % 11).collect();
            let mut spread = Spread::default();
            values.iter().for_each(|&value| spread.push(value));
            let mut sorted = values;
            sorted.sort_unstable();
            assert_eq!(spread.median(), Some(sorted[sorted.len() / 2]));
            assert_eq!(spread.min(), sorted.first().copied());
            assert_eq!(spread.max(), sorted.last().copied());
            assert_eq!(spread.length, length);
        }
    }

    #[test]
    fn one_value_in_a_thousand_may_exceed_the_nearly_longest() {
        for (length, longest) in [(1, 0), (999, 998), (1000, 998), (1001, 999), (5000, 4994)] {
            let mut spread = Spread::default();
            (0..length).for_each(|value| spread.push(value));
            assert_eq!(spread.nearly_longest(), Some(longest), "{length}");
        }
    }

    #[test]
    fn an_empty_spread_has_no_median() {
        assert_eq!(Spread::default().median(), None);
        assert_eq!(Spread::default().nearly_longest(), None);
        assert_eq!(Spread::default().min_median_max(), Value::Null);
    }
}
