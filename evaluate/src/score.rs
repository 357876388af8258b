//! The figures of a method on one recording, on several together, and their mean over sets.

use recordings::recording::Label;
use serde::Serialize;

use scoring::metrics::{Latency, best_f1, brier_score, f1, latency_over, roc_auc};
use scoring::reliability::calibration_error;
use scoring::scored::{DECISION_THRESHOLD, Scored};

/// What a method answered on one recording, with the truth beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Answers {
    /// Its probability; of a detector, 1 or 0.
    pub scored: Vec<Scored>,
    /// What its answer is a threshold on, larger where rather stable; else its probability. For the
    /// figures that are about all thresholds.
    pub ranking: Vec<Scored>,
}

/// Figures of merit about samples, each as [`metrics`](scoring::metrics) and
/// [`reliability`](scoring::reliability) define it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// Root of the Brier score.
    pub rmse: f64,
    /// Mean of (P − label)².
    pub brier_score: f64,
    /// Area under the ROC curve of the ranking.
    pub roc_auc: Option<f64>,
    /// F1 of the answers.
    pub f1_at_0_5: Option<f64>,
    /// F1 at the best threshold on the ranking, chosen on the very samples it is scored on.
    pub best_f1: Option<f64>,
    /// Expected calibration error of the probability.
    pub calibration_error: f64,
    /// Share, in [0, 1], of the samples labelled not stable that are answered stable.
    pub false_stable: Option<f64>,
    /// Share, in [0, 1], of the samples labelled stable that are not answered stable.
    pub missed_stable: Option<f64>,
}

impl Scores {
    /// The mean of each figure over several sets, each of which counts alike; a figure that one of
    /// them lacks has none. `None` where there is no set.
    #[must_use]
    pub fn mean(sets: &[Self]) -> Option<Self> {
        let known = |of: fn(&Self) -> Option<f64>| -> Option<f64> {
            let sum: Option<f64> = sets.iter().map(of).sum();
            sum.map(|sum| sum / sets.len() as f64)
        };
        if sets.is_empty() {
            return None;
        }
        Some(Self {
            rmse: known(|s| Some(s.rmse))?,
            brier_score: known(|s| Some(s.brier_score))?,
            roc_auc: known(|s| s.roc_auc),
            f1_at_0_5: known(|s| s.f1_at_0_5),
            best_f1: known(|s| s.best_f1),
            calibration_error: known(|s| Some(s.calibration_error))?,
            false_stable: known(|s| s.false_stable),
            missed_stable: known(|s| s.missed_stable),
        })
    }
}

/// All figures of merit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// How many samples were scored.
    pub samples: usize,
    /// About the samples.
    #[serde(flatten)]
    pub scores: Scores,
    /// From the label turning stable to the answer.
    pub latency_on: Latency,
    /// From the label turning not stable to the answer.
    pub latency_off: Latency,
}

impl Figures {
    /// Over the samples of all answers together; `None` where there is none.
    #[must_use]
    pub fn of(answers: &[&Answers]) -> Option<Self> {
        let together = |pick: fn(&Answers) -> &[Scored]| -> Vec<Scored> {
            answers.iter().flat_map(|o| pick(o)).copied().collect()
        };
        let scored = together(|answers| &answers.scored);
        let ranking = together(|answers| &answers.ranking);
        let apart: Vec<&[Scored]> = answers.iter().map(|o| o.scored.as_slice()).collect();
        let brier_score = brier_score(&scored)?;
        Some(Self {
            samples: scored.len(),
            scores: Scores {
                rmse: brier_score.sqrt(),
                brier_score,
                roc_auc: roc_auc(&ranking),
                f1_at_0_5: f1(&scored),
                best_f1: best_f1(&ranking),
                calibration_error: calibration_error(&scored)?,
                false_stable: answered_stable(&scored, Label::NotStable),
                missed_stable: answered_stable(&scored, Label::Stable).map(|share| 1.0 - share),
            },
            latency_on: latency_over(&apart, Label::Stable),
            latency_off: latency_over(&apart, Label::NotStable),
        })
    }

