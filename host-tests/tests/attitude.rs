//! The attitude filter against the truth, which only a simulated foot knows.

use estimator_core::internals::{Alignment, AttitudeFilter};
use estimator_core::params::{AttitudeParams, GyroTiming};
use estimator_core::{
    AngularRate, Gravity, ImuSample, Params, Quaternion, SpecificForce, Stream, Timestamp,
    Validity, Vec3,
};
use gait::plan::{GaitName, Ground, Plan};
use gait::sensor::{self, AxisErrors};
use gait::{Activity, SensorParams, Simulation, Track, simulate};
use host_tests::changed::{
    jittering, losing_bursts, losing_single, with_force_bias, with_rate_bias,
};
use replay::scoring::inclination_error_degrees;
use samples::Recording;
use samples::space::{Rotation, Vector};

use proptest::prelude::*;

const GRAVITY: Vector = Vector::new(0.0, 0.0, sensor::GRAVITY);

fn filter(params: &Params, stream: Stream) -> AttitudeFilter {
    params.validate().expect("valid parameters").attitude_filter(stream)
}

fn single(vector: Vector) -> Vec3 {
    let [x, y, z] = vector.to_array().map(|component| component as f32);
    Vec3::new(x, y, z)
}

/// A sensor whose accelerometer has no bias, because a bias tilts the measured gravity, which no filter can detect and
/// only a calibration removes. The gyroscope keeps its bias.
const CALIBRATED: SensorParams = SensorParams {
    accelerometer: AxisErrors { bias_limit: 0.0, drift_limit: 0.0 },
    ..SensorParams::LSM6DSOX
};

#[test]
fn no_gait_tilts_the_estimate_far() {
    // The limit of a run is larger, because its landings exceed ±16 g, so that clipping hides a part of the motion, and
    // its rests are too short to correct the error.
    for (gait, limit) in [(GaitName::Walk, 0.5), (GaitName::Trot, 0.8), (GaitName::Run, 1.5)] {
        let plan = Plan::steady(gait, Ground::Hard, 60.0, 7);
        let simulation = simulate(&plan, &CALIBRATED, 7);
        let mut filter = filter(&Params::DEFAULT, Stream::KILOHERTZ);
        let mut worst = 0.0_f64;
        for (sample, truth) in simulation.recording.samples.iter().zip(&simulation.truth) {
            filter.update(&sample.imu);
            if sample.time_s() > 1.0 {
                let error = inclination_error_degrees(filter.orientation(), truth.orientation);
                worst = worst.max(error);
            }
        }
        assert!(worst < limit, "{gait}: {worst}°");
    }
}

/// The foot's motion as measured by an ideal sensor without noise at `rate` Hz, and the filter's orientation every
/// 20 ms.
fn orientations_at(motion: &Track, rate: f32, seconds: f64) -> Vec<Quaternion> {
    let params = Params {
        attitude: AttitudeParams { gyro_timing: GyroTiming::Delay(0.0), ..AttitudeParams::DEFAULT },
        ..Params::DEFAULT
    };
    let stream = Stream::new(rate, Gravity::Included).expect("a rate");
    let mut filter = filter(&params, stream);
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
    Rotation { w: f64::from(q.w), v: Vector::new(x, y, z) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_result_does_not_depend_on_the_sample_rate(seed in 0_u64..1_000) {
        // Landings are soft, because no sample rate resolves an impact between two samples.
        let seconds = 10.0;
        let motion = Track::new(&Plan::steady(GaitName::Walk, Ground::Soft, seconds, seed));
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

/// Errors of the filter while the foot stands, from two seconds after the start on.
#[derive(Debug)]
struct InStance {
    /// RMS of the inclination error, degrees.
    tilt: f64,
    /// RMS of the error of the linear acceleration, m/s².
    acceleration: f64,
    /// RMS of the error of the angular rate, rad/s.
    rate: f64,
    /// Whether up was known throughout.
    always_aligned: bool,
}

/// A change of a recording: an error of the sensor, or of the transmission of its samples.
type Degradation = fn(&Recording) -> Recording;

fn in_stance(simulation: &Simulation, degradation: Degradation) -> InStance {
    let mut filter = filter(&Params::DEFAULT, Stream::KILOHERTZ);
    let mut always_aligned = true;
    let (mut count, mut tilt, mut acceleration, mut rate) = (0_u32, 0.0, 0.0, 0.0);
    for sample in degradation(&simulation.recording).samples {
        let imu = sample.imu;
        filter.update(&imu);
        // The truth of this millisecond.
        let Some(truth) = simulation.truth.get((1.0e3 * sample.time_s()).round() as usize) else {
            continue;
        };
        if truth.activity != Activity::Standing || imu.timestamp.as_micros() < 2_000_000 {
            continue;
        }
        let error = inclination_error_degrees(filter.orientation(), truth.orientation);
        let gravity = filter.orientation().up() * sensor::GRAVITY as f32;
        let true_acceleration = single(truth.orientation.to_sensor(truth.acceleration));
        let left = imu.specific_force.0 - gravity - true_acceleration;
        let turning = imu.angular_rate.0 - filter.gyro_bias().0 - single(truth.angular_rate);
        count += 1;
        tilt += error * error;
        acceleration += f64::from(left.dot(left));
        rate += f64::from(turning.dot(turning));
        always_aligned &= filter.alignment() == Alignment::Aligned;
    }
    let rms = |squares: f64| (squares / f64::from(count)).sqrt();
    InStance { tilt: rms(tilt), acceleration: rms(acceleration), rate: rms(rate), always_aligned }
}

#[test]
fn a_poor_sensor_or_lost_samples_keep_stance_errors_bounded() {
    const ALL: Vec3 = Vec3::new(1.0, 1.0, 1.0);
    // Limits: tilt in degrees, for the walk and the trot; residual of gravity in m/s².
    let cases: [(&str, Degradation, f64, f64); 9] = [
        ("none", Recording::clone, 0.15, 0.06),
        ("2 °/s", |walk| with_rate_bias(walk, ALL * 2_f32.to_radians()), 0.15, 0.06),
        ("5 °/s", |walk| with_rate_bias(walk, ALL * 5_f32.to_radians()), 0.25, 0.08),
        ("0.3 m/s²", |walk| with_force_bias(walk, ALL * 0.3), 2.7, 0.33),
        ("5 % lost", |walk| losing_single(walk, 0.05, 1), 0.15, 0.06),
        ("10 lost", |walk| losing_bursts(walk, 0.05, 10, 1), 0.3, 0.08),
        ("20 lost", |walk| losing_bursts(walk, 0.05, 20, 1), 1.0, 0.2),
        ("half a period", |walk| jittering(walk, 0.5, 1), 0.2, 0.06),
        ("a period", |walk| jittering(walk, 1.0, 1), 0.3, 0.08),
    ];
    let [walk, trot, run] = [GaitName::Walk, GaitName::Trot, GaitName::Run]
        .map(|gait| simulate(&Plan::steady(gait, Ground::Hard, 30.0, 1), &CALIBRATED, 1));
    for (name, degradation, tilt, acceleration) in cases {
        let [walk, trot, run] = [&walk, &trot, &run].map(|walk| in_stance(walk, degradation));
        for stances in [&walk, &trot] {
            let context = format!("{name}: {stances:?}");
            assert!(stances.tilt < tilt, "{context}");
            assert!(stances.acceleration < acceleration, "{context}");
            assert!(stances.rate < 0.01, "{context}");
            assert!(stances.always_aligned, "{context}");
        }
        assert!(run.always_aligned, "{name}");
    }
}
