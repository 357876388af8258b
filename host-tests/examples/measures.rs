//! Measures of constants of self-calibration, for a search over them.
//!
//! Each line on standard input names the constants that differ from the default preset's
//! (`slide.spread=2.5 memory=9`), and is answered by a line of measures on standard output: `name=value` with spaces
//! between, or `error: …`. A search keeps the process running, so that recordings are read and feet simulated once:
//!
//! ```sh
//! echo 'slide.spread=2.5' | cargo run --release -p host-tests --example measures
//! ```
//!
//! | measure | |
//! |---|---|
//! | `SET@RATE` | RMSE of P on a set, as recorded (`native`) and at 1000 Hz |
//! | `mean@RATE`, `auc@RATE`, `calibration@RATE`, `robots@RATE` | means over the seven sets of the mean, and of the RMSE over the robots |
//! | `later` | mean RMSE of the ATLAS sets that start 2, 3 or 6 s later, in the middle of a step |
//! | `residual` | RMSE on ground with a residual of gravity of 0.1 m/s² on each axis |
//! | `standing` | largest change of an ATLAS set's RMSE by a minute of standing in front of it |
//! | `drift` | largest share of the stances of a simulated walk that a drift of the gyroscope of 2 °/s in a minute costs |
//! | `missed`, `false`, `never` | slips not found, false slips and stances not found, of a sample of the grid of slips |

#[path = "../tests/labelled/mod.rs"]
mod labelled;

use std::io::{BufRead, stdin};

use estimator_core::{AngularRate, Params, Vec3};
use evaluate::labelled::Labelled;
use evaluate::rates::{SampleRate, at_rate};
use evaluate::score::Scores;
use evaluate::sets::{Pool, Set};
use gait::{GaitName, Ground, Plan, SensorParams, Simulation, record};
use host_tests::changed::{changed, stood, with_force_bias};
use host_tests::constants::with_constants;
use host_tests::slips::{Score, profiles};
use labelled::{of_sets, rmse};
use recordings::recording::{Label, Recording};
use recordings::replay::replay;

/// Stride through the profiles of the grid of slips; it is coprime with every dimension of the grid.
const PROFILE_STEP: usize = 7;

/// Duration of each walk on slippery ground, s.
const SLIPPERY_SECONDS: f64 = 14.0;

/// Times after the first sample at which recordings start later, s.
const LATER_S: [f64; 3] = [2.0, 3.0, 6.0];

/// The recordings, and the simulated feet.
struct Material {
    recordings: Vec<Labelled>,
    later: Vec<Recording>,
    residual: Recording,
    /// Recordings, each with a minute of standing in front of it.
    standing: Vec<[Recording; 2]>,
    walk: Recording,
    /// The same, with a drift about each axis.
    drifting: Vec<Recording>,
    slippery: Vec<Simulation>,
}

impl Material {
    /// Reads and simulates everything; `None` without the recordings.
    fn load() -> Option<Self> {
        let sets = [&Set::AVERAGED[..], &Set::ROBOTS, &[Set::Atlas500]];
        let recordings = of_sets(&sets.concat())?;
        let atlas: Vec<Recording> = of_sets(Pool::Atlas.sets())?
            .into_iter()
            .map(|file| file.recording)
            .collect();
        let ground = of_sets(&[Set::Ground])?.pop()?.recording;
        let plan = Plan::steady(GaitName::Walk, Ground::Hard, 65.0, 11);
        let walk = record(&plan, &SensorParams::LSM6DSOX, 11);
        let axes = [
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::new(0.0, 0.0, 1.0),
        ];
        Some(Self {
            recordings,
            later: (atlas.iter())
                .flat_map(|recording| LATER_S.map(|later_s| starting_later(recording, later_s)))
                .collect(),
            residual: with_force_bias(&ground, Vec3::new(0.1, 0.1, 0.1)),
            standing: (atlas.iter())
                .map(|recording| [recording.clone(), stood(recording, 60.0, 1)])
                .collect(),
            drifting: axes.map(|axis| drifting(&walk, axis)).into(),
            walk,
            slippery: (1000..)
                .zip(profiles())
                .step_by(PROFILE_STEP)
                .map(|(seed, profile)| profile.simulate(SLIPPERY_SECONDS, seed))
                .collect(),
        })
    }

