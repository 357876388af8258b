//! Sets of recordings with labels, and their families.
//!
//! A set is scored as a whole. Sets of a family share robots, sensors or the definition of their label, so the
//! result of a constant tuned on one of them says little about others: constants are tuned on other families
//! ([`teaching`](crate::teaching)).

use serde::Serialize;

use gait::plan::DEMO_SEED;
use gait::slips;
use gait::{GaitName, Ground, Plan, SensorParams};
use recordings::input::published::simulated::LabelScheme;

/// Duration of each simulated walk, trot and run, s.
const STEADY_SECONDS: f64 = 30.0;

/// Seed of each simulated walk, trot and run.
const STEADY_SEED: u64 = 1;

/// Duration of each walk with slips, s.
const SLIPS_SECONDS: f64 = 14.0;

/// Step through the profiles of the grid of slips. It is coprime to each side of the grid, so speeds,
/// floors, headings and vibrations all vary.
const SLIPS_STEP: usize = 31;

/// Seed of the first walk with slips, incremented for each further one.
const SLIPS_SEED: u64 = 3000;

samples::named! {
    /// Sets that share their robots, sensors or labels.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Family {
        /// The simulated robot of the method's authors; labels come from the friction cone.
        Atlas = "ATLAS",
        /// Two other simulated robots; labels are contact classes.
        Lcd = "LCD",
        /// A person's shoe; labels come from the shoe's measured speed.
        Shoe = "shoe",
        /// The simulated foot of [`gait`]; labels come from its true motion.
        Simulated = "simulated",
        /// Real robots; labels say that the foot is loaded, which is not quite stable.
        Robots = "robots",
    }
}

samples::named! {
    /// Recordings that are scored as one.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Set {
        /// ATLAS on a floor with grip.
        Ground = "ground",
        /// ATLAS, three steps.
        ThreeSteps = "3 steps",
        /// ATLAS on a slippery floor, on which the paper compares.
        Slip = "slip",
        /// LCD's ATLAS.
        Atlas7k = "ATLAS 7k",
        /// LCD's NAO.
        Nao = "NAO",
        /// Twelve walks in a shoe.
        Shoe = "shoe",
        /// The walk of `footfall demo`: firm, greased and soft ground.
        Demo = "demo",
        /// A simulated walk on firm ground.
        Walk = "walk",
        /// A simulated trot on firm ground.
        Trot = "trot",
        /// A simulated run on firm ground.
        Run = "run",
        /// Simulated walks in which every other stance slips: a sample of [`slips::profiles`].
        Slips = "slips",
        /// ATLAS at 500 Hz, other runs than the sets at 1 kHz.
        Atlas500 = "ATLAS 500 Hz",
        /// A real TALOS.
        Talos = "TALOS",
        /// A real NAO.
        RealNao = "real NAO",
        /// A real GO1.
        Go1 = "GO1",
        /// A real NAO that is pushed, by the IMU of a leg.
        PushedNao = "pushed NAO",
    }
}

impl Set {
    /// Sets included in the mean. The others cover the gaits of the simulated foot, which would outweigh all
    /// other recordings in the mean.
    pub const AVERAGED: [Self; 7] = [
        Self::Ground,
        Self::ThreeSteps,
        Self::Slip,
        Self::Atlas7k,
        Self::Nao,
        Self::Shoe,
        Self::Demo,
    ];

    /// Sets of real robots, which have a separate mean.
    pub const ROBOTS: [Self; 4] = [Self::Talos, Self::RealNao, Self::Go1, Self::PushedNao];

    /// Family of the set.
    #[must_use]
    pub const fn family(self) -> Family {
        match self {
            Self::Ground | Self::ThreeSteps | Self::Slip | Self::Atlas500 => Family::Atlas,
            Self::Atlas7k | Self::Nao => Family::Lcd,
            Self::Shoe => Family::Shoe,
            Self::Demo | Self::Walk | Self::Trot | Self::Run | Self::Slips => Family::Simulated,
            Self::Talos | Self::RealNao | Self::Go1 | Self::PushedNao => Family::Robots,
        }
    }

