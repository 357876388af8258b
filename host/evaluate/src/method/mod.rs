//! Methods that are compared, and their runs over all recordings.

use std::collections::BTreeMap;

use estimator_core::{Gravity, Learning, Params, ParamsError, WindowLength};
use recordings::replay::{replay, replay_and_learn};
use serde::Serialize;

use crate::labelled::Labelled;
use crate::peers::{Detector, answers, grf, published, threshold};
use crate::score::Answers;
use crate::teaching::{self, Teachers};
use crate::window::PAPER_WINDOW;
use crate::{authors, fuzzy, left_out};
use scoring::scored::Scored;

/// A method that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ComparedMethod {
    /// This estimator, default preset.
    Default,
    /// This estimator, default preset, with what the foot has learnt in another recording.
    WarmStart,
    /// This estimator, with the constants that were chosen without the recording's family: see
    /// [`left_out`].
    LeftOut,
    /// This estimator, default preset, without any learning.
    Unlearnt,
    /// This estimator, the paper's preset.
    Paper,
    /// The authors' script, which looks ahead.
    Authors,
    /// SHOE with the constants in [`published`].
    PublishedShoe,
    /// ARED with the constants in [`published`].
    PublishedAred,
    /// A detector with a threshold that others' labels teach.
    Tuned {
        /// Which.
        detector: Detector,
        /// Whose labels.
        teachers: Teachers,
    },
    /// A Schmitt trigger on the vertical force.
    ForceTrigger,
    /// See [`fuzzy`].
    FuzzyCMeans,
}

/// Whether a method sees the future.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Causality {
    /// A robot can run it.
    Causal,
    /// It needs samples that have not happened yet.
    LooksAhead,
}

/// Prior knowledge of a method about a recording, for tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Knowledge {
    /// Parameters learnt from other labels or without labels, and from which recordings.
    pub learnt: String,
    /// The names of the recordings whose labels were used.
    pub labels_of: Vec<String>,
}

/// Run of one method on one recording.
#[derive(Clone, Debug)]
pub struct MethodRun {
    /// Answers of the method.
    pub answers: Answers,
    /// Knowledge of the method.
    pub knowledge: Knowledge,
}

impl ComparedMethod {
    /// All methods in display order.
    pub const ALL: [Self; 20] = [
        Self::Default,
        Self::WarmStart,
        Self::LeftOut,
        Self::Unlearnt,
        Self::Paper,
        Self::Authors,
        Self::PublishedShoe,
        Self::PublishedAred,
        Self::tuned(Detector::Shoe, Teachers::OtherFamilies),
        Self::tuned(Detector::Ared, Teachers::OtherFamilies),
        Self::tuned(Detector::Amvd, Teachers::OtherFamilies),
        Self::tuned(Detector::Mbgtd, Teachers::OtherFamilies),
        Self::tuned(Detector::Force, Teachers::OtherFamilies),
        Self::tuned(Detector::Shoe, Teachers::SameFamily),
        Self::tuned(Detector::Ared, Teachers::SameFamily),
        Self::tuned(Detector::Amvd, Teachers::SameFamily),
        Self::tuned(Detector::Mbgtd, Teachers::SameFamily),
        Self::tuned(Detector::Force, Teachers::SameFamily),
        Self::ForceTrigger,
        Self::FuzzyCMeans,
    ];

