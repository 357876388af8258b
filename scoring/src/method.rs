//! Every method that is compared, and how each is run over all recordings.

use std::collections::BTreeMap;

use estimator_core::{ContactEstimate, Gravity, Learning, Params, ParamsError, WindowLength};
use serde::Serialize;

use crate::labelled::Labelled;
use crate::peers::{Detector, answers, grf, published, threshold};
use crate::score::Answers;
use crate::scored::Scored;
use crate::teaching::{self, Teachers};
use crate::window::PAPER_WINDOW;
use crate::{authors, fuzzy, left_out};
use recordings::replay::{replay, replay_and_learn};

/// A method that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
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

/// What a method knew of a recording before it was scored on it, for tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Knowledge {
    /// What was learnt from other labels or without any, and from which recordings.
    pub learnt: String,
    /// The names of the recordings whose labels were used.
    pub labels_of: Vec<String>,
}

/// One method on one recording.
#[derive(Clone, Debug)]
pub struct Run {
    /// What it answered.
    pub answers: Answers,
    /// What it knew.
    pub knowledge: Knowledge,
}

impl Method {
    /// All methods in the order in which they are shown.
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

    /// A detector with a threshold that the labels of `teachers` teach.
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
                let on = match teachers {
                    Teachers::OtherFamilies => "on other families",
                    Teachers::SameFamily => "on its family",
                };
                format!("{}, tuned {on}", detector.name())
            }
            Self::ForceTrigger => "force Schmitt trigger 10/5 %".to_owned(),
            Self::FuzzyCMeans => "fuzzy c-means, force and IMU".to_owned(),
        }
    }

    /// Whether a robot can run it.
    #[must_use]
    pub const fn causality(self) -> Causality {
        match self {
            Self::Authors => Causality::LooksAhead,
            _ => Causality::Causal,
        }
    }

    /// Runs it over all recordings: one run each, in their order; `None` where the recording lacks
    /// what the method needs.
    ///
    /// # Errors
    /// The estimator refuses a recording's sample rate.
    pub fn run(self, recordings: &[Labelled]) -> Result<Vec<Option<Run>>, ParamsError> {
        match self {
            Self::Default => each(recordings, |_, file| {
                estimated(file, &Params::DEFAULT, "preset as it is").map(Some)
            }),
            Self::WarmStart => each(recordings, |index, file| {
                let from = &recordings[teaching::unlabelled(recordings, index)];
                let (_, learnt) = replay_and_learn(&from.recording, &Params::DEFAULT)?;
                let params = Params {
                    learnt: Some(learnt),
                    ..Params::DEFAULT
                };
                let learnt = format!("amplitudes from {}, no labels", from.name());
                estimated(file, &params, &learnt).map(Some)
            }),
            Self::LeftOut => each(recordings, |_, file| {
                let constants = left_out::without(file.set.family());
                let params = Params {
                    stillness: constants.check()?,
                    ..Params::DEFAULT
                };
                estimated(file, &params, "constants from other families").map(Some)
            }),
            Self::Unlearnt => each(recordings, |_, file| {
                let params = Params {
                    learning: Learning::Frozen,
                    ..Params::DEFAULT
                };
                estimated(file, &params, "preset, frozen").map(Some)
            }),
            Self::Paper => each(recordings, |_, file| {
                estimated(file, &paper_params(), "preset as it is").map(Some)
            }),
            Self::Authors => each(recordings, |_, file| Ok(authors_run(file))),
            Self::PublishedShoe => each(recordings, |_, file| {
                Ok(Some(published_run(file, &published::shoe(file))))
            }),
            Self::PublishedAred => each(recordings, |_, file| {
                Ok(Some(published_run(file, &published::ared(file))))
            }),
            Self::Tuned { detector, teachers } => Ok(tuned(recordings, detector, teachers)),
            Self::ForceTrigger => each(recordings, |_, file| Ok(force_trigger_run(file))),
            Self::FuzzyCMeans => each(recordings, |index, file| {
                let from = &recordings[teaching::unlabelled(recordings, index)];
                let learnt = format!("clusters from {}, no labels", from.name());
                let probabilities = fuzzy::probabilities(from, file);
                Ok(probabilities.map(|p| Run::of(file, &p, &learnt)))
            }),
        }
    }
}

impl Run {
    /// Of a method whose probability is its ranking, and which used no labels.
    fn of(file: &Labelled, probabilities: &[f64], learnt: &str) -> Self {
        let scored = file.scored(probabilities);
        Self {
            answers: Answers {
                ranking: scored.clone(),
                scored,
            },
            knowledge: Knowledge {
                learnt: learnt.to_owned(),
                labels_of: Vec::new(),
            },
        }
    }

