//! The part's own clock: its 25 µs counter, and its frequency error.

/// Nominal length of a step of the counter, µs \[P, D\].
pub const STEP_MICROS: u32 = 25;

/// A reading of the part's 32-bit counter. It wraps after 29.8 hours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorTimestamp(pub u32);

impl SensorTimestamp {
    /// Returns the steps from `earlier` to `self`, across at most one wrap.
    #[must_use]
    pub const fn steps_since(self, earlier: Self) -> u32 {
        self.0.wrapping_sub(earlier.0)
    }

    /// Returns the time from `earlier` to `self` by the part's clock, corrected by its stated error, µs.
    #[must_use]
    pub fn micros_since(self, earlier: Self, fine: FrequencyFine) -> f64 {
        f64::from(self.steps_since(earlier)) * f64::from(STEP_MICROS) / fine.ratio()
    }
}

/// `INTERNAL_FREQ_FINE`: error of the part's clock, as measured in production;
/// steps of 0.15 % \[D; P of a sibling\]. It applies to the data rates and the timestamp alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrequencyFine(pub i8);

impl FrequencyFine {
    /// Ratio of the part's rate to the nominal one.
    #[must_use]
    pub fn ratio(self) -> f64 {
        1.0 + 0.0015 * f64::from(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_counted_across_the_wrap() {
        let (before, after) = (SensorTimestamp(u32::MAX - 9), SensorTimestamp(30));
        assert_eq!(after.steps_since(before), 40);
        assert_eq!(after.micros_since(before, FrequencyFine(0)), 1000.0);
    }

    #[test]
    fn a_fast_clock_counts_more_steps_in_the_same_time() {
        let micros = SensorTimestamp(10_015).micros_since(SensorTimestamp(0), FrequencyFine(1));
        assert!((micros - 250_000.0).abs() < 1.0e-6);
        assert_eq!(FrequencyFine(-10).ratio(), 0.985);
    }
}
