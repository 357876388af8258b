//! `footfall evaluate`: every method on every recording with labels.
//!
//! | step | module |
//! |---|---|
//! | the recordings, and who may learn from which | [`labelled`] |
//! | the methods | [`method`] |
//! | trailing windows, for detectors | [`window`] |
//! | detectors that others published | [`peers`] |
//! | fuzzy c-means | [`fuzzy`] |
//! | the authors' own script | [`authors`] |
//! | figures of merit | [`score`] |
//! | tables for people | [`table`] |
//! | histogram of errors, reliability diagram | [`pictures`] |
//!
//! All figures are of whole recordings, by sample; those of several recordings are of all their
//! samples together.

pub mod authors;
pub mod fuzzy;
pub mod labelled;
pub mod method;
pub mod peers;
pub mod pictures;
pub mod score;
pub mod table;
#[cfg(test)]
mod testing;
pub mod window;

use std::ops::Range;
use std::path::Path;

use serde::Serialize;

use crate::error::Error;
use labelled::{Labelled, SOURCES};
use method::{Causality, Knowledge, Method, Run};
use score::{Figures, Outcome};

/// The folder of datasets where nothing else is said.
pub const DATASETS: &str = "../shared/datasets";

/// Recordings that are scored together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// The three of the method's authors.
    Atlas,
    /// The one among them with a slippery floor, on which the paper compares.
    Slip,
    /// The two robots with contact classes.
    Lcd,
}

impl Group {
    /// All groups in the order in which they are shown.
    pub const ALL: [Self; 3] = [Self::Atlas, Self::Slip, Self::Lcd];

    /// Which of [`SOURCES`] it holds.
    const fn places(self) -> Range<usize> {
        match self {
            Self::Atlas => 0..3,
            Self::Slip => 2..3,
            Self::Lcd => 3..5,
        }
    }

    /// How it is called in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Atlas => "ATLAS",
            Self::Slip => "slip",
            Self::Lcd => "LCD",
        }
    }
}

/// What was recorded.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct About {
    /// The recording's name.
    pub recording: String,
    /// Number of samples.
    pub samples: usize,
    /// Sample rate, Hz.
    pub sample_rate_hz: f32,
    /// Share of the samples with the label "stable", in [0, 1].
    pub stable_share: f64,
}

/// A method's figures on one recording.
#[derive(Clone, Debug, Serialize)]
pub struct OnRecording {
    /// The recording's name.
    pub recording: String,
    /// What the method knew before.
    #[serde(flatten)]
    pub knowledge: Knowledge,
    /// How it did.
    pub figures: Figures,
    /// What it answered.
    #[serde(skip)]
    pub outcome: Outcome,
}

/// A method's figures on several recordings together.
#[derive(Clone, Debug, Serialize)]
pub struct OnGroup {
    /// Which.
    pub group: Group,
    /// How it did.
    pub figures: Figures,
}

/// A method with all of its figures.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluated {
    /// The method.
    pub method: Method,
    /// How it is called in tables.
    pub name: &'static str,
    /// Whether a robot can run it.
    pub causality: Causality,
    /// Recording by recording, in the order of [`SOURCES`].
    pub recordings: Vec<OnRecording>,
    /// Group by group, in the order of [`Group::ALL`].
    pub groups: Vec<OnGroup>,
}

/// Every method on every recording.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// The recordings, in the order of [`SOURCES`].
    pub recordings: Vec<About>,
    /// The methods, in the order of [`Method::ALL`].
    pub methods: Vec<Evaluated>,
}

impl Evaluation {
    /// Runs every method on every recording in the folder of datasets.
    ///
    /// # Errors
    /// A recording is absent or damaged, or the estimator refuses its sample rate.
    pub fn run(datasets: &Path) -> Result<Self, Error> {
        let files = SOURCES
            .iter()
            .map(|source| Labelled::read(datasets, source))
            .collect::<Result<Vec<_>, _>>()?;
        let methods = Method::ALL
            .into_iter()
            .map(|method| Ok(Evaluated::of(method, &files, method.run(&files)?)))
            .collect::<Result<_, Error>>()?;
        Ok(Self {
            recordings: files.iter().map(About::of).collect(),
            methods,
        })
    }

    /// What a method answered on the recordings of a group.
    fn outcomes(&self, method: Method, group: Group) -> Vec<&Outcome> {
        let of_method = self.methods.iter().filter(|e| e.method == method);
        let of_group = of_method.flat_map(|e| e.recordings.get(group.places()));
        of_group.flatten().map(|on| &on.outcome).collect()
    }
}

impl About {
    fn of(file: &Labelled) -> Self {
        let stable = file
            .labels()
            .filter(|l| *l == crate::recording::Label::Stable);
        let samples = file.recording.samples.len();
        Self {
            recording: file.name().to_owned(),
            samples,
            sample_rate_hz: file.recording.sample_rate,
            stable_share: stable.count() as f64 / samples.max(1) as f64,
        }
    }
}

impl Evaluated {
    fn of(method: Method, files: &[Labelled], runs: Vec<Run>) -> Self {
        let groups = Group::ALL
            .into_iter()
            .filter_map(|group| {
                let outcomes: Vec<_> = runs
                    .get(group.places())?
                    .iter()
                    .map(|r| &r.outcome)
                    .collect();
                Some(OnGroup {
                    group,
                    figures: Figures::of(&outcomes)?,
                })
            })
            .collect();
        let recordings = files
            .iter()
            .zip(runs)
            .filter_map(|(file, run)| {
                Some(OnRecording {
                    recording: file.name().to_owned(),
                    figures: Figures::of(&[&run.outcome])?,
                    knowledge: run.knowledge,
                    outcome: run.outcome,
                })
            })
            .collect();
        Self {
            method,
            name: method.name(),
            causality: method.causality(),
            recordings,
            groups,
        }
    }
}