    /// Of a method that answers "stable" where a score is above a threshold.
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
    /// What a method knew of several recordings: each thing once.
    #[must_use]
    pub fn of_all(runs: &[&Run]) -> Self {
        let mut learnt: Vec<&str> = Vec::new();
        let mut labels_of: Vec<String> = Vec::new();
        for Run { knowledge, .. } in runs {
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

fn each(
    recordings: &[Labelled],
    run: impl Fn(usize, &Labelled) -> Result<Option<Run>, ParamsError>,
) -> Result<Vec<Option<Run>>, ParamsError> {
    let runs = recordings.iter().enumerate();
    runs.map(|(index, file)| run(index, file)).collect()
}

/// The paper's preset with its window as a duration.
fn paper_params() -> Params {
    Params {
        window: WindowLength::Duration(PAPER_WINDOW),
        ..Params::PAPER
    }
}

fn estimated(file: &Labelled, params: &Params, learnt: &str) -> Result<Run, ParamsError> {
    let estimates = replay(&file.recording, params)?;
    let stable = |estimate: &ContactEstimate| f64::from(estimate.probabilities.stable);
    let probabilities: Vec<f64> = estimates.iter().map(stable).collect();
    Ok(Run::of(file, &probabilities, learnt))
}

/// The script has no means to take out gravity.
fn authors_run(file: &Labelled) -> Option<Run> {
    match file.recording.gravity {
        Gravity::Included => None,
        Gravity::Removed => {
            let window = file.samples_in(f64::from(PAPER_WINDOW));
            let probabilities = authors::probabilities(&file.readings, window, &Params::PAPER);
            Some(Run::of(file, &probabilities, "parameters as published"))
        }
    }
}

fn published_run(file: &Labelled, scores: &[f64]) -> Run {
    let knowledge = Knowledge {
        learnt: "constants as published".to_owned(),
        labels_of: Vec::new(),
    };
    Run::thresholded(file, scores, -published::THRESHOLD, knowledge)
}

fn force_trigger_run(file: &Labelled) -> Option<Run> {
    let shares = grf::load_shares(file.ground_reaction.as_ref()?);
    Some(Run::of(
        file,
        &grf::schmitt_trigger(&shares),
        "levels as published, weight from the load",
    ))
}

/// A detector with the threshold that gives the fewest wrong answers on its teachers' recordings, in
/// which each family counts alike.
fn tuned(recordings: &[Labelled], detector: Detector, teachers: Teachers) -> Vec<Option<Run>> {
    let scores: Vec<_> = recordings
        .iter()
        .map(|file| detector.scores(file))
        .collect();
    // The recordings of a family have the same teachers in the other families.
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
        Some(Run::thresholded(file, scores_here, threshold, knowledge))
    };
    recordings.iter().enumerate().map(of_index).collect()
}

/// The scores of recordings beside their labels, one group a family. The recordings of a family are
/// next to each other.
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
mod tests {
    use super::*;
    use crate::sets::{Family, Set};
    use crate::testing::labelled;
    use recordings::recording::Label;

    /// Every kind of set, each with more than one recording.
    const SETS: [Set; 9] = [
        Set::Ground,
        Set::ThreeSteps,
        Set::Slip,
        Set::Atlas7k,
        Set::Nao,
        Set::Shoe,
        Set::Shoe,
        Set::Demo,
        Set::Walk,
    ];

    /// The index of a recording that teaches no other one of its family.
    const SLIP: usize = 2;

    type Row = (recordings::input::pce::Wrench, [f64; 6], Label);

    /// A walk of a foot that turns `slowness` times slower in its swing than in the first.
    fn rows(slowness: f64) -> impl Iterator<Item = Row> {
        (0..2000_u32).map(move |k| {
            let noise = 0.01 * (f64::from(k * 7919 % 1000) / 1000.0 - 0.5);
            let tremble = [10.0 * noise, noise, noise, noise, noise, noise];
            if k / 125 % 2 == 0 {
                ([0.0, 0.0, 800.0, 0.0, 0.0, 0.0], tremble, Label::Stable)
            } else {
                let swing = tremble.map(|m| 8.0 / slowness + m);
                ([0.0; 6], swing, Label::NotStable)
            }
        })
    }

    fn walks() -> Vec<Labelled> {
        let slowness = (0..).map(|index| 1.0 + 0.1 * f64::from(index % 4));
        let sets = SETS.into_iter().zip(slowness);
        sets.map(|(set, slowness)| labelled(set, rows(slowness)))
            .collect()
    }

    fn with_labels_turned(walks: &[Labelled], turns: impl Fn(usize) -> bool) -> Vec<Labelled> {
        let mut turned = walks.to_vec();
        for (_, file) in turned.iter_mut().enumerate().filter(|(k, _)| turns(*k)) {
            for sample in &mut file.recording.samples {
                sample.label = sample.label.map(|label| match label {
                    Label::Stable => Label::NotStable,
                    Label::NotStable => Label::Stable,
                });
            }
        }
        turned
    }

    fn probabilities(run: Option<&Run>) -> Option<Vec<f64>> {
        let scored = run?.answers.scored.iter();
        Some(scored.map(|s| s.probability).collect())
    }

    #[test]
    fn a_threshold_is_what_the_other_recordings_say_and_not_the_one_scored() {
        for teachers in [Teachers::OtherFamilies, Teachers::SameFamily] {
            let method = Method::tuned(Detector::Shoe, teachers);
            let mut files = walks();
            let before = method.run(&files).unwrap().swap_remove(0).unwrap();
            // Another motion in the recordings that tune the first moves the first's threshold …
            for index in teachers.indices(&files, 0) {
                files[index] = labelled(SETS[index], rows(2000.0));
            }
            let after = method.run(&files).unwrap().swap_remove(0).unwrap();
            assert_ne!(before.answers.scored, after.answers.scored, "{teachers:?}");
            // … while what it is a threshold on stays.
            assert_eq!(before.answers.ranking, after.answers.ranking);
        }
    }

    #[test]
    fn no_method_that_a_robot_can_run_changes_its_mind_by_what_comes_later() {
        let files = walks();
        let mut cut = files.clone();
        // What is learnt from others stays: nothing that is scored here learns from the slip set.
        let keep = 1000;
        cut[SLIP] = labelled(Set::Slip, rows(1.2).take(keep));
        for method in Method::ALL {
            let slip = |files| method.run(files).unwrap().swap_remove(SLIP);
            let whole = slip(&files).unwrap().answers.scored;
            let part = slip(&cut).unwrap().answers.scored;
            let same = part.iter().zip(&whole).all(|(a, b)| a == b);
            let reaches_the_end = part.len() == keep;
            match method.causality() {
                Causality::Causal => assert!(same && reaches_the_end, "{method:?}"),
                Causality::LooksAhead => assert!(!reaches_the_end, "{method:?}"),
            }
        }
    }

    #[test]
    fn no_method_uses_labels_of_the_recording_it_is_scored_on() {
        let files = walks();
        for method in Method::ALL {
            let before = method.run(&files).unwrap();
            for (index, run) in before.iter().enumerate() {
                let turned = with_labels_turned(&files, |other| other == index);
                let after = method.run(&turned).unwrap();
                assert_eq!(
                    probabilities(run.as_ref()),
                    probabilities(after[index].as_ref()),
                    "{method:?} on {index}"
                );
            }
        }
    }

    #[test]
    fn what_is_tuned_on_other_families_uses_no_labels_of_its_own() {
        let files = walks();
        let tuned = Method::ALL.into_iter().filter(|method| {
            matches!(method, Method::Tuned { teachers, .. } if *teachers == Teachers::OtherFamilies)
        });
        for method in tuned {
            let before = method.run(&files).unwrap();
            for family in SETS.map(Set::family) {
                let own = |index: usize| SETS[index].family() == family;
                let after = method.run(&with_labels_turned(&files, own)).unwrap();
                for index in (0..files.len()).filter(|index| own(*index)) {
                    assert_eq!(
                        probabilities(before[index].as_ref()),
                        probabilities(after[index].as_ref()),
                        "{method:?} on {index}"
                    );
                    let knowledge = before[index].as_ref().map(|run| &run.knowledge.learnt);
                    assert!(knowledge.is_none_or(|learnt| !learnt.contains(family.name())));
                }
            }
        }
    }

    #[test]
    fn where_there_is_no_force_its_methods_are_absent_and_all_others_are_there() {
        let files = walks();
        for method in Method::ALL {
            let needs_robot = matches!(
                method,
                Method::Authors
                    | Method::ForceTrigger
                    | Method::FuzzyCMeans
                    | Method::Tuned {
                        detector: Detector::Force,
                        ..
                    }
            );
            for (file, run) in files.iter().zip(method.run(&files).unwrap()) {
                let robot = matches!(file.set.family(), Family::Atlas | Family::Lcd);
                assert_eq!(run.is_some(), robot || !needs_robot, "{method:?}");
            }
        }
    }

    #[test]
    fn what_several_runs_knew_is_said_once() {
        let runs = Method::tuned(Detector::Ared, Teachers::SameFamily)
            .run(&walks())
            .unwrap();
        let atlas: Vec<&Run> = runs[..3].iter().flatten().collect();
        let knowledge = Knowledge::of_all(&atlas);
        assert_eq!(
            knowledge.learnt,
            "threshold from made up for 3 steps; threshold from made up for ground"
        );
        assert_eq!(knowledge.labels_of.len(), 2);
    }
}
