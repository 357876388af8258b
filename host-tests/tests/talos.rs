//! The paper's recording of a real TALOS: P while the foot is loaded, and while it is not.

use crate::labelled;
use estimator_core::{Load, Params};
use host_tests::sets::Set;
use labelled::of_sets;
use recordings::replay::replay;
use recordings::samples::recording::Recording;

/// Force above which the foot bears the robot, N.
const LOADED: f32 = 850.0;

/// Force below which the foot swings, or is about to, N.
const UNLOADED: f32 = 150.0;

/// Medians of P above [`LOADED`] and below [`UNLOADED`].
fn medians(recording: &Recording, params: &Params) -> [f32; 2] {
    let estimates = replay(recording, params).expect("a preset");
    let pairs = || recording.samples.iter().zip(&estimates);
    let median = |counts: fn(f32) -> bool| {
        let counted = pairs().filter(|(s, _)| s.load.is_some_and(|Load(force)| counts(force)));
        let mut values: Vec<f32> = counted.map(|(_, e)| e.probabilities.stable).collect();
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    };
    [
        median(|force| force > LOADED),
        median(|force| force < UNLOADED),
    ]
}

#[test]
fn stable_probability_follows_the_load_of_talos() {
    let Some(files) = of_sets(&[Set::Talos]) else {
        return;
    };
    let native = &files[0].recording;
    let [loaded, unloaded] = medians(native, &Params::DEFAULT);
    assert!(loaded > 0.95 && unloaded < 0.25, "{loaded}, {unloaded}");
}
