//! The recordings that the repository holds: made by the simulator, the same on every machine,
//! and estimated as they were when they were committed.
//!
//! `FOOTFALL_UPDATE=1 cargo test -p host-tests --test recordings` writes them anew.

use std::fs;

use estimator_core::{Params, Phase};
use footfall::gait::{Activity, GaitName, Ground, Plan, SensorParams, Simulation, simulate};
use footfall::input::{self, Format, Hints};
use footfall::metrics::{Metrics, Scored};
use footfall::output::write_recording;
use footfall::replay::replay;
use host_tests::committed::assert_current;
use host_tests::datasets::simulated;

const SECONDS: f64 = 5.0;
const SEED: u64 = 1;

/// A committed file: where the foot walks, and the RMSE of the default preset's P on it.
struct Walk {
    file: &'static str,
    ground: Ground,
    rmse: f64,
}

const WALKS: [Walk; 2] = [
    Walk {
        file: "walk.csv",
        ground: Ground::Hard,
        rmse: 0.2335,
    },
    Walk {
        file: "slip.csv",
        ground: Ground::Greased,
        rmse: 0.2783,
    },
];

/// Either way: a gain that nobody meant wants explaining, too.
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
fn a_fresh_clone_tells_stance_from_slip_and_swing() {
    for Walk { file, ground, rmse } in WALKS {
        let truth = simulation(ground).truth;
        let path = simulated(file);
        let loaded = input::read(&path, Format::Csv, &Hints::default()).expect("a recording");
        let estimates = replay(&loaded.recording, &Params::DEFAULT).expect("the preset");
        let metrics = Metrics::of(&Scored::collect(&loaded.recording.samples, &estimates));
        let metrics = metrics.expect("labels");
        assert!(
            (metrics.rmse - rmse).abs() <= RMSE_TOLERANCE,
            "{file}: {metrics:?}"
        );

        // Deep inside each activity there is no excuse.
        let share = |activity: Activity, phase: Phase| {
            let inside = (100..truth.len()).filter(|k| {
                let settled = k.saturating_sub(100)..=*k;
                truth[settled]
                    .iter()
                    .all(|state| state.activity == activity)
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
fn there_is_no_recording_that_nobody_makes() {
    let folder = simulated("");
    let mut files: Vec<String> = fs::read_dir(&folder)
        .expect("the folder of recordings")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    files.sort();
    let mut known = WALKS.map(|walk| walk.file.to_owned()).to_vec();
    known.sort();
    assert_eq!(files, known);
}
