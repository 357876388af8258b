//! The README's picture, and the figures of the demo.

use estimator_core::{ContactEstimate, Flag};
use footfall::plot;
use gait::plan::DEMO_SEED;
use gait::{Activity, Plan, SensorParams, record, simulate};
use host_tests::committed::{assert_current, workspace};
use recordings::config::default_params;
use recordings::replay::replay;
use recordings::scoring::metrics::Metrics;
use recordings::scoring::scored::Scored;

/// Limits of the demo's mean P: measured are 0.043 swinging and 0.165 slipping.
const STANDING_P: f64 = 0.93;
const SWINGING_P: f64 = 0.045;
const SLIPPING_P: f64 = 0.17;

/// Limit of the demo's RMSE: measured is 0.260.
const DEMO_RMSE: f64 = 0.265;

/// Mean P over the samples of the demo in an activity, after the foot has settled.
fn mean_while(activity: Activity) -> f64 {
    let walk = simulate(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    let estimates = replay(&walk.recording, &default_params()).expect("the preset");
    let settled = |estimate: &ContactEstimate| !estimate.flags.contains(Flag::Settling);
    let first = estimates.iter().position(settled).expect("it settles");
    let of_activity: Vec<f64> = walk.truth[first..]
        .iter()
        .zip(&estimates[first..])
        .filter(|(truth, _)| truth.activity == activity)
        .map(|(_, estimate)| f64::from(estimate.probabilities.stable))
        .collect();
    assert!(of_activity.len() > 500, "{} samples", of_activity.len());
    of_activity.iter().sum::<f64>() / of_activity.len() as f64
}

#[test]
fn p_is_high_in_stances_and_low_in_swings_and_slips() {
    let standing = mean_while(Activity::Standing);
    assert!((STANDING_P..=1.0).contains(&standing), "{standing}");
    let swinging = mean_while(Activity::Swinging);
    assert!((0.0..=SWINGING_P).contains(&swinging), "{swinging}");
    let slipping = mean_while(Activity::Slipping);
    assert!((0.0..=SLIPPING_P).contains(&slipping), "{slipping}");
}

#[test]
fn the_picture_and_the_rmse_are_those_of_the_demo() {
    let recording = record(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    let estimates = replay(&recording, &default_params()).expect("the preset");
    let svg = plot::svg(&recording, &estimates).expect("a picture");
    assert_current(&workspace().join("docs/demo.svg"), &svg);
    let metrics = Metrics::of(&Scored::collect(&recording.samples, &estimates)).expect("labels");
    assert!(metrics.rmse <= DEMO_RMSE, "{}", metrics.rmse);
}