    /// Returns whether its labels may tune a method for other families. The labels of the real robots mean
    /// "loaded", and the runs at 500 Hz have spikes in their stances.
    #[must_use]
    pub const fn teaches_other_families(self) -> bool {
        !matches!(self, Self::Atlas500) && !matches!(self.family(), Family::Robots)
    }

    /// Sources of its recordings, in the order of scoring.
    #[must_use]
    pub fn sources(self) -> Vec<RecordingSource> {
        match self {
            Self::Ground => vec![file(ATLAS, "pce/ATLAS_01ground.csv")],
            Self::ThreeSteps => vec![file(ATLAS, "pce/ATLAS_01ground_3steps.csv")],
            Self::Slip => vec![file(ATLAS, "pce/ATLAS_01ground_003slip.csv")],
            Self::Atlas7k => vec![file(LCD, "lcd/ATLAS_7k_04ground.csv")],
            Self::Nao => vec![file(LCD, "lcd/NAO_05ground.csv")],
            Self::Shoe => SHOE_WALKS.map(|path| file(FileLayout::Walk, path)).into(),
            Self::Demo => vec![RecordingSource::Simulated {
                plan: Plan::demo(DEMO_SEED),
                sensor: SensorParams::LSM6DSOX,
                seed: DEMO_SEED,
            }],
            Self::Walk => vec![steady(GaitName::Walk)],
            Self::Trot => vec![steady(GaitName::Trot)],
            Self::Run => vec![steady(GaitName::Run)],
            Self::Slips => (SLIPS_SEED..)
                .zip(slips::profiles().step_by(SLIPS_STEP))
                .map(|(seed, profile)| RecordingSource::Simulated {
                    plan: profile.plan(SLIPS_SECONDS, seed),
                    sensor: slips::SENSOR,
                    seed,
                })
                .collect(),
            Self::Atlas500 => vec![
                file(AUTHORS_HISTORY, "robots/atlas500/atlas_500hz_01ground.csv"),
                file(AUTHORS_HISTORY, "robots/atlas500/atlas_500hz_03ground.csv"),
            ],
            Self::Talos => vec![file(AUTHORS_HISTORY, "robots/talos/talos1.csv")],
            Self::RealNao => vec![file(AUTHORS_HISTORY, "robots/nao/nao_L.csv")],
            Self::Go1 => vec![
                file(AUTHORS_HISTORY, "robots/go1/REALgo1.csv"),
                file(AUTHORS_HISTORY, "robots/go1/normal_surface.csv"),
            ],
            // The force of the left leg is doubtful.
            Self::PushedNao => vec![
                file(GEM_HISTORY, "robots/nao_gem/1_r.csv"),
                file(GEM_HISTORY, "robots/nao_gem/2_r.csv"),
            ],
        }
    }
}

samples::named! {
    /// Sets whose samples are also scored together.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Pool {
        /// The three sets of ATLAS at 1 kHz, on which the paper reports.
        Atlas = "ATLAS pooled",
        /// The two sets of LCD.
        Lcd = "LCD pooled",
    }
}

impl Pool {
    /// Sets in the pool.
    #[must_use]
    pub const fn sets(self) -> &'static [Set] {
        match self {
            Self::Atlas => &[Set::Ground, Set::ThreeSteps, Set::Slip],
            Self::Lcd => &[Set::Atlas7k, Set::Nao],
        }
    }
}

/// Source of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingSource {
    /// A file in the folder of datasets.
    File(File),
    /// A foot simulated by [`gait::simulate`].
    Simulated {
        /// Motion of the foot.
        plan: Plan,
        /// Model of the sensor.
        sensor: SensorParams,
        /// Seed of the sensor's specimen.
        seed: u64,
    },
}

/// A file in the folder of datasets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct File {
    /// Its path in that folder.
    pub path: &'static str,
    /// Layout of the file.
    pub layout: FileLayout,
}

/// Layout of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileLayout {
    /// Force, torque and motion without gravity, of a simulated robot.
    Robot(LabelScheme),
    /// A header and motion with gravity.
    Walk,
    /// A header, motion and force; gravity is removed if the folder has a file
    /// [`GRAVITY_REMOVED`](crate::labelled::GRAVITY_REMOVED).
    Foot {
        /// Origin of the file.
        origin: &'static str,
    },
}

