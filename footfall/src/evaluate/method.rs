//! Every method that is compared, and how each is run over all recordings.

use estimator_core::{Calibrator, Params, ParamsError, PerAxis, WindowLength};
use serde::Serialize;

use super::labelled::{Labelled, SOURCES};
use super::peers::{amvd, answers, ared, grf, mbgtd, shoe, threshold};
use super::score::Outcome;
use super::{authors, fuzzy};
use crate::metrics::Scored;
use crate::probability_map::ProbabilityMap;
use crate::replay::replay;

/// Duration of the paper's window, s: 50 samples at 1 kHz. At another rate it is this duration and
/// not that count, for the paper's preset and for all peers.
pub const PAPER_WINDOW: f32 = 0.05;

/// A method that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// This estimator, default preset.
    Default,
    /// This estimator, default preset, with half-widths calibrated for the robot without labels.
    Calibrated,
    /// As [`Calibrated`](Self::Calibrated), with P mapped by what the labels of the other recordings
    /// of the same kind teach.
    Mapped,
    /// As [`Mapped`](Self::Mapped), from all other recordings, of whatever kind.
    MappedAcross,
    /// This estimator, the paper's preset.
    Paper,
    /// The authors' script, which looks ahead.
    Authors,
    /// See [`shoe`].
    Shoe,
    /// See [`ared`].
    Ared,
    /// See [`amvd`].
    Amvd,
    /// See [`mbgtd`].
    Mbgtd,
    /// A threshold on the vertical force.
    Force,
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
    /// What was learnt from other labels or without any, and from which files.
    pub learnt: String,
    /// The names of the recordings whose labels were used.
    pub labels_of: Vec<String>,
}

/// One method on one recording.
#[derive(Clone, Debug)]
pub struct Run {
    /// What it answered.
    pub outcome: Outcome,
    /// What it knew.
    pub knowledge: Knowledge,
}

impl Method {
    /// All methods in the order in which they are shown.
    pub const ALL: [Self; 13] = [
        Self::Default,
        Self::Calibrated,
        Self::Mapped,
        Self::MappedAcross,
        Self::Paper,
        Self::Authors,
        Self::Shoe,
        Self::Ared,
        Self::Amvd,
        Self::Mbgtd,
        Self::Force,
        Self::ForceTrigger,
        Self::FuzzyCMeans,
    ];

    /// How it is called in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Default => "footfall, default preset",
            Self::Calibrated => "footfall, half-widths calibrated",
            Self::Mapped => "footfall, calibrated and mapped",
            Self::MappedAcross => "footfall, mapped by other robots too",
            Self::Paper => "footfall, paper preset",
            Self::Authors => "authors' script (looks ahead)",
            Self::Shoe => "SHOE / GLRT",
            Self::Ared => "ARED",
            Self::Amvd => "AMVD",
            Self::Mbgtd => "MBGTD",
            Self::Force => "force threshold",
            Self::ForceTrigger => "force Schmitt trigger 10/5 %",
            Self::FuzzyCMeans => "fuzzy c-means, force and IMU",
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

    /// Runs it over all recordings, which are those of [`SOURCES`] in their order.
    ///
    /// # Errors
    /// The estimator refuses a recording's sample rate.
    pub fn run(self, files: &[Labelled]) -> Result<Vec<Run>, ParamsError> {
        match self {
            Self::Default => each(files, |_, file| {
                estimated(file, &Params::DEFAULT, "preset as it is")
            }),
            Self::Paper => each(files, |_, file| {
                estimated(file, &paper_params(), "preset as it is")
            }),
            Self::Calibrated => each(files, |place, file| {
                let from = &files[SOURCES[place].learnt_on];
                match half_widths(from)? {
                    Some(half_width) => {
                        let params = Params {
                            half_width,
                            ..Params::DEFAULT
                        };
                        let learnt = format!("half-widths from {}, no labels", from.name());
                        estimated(file, &params, &learnt)
                    }
                    None => estimated(
                        file,
                        &Params::DEFAULT,
                        &format!("preset as it is: too few steps in {}", from.name()),
                    ),
                }
            }),
            Self::Mapped => {
                let same = |a: usize, b: usize| SOURCES[a].labels == SOURCES[b].labels;
                Ok(mapped(files, &Self::Calibrated.run(files)?, same))
            }
            Self::MappedAcross => Ok(mapped(files, &Self::Calibrated.run(files)?, |_, _| true)),
            Self::Authors => each(files, |_, file| Ok(authors_run(file))),
            Self::FuzzyCMeans => each(files, |place, file| {
                let from = &files[SOURCES[place].learnt_on];
                let learnt = format!("clusters from {}, no labels", from.name());
                let probabilities = fuzzy::probabilities(from, file);
                Ok(Run::of(file, &probabilities, &learnt))
            }),
            Self::ForceTrigger => each(files, |_, file| {
                let shares = grf::load_shares(&file.wrenches, file.weight);
                let answers = grf::schmitt_trigger(&shares);
                Ok(Run::of(
                    file,
                    &answers,
                    "levels as published, weight from the load",
                ))
            }),
            Self::Shoe => Ok(thresholded(files, |file| {
                let sigma = (
                    f64::from(Params::PAPER.bandwidth.ax),
                    f64::from(Params::PAPER.bandwidth.wx),
                );
                negated(shoe::statistic(&file.motions, window(file), sigma))
            })),
            Self::Ared => Ok(thresholded(files, |file| {
                negated(ared::statistic(&file.motions, window(file)))
            })),
            Self::Amvd => Ok(thresholded(files, |file| {
                negated(amvd::statistic(&file.motions, window(file)))
            })),
            Self::Mbgtd => Ok(thresholded(files, |file| {
                negated(mbgtd::statistic(&file.motions, window(file)))
            })),
            Self::Force => Ok(thresholded(files, |file| {
                grf::load_shares(&file.wrenches, file.weight)
            })),
        }
    }
}

