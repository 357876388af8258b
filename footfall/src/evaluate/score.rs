//! The figures of a method on one recording, or on several together.

use serde::Serialize;

use crate::metrics::{Latency, Scored, best_f1, brier_score, f1, latency_over, roc_auc};
use crate::recording::Label;
use crate::reliability::calibration_error;

/// What a method answered on one recording, with the truth beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Its probability; of a detector, 1 or 0.
    pub scored: Vec<Scored>,
    /// What its answer is a threshold on, larger where rather stable; else its probability. For the
    /// figures that are about all thresholds.
    pub ranking: Vec<Scored>,
}

impl Outcome {
    /// With another probability in place of each, by a monotone map; the ranking stays.
    pub(super) fn mapped(mut self, map: impl Fn(f64) -> f64) -> Self {
        for sample in &mut self.scored {
            sample.probability = map(sample.probability);
        }
        self
    }
}

/// Figures of merit, each as [`metrics`](crate::metrics) and [`reliability`](crate::reliability)
/// define it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// How many samples were scored.
    pub samples: usize,
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
    /// From the label turning stable to the answer.
    pub latency_on: Latency,
    /// From the label turning not stable to the answer.
    pub latency_off: Latency,
}

impl Figures {
    /// Over the samples of all outcomes together; `None` where there is none.
    #[must_use]
    pub fn of(outcomes: &[&Outcome]) -> Option<Self> {
        let together = |pick: fn(&Outcome) -> &[Scored]| -> Vec<Scored> {
            outcomes.iter().flat_map(|o| pick(o)).copied().collect()
        };
        let scored = together(|outcome| &outcome.scored);
        let ranking = together(|outcome| &outcome.ranking);
        let apart: Vec<&[Scored]> = outcomes.iter().map(|o| o.scored.as_slice()).collect();
        let brier_score = brier_score(&scored)?;
        Some(Self {
            samples: scored.len(),
            rmse: brier_score.sqrt(),
            brier_score,
            roc_auc: roc_auc(&ranking),
            f1_at_0_5: f1(&scored),
            best_f1: best_f1(&ranking),
            calibration_error: calibration_error(&scored)?,
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
        let outcome = Outcome {
            scored: with([0.0, 0.0, 1.0, 0.0]),
            ranking: with([-9.0, -3.0, -2.0, -8.0]),
        };
        let figures = Figures::of(&[&outcome]).unwrap();
        assert_eq!(figures.rmse, 0.5);
        assert_eq!(figures.roc_auc, Some(1.0));
        assert_eq!(figures.f1_at_0_5, Some(2.0 / 3.0));
        assert_eq!(figures.best_f1, Some(1.0));
        assert_eq!(figures.latency_on.median_s, Some(1.0));
        assert_eq!(figures.missed(), 0);
    }

    #[test]
    fn a_sample_of_one_recording_counts_like_one_of_another() {
        let right = Outcome {
            scored: scored(&[(1.0, Label::Stable); 3]),
            ranking: scored(&[(1.0, Label::Stable); 3]),
        };
        let wrong = Outcome {
            scored: scored(&[(1.0, Label::NotStable)]),
            ranking: scored(&[(1.0, Label::NotStable)]),
        };
        let figures = Figures::of(&[&right, &wrong]).unwrap();
        assert_eq!((figures.samples, figures.brier_score), (4, 0.25));
        assert!(Figures::of(&[]).is_none());
    }
}
