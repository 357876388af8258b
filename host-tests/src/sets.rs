//! Sets of recordings with labels. The recordings of a set are scored as one.

use std::path::Path;

use estimator_core::Gravity;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams};
use options::{Format, InputOptions, TableOptions, Times};
use samples::Recording;

use crate::datasets::{missing, recorded};

/// Name of the file that marks the recordings in its folder as free of gravity.
const GRAVITY_REMOVED: &str = "gravity_removed";

samples::named! {
    /// Recordings that are scored as one.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Set {
        /// ATLAS on a floor with grip, 1 kHz.
        Ground = "ground",
        /// ATLAS, three steps, 1 kHz.
        ThreeSteps = "3 steps",
        /// ATLAS on a slippery floor, on which the paper compares methods, 1 kHz.
        Slip = "slip",
        /// LCD's ATLAS.
        Atlas7k = "ATLAS 7k",
        /// LCD's NAO.
        Nao = "NAO",
        /// Twelve walks in a shoe.
        Shoe = "shoe",
        /// The walk of `footfall demo`: firm, greased and soft ground.
        Demo = "demo",
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

/// Recording of a set.
#[derive(Clone, Debug)]
pub struct Labelled {
    /// The set.
    pub set: Set,
    /// Samples; the ones without a label are not scored.
    pub recording: Recording,
}

impl Set {
    /// Sets in the mean of the README.
    pub const AVERAGED: [Self; 7] = [
        Self::Ground,
        Self::ThreeSteps,
        Self::Slip,
        Self::Atlas7k,
        Self::Nao,
        Self::Shoe,
        Self::Demo,
    ];

    /// Sets of real robots, whose labels mean "loaded".
    pub const ROBOTS: [Self; 4] = [Self::Talos, Self::RealNao, Self::Go1, Self::PushedNao];

    /// The sets of ATLAS at 1 kHz, on which the paper reports.
    pub const ATLAS: [Self; 3] = [Self::Ground, Self::ThreeSteps, Self::Slip];

    /// Files of the set, in the folder of datasets; empty for the demo.
    const fn files(self) -> &'static [&'static str] {
        match self {
            Self::Ground => &["pce/ATLAS_01ground.csv"],
            Self::ThreeSteps => &["pce/ATLAS_01ground_3steps.csv"],
            Self::Slip => &["pce/ATLAS_01ground_003slip.csv"],
            Self::Atlas7k => &["lcd/ATLAS_7k_04ground.csv"],
            Self::Nao => &["lcd/NAO_05ground.csv"],
            Self::Shoe => &SHOE_WALKS,
            Self::Demo => &[],
            Self::Atlas500 => &[
                "robots/atlas500/atlas_500hz_01ground.csv",
                "robots/atlas500/atlas_500hz_03ground.csv",
            ],
            Self::Talos => &["robots/talos/talos1.csv"],
            Self::RealNao => &["robots/nao/nao_L.csv"],
            Self::Go1 => &["robots/go1/REALgo1.csv", "robots/go1/normal_surface.csv"],
            // The force of the left leg is doubtful.
            Self::PushedNao => &["robots/nao_gem/1_r.csv", "robots/nao_gem/2_r.csv"],
        }
    }

    /// RMSE of the default preset on the set, as `docs/reference/evaluation.md` shows it.
    #[must_use]
    pub const fn rmse(self) -> f64 {
        match self {
            Self::Ground => 0.2681,
            Self::ThreeSteps => 0.2875,
            Self::Slip => 0.447,
            Self::Atlas7k => 0.2567,
            Self::Nao => 0.2496,
            Self::Shoe => 0.2705,
            Self::Demo => 0.239,
            Self::Atlas500 => 0.3563,
            Self::Talos => 0.1818,
            Self::RealNao => 0.2378,
            Self::Go1 => 0.2063,
            Self::PushedNao => 0.2649,
        }
    }

    /// Files of the set that are absent, by their paths in the folder of datasets.
    #[must_use]
    pub fn missing_files(self) -> Vec<&'static str> {
        self.files().iter().copied().filter(|file| missing(file)).collect()
    }

    /// Reads its recordings; `None` if one is absent.
    ///
    /// # Panics
    /// If a recording cannot be read, or is absent where every check is required.
    #[must_use]
    pub fn read(self) -> Option<Vec<Labelled>> {
        let labelled = |recording| Labelled { set: self, recording };
        if self == Self::Demo {
            let walk = gait::record(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
            return Some(vec![labelled(walk)]);
        }
        let files = self.files().iter();
        files.map(|file| Some(labelled(read(file, &recorded(file)?)))).collect()
    }
}

fn read(file: &str, path: &Path) -> Recording {
    let format = match file.split('/').next() {
        Some("pce") => Format::PceAtlas,
        Some("lcd") => Format::Lcd,
        _ => Format::Csv,
    };
    let gravity = (format == Format::Csv).then(|| {
        if path.with_file_name(GRAVITY_REMOVED).exists() {
            Gravity::Removed
        } else {
            Gravity::Included
        }
    });
    // Figures compare estimates and not clocks, so no time is smoothed.
    let times = if format == Format::Csv { Times::Keep } else { Times::default() };
    let table = TableOptions { times, ..TableOptions::default() };
    let input_options = InputOptions { gravity, table, ..InputOptions::default() };
    let loaded = recordings::read(path, format, &input_options).expect("a readable file");
    loaded.recording
}

/// Walks whose labels come from an optical reference, named by their time of recording.
const SHOE_WALKS: [&str; 12] = [
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
