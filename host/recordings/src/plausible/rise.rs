//! A probability that does not rise although the foot is loaded.

use estimator_core::Load;

use super::Finding;
use super::histogram::Histogram;

/// Probability above which the foot is more likely stable than not.
const HIGH: f32 = 0.5;

/// Share of the usual load from which a foot is loaded; the usual load is exceeded in a tenth of the time.
const LOADED: f32 = 0.5;

/// Share of the loaded time below which the probability does not rise with the load.
const LEAST_SHARE: f64 = 0.05;

/// Least time under load for a finding, s.
const LEAST_LOADED_S: f32 = 1.0;

/// Least duration of a recording without a load for a finding, s.
const LEAST_UNKNOWN_S: f32 = 10.0;

/// Counts all loads, and those with a high probability.
#[derive(Default)]
pub(super) struct Rise {
    samples: u64,
    high: u64,
    loads: Histogram,
    high_loads: Histogram,
}

impl Rise {
    pub(super) fn add(&mut self, load: Option<Load>, probability: f32) {
        let is_high = probability > HIGH;
        self.samples += 1;
        self.high += u64::from(is_high);
        if let Some(Load(load)) = load
            && load > 0.0
        {
            self.loads.add(load);
            if is_high {
                self.high_loads.add(load);
            }
        }
    }

    pub(super) fn finding(&self, sample_rate: f32) -> Option<Finding> {
        let seconds = |samples: u64| samples as f32 / sample_rate;
        let Some(usual) = self.loads.quantile(0.9) else {
            let never = self.high == 0 && seconds(self.samples) >= LEAST_UNKNOWN_S;
            return never.then_some(Finding::NeverRises { loaded_share: None });
        };
        let loaded = self.loads.from(LOADED * usual);
        let share = self.high_loads.from(LOADED * usual) as f64 / loaded as f64;
        let rises = share >= LEAST_SHARE || seconds(loaded) < LEAST_LOADED_S;
        (!rises).then_some(Finding::NeverRises {
            loaded_share: Some(share),
        })
    }
}
