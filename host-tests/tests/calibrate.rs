//! A warm start and sensor errors from recordings, against known values: the learning of the estimator, labels
//! that the calibration does not use, and the simulated sensor.

use std::ops::Range;

use calibration::sensor::{RestsError, SensorCalibration};
use estimator_core::{ContactEstimator, Learnt, Params, Stream, Vec3};
use gait::sensor::{AxisErrors, GRAVITY, MILLI_DPS, MILLI_G};
use gait::{GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::labelled;
use host_tests::sets::Labelled;
use labelled::{averaged, rmse};
use samples::Recording;
use samples::space::Vector;

/// An accelerometer without errors of its own.
const CALIBRATED: SensorParams = SensorParams {
    accelerometer: AxisErrors { bias_limit: 0.0, drift_limit: 0.0 },
    ..SensorParams::LSM6DSOX
};

/// Maximum increase of the RMSE by a warm start, on any recording.
const WARM_COSTS: f64 = 0.02;

/// Maximum increase of the mean RMSE over the recordings; less is noise.
const WARM_COSTS_IN_THE_MEAN: f64 = 0.002;

/// Values learnt by the estimator of the foot, with its capacity, from the same samples.
fn learnt_by_the_estimator(recording: &Recording, learnt: Option<Learnt>) -> Learnt {
    let config = Params { learnt, ..Params::DEFAULT }.validate().expect("the preset");
    let stream = Stream::new(recording.sample_rate, recording.gravity).expect("a rate");
    let mut estimator = ContactEstimator::new(&config, stream);
    for sample in &recording.samples {
        estimator.update(&sample.imu, None);
    }
    estimator.learnt()
}

/// Samples of a part of a recording.
fn part(recording: &Recording, samples: Range<usize>) -> Recording {
    Recording { samples: recording.samples[samples].to_vec(), ..recording.clone() }
}

#[test]
fn a_warm_start_from_the_first_half_does_not_harm_the_second() {
    let Some(recordings) = averaged() else {
        return;
    };
    let gains: Vec<(String, f64)> = recordings
        .iter()
        .map(|Labelled { recording, .. }| {
            let middle = recording.samples.len() / 2;
            let first = part(recording, 0..middle);
            let second = part(recording, middle..recording.samples.len());
            let warm =
                Params { learnt: Some(learnt_by_the_estimator(&first, None)), ..Params::DEFAULT };
            let [cold, warm] = [Params::DEFAULT, warm].map(|params| rmse(&second, &params.into()));
            println!("{:24} cold {cold:.4}, warm {warm:.4}", recording.name);
            (recording.name.clone(), cold - warm)
        })
        .collect();
    let mean = gains.iter().map(|(_, gain)| gain).sum::<f64>() / gains.len() as f64;
    println!("gain in the mean {mean:.4}");
    for (name, gain) in &gains {
        assert!(*gain >= -WARM_COSTS, "{name}: {gain}");
    }
    assert!(mean >= -WARM_COSTS_IN_THE_MEAN, "{mean}");
}

/// A sensor with known errors that lies still for two seconds on each of some sides, and is turned by hand in
/// between.
fn lying(sides: &[Vector], bias: Vector, scale: Vector, gyro_bias: Vector) -> Recording {
    let mut recording = simulate(
        &Plan::steady(GaitName::Stand, Ground::Hard, 2.5 * sides.len() as f64, 1),
        &SensorParams { gyroscope: AxisErrors { bias_limit: 0.0, drift_limit: 0.0 }, ..CALIBRATED },
        1,
    )
    .recording;
    let up = Vector::new(0.0, 0.0, GRAVITY);
    for (k, sample) in recording.samples.iter_mut().enumerate() {
        let side = sides[k / 2500];
        let turning = k % 2500 >= 2000;
        // Noise of the simulated sensor, and the force of this side.
        let f = sample.imu.specific_force.0;
        let noise = Vector::new(f.x.into(), f.y.into(), f.z.into()) - up;
        let force = side * (GRAVITY / side.length());
        let single = |v: Vector| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        sample.imu.specific_force.0 = single(
            Vector::new(force.x * scale.x, force.y * scale.y, force.z * scale.z) + bias + noise,
        );
        let rate = sample.imu.angular_rate.0;
        let hand = if turning { 2.0 } else { 0.0 };
        sample.imu.angular_rate.0 = rate + single(gyro_bias) + Vec3::new(hand, 0.0, 0.0);
    }
    recording
}

/// Returns sides as placed by hand, of which none is exactly level.
fn six_sides() -> Vec<Vector> {
    [
        [1.0, 0.05, -0.08],
        [-1.0, 0.03, 0.04],
        [-0.04, 1.0, 0.06],
        [0.06, -1.0, 0.04],
        [0.03, -0.07, 1.0],
        [-0.05, 0.06, -1.0],
    ]
    .map(Vector::from_array)
    .to_vec()
}

const BIAS: Vector = Vector::new(0.19, -0.12, 0.15);
const SCALE: Vector = Vector::new(1.01, 0.992, 1.006);
const GYRO_BIAS: Vector = Vector::new(0.006, -0.008, 0.002);

#[test]
fn six_rests_determine_bias_and_scale_of_each_axis() {
    let recording = lying(&six_sides(), BIAS, SCALE, GYRO_BIAS);
    let found = SensorCalibration::of([&recording]).expect("six sides");
    println!("{found}");
    assert_eq!((found.orientations, found.rests.len()), (6, 6));
    let milli_g = |found: f64, truth: f64| ((found - truth) / MILLI_G).abs();
    for (found, truth) in found.accelerometer_bias.into_iter().zip(BIAS.to_array()) {
        assert!(milli_g(found, truth) < 0.5, "{found} is not {truth}");
    }
    for (found, truth) in found.accelerometer_scale.into_iter().zip(SCALE.to_array()) {
        assert!((found * truth - 1.0).abs() < 5e-4, "{found} is not 1/{truth}");
    }
    for (found, truth) in found.gyroscope_bias.into_iter().zip(GYRO_BIAS.to_array()) {
        assert!((found - truth).abs() < 5.0 * MILLI_DPS, "{found} is not {truth}");
    }
    assert!(found.residual_before > 0.1 && found.residual_after < 0.01);
}

#[test]
fn rests_may_be_spread_over_recordings_and_repeat() {
    let sides = six_sides();
    let (first, rest) = sides.split_at(2);
    let recordings = [first, rest, first, first].map(|sides| lying(sides, BIAS, SCALE, GYRO_BIAS));
    let found = SensorCalibration::of(&recordings).expect("six sides");
    assert_eq!((found.orientations, found.rests.len()), (6, 10));
    assert!((found.accelerometer_bias[0] - BIAS.x).abs() < 0.5 * MILLI_G);
}

#[test]
fn rests_that_are_all_approximately_upright_are_rejected() {
    let upright: Vec<Vector> = (0..8)
        .map(|k| {
            let (sine, cosine) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            Vector::new(0.4 * cosine, 0.4 * sine, 1.0)
        })
        .collect();
    let refused = SensorCalibration::of([&lying(&upright, BIAS, SCALE, GYRO_BIAS)]);
    assert!(matches!(refused, Err(RestsError::Span { axis: "az", .. })));
}
