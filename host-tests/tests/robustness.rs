//! Sample defects of real installations: the default preset on the walk of `footfall demo`, and a foot that has
//! stood for long before it walks. Limits are on the RMSE of P against the labels.

use crate::labelled;
use estimator_core::{Params, Vec3};
use gait::{Plan, SensorParams, record};
use host_tests::changed::{
    jittering, losing_bursts, losing_single, stood, with_force_bias, with_rate_bias,
};
use host_tests::sets::{Labelled, Set};
use labelled::{averaged, rmse};
use recordings::samples::recording::Recording;

const SEED: u64 = 1;

/// Maximum increase of the RMSE by a minute of standing. It decreases by up to 0.05, since the foot is proven at once.
///
/// The simulated ATLAS of 7,000 samples has no noise: a stand leaves nothing in its speed, each of its steps something.
fn standing_costs(recording: &str) -> f64 {
    match recording {
        "ATLAS_7k_04ground" => 0.18,
        _ => 0.02,
    }
}

fn demo() -> Recording {
    record(&Plan::demo(SEED), &SensorParams::LSM6DSOX, SEED)
}

fn assert_rmse(recording: &Recording, limit: f64) {
    let rmse = rmse(recording, &Params::DEFAULT);
    println!("RMSE {rmse:.4}, limit {limit}");
    assert!(rmse <= limit, "RMSE {rmse:.4}, limit {limit}");
}

#[test]
fn defects_of_samples_are_tolerated() {
    let demo = demo();
    assert_rmse(&losing_single(&demo, 0.05, SEED), 0.28);
    assert_rmse(&losing_bursts(&demo, 0.05, 10, SEED), 0.28);
    assert_rmse(&jittering(&demo, 0.5, SEED), 0.28);
    for sign in [1.0_f32, -1.0] {
        let all = |bias: f32| Vec3::new(sign * bias, sign * bias, sign * bias);
        assert_rmse(&with_rate_bias(&demo, all(2.0_f32.to_radians())), 0.28);
        assert_rmse(&with_force_bias(&demo, all(0.3)), 0.3);
    }
}

#[test]
fn a_residual_of_removed_gravity_is_found() {
    let Some(recordings) = averaged() else {
        return;
    };
    let ground = recordings.into_iter().find(|file| file.set == Set::Ground);
    let ground = ground.expect("a set that is averaged").recording;
    // In the first stances the bias counts as a usual speed of this foot.
    assert_rmse(&with_force_bias(&ground, Vec3::new(0.1, 0.1, 0.1)), 0.47);
}

#[test]
fn a_minute_of_standing_before_a_walk_changes_little() {
    let Some(recordings) = averaged() else {
        return;
    };
    let changes: Vec<(String, f64)> = recordings
        .iter()
        .map(|Labelled { recording, .. }| {
            let stood = stood(recording, 60.0, SEED);
            let [before, after] = [recording, &stood].map(|r| rmse(r, &Params::DEFAULT));
            println!(
                "{:24} {before:.4}, after a minute {after:.4}",
                recording.name
            );
            (recording.name.clone(), after - before)
        })
        .collect();
    let changed = changes
        .iter()
        .filter(|(name, by)| *by > standing_costs(name));
    let changed: Vec<_> = changed.collect();
    assert!(changed.is_empty(), "{changed:?}");
}