    /// Measures parameters, as a line.
    fn measure(&self, params: &Params) -> String {
        let mut measures = Vec::new();
        for (name, rate) in [
            ("native", SampleRate::Native),
            ("1000", SampleRate::Hz(1000.0)),
        ] {
            let at = at_rate(&self.recordings, rate, params).expect("checked parameters");
            for on in &at.sets {
                let set = on.set.name().replace(' ', "-");
                measures.push(format!("{set}@{name}={:.4}", on.scores.rmse));
            }
            let of = |sets: &[Set]| -> Vec<Scores> {
                sets.iter()
                    .filter_map(|set| at.on_set(*set))
                    .copied()
                    .collect()
            };
            let averaged = Scores::mean(&of(&Set::AVERAGED)).expect("sets");
            let robots = Scores::mean(&of(&Set::ROBOTS)).expect("sets");
            measures.push(format!("mean@{name}={:.4}", averaged.rmse));
            measures.push(format!(
                "auc@{name}={:.4}",
                averaged.roc_auc.unwrap_or(f64::NAN)
            ));
            measures.push(format!(
                "calibration@{name}={:.4}",
                averaged.calibration_error
            ));
            measures.push(format!("robots@{name}={:.4}", robots.rmse));
        }
        let later = self.later.iter().map(|recording| rmse(recording, params));
        let later = later.sum::<f64>() / self.later.len() as f64;
        let standing = self
            .standing
            .iter()
            .map(|[before, after]| (rmse(after, params) - rmse(before, params)).abs());
        let without = found(&self.walk, params);
        let lost = self
            .drifting
            .iter()
            .map(|with| without - found(with, params));
        let mut slips = Score::default();
        for walk in &self.slippery {
            slips.add(walk, params);
        }
        measures.push(format!("later={later:.4}"));
        measures.push(format!("residual={:.4}", rmse(&self.residual, params)));
        measures.push(format!("standing={:.4}", standing.fold(0.0, f64::max)));
        measures.push(format!("drift={:.4}", lost.fold(0.0, f64::max)));
        measures.push(format!("missed={}", slips.missed()));
        measures.push(format!("false={}", slips.false_slips));
        measures.push(format!("never={}", slips.never_stable));
        measures.join(" ")
    }
}

fn starting_later(recording: &Recording, later_s: f64) -> Recording {
    let mut later = recording.clone();
    let start = recording.samples[0].time_s();
    later
        .samples
        .retain(|sample| sample.time_s() >= start + later_s);
    later
}

/// The recording with a bias about `axis` that grows from 5 s on to 2 °/s after a minute.
fn drifting(recording: &Recording, axis: Vec3) -> Recording {
    changed(recording, |sample| {
        let share = ((sample.time_s() as f32 - 5.0) / 60.0).clamp(0.0, 1.0);
        let rate = sample.imu.angular_rate.0;
        sample.imu.angular_rate = AngularRate(rate + axis * (share * 2.0_f32.to_radians()));
    })
}

/// Share of the stable samples of the last half of a recording with P > 0.5.
fn found(recording: &Recording, params: &Params) -> f64 {
    let estimates = replay(recording, params).expect("checked parameters");
    let half = recording.samples.len() / 2;
    let pairs = recording.samples.iter().zip(&estimates).skip(half);
    let stable: Vec<bool> = pairs
        .filter(|(sample, _)| sample.label == Some(Label::Stable))
        .map(|(_, estimate)| estimate.probabilities.stable > 0.5)
        .collect();
    stable.iter().filter(|found| **found).count() as f64 / stable.len() as f64
}

fn main() {
    let Some(material) = Material::load() else {
        return;
    };
    for line in stdin().lock().lines() {
        let line = line.expect("text on standard input");
        match with_constants(&line) {
            Ok(params) => println!("{}", material.measure(&params)),
            Err(error) => println!("error: {error}"),
        }
    }
}
