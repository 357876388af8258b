//! Histogram of sizes, so that a quantile does not need all of them in memory.

/// Low bits of an f32 that are dropped; the rest resolves sizes to 0.2 %.
const DROPPED_BITS: u32 = 14;

/// Sizes in bins of at most 0.2 % of their size.
pub(super) struct Histogram {
    counts: Vec<u64>,
    total: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: vec![0; 1 << (31 - DROPPED_BITS)], total: 0 }
    }
}

impl Histogram {
    /// Counts a size, which must not be negative.
    pub(super) fn add(&mut self, size: f32) {
        let bin = (size.abs().to_bits() >> DROPPED_BITS) as usize;
        if let Some(count) = self.counts.get_mut(bin) {
            *count += 1;
            self.total += 1;
        }
    }

    /// Size below which a `share` of the values lies, in [0, 1], to the resolution of a bin; `None` if empty.
    pub(super) fn quantile(&self, share: f64) -> Option<f32> {
        let wanted = ((self.total as f64 * share) as u64).min(self.total.checked_sub(1)?);
        let mut before = 0;
        let bin = self.counts.iter().position(|count| {
            before += count;
            before > wanted
        })?;
        Some(f32::from_bits((bin as u32) << DROPPED_BITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantile_is_right_to_its_bin() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), None);
        for k in 1..=1000_u16 {
            histogram.add(f32::from(k));
        }
        for (share, exact) in [(0.0, 1.0), (0.5, 501.0), (0.99, 991.0), (1.0, 1000.0)] {
            let found = histogram.quantile(share).unwrap();
            assert!(found <= exact && found > 0.998 * exact, "{share}: {found}");
        }
    }
}
