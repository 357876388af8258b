//! The recordings stored in the repository: made by the simulator, the same on every machine, with the same
//! estimates as when they were committed.
//!
//! `FOOTFALL_UPDATE=1 cargo test -p host-tests --test host recordings::` writes them again.

use config::default_params;
use estimator_core::{ContactEstimate, Flag, ImuSample, Phase, Timestamp};
use footfall::files::{Existing, write_file};
use gait::{Activity, GaitName, Ground, Plan, SensorParams, Simulation, record, simulate};
use host_tests::committed::assert_current;
use host_tests::datasets::simulated;
use options::{Format, InputOptions};
use replay::scoring::{Metrics, Scored};
use samples::RecordedSample;
use samples::estimate::estimates_of;
use tables::output::{write_recording, write_row, write_samples};

const SECONDS: f64 = 5.0;
const SEED: u64 = 1;

/// A committed file: the ground of the walk, and the RMSE of the default preset's P on it.
struct Walk {
    file: &'static str,
    ground: Ground,
    rmse: f64,
}

const WALKS: [Walk; 2] = [
    Walk { file: "walk.csv", ground: Ground::Hard, rmse: 0.1712 },
    Walk { file: "slip.csv", ground: Ground::Greased, rmse: 0.2283 },
];

/// Largest change of the RMSE in either direction, because an unintended gain needs an explanation, too.
const RMSE_TOLERANCE: f64 = 0.001;

fn simulation(ground: Ground) -> Simulation {
    let plan = Plan::steady(GaitName::Walk, ground, SECONDS, SEED);
    simulate(&plan, &SensorParams::LSM6DSOX, SEED)
}

#[test]
fn the_simulator_makes_the_committed_recordings_bit_for_bit() {
    for Walk { file, ground, .. } in WALKS {
        let mut csv = Vec::new();
        write_recording(&simulation(ground).recording.samples, &mut csv).expect("memory is enough");
        let csv = String::from_utf8(csv).expect("a table is text");
        assert_current(&simulated(file), &csv);
    }
}

#[test]
fn a_fresh_clone_distinguishes_stance_from_slip_and_swing() {
    for Walk { file, ground, rmse } in WALKS {
        let truth = simulation(ground).truth;
        let path = simulated(file);
        let loaded =
            recordings::read(&path, Format::Csv, &InputOptions::default()).expect("a recording");
        let estimates = estimates_of(&loaded.recording, &default_params()).expect("the preset");
        let metrics = Metrics::of(&Scored::collect(&loaded.recording.samples, &estimates));
        let metrics = metrics.expect("labels");
        assert!((metrics.rmse - rmse).abs() <= RMSE_TOLERANCE, "{file}: {metrics:?}");

        // Deep inside each activity the estimate has to be right.
        let share = |activity: Activity, phase: Phase| {
            let inside = (100..truth.len()).filter(|k| {
                let settled = k.saturating_sub(100)..=*k;
                truth[settled].iter().all(|state| state.activity == activity)
            });
            let (hits, all) = inside.fold((0, 0), |(hits, all), k| {
                (hits + usize::from(estimates[k].phase == phase), all + 1)
            });
            f64::from(hits as u32) / f64::from(all.max(1) as u32)
        };
        assert_eq!(share(Activity::Swinging, Phase::Swing), 1.0, "{file}");
        match ground {
            Ground::Greased => assert_eq!(share(Activity::Slipping, Phase::Slip), 1.0, "{file}"),
            Ground::Hard | Ground::Soft => {
                assert!(estimates[2_100..].iter().any(|e| e.phase == Phase::Stance));
            }
        }
    }
}

#[test]
fn a_table_of_samples_replays_to_the_bits_of_the_live_run() {
    // The demo's walk: samples between ticks, hard landings that saturate, gravity included.
    let recording = record(&Plan::demo(SEED), &SensorParams::LSM6DSOX, SEED);
    let live = estimates_of(&recording, &default_params()).expect("the preset");
    assert!(live.iter().any(|e| e.flags.contains(Flag::Saturated)));
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = folder.path().join("samples.csv");
    write_file(&path, Existing::Replaced, |to| write_samples(&recording.samples, &live, to))
        .expect("a file");
    let loaded =
        recordings::read(&path, Format::Csv, &InputOptions::default()).expect("a recording");
    assert_eq!(loaded.recording.sample_rate, recording.sample_rate);
    // A replay's clock starts with its first row.
    let first_us = recording.samples[0].imu.timestamp.as_micros();
    assert_eq!(loaded.start_us, first_us as i64);
    for (read, sample) in loaded.recording.samples.iter().zip(&recording.samples) {
        let micros = read.imu.timestamp.as_micros() + first_us;
        let imu = ImuSample { timestamp: Timestamp::from_micros(micros), ..read.imu };
        assert_eq!(RecordedSample { imu, ..*read }, *sample);
    }
    let replayed = estimates_of(&loaded.recording, &default_params()).expect("the preset");
    let table = |estimates: &[ContactEstimate], start_us: i64| {
        let mut bytes = Vec::new();
        for estimate in estimates {
            write_row(None, estimate, start_us, &mut bytes).expect("memory is enough");
        }
        bytes
    };
    // Numbers are written so that different bits give different text.
    assert!(table(&replayed, loaded.start_us) == table(&live, 0));
}
