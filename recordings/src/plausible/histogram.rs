//! How often sizes occur, so that a quantile does not need all of them in memory.

/// The low bits of an f32 that do not count: what is left tells sizes apart that differ by 0.2 %.
const DROPPED_BITS: u32 = 14;

/// Sizes in bins of 0.2 % of their size at most.
pub(super) struct Histogram {
    counts: Vec<u64>,
    total: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            counts: vec![0; 1 << (31 - DROPPED_BITS)],
            total: 0,
        }
    }
}

impl Histogram {
    /// Counts a size, which is not negative.
    pub(super) fn add(&mut self, size: f32) {
        let bin = (size.abs().to_bits() >> DROPPED_BITS) as usize;
        if let Some(count) = self.counts.get_mut(bin) {
            *count += 1;
            self.total += 1;
        }
    }

    /// The size below which a `share` of them lies, in [0, 1], to its bin; `None` of none.
    pub(super) fn quantile(&self, share: f64) -> Option<f32> {
        let wanted = ((self.total as f64 * share) as u64).min(self.total.checked_sub(1)?);
        let mut before = 0;
        let bin = self.counts.iter().position(|count| {
            before += count;
            before > wanted
        })?;
        Some(f32::from_bits((bin as u32) << DROPPED_BITS))
    }

    /// How many of them are `size` or more, to its bin.
    pub(super) fn from(&self, size: f32) -> u64 {
        let bin = (size.abs().to_bits() >> DROPPED_BITS) as usize;
        self.counts.iter().skip(bin).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_right_to_its_bin() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), None);
        for k in 1..=1000_u16 {
            histogram.add(f32::from(k));
        }
        for (share, exact) in [(0.0, 1.0), (0.5, 501.0), (0.99, 991.0), (1.0, 1000.0)] {
            let found = histogram.quantile(share).unwrap();
            assert!(found <= exact && found > 0.998 * exact, "{share}: {found}");
        }
        assert_eq!(histogram.from(512.0), 489);
    }
}
