//! Recordings for the tests of the checks.

use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Validity, Vec3};
use samples::{RecordedSample, Recording};

use crate::check;
use crate::finding::Finding;

/// Noise of an axis that hardly moves.
fn noise(k: u64) -> f32 {
    1.0e-4 * (k % 5) as f32
}

/// A foot that rests and swings every second for 10 s at 200 Hz, with gravity along z. It hardly turns, so that no swing
/// shows the axes.
pub(crate) fn walk() -> Recording {
    let sample = |k: u64| {
        let phase = (k % 200) as f32 / 200.0;
        let swing = if phase < 0.5 { 0.0 } else { 1.0 };
        let wave = libm::sinf(40.0 * phase);
        RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(5_000 * k),
                specific_force: SpecificForce(Vec3::new(
                    8.0 * swing * wave,
                    3.0 * swing * wave,
                    9.81 + 0.01 * wave + 5.0 * swing * wave,
                )),
                angular_rate: AngularRate(Vec3::new(
                    noise(k),
                    4.0 * swing * wave,
                    0.001 + noise(k + 3),
                )),
                validity: Validity::Valid,
            },
            load: None,
            label: None,
        }
    };
    Recording {
        name: "walk".to_owned(),
        sample_rate: 200.0,
        gravity: Gravity::Included,
        load_title: String::new(),
        samples: (0..2000).map(sample).collect(),
    }
}

pub(crate) fn with_force(change: impl Fn(Vec3) -> Vec3) -> Recording {
    let mut recording = walk();
    for sample in &mut recording.samples {
        sample.imu.specific_force.0 = change(sample.imu.specific_force.0);
    }
    recording
}

pub(crate) fn with_times(micros: impl Fn(u64) -> u64) -> Recording {
    let mut recording = walk();
    for (k, sample) in (0..).zip(&mut recording.samples) {
        sample.imu.timestamp = Timestamp::from_micros(micros(k));
    }
    recording
}

/// The names of all findings.
pub(crate) fn found(recording: &Recording) -> Vec<&'static str> {
    check(recording).iter().map(Finding::name).collect()
}

pub(crate) fn scaled(by: f32) -> impl Fn(Vec3) -> Vec3 {
    move |force| Vec3::new(force.x * by, force.y * by, force.z * by)
}

/// Readings that are updated once in `rows` rows and held in between.
pub(crate) fn held(rows: usize) -> Recording {
    let mut recording = walk();
    for k in 0..recording.samples.len() {
        let read = recording.samples[k - k % rows].imu;
        let imu = &mut recording.samples[k].imu;
        (imu.specific_force, imu.angular_rate) = (read.specific_force, read.angular_rate);
    }
    recording
}

/// A foot that rests for 0.5 s and then swings for 0.5 s with a pitch of up to 1 rad, for 20 s at 500 Hz: each swing
/// goes 0.4 m forth and 0.1 m up and down.
pub(crate) fn pitching() -> Recording {
    use std::f64::consts::TAU;
    let sample = |k: u64| {
        let time = k as f64 / 500.0;
        // From 0 to 1 in the swing, with smooth ends.
        let phase = ((time % 1.0) * 2.0 - 1.0).max(0.0);
        let bump = libm::sin(0.5 * TAU * phase).powi(4);
        let slope = |f: fn(f64) -> f64| {
            let step = 1.0e-4;
            (f(phase + step) - 2.0 * f(phase) + f(phase - step)) / (step * step) * 4.0
        };
        let swings = phase > 0.0;
        let forward = |p: f64| 0.4 * (p - libm::sin(TAU * p) / TAU);
        let upward = |p: f64| 0.1 * libm::sin(0.5 * TAU * p).powi(4);
        let (x, z) = if swings { (slope(forward), slope(upward)) } else { (0.0, 0.0) };
        let cosine = libm::cos(0.5 * TAU * phase);
        let rate = 2.0 * 4.0 * 0.5 * TAU * libm::sin(0.5 * TAU * phase).powi(3) * cosine;
        let rate = if swings { rate } else { 0.0 };
        let (sine, cosine) = (libm::sin(bump), libm::cos(bump));
        let gravity = 9.81 + z;
        let noise = 1.0e-3 * (k % 7) as f32;
        let force = Vec3::new(
            (cosine * x - sine * gravity) as f32 + noise,
            noise,
            (sine * x + cosine * gravity) as f32,
        );
        RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(2_000 * k),
                specific_force: SpecificForce(force),
                angular_rate: AngularRate(Vec3::new(0.1 * noise, rate as f32, 0.01 + 0.1 * noise)),
                validity: Validity::Valid,
            },
            load: None,
            label: None,
        }
    };
    Recording { sample_rate: 500.0, samples: (0..10_000).map(sample).collect(), ..walk() }
}

pub(crate) fn with_both(mut recording: Recording, change: impl Fn(Vec3) -> Vec3) -> Recording {
    for sample in &mut recording.samples {
        let imu = &mut sample.imu;
        imu.specific_force.0 = change(imu.specific_force.0);
        imu.angular_rate.0 = change(imu.angular_rate.0);
    }
    recording
}
