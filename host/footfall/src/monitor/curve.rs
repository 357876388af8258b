//! Curve of the newest probabilities of a foot.

use std::collections::VecDeque;

/// Number of probabilities kept: 16 s at 1 kHz.
const KEPT: usize = 1 << 14;

/// Newest probabilities of a foot.
#[derive(Clone, Debug, Default)]
pub struct Curve(VecDeque<f32>);

impl Curve {
    pub(super) fn push(&mut self, stable: f32) {
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(stable);
    }

    /// Returns the curve as `columns` values, newest last. Each value is the minimum of its share, so that short
    /// dips stay visible.
    #[must_use]
    pub fn least(&self, columns: usize) -> Vec<f32> {
        let share = KEPT.div_ceil(columns.max(1)).min(32);
        let skipped = self.0.len().saturating_sub(share * columns);
        let newest: Vec<f32> = self.0.iter().skip(skipped).copied().collect();
        let least = |share: &[f32]| share.iter().copied().fold(1.0, f32::min);
        newest.chunks(share).map(least).collect()
    }
}