impl Run {
    /// Of a method whose probability is its ranking, and which used no labels.
    fn of(file: &Labelled, probabilities: &[f64], learnt: &str) -> Self {
        let scored = file.scored(probabilities);
        Self {
            outcome: Outcome {
                ranking: scored.clone(),
                scored,
            },
            knowledge: Knowledge {
                learnt: learnt.to_owned(),
                labels_of: Vec::new(),
            },
        }
    }
}

fn each(
    files: &[Labelled],
    run: impl Fn(usize, &Labelled) -> Result<Run, ParamsError>,
) -> Result<Vec<Run>, ParamsError> {
    let runs = files.iter().enumerate();
    runs.map(|(place, file)| run(place, file)).collect()
}

/// The paper's preset with its window as a duration.
fn paper_params() -> Params {
    Params {
        window: WindowLength::Duration(PAPER_WINDOW),
        ..Params::PAPER
    }
}

fn window(file: &Labelled) -> usize {
    file.samples_in(f64::from(PAPER_WINDOW))
}

fn negated(statistic: Vec<f64>) -> Vec<f64> {
    statistic.into_iter().map(|value| -value).collect()
}

fn estimated(file: &Labelled, params: &Params, learnt: &str) -> Result<Run, ParamsError> {
    let estimates = replay(&file.recording, params)?;
    let stable = |estimate: &estimator_core::ContactEstimate| estimate.probabilities.stable;
    let probabilities: Vec<f64> = estimates.iter().map(|e| f64::from(stable(e))).collect();
    Ok(Run::of(file, &probabilities, learnt))
}

/// Half-widths for a robot, from a recording of it and without its labels; `None` where it takes
/// too few steps.
fn half_widths(file: &Labelled) -> Result<Option<PerAxis<f32>>, ParamsError> {
    let params = Params {
        sample_rate: file.recording.sample_rate,
        ..Params::DEFAULT
    };
    let mut calibrator = Calibrator::new(&params);
    for estimate in replay(&file.recording, &params)? {
        calibrator.update(&estimate);
    }
    Ok(calibrator.propose().ok())
}

fn authors_run(file: &Labelled) -> Run {
    let probabilities = authors::probabilities(&file.motions, window(file), &Params::PAPER);
    Run::of(file, &probabilities, "parameters as published")
}

/// A method that answers "stable" where a score is above a threshold. The threshold comes from the
/// file that [`SOURCES`] names for it.
fn thresholded(files: &[Labelled], score: impl Fn(&Labelled) -> Vec<f64>) -> Vec<Run> {
    let scores: Vec<Vec<f64>> = files.iter().map(score).collect();
    let of_file = |(place, file): (usize, &Labelled)| {
        let tuned_on = SOURCES[place].tuned_on;
        let from = &files[tuned_on];
        let threshold = threshold(&from.scored(&scores[tuned_on]));
        Run {
            outcome: Outcome {
                scored: file.scored(&answers(&scores[place], threshold)),
                ranking: file.scored(&scores[place]),
            },
            knowledge: Knowledge {
                learnt: format!("threshold from {}", from.name()),
                labels_of: vec![from.name().to_owned()],
            },
        }
    };
    files.iter().enumerate().map(of_file).collect()
}

