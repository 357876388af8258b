//! A gyroscope bias that drifts while the foot walks costs no stances, although there is no rest in which it could
//! be learnt. After a sudden change of the bias all stances are found again within a minute, and a change that is too
//! large to follow is reported.

use std::f32::consts::PI;

use estimator_core::any::AnyParams;
use estimator_core::{AngularRate, ContactEstimator, Gravity, Params, Stream, Vec3};
use gait::{GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::changed::{AXES, changed, stood, with_rate_drifts};
use samples::estimate::{Estimator, estimates_of};
use samples::{Label, Recording};

/// Maximum share of the stable samples lost by the drift.
const LOST: f64 = 0.01;

#[test]
fn drift_of_the_gyroscope_in_a_walk_costs_no_stances() {
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        let plan = Plan::steady(gait, Ground::Hard, 65.0, 11);
        let recording = simulate(&plan, &SensorParams::LSM6DSOX, 11).recording;
        let (without, _) = found_from(&recording, 32.5);
        for (axis, drifting) in ["x", "y", "z"].iter().zip(with_rate_drifts(&recording)) {
            let (with, _) = found_from(&drifting, 32.5);
            println!("{gait} {axis}: {without:.3} → {with:.3}");
            assert!(with > without - LOST, "{gait} {axis}: {without} → {with}");
        }
    }
}

/// A walk for [`with_step`].
fn long_walk(gait: GaitName) -> Recording {
    let plan = Plan::steady(gait, Ground::Hard, 150.0, 11);
    let walk = simulate(&plan, &SensorParams::LSM6DSOX, 11).recording;
    assert_eq!(walk.gravity, Gravity::Included);
    walk
}

/// A walk whose gyroscope is biased by `bias`, rad/s, from 60 s on; 10 s of standing come first.
fn with_step(walk: &Recording, bias: Vec3) -> Recording {
    let biased = changed(walk, |sample| {
        if sample.time_s() > 60.0 {
            let rate = sample.imu.angular_rate.0;
            sample.imu.angular_rate = AngularRate(rate + bias);
        }
    });
    stood(&biased, 10.0, 3)
}

/// Shares of samples with P > 0.5 after a time, s: among the stable samples, and among the others.
fn found_from(recording: &Recording, from_s: f64) -> (f64, f64) {
    let estimates = estimates_of(recording, &AnyParams::DEFAULT).expect("the preset");
    // Numbers of found samples and of all samples: among the stable samples, and among the others.
    let mut counts = [(0_u32, 0_u32); 2];
    for (sample, estimate) in recording.samples.iter().zip(&estimates) {
        let Some(label) = sample.label.filter(|_| sample.time_s() > from_s) else {
            continue;
        };
        let (found, all) = &mut counts[usize::from(label != Label::Stable)];
        *found += u32::from(estimate.probabilities.stable > 0.5);
        *all += 1;
    }
    let [stances, others] = counts.map(|(found, all)| f64::from(found) / f64::from(all));
    (stances, others)
}

#[test]
fn stances_are_found_a_minute_after_a_step_of_the_bias() {
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        let walk = long_walk(gait);
        let (without, others_without) = found_from(&with_step(&walk, Vec3::ZERO), 130.0);
        for axis in AXES {
            for degrees in [3.0, 5.0] {
                let step = with_step(&walk, axis * (degrees * PI / 180.0));
                let (with, others) = found_from(&step, 130.0);
                println!("{gait}, {degrees} °/s: {without:.3} → {with:.3}, others {others:.3}");
                assert!(with > without - LOST, "{gait}, {axis:?}: {without} → {with}");
                assert!(others < others_without + LOST, "{gait}, {axis:?}: {others}");
            }
        }
    }
}

#[test]
fn step_of_the_bias_beyond_the_limit_is_reported() {
    let walk = long_walk(GaitName::Walk);
    for (degrees, reported) in [(5.0, false), (9.0, true)] {
        let step = with_step(&walk, Vec3::new(degrees * PI / 180.0, 0.0, 0.0));
        let config = Params::DEFAULT.validate().expect("the preset");
        let mut estimator = ContactEstimator::new(&config, Stream::KILOHERTZ);
        let mut first = None;
        for sample in &step.samples {
            estimator.update(&sample.imu, None);
            if estimator.excess_bias().is_some() && first.is_none() {
                first = Some(sample.time_s());
            }
        }
        println!("{degrees} °/s: reported at {first:?} s");
        // The step comes at 70 s.
        assert_eq!(first.is_some_and(|at_s| (70.0..130.0).contains(&at_s)), reported);
        assert_eq!(first.is_some(), reported, "{degrees} °/s: {first:?}");
    }
}

/// A walk after 10 s of standing, whose gyroscope has no bias.
fn unbiased(gait: GaitName) -> Recording {
    let plan = Plan::steady(gait, Ground::Hard, 100.0, 11);
    let mut sensor = SensorParams::LSM6DSOX;
    sensor.gyroscope.bias_limit = 0.0;
    stood(&simulate(&plan, &sensor, 11).recording, 10.0, 3)
}

/// A walk whose foot is turned over at some times, s, without a rate.
fn turned_over(walk: &Recording, times: &[f64]) -> Recording {
    changed(walk, |sample| {
        let turns = times.iter().filter(|time| **time < sample.time_s()).count();
        let turned = |Vec3 { x, y, z }| match turns % 2 {
            0 => Vec3::new(x, y, z),
            _ => Vec3::new(x, -y, -z),
        };
        sample.imu.specific_force.0 = turned(sample.imu.specific_force.0);
        sample.imu.angular_rate.0 = turned(sample.imu.angular_rate.0);
    })
}

/// Largest distance of the estimated bias from `bias`, °/s, after a time, s.
fn farthest_from(bias: Vec3, recording: &Recording, from_s: f64) -> f32 {
    let (rate, gravity) = (recording.sample_rate, recording.gravity);
    let mut estimator = Estimator::new(rate, gravity, &AnyParams::DEFAULT).expect("the preset");
    let mut farthest = 0.0_f32;
    for sample in &recording.samples {
        estimator.update(sample);
        if sample.time_s() > from_s {
            let estimated = estimator.gyro_bias().expect("it stood").0;
            farthest = farthest.max((estimated - bias).length());
        }
    }
    farthest * (180.0 / PI)
}

#[test]
fn walking_foot_turned_over_learns_the_true_bias() {
    let often = [45.5, 55.3, 65.7, 75.2, 85.9, 95.0];
    for gait in [GaitName::Walk, GaitName::Trot] {
        let walk = unbiased(gait);
        for (times, degrees) in [(&often[..1], 0.0), (&often, 0.0), (&often, 5.0)] {
            let bias = Vec3::new(degrees * PI / 180.0, 0.0, 0.0);
            let from_s = if degrees > 0.0 { 100.0 } else { 15.0 };
            let biased = changed(&turned_over(&walk, times), |sample| {
                if sample.time_s() > 40.0 {
                    sample.imu.angular_rate.0 += bias;
                }
            });
            let error = farthest_from(bias, &biased, from_s);
            println!("{gait}, {} times, {degrees} °/s: {error:.2} °/s", times.len());
            assert!(error < 1.0, "{gait}, {times:?}, {degrees} °/s: {error}");
        }
    }
}
