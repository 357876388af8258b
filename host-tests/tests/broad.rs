//! The attitude filter on six trials of BROAD: a hand-held IMU with optical truth (Laidig, Caruso,
//! Cereatti, Seel, *BROAD: A Benchmark for Robust Inertial Orientation Estimation*, 2021).

use std::fs;

use estimator_core::Params;
use estimator_core::params::{AttitudeParams, GyroTiming};
use host_tests::datasets::recorded;
use options::{Format, InputOptions};
use replay::scoring::inclination_error_degrees;
use samples::Recording;
use samples::estimate::estimates_of;
use samples::space::{Rotation, Vector};

const TRIALS: [&str; 6] = [
    "02_undisturbed_slow_rotation_B",
    "07_undisturbed_fast_rotation_B",
    "11_undisturbed_slow_translation_B",
    "15_undisturbed_fast_translation_A",
    "24_disturbed_tapping_A",
    "27_disturbed_phone_vibration_B",
];

/// Limits of the RMS inclination error, mean over the trials and worst of them, degrees.
const MEAN_DEG: f64 = 0.60;
const WORST_DEG: f64 = 1.2;

struct Trial {
    recording: Recording,
    truth: Vec<Option<Rotation>>,
}

/// Orientation in the cells `qw,qx,qy,qz,movement` at the end of a row, from the sensor to the world; `None` if it is
/// unknown, or the sensor does not move.
fn truth(row: &str) -> Option<Rotation> {
    let cells: Vec<f64> = row.split(',').skip(7).map_while(|cell| cell.parse().ok()).collect();
    match cells[..] {
        [w, x, y, z, 1.0] => Some(Rotation { w, v: Vector::new(x, y, z) }),
        _ => None,
    }
}

/// All trials, or `None` if they are absent.
fn trials() -> Option<Vec<Trial>> {
    let trial = |name: &str| {
        let path = recorded(&format!("broad/{name}.csv"))?;
        let loaded = recordings::read(&path, Format::Csv, &InputOptions::default())
            .expect("a readable file");
        let text = fs::read_to_string(&path).expect("a readable file");
        let truth: Vec<_> = text.lines().skip(1).map(truth).collect();
        assert_eq!(truth.len(), loaded.recording.samples.len());
        Some(Trial { recording: loaded.recording, truth })
    };
    TRIALS.into_iter().map(trial).collect()
}

/// RMS error of each trial, degrees.
fn errors_deg(trials: &[Trial], attitude: AttitudeParams) -> Vec<f64> {
    let params = Params { attitude, ..Params::DEFAULT }.into();
    let error = |trial: &Trial| {
        let estimates = estimates_of(&trial.recording, &params).expect("valid parameters");
        let squares = estimates.iter().zip(&trial.truth).filter_map(|(estimate, truth)| {
            Some(inclination_error_degrees(estimate.orientation, (*truth)?).powi(2))
        });
        mean(&squares.collect::<Vec<_>>()).sqrt()
    };
    trials.iter().map(error).collect()
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn inclination_keeps_its_bounds_on_broad() {
    let Some(trials) = trials() else {
        return;
    };
    let errors = errors_deg(&trials, AttitudeParams::DEFAULT);
    assert!(mean(&errors) <= MEAN_DEG, "{errors:?}");
    assert!(errors.iter().all(|error| *error <= WORST_DEG), "{errors:?}");

    // Of all settings, the time at which the gyroscope measures has the largest effect. With a delay of 0, rates are late
    // by half a period.
    let late = AttitudeParams { gyro_timing: GyroTiming::Delay(0.0), ..AttitudeParams::DEFAULT };
    assert!(mean(&errors_deg(&trials, late)) > mean(&errors) + 0.1);
}
