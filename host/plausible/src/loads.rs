//! Whether a load signal crosses its thresholds, and thresholds that it would cross.

use estimator_core::params::LoadParams;

use crate::finding::Finding;
use samples::RecordedSample;

/// Number of loads that are kept. Of a longer recording, every second, fourth, … load is kept.
const MOST: usize = 1 << 16;

/// Fewest loads that show both levels.
const FEWEST: usize = 200;

/// Shares of the loads below the level of a swing, and below the level of a stance.
const LOW: f64 = 0.05;
const HIGH: f64 = 0.95;

/// Share of the loads that may lie in the middle half between both levels. If the loads were noise about one level, the
/// share would be 0.6.
const MIDDLE: f64 = 0.45;

/// Share of the load in stances. If the load in swings is below this share, both are levels, however many loads lie in
/// the middle, because a robot that stands before it walks has most of its loads there.
const UNLOADED: f32 = 0.3;

/// [`UNLOADED`] for a load that is negative in stances.
const UNLOADED_IF_NEGATIVE: f32 = 0.1;

/// Proposed thresholds between both levels, as fractions of their distance.
const ON: f32 = 0.3;
const OFF: f32 = 0.15;

/// Collects the loads of a recording.
#[derive(Default)]
pub(crate) struct LoadCheck {
    kept: Vec<f32>,
    /// Number of loads that are skipped after each load that is kept.
    skipped: usize,
    left: usize,
}

impl LoadCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let Some(load) = sample.load.filter(|load| load.0.is_finite()) else {
            return;
        };
        if self.left > 0 {
            self.left -= 1;
            return;
        }
        self.left = self.skipped;
        self.kept.push(load.0);
        if self.kept.len() == MOST {
            let mut place = 0_usize;
            self.kept.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.skipped = 2 * self.skipped + 1;
        }
    }

    /// Loads in a swing and in a stance, if both are seen.
    fn levels(&self) -> Option<(f32, f32)> {
        let mut sorted = self.kept.clone();
        sorted.sort_by(f32::total_cmp);
        let at = |share: f64| sorted.get((share * sorted.len() as f64) as usize).copied();
        let (low, high) = (at(LOW)?, at(HIGH)?);
        let quarter = 0.25 * (high - low);
        let middle = low + quarter..high - quarter;
        let between = sorted.iter().filter(|load| middle.contains(load)).count();
        let are_apart = (between as f64) < MIDDLE * sorted.len() as f64
            || low.abs() < UNLOADED * high
            || high.abs() < UNLOADED_IF_NEGATIVE * -low;
        (sorted.len() >= FEWEST && high > low && are_apart).then_some((low, high))
    }

    /// Finding about the thresholds.
    pub(crate) fn finding(&self, thresholds: &LoadParams) -> Option<Finding> {
        let (low, high) = self.levels()?;
        if low < 0.0 && high < UNLOADED_IF_NEGATIVE * -low {
            return Some(Finding::LoadNegative { lowest: low });
        }
        let crosses = high >= thresholds.on_threshold && low < thresholds.off_threshold;
        let distance = high - low;
        (!crosses).then(|| Finding::LoadNeverCrosses {
            low,
            high,
            on: rounded(low + ON * distance, distance),
            off: rounded(low + OFF * distance, distance),
        })
    }
}

/// Rounds a threshold to a hundredth of the power of ten below the distance of the levels.
fn rounded(value: f32, distance: f32) -> f32 {
    let digits = (2.0 - f64::from(distance).log10().floor()) as i32;
    let step = 10.0_f64.powi(digits);
    ((f64::from(value) * step).round() / step) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::check_with_load;
    use crate::fixtures::walk;

    fn with_loads(stance: f32, swing: f32) -> Vec<Finding> {
        let mut recording = walk();
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            let level = if k % 200 < 100 { stance } else { swing };
            let noise = (k % 7) as f32 / 100.0 * (stance - swing);
            sample.load = Some(estimator_core::Load(level + noise));
        }
        check_with_load(&recording, LoadParams { on_threshold: 12.0, off_threshold: 6.0 })
    }

    #[test]
    fn load_that_never_crosses_is_found_with_thresholds() {
        assert_eq!(with_loads(40.0, 0.0), []);
        for (stance, swing) in [(1.0, 0.0), (300.0, 80.0)] {
            let findings = with_loads(stance, swing);
            let [Finding::LoadNeverCrosses { on, off, .. }] = findings[..] else {
                panic!("{findings:?}");
            };
            assert!(swing < off && off < on && on < stance, "{off}, {on}");
        }
        let said = with_loads(300.0, 80.0)[0].to_string();
        assert!(said.contains(": on_threshold = 15"), "{said}");
        // A foot that only stands or only swings shows no levels.
        assert_eq!(with_loads(3.0, 3.0), []);
    }

    #[test]
    fn load_of_a_walk_after_a_long_stand_is_found() {
        let mut recording = walk();
        let half = recording.samples.len() * 7 / 10;
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            let load = match k % 200 {
                _ if k < half => 229.0 + (k % 3) as f32,
                0..100 => 487.0,
                _ => 13.0,
            };
            sample.load = Some(estimator_core::Load(load));
        }
        let found = |on_threshold, off_threshold| {
            check_with_load(&recording, LoadParams { on_threshold, off_threshold })
        };
        let [Finding::LoadNeverCrosses { on, off, .. }] = found(12.0, 6.0)[..] else {
            panic!("{:?}", found(12.0, 6.0));
        };
        assert!(13.0 < off && off < on && on < 229.0, "{off}, {on}");
        assert_eq!(found(on, off), []);
        for sample in &mut recording.samples {
            sample.load = sample.load.map(|load| estimator_core::Load(13.0 - load.0));
        }
        let found =
            check_with_load(&recording, LoadParams { on_threshold: 12.0, off_threshold: 6.0 });
        assert!(matches!(found[..], [Finding::LoadNegative { .. }]), "{found:?}");
    }

    #[test]
    fn load_of_a_foot_that_only_stands_has_one_level() {
        let mut recording = walk();
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            let noise: f32 =
                [0.7, 1.3, 2.9, 3.7, 5.3].map(|rate: f32| (rate * k as f32).sin()).iter().sum();
            sample.load = Some(estimator_core::Load(229.0 + noise));
        }
        let thresholds = LoadParams { on_threshold: 12.0, off_threshold: 6.0 };
        assert_eq!(check_with_load(&recording, thresholds), []);
    }

    #[test]
    fn negative_load_is_found() {
        let names: Vec<_> = with_loads(-40.0, 0.0).iter().map(Finding::name).collect();
        assert_eq!(names, ["load_negative"]);
    }
}
