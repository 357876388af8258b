//! Figures of merit of a probability against labels.
//!
//! All figures are computed in f64 over the samples whose label is known. A probability above
//! [`DECISION_THRESHOLD`](crate::scoring::scored::DECISION_THRESHOLD) counts as the answer "stable".

use crate::samples::recording::Label;
use serde::Serialize;

use crate::scoring::running::RunningMetrics;
use crate::scoring::scored::Scored;

/// Every figure of merit at once.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// How many samples have a label.
    pub labelled_samples: usize,
    /// Root of the Brier score, in [0, 1], best 0.
    pub rmse: f64,
    /// Mean of (P − label)², in [0, 1], best 0: [`brier_score`].
    pub brier_score: f64,
    /// Area under the receiver operating characteristic, in [0, 1], best 1: the probability that a stable sample ranks
    /// above one that is not, ties counting half (Mann and Whitney's U over all pairs). `None` if only one label occurs.
    pub roc_auc: Option<f64>,
    /// F1 of the answer "stable" at P above 0.5, in [0, 1], best 1: the harmonic mean of precision and recall. `None` if
    /// "stable" is neither true nor answered for any sample.
    pub f1_at_0_5: Option<f64>,
    /// From the label turning stable until the answer is "stable".
    pub latency_on: Latency,
    /// From the label turning not stable until the answer is "not stable".
    pub latency_off: Latency,
    /// Expected calibration error over the bins of `reliability`, in [0, 1], best 0.
    pub calibration_error: f64,
}

impl Metrics {
    /// Computes all figures; `None` if there is no label.
    #[must_use]
    pub fn of(scored: &[Scored]) -> Option<Self> {
        let mut running = RunningMetrics::default();
        scored.iter().for_each(|sample| running.add(sample));
        running.finish()
    }
}

/// Brier score: mean of (P − label)², in [0, 1], best 0. Its root is the paper's RMSE.
/// `None` if there is no sample.
#[must_use]
pub fn brier_score(scored: &[Scored]) -> Option<f64> {
    let sum: f64 = scored.iter().map(|s| (s.probability - s.truth()).powi(2)).sum();
    (!scored.is_empty()).then(|| sum / scored.len() as f64)
}

/// Area under the receiver operating characteristic of pairs sorted by probability.
pub(crate) fn roc_auc<P: PartialEq>(ranked: &[(P, Label)]) -> Option<f64> {
    let is_stable = |pair: &&(P, Label)| pair.1 == Label::Stable;
    let mut rank_sum = 0.0;
    let mut before = 0;
    for tied in ranked.chunk_by(|a, b| a.0 == b.0) {
        let stable = tied.iter().filter(is_stable).count();
        let mean_rank = before as f64 + (tied.len() + 1) as f64 / 2.0;
        rank_sum += stable as f64 * mean_rank;
        before += tied.len();
    }
    let stable = ranked.iter().filter(is_stable).count() as f64;
    let others = ranked.len() as f64 - stable;
    let pairs = stable * others;
    (pairs > 0.0).then(|| (rank_sum - stable * (stable + 1.0) / 2.0) / pairs)
}

/// Counts of right and wrong answers "stable".
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Answers {
    hits: u64,
    misses: u64,
    false_alarms: u64,
}

impl Answers {
    pub(crate) fn add(&mut self, sample: &Scored) {
        match (sample.label, sample.answer()) {
            (Label::Stable, Label::Stable) => self.hits += 1,
            (Label::Stable, Label::NotStable) => self.misses += 1,
            (Label::NotStable, Label::Stable) => self.false_alarms += 1,
            (Label::NotStable, Label::NotStable) => {}
        }
    }

    pub(crate) fn f1(self) -> Option<f64> {
        let all = (2 * self.hits + self.misses + self.false_alarms) as f64;
        (all > 0.0).then(|| 2.0 * self.hits as f64 / all)
    }
}

/// How fast the answer follows the label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Latency {
    /// Median over the transitions that were followed, s; `None` where there was none.
    pub median_s: Option<f64>,
    /// Transitions that were followed.
    pub followed: usize,
    /// Transitions that were not, because the label turned again, or the recording ended, first.
    pub missed: usize,
}