    /// Detector with a threshold tuned on the labels of `teachers`.
    #[must_use]
    pub const fn tuned(detector: Detector, teachers: Teachers) -> Self {
        Self::Tuned { detector, teachers }
    }

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Default => "footfall, default preset".to_owned(),
            Self::WarmStart => "footfall, warm start".to_owned(),
            Self::LeftOut => "footfall, constants chosen without the family".to_owned(),
            Self::Unlearnt => "footfall, nothing learnt".to_owned(),
            Self::Paper => "footfall, paper preset".to_owned(),
            Self::Authors => "authors' script (looks ahead)".to_owned(),
            Self::PublishedShoe => format!("{}, as published", Detector::Shoe.name()),
            Self::PublishedAred => format!("{}, as published", Detector::Ared.name()),
            Self::Tuned { detector, teachers } => {
                format!("{detector}, tuned {teachers}")
            }
            Self::ForceTrigger => "force Schmitt trigger 10/5 %".to_owned(),
            Self::FuzzyCMeans => "fuzzy c-means, force and IMU".to_owned(),
        }
    }

    /// Returns whether a robot can run the method.
    #[must_use]
    pub const fn causality(self) -> Causality {
        match self {
            Self::Authors => Causality::LooksAhead,
            _ => Causality::Causal,
        }
    }

    /// Runs the method on each recording, in order; `None` if a recording lacks a signal that the method
    /// needs.
    ///
    /// # Errors
    /// The estimator refuses a recording's sample rate.
    pub fn run(self, recordings: &[Labelled]) -> Result<Vec<Option<MethodRun>>, ParamsError> {
        match self {
            Self::Tuned { detector, teachers } => Ok(tuned(recordings, detector, teachers)),
            _ => (0..recordings.len())
                .map(|index| self.run_on(recordings, index))
                .collect(),
        }
    }

    /// Runs the method on the recording at `index`; `None` if it lacks a signal that the method needs, and for
    /// [`Self::Tuned`], which runs on all recordings together.
    fn run_on(
        self,
        recordings: &[Labelled],
        index: usize,
    ) -> Result<Option<MethodRun>, ParamsError> {
        let file = &recordings[index];
        let from = || &recordings[teaching::unlabelled(recordings, index)];
        let mut params = Params::DEFAULT;
        let learnt = match self {
            Self::Default => "preset as it is".to_owned(),
            Self::WarmStart => {
                let from = from();
                params.learnt = Some(replay_and_learn(&from.recording, &params)?.1);
                format!("amplitudes from {}, no labels", from.name())
            }
            Self::LeftOut => {
                params.stillness = left_out::without(file.set.family()).check()?;
                "constants from other families".to_owned()
            }
            Self::Unlearnt => {
                params.learning = Learning::Frozen;
                "preset, frozen".to_owned()
            }
            Self::Paper => {
                params = Params::PAPER;
                params.window = WindowLength::Duration(PAPER_WINDOW);
                "preset as it is".to_owned()
            }
            Self::Authors => return Ok(authors_run(file)),
            Self::PublishedShoe => return Ok(Some(published_run(file, &published::shoe(file)))),
            Self::PublishedAred => return Ok(Some(published_run(file, &published::ared(file)))),
            Self::ForceTrigger => return Ok(force_trigger_run(file)),
            Self::FuzzyCMeans => {
                let from = from();
                let learnt = format!("clusters from {}, no labels", from.name());
                let probabilities = fuzzy::probabilities(from, file);
                return Ok(probabilities.map(|p| MethodRun::of(file.scored(&p), learnt)));
            }
            // Its threshold needs the scores of all recordings.
            Self::Tuned { .. } => return Ok(None),
        };
        let estimates = replay(&file.recording, &params)?;
        let scored = Scored::collect(&file.recording.samples, &estimates);
        Ok(Some(MethodRun::of(scored, learnt)))
    }
}

impl MethodRun {
    /// Run of a method without labels, whose ranking is its probability.
    fn of(scored: Vec<Scored>, learnt: String) -> Self {
        Self {
            answers: Answers::of(scored),
            knowledge: Knowledge {
                learnt,
                labels_of: Vec::new(),
            },
        }
    }

    /// Run of a method that answers "stable" if a score is above a threshold.
    fn thresholded(file: &Labelled, scores: &[f64], threshold: f64, knowledge: Knowledge) -> Self {
        Self {
            answers: Answers {
                scored: file.scored(&answers(scores, threshold)),
                ranking: file.scored(scores),
            },
            knowledge,
        }
    }
}

