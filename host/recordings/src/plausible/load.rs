//! A load that stays on one side of its thresholds: wrong unit or an offset.

use estimator_core::{Load, Phase};

use super::Finding;

/// Least time in stance and in motion for a finding, s.
const LEAST_S: f32 = 1.0;

crate::named! {
    /// Side of the thresholds on which a load stays.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum LoadSide {
        /// Above the thresholds: the foot never seems to swing.
        Above = "above",
        /// Below the thresholds: the foot never seems to stand.
        Below = "below",
    }
}

/// Counts the phases derived from the load.
#[derive(Default)]
pub(super) struct LoadCheck {
    /// Samples at rest and in motion, with load.
    loaded: [u64; 2],
    /// Samples at rest and in motion, without load.
    unloaded: [u64; 2],
    range: Option<[f32; 2]>,
}

impl LoadCheck {
    pub(super) fn add(&mut self, load: Option<Load>, phase: Phase) {
        let Some(Load(load)) = load else {
            return;
        };
        let count = match phase {
            Phase::Unknown => return,
            Phase::Stance => &mut self.loaded[0],
            Phase::Slip => &mut self.loaded[1],
            Phase::QuietSwing => &mut self.unloaded[0],
            Phase::Swing => &mut self.unloaded[1],
        };
        *count += 1;
        let [lowest, highest] = self.range.unwrap_or([load; 2]);
        self.range = Some([lowest.min(load), highest.max(load)]);
    }

    pub(super) fn finding(&self, sample_rate: f32) -> Option<Finding> {
        let range = self.range?;
        let walks = |counts: [u64; 2]| counts.iter().all(|n| *n as f32 >= LEAST_S * sample_rate);
        let side = match (self.loaded, self.unloaded) {
            (loaded, [0, 0]) if walks(loaded) => LoadSide::Above,
            ([0, 0], unloaded) if walks(unloaded) => LoadSide::Below,
            _ => return None,
        };
        Some(Finding::LoadThresholds { side, range })
    }
}