/// Minimum duration of a label after a transition, s. The labels of the ATLAS recordings come from a noisy
/// force and change hundreds of times, six times in seven for 20 ms or less.
pub const SETTLED_S: f64 = 0.1;

/// Latency of the label's transitions to `to`.
///
/// A stretch is a run of samples with one label; it lasts until the next stretch's first sample.
/// Stretches shorter than [`SETTLED_S`] are ignored. A transition is the first sample of a
/// stretch whose label differs from that of the last stretch before it that was not ignored. Its
/// latency is the time from that sample to the first one, itself included, whose answer is `to`;
/// it is 0 if that was the answer already. The search ends before the next transition or
/// with the recording; without a result, the transition counts as missed.
#[must_use]
pub fn latency(scored: &[Scored], to: Label) -> Latency {
    let mut delays = Vec::new();
    let mut missed = 0;
    // A recording begins with a label, not with a transition.
    for stretch in settled(scored).windows(2).map(|pair| pair[1]) {
        if stretch[0].label != to {
            continue;
        }
        match stretch.iter().find(|s| s.answer() == to) {
            Some(found) => delays.push(micros_between(&stretch[0], found)),
            None => missed += 1,
        }
    }
    Latency {
        followed: delays.len(),
        median_s: median(delays).map(|micros| micros / 1.0e6),
        missed,
    }
}

/// Splits the samples at the transitions of the label; the first part ends at the first transition.
fn settled(scored: &[Scored]) -> Vec<&[Scored]> {
    let mut turns: Vec<usize> = Vec::new();
    let mut start = 0;
    for stretch in scored.chunk_by(|a, b| a.label == b.label) {
        let end = start + stretch.len();
        let until = scored.get(end).or(stretch.last());
        let lasts = until.map_or(0, |until| micros_between(&stretch[0], until));
        let turned = turns.last().is_none_or(|turn| scored[*turn].label != stretch[0].label);
        if turned && lasts as f64 >= 1.0e6 * SETTLED_S {
            turns.push(start);
        }
        start = end;
    }
    let ends = turns.iter().skip(1).copied().chain([scored.len()]);
    turns.iter().zip(ends).map(|(start, end)| &scored[*start..end]).collect()
}

fn micros_between(earlier: &Scored, later: &Scored) -> u64 {
    later.time.micros_since(earlier.time).unwrap_or(0)
}