    /// Transitions of the label, either way, that were never answered.
    #[must_use]
    pub const fn missed(&self) -> usize {
        self.latency_on.missed + self.latency_off.missed
    }
}

/// Share of the samples with a label that are answered stable; `None` where there are none.
fn answered_stable(scored: &[Scored], label: Label) -> Option<f64> {
    let labelled = || scored.iter().filter(|s| s.label == label);
    let answered = labelled().filter(|s| s.probability > DECISION_THRESHOLD);
    let all = labelled().count();
    (all > 0).then(|| answered.count() as f64 / all as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    fn scored(pairs: &[(f64, Label)]) -> Vec<Scored> {
        let sample = |(k, (probability, label)): (u64, &(f64, Label))| Scored {
            time: Timestamp::from_micros(1_000_000 * k),
            probability: *probability,
            label: *label,
        };
        (0..).zip(pairs).map(sample).collect()
    }

    #[test]
    fn answers_make_the_error_and_the_ranking_makes_the_area() {
        use Label::{NotStable, Stable};
        let labels = [NotStable, Stable, Stable, NotStable];
        let with = |values: [f64; 4]| scored(&[0, 1, 2, 3].map(|k| (values[k], labels[k])));
        let answers = Answers {
            scored: with([0.0, 0.0, 1.0, 0.0]),
            ranking: with([-9.0, -3.0, -2.0, -8.0]),
        };
        let figures = Figures::of(&[&answers]).unwrap();
        assert_eq!(figures.scores.rmse, 0.5);
        assert_eq!(figures.scores.roc_auc, Some(1.0));
        assert_eq!(figures.scores.f1_at_0_5, Some(2.0 / 3.0));
        assert_eq!(figures.scores.best_f1, Some(1.0));
        assert_eq!(figures.latency_on.median_s, Some(1.0));
        assert_eq!(figures.missed(), 0);
    }

    #[test]
    fn a_sample_of_one_recording_counts_like_one_of_another() {
        let right = Answers {
            scored: scored(&[(1.0, Label::Stable); 3]),
            ranking: scored(&[(1.0, Label::Stable); 3]),
        };
        let wrong = Answers {
            scored: scored(&[(1.0, Label::NotStable)]),
            ranking: scored(&[(1.0, Label::NotStable)]),
        };
        let figures = Figures::of(&[&right, &wrong]).unwrap();
        assert_eq!((figures.samples, figures.scores.brier_score), (4, 0.25));
        assert!(Figures::of(&[]).is_none());
    }

    #[test]
    fn false_stable_is_a_share_of_what_is_not_stable() {
        use Label::{NotStable, Stable};
        let samples = scored(&[
            (0.9, NotStable),
            (0.5, NotStable),
            (0.1, NotStable),
            (0.2, NotStable),
            (0.9, Stable),
        ]);
        assert_eq!(answered_stable(&samples, NotStable), Some(0.25));
        assert_eq!(answered_stable(&samples, Stable), Some(1.0));
        assert_eq!(answered_stable(&scored(&[(0.9, Stable)]), NotStable), None);
    }

    #[test]
    fn in_the_mean_a_short_set_counts_like_a_long_one() {
        let scores = |rmse, roc_auc| Scores {
            rmse,
            brier_score: rmse * rmse,
            roc_auc,
            f1_at_0_5: Some(1.0),
            best_f1: Some(1.0),
            calibration_error: 0.0,
            false_stable: Some(0.0),
            missed_stable: Some(0.0),
        };
        let mean = Scores::mean(&[scores(0.25, Some(0.5)), scores(0.75, Some(1.0))]).unwrap();
        assert_eq!((mean.rmse, mean.roc_auc), (0.5, Some(0.75)));
        // A figure that one set lacks has no mean, instead of that of the others.
        let mean = Scores::mean(&[scores(0.25, None), scores(0.75, Some(1.0))]).unwrap();
        assert_eq!((mean.rmse, mean.roc_auc), (0.5, None));
        assert_eq!(Scores::mean(&[]), None);
    }
}
