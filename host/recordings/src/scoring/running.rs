//! Figures of a recording that is too long to keep in memory, with eight bytes per sample.

use crate::samples::recording::Label;

use crate::scoring::metrics::{Answers, Metrics, latency, roc_auc};
use crate::scoring::reliability::Sums;
use crate::scoring::scored::Scored;

/// Incremental computation of [`Metrics`].
#[derive(Clone, Debug, Default)]
pub struct RunningMetrics {
    squares: f64,
    answers: Answers,
    sums: Sums,
    /// Probabilities with their labels; f32, as in the estimates.
    ranks: Vec<(f32, Label)>,
    /// Samples at which the label or the answer changes; latencies need no others.
    turns: Vec<Scored>,
    /// Newest sample, which ends the recording.
    newest: Option<Scored>,
}

impl RunningMetrics {
    /// Adds the next sample with a label.
    pub fn add(&mut self, sample: &Scored) {
        self.squares += (sample.probability - sample.truth()).powi(2);
        self.answers.add(sample);
        self.sums.add(sample);
        self.ranks.push((sample.probability as f32, sample.label));
        let turned =
            |before: &Scored| before.label != sample.label || before.answer() != sample.answer();
        if self.newest.as_ref().is_none_or(turned) {
            self.turns.push(*sample);
        }
        self.newest = Some(*sample);
    }

    /// Returns all figures; `None` if no sample has a label.
    #[must_use]
    pub fn finish(mut self) -> Option<Metrics> {
        self.turns.extend(self.newest);
        self.ranks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let labelled_samples = self.ranks.len();
        let brier_score = self.squares / labelled_samples as f64;
        Some(Metrics {
            labelled_samples,
            rmse: brier_score.sqrt(),
            brier_score,
            roc_auc: roc_auc(&self.ranks),
            f1_at_0_5: self.answers.f1(),
            latency_on: latency(&self.turns, Label::Stable),
            latency_off: latency(&self.turns, Label::NotStable),
            calibration_error: self.sums.calibration_error()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    #[test]
    fn latencies_need_only_the_turns_of_label_and_answer() {
        // The labels flicker and hold, the probabilities follow late, and there are ties.
        let samples: Vec<Scored> = (0..5000_u64)
            .map(|k| {
                let noise = k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 60;
                let stable = (k / 700) % 2 == 0 && noise != 0;
                let late = (k.saturating_sub(40) / 700) % 2 == 0;
                let probability = if late { 0.9 } else { 0.1 } + 0.02 * (noise % 4) as f32;
                Scored {
                    time: Timestamp::from_micros(1000 * k),
                    probability: f64::from(probability),
                    label: if stable { Label::Stable } else { Label::NotStable },
                }
            })
            .collect();
        for length in [0, 1, 2, 699, 700, 701, 5000] {
            let samples = &samples[..length];
            let found = Metrics::of(samples);
            let [on, off] = [Label::Stable, Label::NotStable].map(|to| latency(samples, to));
            let latencies = found.map(|metrics| [metrics.latency_on, metrics.latency_off]);
            let expected = (length > 0).then_some([on, off]);
            assert_eq!(latencies, expected, "{length}");
        }
    }
}
