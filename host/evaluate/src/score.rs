//! Figures of a method on one recording, on several together, and their mean over sets.

use samples::recording::Label;
use serde::Serialize;

use scoring::metrics::{Latency, best_f1, brier_score, f1, latency_over, roc_auc};
use scoring::reliability::calibration_error;
use scoring::scored::{DECISION_THRESHOLD, Scored};

/// Answers of a method on one recording, with the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Answers {
    /// Probability; 1 or 0 for a detector.
    pub scored: Vec<Scored>,
    /// Score that the answer is a threshold on, larger if more stable, or else the probability; used by figures
    /// over all thresholds.
    pub ranking: Vec<Scored>,
}

impl Answers {
    /// Answers of a method whose ranking is its probability.
    #[must_use]
    pub fn of(scored: Vec<Scored>) -> Self {
        Self {
            ranking: scored.clone(),
            scored,
        }
    }
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
    /// Mean of each figure over several sets with equal weight; a figure missing in one set has no mean.
    /// `None` if there is no set.
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
    /// Computes the figures over the samples of all answers together; `None` if there is none.
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

    /// Number of missed transitions of the label in both directions.
    #[must_use]
    pub const fn missed(&self) -> usize {
        self.latency_on.missed + self.latency_off.missed
    }
}

/// Share of the samples with this label that are answered stable; `None` if there are none.
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
    fn error_uses_the_answers_and_auc_the_ranking() {
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
    fn samples_of_all_recordings_have_equal_weight() {
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
    fn false_stable_is_a_share_of_the_not_stable_samples() {
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
    fn mean_weights_sets_equally() {
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
        // A figure missing in one set has no mean.
        let mean = Scores::mean(&[scores(0.25, None), scores(0.75, Some(1.0))]).unwrap();
        assert_eq!((mean.rmse, mean.roc_auc), (0.5, None));
        assert_eq!(Scores::mean(&[]), None);
    }
}