/// Median: the middle value, or the mean of the two in the middle.
fn median(mut values: Vec<u64>) -> Option<f64> {
    values.sort_unstable();
    let upper = *values.get(values.len() / 2)?;
    if values.len() % 2 == 1 {
        Some(upper as f64)
    } else {
        Some((values[values.len() / 2 - 1] + upper) as f64 / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    /// One sample per second: a probability and a label of 1 or 0 each.
    fn scored(pairs: &[(f64, u8)]) -> Vec<Scored> {
        let sample = |(k, (probability, label)): (usize, &(f64, u8))| Scored {
            time: Timestamp::from_micros(k as u64 * 1_000_000),
            probability: *probability,
            label: if *label == 1 { Label::Stable } else { Label::NotStable },
        };
        pairs.iter().enumerate().map(sample).collect()
    }

    fn auc(pairs: &[(f64, u8)]) -> Option<f64> {
        Metrics::of(&scored(pairs)).and_then(|metrics| metrics.roc_auc)
    }

    fn f1(pairs: &[(f64, u8)]) -> Option<f64> {
        Metrics::of(&scored(pairs)).and_then(|metrics| metrics.f1_at_0_5)
    }

    #[test]
    fn metrics_require_a_label() {
        assert_eq!(Metrics::of(&[]), None);
    }

    #[test]
    fn rmse_is_the_root_of_the_mean_squared_error() {
        // Errors 0.1, 0.3, 0.5, 1: squares add up to 0.01 + 0.09 + 0.25 + 1 = 1.35.
        let metrics = Metrics::of(&scored(&[(0.9, 1), (0.3, 0), (0.5, 1), (1.0, 0)])).unwrap();
        assert!((metrics.brier_score - 0.3375).abs() < 1e-12);
        assert!((metrics.rmse - 0.580_947_501_931).abs() < 1e-12);
    }

    #[test]
    fn auc_is_the_share_of_correctly_ordered_pairs() {
        // Stable 0.8, 0.4; others 0.6, 0.2: of 4 pairs only 0.4 < 0.6 is wrong.
        assert_eq!(auc(&[(0.8, 1), (0.4, 1), (0.6, 0), (0.2, 0)]), Some(0.75));
    }

    #[test]
    fn ties_count_half_in_the_auc() {
        // Stable 0.5, 1; others 0.5, 0: 0.5 + 1 + 1 + 1 of 4.
        assert_eq!(auc(&[(0.5, 1), (1.0, 1), (0.5, 0), (0.0, 0)]), Some(0.875));
        assert_eq!(auc(&[(0.3, 1), (0.3, 0), (0.3, 0)]), Some(0.5));
    }

    #[test]
    fn auc_requires_both_labels() {
        assert_eq!(auc(&[(0.8, 1), (0.4, 1)]), None);
    }

    #[test]
    fn f1_counts_probability_one_half_as_not_stable() {
        // Hits 2, miss 1 (the 0.5), false alarm 1: 4 / (4 + 1 + 1).
        let f1 = f1(&[(0.9, 1), (0.6, 1), (0.5, 1), (0.51, 0), (0.1, 0)]).unwrap();
        assert!((f1 - 2.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn f1_requires_a_stable_sample() {
        assert_eq!(f1(&[(0.1, 0), (0.2, 0)]), None);
    }

    #[test]
    fn latency_is_the_median_time_until_the_answer_follows() {
        let samples = scored(&[
            (0.9, 0), // the start is no transition
            (0.1, 1), // on, followed after 2 s
            (0.2, 1),
            (0.9, 1),
            (0.9, 0), // off, followed after 1 s
            (0.4, 0),
            (0.6, 1), // on, followed at once
            (0.9, 0), // off, missed: the label turns first
            (0.9, 1), // on, at once
            (0.9, 1),
        ]);
        assert_eq!(
            latency(&samples, Label::Stable),
            Latency { median_s: Some(0.0), followed: 3, missed: 0 }
        );
        assert_eq!(
            latency(&samples, Label::NotStable),
            Latency { median_s: Some(1.0), followed: 1, missed: 1 }
        );
    }

    #[test]
    fn short_change_of_the_label_is_ignored() {
        // Samples 40 ms apart: stable for 80 ms is ignored, for 120 ms it is not.
        let mut samples = scored(&[
            (0.1, 0),
            (0.1, 0),
            (0.1, 0),
            (0.1, 0),
            (0.1, 1),
            (0.1, 1),
            (0.1, 0),
            (0.1, 1), // the transition
            (0.1, 1),
            (0.9, 1), // followed
            (0.9, 1),
        ]);
        for (sample, k) in samples.iter_mut().zip(0..) {
            sample.time = Timestamp::from_micros(k * 40_000);
        }
        let on = latency(&samples, Label::Stable);
        assert_eq!((on.followed, on.missed), (1, 0));
        assert_eq!(on.median_s, Some(0.08));
        assert_eq!(latency(&samples, Label::NotStable), Latency::default());
    }

    #[test]
    fn latency_has_the_precision_of_the_times() {
        // Followed after 34 and 38 ms: in f64 seconds their mean is 0.036000000000000004.
        let mut samples = scored(&[
            (0.1, 0),
            (0.1, 1),
            (0.9, 1),
            (0.9, 0),
            (0.1, 0),
            (0.1, 1),
            (0.9, 1),
            (0.9, 1),
        ]);
        let times_ms = [0, 200, 234, 500, 600, 800, 838, 1000];
        for (sample, ms) in samples.iter_mut().zip(times_ms) {
            sample.time = Timestamp::from_micros(1000 * ms);
        }
        let on = latency(&samples, Label::Stable);
        assert_eq!(serde_json::to_value(on).unwrap()["median_s"].to_string(), "0.036");
    }

    #[test]
    fn median_of_an_even_count_is_the_mean_of_the_middle_two() {
        assert_eq!(median(vec![4, 1, 3, 2]), Some(2.5));
        assert_eq!(median(vec![]), None);
    }
}
