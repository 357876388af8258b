//! A load that stays on one side of its thresholds: another unit than theirs, or an offset.

use std::fmt;

use estimator_core::{Load, Phase};

use super::Finding;

/// From this time in stance, and from this time in motion on, there is something to say, s.
const LEAST_S: f32 = 1.0;

/// Where a load stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadSide {
    /// Above the thresholds: the foot seems never to be in the air.
    Above,
    /// Below them: it seems never to be on the ground.
    Below,
}

impl fmt::Display for LoadSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Above => "above",
            Self::Below => "below",
        })
    }
}

/// Counts the phases that follow from the load.
#[derive(Default)]
pub(super) struct LoadCheck {
    /// At rest and in motion, under load.
    loaded: [u64; 2],
    /// The same without.
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