impl FileLayout {
    /// Origin of files with this layout.
    #[must_use]
    pub const fn origin(self) -> &'static str {
        match self {
            Self::Robot(LabelScheme::StableOrNot) => {
                "github.com/MichaelMarav/ProbabilisticContactEstimation, offline/data"
            }
            Self::Robot(LabelScheme::ContactClass) => "github.com/mrsp/lcd",
            Self::Walk => "github.com/mtahakoroglu/OpenShoe-PyShoe-DeepShoe-FuseShoe",
            Self::Foot { origin } => origin,
        }
    }
}

/// All files that are read, in the order of the sets.
#[must_use]
pub fn files() -> Vec<File> {
    let sources = Set::ALL.into_iter().flat_map(Set::sources);
    let file = |source| match source {
        RecordingSource::File(file) => Some(file),
        RecordingSource::Simulated { .. } => None,
    };
    sources.filter_map(file).collect()
}

/// Lists the files needed in the folder of datasets, by origin.
#[must_use]
pub fn needed() -> String {
    let mut text = "All of these are needed:".to_owned();
    for of_one_origin in files().chunk_by(|one, next| one.layout.origin() == next.layout.origin()) {
        let origin = of_one_origin
            .first()
            .map_or("", |file| file.layout.origin());
        text = text + "\n  from " + origin;
        for file in of_one_origin {
            text = text + "\n    " + file.path;
        }
    }
    text
}

/// Walks whose labels come from an optical reference, named by their time of recording.
pub(crate) const SHOE_WALKS: [&str; 12] = [
    "pyshoe/2017-11-22-11-22-03.csv",
    "pyshoe/2017-11-22-11-22-46.csv",
    "pyshoe/2017-11-22-11-23-25.csv",
    "pyshoe/2017-11-22-11-25-20.csv",
    "pyshoe/2017-11-22-11-26-05.csv",
    "pyshoe/2017-11-22-11-26-46.csv",
    "pyshoe/2017-11-22-11-27-30.csv",
    "pyshoe/2017-11-22-11-28-03.csv",
    "pyshoe/2017-11-22-11-28-39.csv",
    "pyshoe/2017-11-22-11-30-14.csv",
    "pyshoe/2017-11-22-11-35-59.csv",
    "pyshoe/2017-11-22-11-36-45.csv",
];

const ATLAS: FileLayout = FileLayout::Robot(LabelScheme::StableOrNot);

const LCD: FileLayout = FileLayout::Robot(LabelScheme::ContactClass);

const AUTHORS_HISTORY: FileLayout = FileLayout::Foot {
    origin: "the history of github.com/MichaelMarav/ProbabilisticContactEstimation, converted to CSV",
};

const GEM_HISTORY: FileLayout = FileLayout::Foot {
    origin: "the history of github.com/mrsp/gem, converted to CSV",
};

const fn file(layout: FileLayout, path: &'static str) -> RecordingSource {
    RecordingSource::File(File { path, layout })
}

fn steady(gait: GaitName) -> RecordingSource {
    RecordingSource::Simulated {
        plan: Plan::steady(gait, Ground::Hard, STEADY_SECONDS, STEADY_SEED),
        sensor: SensorParams::LSM6DSOX,
        seed: STEADY_SEED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_has_a_recording_and_its_family_a_mean() {
        for set in Set::ALL {
            assert!(!set.sources().is_empty(), "{set:?}");
            let counted = Set::AVERAGED.into_iter().chain(Set::ROBOTS);
            assert!(
                counted
                    .map(Set::family)
                    .any(|family| family == set.family())
            );
        }
        assert_eq!(Set::Shoe.sources().len(), 12);
    }

    #[test]
    fn sample_of_slips_covers_all_speeds_and_both_gaits() {
        let sample: Vec<_> = slips::profiles().step_by(SLIPS_STEP).collect();
        for speed in slips::SPEEDS {
            assert!(
                sample.iter().any(|profile| profile.speed == speed),
                "{speed}"
            );
        }
        for gait in [GaitName::Walk, GaitName::Trot] {
            assert!(sample.iter().any(|profile| profile.gait == gait), "{gait}");
        }
    }
}