impl Knowledge {
    /// Merges the knowledge of several runs without duplicates.
    #[must_use]
    pub fn of_all(runs: &[&MethodRun]) -> Self {
        let mut learnt: Vec<&str> = Vec::new();
        let mut labels_of: Vec<String> = Vec::new();
        for MethodRun { knowledge, .. } in runs {
            if !learnt.contains(&knowledge.learnt.as_str()) {
                learnt.push(&knowledge.learnt);
            }
            for name in &knowledge.labels_of {
                if !labels_of.contains(name) {
                    labels_of.push(name.clone());
                }
            }
        }
        Self {
            learnt: learnt.join("; "),
            labels_of,
        }
    }
}

/// Runs the authors' script, which cannot remove gravity.
fn authors_run(file: &Labelled) -> Option<MethodRun> {
    match file.recording.gravity {
        Gravity::Included => None,
        Gravity::Removed => {
            let window = file.samples_in(f64::from(PAPER_WINDOW));
            let probabilities = authors::probabilities(&file.readings, window, &Params::PAPER);
            let learnt = "parameters as published".to_owned();
            Some(MethodRun::of(file.scored(&probabilities), learnt))
        }
    }
}

fn published_run(file: &Labelled, scores: &[f64]) -> MethodRun {
    let knowledge = Knowledge {
        learnt: "constants as published".to_owned(),
        labels_of: Vec::new(),
    };
    MethodRun::thresholded(file, scores, -published::THRESHOLD, knowledge)
}

fn force_trigger_run(file: &Labelled) -> Option<MethodRun> {
    let shares = grf::load_shares(file.ground_reaction.as_ref()?);
    let scored = file.scored(&grf::schmitt_trigger(&shares));
    let learnt = "levels as published, weight from the load".to_owned();
    Some(MethodRun::of(scored, learnt))
}

/// Runs a detector with the threshold that gives the fewest wrong answers on its teachers' recordings, each
/// family with equal weight.
fn tuned(
    recordings: &[Labelled],
    detector: Detector,
    teachers: Teachers,
) -> Vec<Option<MethodRun>> {
    let scores: Vec<_> = recordings
        .iter()
        .map(|file| detector.scores(file))
        .collect();
    // All recordings of a family have the same teachers in other families.
    let mut thresholds: BTreeMap<Vec<usize>, f64> = BTreeMap::new();
    let of_index = |(index, file): (usize, &Labelled)| {
        let scores_here = scores[index].as_ref()?;
        let mut from = teachers.indices(recordings, index);
        from.retain(|index| scores[*index].is_some());
        if from.is_empty() {
            return None;
        }
        let knowledge = Knowledge {
            learnt: format!(
                "threshold from {}",
                teachers_name(recordings, teachers, &from)
            ),
            labels_of: from
                .iter()
                .map(|index| recordings[*index].name().to_owned())
                .collect(),
        };
        let threshold = *thresholds.entry(from).or_insert_with_key(|from| {
            threshold(&by_family(recordings, from, |index| {
                scores[index].as_deref().unwrap_or_default()
            }))
        });
        Some(MethodRun::thresholded(
            file,
            scores_here,
            threshold,
            knowledge,
        ))
    };
    recordings.iter().enumerate().map(of_index).collect()
}

/// Pairs the scores of recordings with their labels, one group per family. The recordings of a family are
/// adjacent.
fn by_family<'a>(
    recordings: &[Labelled],
    indices: &[usize],
    scores: impl Fn(usize) -> &'a [f64],
) -> Vec<Vec<Scored>> {
    let family = |index: &usize| recordings[*index].set.family();
    let families = indices.chunk_by(|a, b| family(a) == family(b));
    families
        .map(|indices| {
            let scored = |index: &usize| recordings[*index].scored(scores(*index));
            indices.iter().flat_map(scored).collect()
        })
        .collect()
}

fn teachers_name(recordings: &[Labelled], teachers: Teachers, indices: &[usize]) -> String {
    let mut names: Vec<&str> = indices
        .iter()
        .map(|index| match teachers {
            Teachers::OtherFamilies => recordings[*index].set.family().name(),
            Teachers::SameFamily => recordings[*index].name(),
        })
        .collect();
    names.dedup();
    names.join(", ")
}

#[cfg(test)]
mod tests;
