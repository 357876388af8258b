//! The attitude filter against the truth, which only a simulated foot knows.

use estimator_core::{
    AngularRate, AttitudeFilter, AttitudeParams, GyroTiming, ImuSample, Params, Quaternion,
    SpecificForce, Timestamp, Validity, Vec3,
};
use footfall::attitude::inclination_error_degrees;
use footfall::gait::plan::{GaitName, Ground, Plan};
use footfall::gait::sensor::{self, AxisErrors};
use footfall::gait::space::{Rotation, Vector};
use footfall::gait::{Motion, SensorParams, simulate};

use proptest::prelude::*;

const GRAVITY: Vector = Vector::new(0.0, 0.0, sensor::GRAVITY);

fn filter(params: &Params) -> AttitudeFilter {
    AttitudeFilter::new(&params.validate::<256>().expect("valid parameters"))
}

fn single(vector: Vector) -> Vec3 {
    let [x, y, z] = vector.to_array().map(|component| component as f32);
    Vec3::new(x, y, z)
}

/// An accelerometer without bias: with one, gravity itself seems to lean, which no filter can see
/// and only calibration removes. The gyroscope keeps its bias.
const CALIBRATED: SensorParams = SensorParams {
    accelerometer: AxisErrors {
        bias_limit: 0.0,
        drift_limit: 0.0,
    },
    ..SensorParams::LSM6DSOX
};

/// Tilt of the estimate in degrees at every sample of a simulated walk.
fn tilt_errors(plan: &Plan, seed: u64) -> Vec<(f64, f64)> {
    let simulation = simulate(plan, &CALIBRATED, seed);
    let mut filter = filter(&Params::DEFAULT);
    simulation
        .recording
        .samples
        .iter()
        .zip(&simulation.truth)
        .map(|(sample, truth)| {
            filter.update(&sample.imu);
            let error = inclination_error_degrees(filter.orientation(), truth.orientation);
            (sample.time_s(), error)
        })
        .collect()
}

#[test]
fn no_gait_tilts_the_estimate_far() {
    // A run lands beyond ±16 g and rests too briefly to settle: what clipping hides is lost.
    for (gait, limit) in [
        (GaitName::Walk, 0.5),
        (GaitName::Trot, 0.8),
        (GaitName::Run, 1.5),
    ] {
        let plan = Plan::steady(gait, Ground::Hard, 60.0, 7);
        let worst = tilt_errors(&plan, 7)
            .into_iter()
            .filter(|(t, _)| *t > 1.0)
            .fold(0.0, |worst: f64, (_, error)| worst.max(error));
        assert!(worst < limit, "{gait}: {worst}°");
    }
}

#[test]
fn after_a_third_of_a_second_of_quiet_stance_the_tilt_is_below_one_degree() {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, 60.0, 5);
    let simulation = simulate(&plan, &CALIBRATED, 5);
    let mut quiet_since = None;
    let mut checked = 0;
    for ((t, error), truth) in tilt_errors(&plan, 5).into_iter().zip(&simulation.truth) {
        if truth.is_at_rest_under_load() {
            let since = *quiet_since.get_or_insert(t);
            if t - since > 0.3 {
                assert!(error < 1.0, "{error}° at {t} s");
                checked += 1;
            }
        } else {
            quiet_since = None;
        }
    }
    assert!(checked > 5_000, "{checked} samples were quiet");
}

/// The foot's motion as an ideal sensor without noise sees it at `rate` Hz, and the filter's
/// orientation every 20 ms.
fn orientations_at(motion: &Motion, rate: f32, seconds: f64) -> Vec<Quaternion> {
    let params = Params {
        sample_rate: rate,
        attitude: AttitudeParams {
            gyro_timing: GyroTiming::Delay(0.0),
            ..AttitudeParams::DEFAULT
        },
        ..Params::DEFAULT
    };
    let mut filter = filter(&params);
    let samples = (seconds * f64::from(rate)) as u64;
    let every = (0.02 * rate).round() as u64;
    let mut orientations = Vec::new();
    for k in 0..samples {
        let t = k as f64 / f64::from(rate);
        let state = motion.at(t);
        let force = state.orientation.to_sensor(state.acceleration + GRAVITY);
        filter.update(&ImuSample {
            timestamp: Timestamp::from_micros((t * 1.0e6).round() as u64),
            specific_force: SpecificForce(single(force)),
            angular_rate: AngularRate(single(state.angular_rate)),
            validity: Validity::Valid,
        });
        if k % every == 0 {
            orientations.push(filter.orientation());
        }
    }
    orientations
}

fn as_rotation(q: Quaternion) -> Rotation {
    let [x, y, z] = [q.x, q.y, q.z].map(f64::from);
    Rotation {
        w: f64::from(q.w),
        v: Vector::new(x, y, z),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_result_does_not_depend_on_the_sample_rate(seed in 0_u64..1_000) {
        // Soft landings: what an impact does between two samples no rate can know.
        let seconds = 10.0;
        let motion = Motion::new(&Plan::steady(GaitName::Walk, Ground::Soft, seconds, seed));
        let reference = orientations_at(&motion, 4000.0, seconds);
        for rate in [250.0, 500.0, 1000.0, 2000.0] {
            let orientations = orientations_at(&motion, rate, seconds);
            prop_assert_eq!(orientations.len(), reference.len());
            let worst = orientations
                .into_iter()
                .zip(&reference)
                .map(|(q, reference)| inclination_error_degrees(q, as_rotation(*reference)))
                .fold(0.0, f64::max);
            prop_assert!(worst < 0.5, "{rate} Hz: {worst}°");
        }
    }
}
