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
//! | `mean@RATE`, `auc@RATE`, `calibration@RATE` | means over the seven sets of the mean: RMSE, ROC-AUC, calibration error |
//! | `robots@RATE`, `atlas@RATE` | RMSE, mean over the robots and pooled over ATLAS |
//! | `later` | mean RMSE of the ATLAS sets that start 2, 3 or 6 s later, in the middle of a step |
//! | `residual` | RMSE on ground with a residual of gravity of 0.1 m/s² on each axis |
//! | `standing` | largest change of an ATLAS set's RMSE by a minute of standing in front of it |
//! | `drift` | largest share of the stances of a simulated walk that a drift of the gyroscope of 2 °/s in a minute costs |
//! | `missed`, `false`, `never` | slips not found, false slips and stances not found, of a sample of the grid of slips |

#[path = "../tests/labelled/mod.rs"]
mod labelled;

use std::io::{self, BufRead};
use std::process::ExitCode;

use estimator_core::{Params, Vec3};
use evaluate::labelled::Labelled;
use evaluate::rates::{BOARD_RATE, SampleRate, at_rate};
use evaluate::sets::{Pool, Set};
use gait::{GaitName, Ground, Plan, SensorParams, Simulation, record};
use host_tests::changed::{starting_later, stood, with_force_bias, with_rate_drifts};
use host_tests::constants::with_constants;
use host_tests::slips::{self, Score};
use labelled::{of_sets, rmse, stances_found};
use samples::recording::Recording;

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
    drifting: [Recording; 3],
    slippery: Vec<Simulation>,
}

impl Material {
    /// Reads and simulates everything; `None` without the recordings.
    fn load() -> Option<Self> {
        let sets = [&Set::AVERAGED[..], &Set::ROBOTS, &[Set::Atlas500]];
        let recordings = of_sets(&sets.concat())?;
        let on = |set: Set| recordings.iter().filter(move |file| file.set == set);
        let atlas = Pool::Atlas.sets().iter().flat_map(|set| on(*set));
        let atlas: Vec<Recording> = atlas.map(|file| file.recording.clone()).collect();
        let ground = &on(Set::Ground).next()?.recording;
        let plan = Plan::steady(GaitName::Walk, Ground::Hard, 65.0, 11);
        let walk = record(&plan, &SensorParams::LSM6DSOX, 11);
        Some(Self {
            later: (atlas.iter())
                .flat_map(|recording| LATER_S.map(|later_s| starting_later(recording, later_s)))
                .collect(),
            residual: with_force_bias(ground, Vec3::new(0.1, 0.1, 0.1)),
            standing: (atlas.iter())
                .map(|recording| [recording.clone(), stood(recording, 60.0, 1)])
                .collect(),
            drifting: with_rate_drifts(&walk),
            walk,
            slippery: slips::sample(),
            recordings,
        })
    }

    /// Measures parameters, as a line.
    fn measure(&self, params: &Params) -> String {
        let mut measures = Vec::new();
        for (name, rate) in [("native", SampleRate::Native), ("1000", BOARD_RATE)] {
            let at = at_rate(&self.recordings, rate, params).expect("checked parameters");
            for on in &at.sets {
                let set = on.set.name().replace(' ', "-");
                measures.push(format!("{set}@{name}={:.4}", on.scores.rmse));
            }
            let [averaged, robots, atlas] =
                [at.mean, at.robots, at.atlas_pooled].map(|scores| scores.expect("every set"));
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
            measures.push(format!("atlas@{name}={:.4}", atlas.rmse));
        }
        let later = self.later.iter().map(|recording| rmse(recording, params));
        let later = later.sum::<f64>() / self.later.len() as f64;
        let standing = self
            .standing
            .iter()
            .map(|[before, after]| (rmse(after, params) - rmse(before, params)).abs());
        let without = stances_found(&self.walk, params);
        let lost = self
            .drifting
            .iter()
            .map(|with| without - stances_found(with, params));
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

fn main() -> io::Result<ExitCode> {
    let Some(material) = Material::load() else {
        return Ok(ExitCode::FAILURE);
    };
    for line in io::stdin().lock().lines() {
        match with_constants(&line?) {
            Ok(params) => println!("{}", material.measure(&params)),
            Err(error) => println!("error: {error}"),
        }
    }
    Ok(ExitCode::SUCCESS)
}
