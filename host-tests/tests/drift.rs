//! A gyroscope bias that drifts while the foot walks costs no stances, although there is no rest in which it could
//! be learnt.

use std::f32::consts::PI;

use estimator_core::{AngularRate, Params, Vec3};
use gait::{GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::changed::changed;
use recordings::recording::{Label, Recording};
use recordings::replay::replay;

/// Drift of the bias after a minute, rad/s: 0.05 °/s/K over 40 K.
const DRIFT: f32 = 2.0 * PI / 180.0;

/// Maximum share of the stable samples lost by the drift.
const LOST: f64 = 0.01;

/// Share of the stable samples of the last half of a recording with P > 0.5.
fn found(recording: &Recording) -> f64 {
    let estimates = replay(recording, &Params::DEFAULT).expect("the preset");
    let half = recording.samples.len() / 2;
    let pairs = recording.samples.iter().zip(&estimates).skip(half);
    let stable: Vec<bool> = pairs
        .filter(|(sample, _)| sample.label == Some(Label::Stable))
        .map(|(_, estimate)| estimate.probabilities.stable > 0.5)
        .collect();
    stable.iter().filter(|found| **found).count() as f64 / stable.len() as f64
}

#[test]
fn drift_of_the_gyroscope_in_a_walk_costs_no_stances() {
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        let plan = Plan::steady(gait, Ground::Hard, 65.0, 11);
        let recording = simulate(&plan, &SensorParams::LSM6DSOX, 11).recording;
        let without = found(&recording);
        for axis in [
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::new(0.0, 0.0, 1.0),
        ] {
            let drifting = changed(&recording, |sample| {
                let share = ((sample.time_s() as f32 - 5.0) / 60.0).clamp(0.0, 1.0);
                let rate = sample.imu.angular_rate.0;
                sample.imu.angular_rate = AngularRate(rate + axis * (share * DRIFT));
            });
            let with = found(&drifting);
            println!("{gait} {axis:?}: {without:.3} → {with:.3}");
            assert!(with > without - LOST, "{gait} {axis:?}: {without} → {with}");
        }
    }
}