/// Maps each recording's probabilities by what the labels of others teach: of those that `fits`
/// finds fit for it, by their places in [`SOURCES`], but never its own.
fn mapped(files: &[Labelled], runs: &[Run], fits: impl Fn(usize, usize) -> bool) -> Vec<Run> {
    let of_run = |(place, run): (usize, &Run)| {
        let others = (0..runs.len()).filter(|other| *other != place && fits(place, *other));
        let others: Vec<usize> = others.collect();
        let scored: Vec<Scored> = others
            .iter()
            .flat_map(|other| runs[*other].outcome.scored.iter().copied())
            .collect();
        let map = ProbabilityMap::learn(&scored).unwrap_or(ProbabilityMap::IDENTITY);
        let names: Vec<_> = others
            .iter()
            .map(|other| files[*other].name().to_owned())
            .collect();
        Run {
            outcome: run.outcome.clone().mapped(|p| map.apply(p)),
            knowledge: Knowledge {
                learnt: format!(
                    "{}; slope {:.2}, offset {:.2} from {}",
                    run.knowledge.learnt,
                    map.slope(),
                    map.offset(),
                    names.join(", ")
                ),
                labels_of: names,
            },
        }
    };
    runs.iter().enumerate().map(of_run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::testing::labelled;
    use crate::recording::Label;

    /// Five walks of a foot that turns `slowness` times slower in its swing than in the first.
    fn walks(slowness: [f64; 5]) -> Vec<Labelled> {
        let walk = |slowness: f64| {
            labelled((0..2000_u32).map(move |k| {
                let noise = 0.01 * (f64::from(k * 7919 % 1000) / 1000.0 - 0.5);
                let tremble = [10.0 * noise, noise, noise, noise, noise, noise];
                if k / 125 % 2 == 0 {
                    ([0.0, 0.0, 800.0, 0.0, 0.0, 0.0], tremble, Label::Stable)
                } else {
                    let swing = tremble.map(|m| 8.0 / slowness + m);
                    ([0.0; 6], swing, Label::NotStable)
                }
            }))
        };
        slowness.map(walk).into()
    }

    #[test]
    fn half_widths_come_from_the_other_walk_and_not_from_the_preset() {
        let runs = Method::Calibrated.run(&walks([1.0; 5])).unwrap();
        for run in runs {
            assert_eq!(run.knowledge.learnt, "half-widths from made up, no labels");
        }
    }

    #[test]
    fn a_threshold_is_what_the_other_file_says_and_not_the_one_scored() {
        let files = walks([1.0, 1.0, 1.0, 1.0, 1.0]);
        let before = Method::Shoe.run(&files).unwrap();
        // Another motion in the file that tunes the first moves the first's threshold …
        let mut files = files;
        files[SOURCES[0].tuned_on] = walks([20.0; 5]).remove(0);
        let after = Method::Shoe.run(&files).unwrap();
        assert_ne!(before[0].outcome.scored, after[0].outcome.scored);
        // … while what it is a threshold on stays.
        assert_eq!(before[0].outcome.ranking, after[0].outcome.ranking);
    }

    #[test]
    fn no_method_that_a_robot_can_run_changes_its_mind_by_what_comes_later() {
        let files = walks([1.0, 1.2, 1.1, 1.0, 1.3]);
        let mut cut = files.clone();
        // What is learnt from a file stays: only the slip file, from which nothing learns, is cut.
        let place = 2;
        let keep = 1000;
        let rows = (0..keep).map(|k| {
            let label = files[place].labels().nth(k);
            (
                files[place].wrenches[k],
                files[place].motions[k],
                label.unwrap(),
            )
        });
        let rows: Vec<_> = rows.collect();
        cut[place] = labelled(rows.into_iter());
        for method in Method::ALL {
            let whole = method.run(&files).unwrap().remove(place).outcome.scored;
            let part = method.run(&cut).unwrap().remove(place).outcome.scored;
            let same = part.iter().zip(&whole).all(|(a, b)| a == b);
            let reaches_the_end = part.len() == keep;
            match method.causality() {
                Causality::Causal => assert!(same && reaches_the_end, "{method:?}"),
                Causality::LooksAhead => assert!(!reaches_the_end, "{method:?}"),
            }
        }
    }

    #[test]
    fn no_method_uses_labels_of_the_file_it_is_scored_on() {
        let files = walks([1.0, 1.2, 1.1, 1.0, 1.3]);
        let turned = |place: usize| {
            let mut turned = files.clone();
            for sample in &mut turned[place].recording.samples {
                sample.label = sample.label.map(|label| match label {
                    Label::Stable => Label::NotStable,
                    Label::NotStable => Label::Stable,
                });
            }
            turned
        };
        let probabilities = |run: &Run| -> Vec<f64> {
            let scored = run.outcome.scored.iter();
            scored.map(|s| s.probability).collect()
        };
        for method in Method::ALL {
            let before = method.run(&files).unwrap();
            for (place, run) in before.iter().enumerate() {
                let after = method.run(&turned(place)).unwrap();
                assert_eq!(
                    probabilities(run),
                    probabilities(&after[place]),
                    "{method:?} on {place}"
                );
            }
        }
    }
}
