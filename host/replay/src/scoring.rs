//! Figures of merit of contact probabilities against labels, and of orientations against their truth.
//!
//! Figures of a probability are computed in f64 over the samples whose label is known. A probability above
//! [`DECISION_THRESHOLD`] counts as the answer "stable". [`RunningMetrics`] takes a recording that is too long to keep in
//! memory, with eight bytes per sample.
//!
//! The calibration error follows from the reliability of a probability: among the samples with P near 0.8, four in five
//! should be stable. Samples are sorted into ten bins of equal width by their probability, as in M. P. Naeini, G. F. Cooper,
//! M. Hauskrecht, *Obtaining Well Calibrated Probabilities Using Bayesian Binning*, AAAI 2015. A reliability diagram shows
//! each bin's mean label over its mean probability; the expected calibration error is their mean distance, weighted by the
//! samples in the bin.
//!
//! The error of an orientation is the angle between the vertical of the estimate and the true vertical. Heading is not
//! observable by an IMU on a foot, and gravity is removed by inclination only.

use estimator_core::{ContactEstimate, Quaternion, Timestamp};
use serde::Serialize;

use samples::space::{Rotation, Vector};
use samples::{Label, RecordedSample};

/// Probability above which the answer is "stable".
pub const DECISION_THRESHOLD: f64 = 0.5;

/// Probability of a sample with its label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// Time of acquisition of the sample.
    pub time: Timestamp,
    /// Estimated probability of stable contact, in [0, 1].
    pub probability: f64,
    /// Label of the sample: contact was stable or not.
    pub label: Label,
}

impl Scored {
    /// Pairs a sample with its total probability; `None` if its label is unknown.
    #[must_use]
    pub fn of(sample: &RecordedSample, estimate: &ContactEstimate) -> Option<Self> {
        Some(Self {
            time: sample.imu.timestamp,
            probability: f64::from(estimate.probabilities.stable),
            label: sample.label?,
        })
    }

    /// Pairs the samples whose label is known with their total probability.
    #[must_use]
    pub fn collect(samples: &[RecordedSample], estimates: &[ContactEstimate]) -> Vec<Self> {
        let pairs = samples.iter().zip(estimates);
        pairs.filter_map(|(sample, estimate)| Self::of(sample, estimate)).collect()
    }

    /// Label as a probability: 1 or 0.
    #[must_use]
    pub fn truth(&self) -> f64 {
        match self.label {
            Label::Stable => 1.0,
            Label::NotStable => 0.0,
        }
    }

    /// Answer by the [`DECISION_THRESHOLD`].
    #[must_use]
    pub fn answer(&self) -> Label {
        if self.probability > DECISION_THRESHOLD { Label::Stable } else { Label::NotStable }
    }
}

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
    /// no sample is labelled or answered "stable".
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
    /// Median over the transitions that were followed, s; `None` if no transition was.
    pub median_s: Option<f64>,
    /// Transitions that were followed.
    pub followed: usize,
    /// Transitions that were missed, because the label changed again first, or the recording ended.
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

/// Number of bins over [0, 1].
const BINS: usize = 10;

/// Sums over the samples whose probability lies in one bin. A bin includes its lower end, the last one also 1.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    samples: usize,
    probability: f64,
    /// Number of stable samples.
    stable: f64,
}

/// Sums over the samples of each bin.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sums([Bin; BINS]);

impl Sums {
    pub(crate) fn add(&mut self, sample: &Scored) {
        let index = (sample.probability * BINS as f64) as usize;
        let bin = &mut self.0[index.min(BINS - 1)];
        bin.samples += 1;
        bin.probability += sample.probability;
        bin.stable += sample.truth();
    }

    /// Expected calibration error, in [0, 1], best 0; `None` if there is no sample.
    pub(crate) fn calibration_error(&self) -> Option<f64> {
        let filled = self.0.iter().filter(|bin| bin.samples > 0);
        let apart = filled.map(|bin| {
            let samples = bin.samples as f64;
            samples * (bin.probability / samples - bin.stable / samples).abs()
        });
        let sum: f64 = apart.sum();
        let samples: usize = self.0.iter().map(|bin| bin.samples).sum();
        (samples > 0).then(|| sum / samples as f64)
    }
}

/// Angle between the vertical of the estimate and the true vertical in the sensor frame, 0 to 180 degrees.
#[must_use]
pub fn inclination_error_degrees(estimate: Quaternion, truth: Rotation) -> f64 {
    let estimated = Vector::from(estimate.up());
    let true_up = truth.to_sensor(Vector::new(0.0, 0.0, 1.0));
    estimated.angle_to(true_up).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    use samples::Label;

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

    fn sums(pairs: &[(f64, u8)]) -> Sums {
        let sample = |(probability, label): &(f64, u8)| Scored {
            time: Timestamp::from_micros(0),
            probability: *probability,
            label: match label {
                1 => Label::Stable,
                _ => Label::NotStable,
            },
        };
        let mut sums = Sums::default();
        pairs.iter().for_each(|pair| sums.add(&sample(pair)));
        sums
    }

    #[test]
    fn calibrated_probability_has_no_error() {
        let sums = sums(&[(0.25, 1), (0.25, 0), (0.25, 0), (0.25, 0), (1.0, 1), (0.0, 0)]);
        assert_eq!(sums.calibration_error(), Some(0.0));
    }

    #[test]
    fn bins_are_weighted_by_their_samples() {
        // Four at 0.9, half of them stable: distance 0.4; one at 0.1: distance 0.1.
        let sums = sums(&[(0.9, 1), (0.9, 0), (0.9, 1), (0.9, 0), (0.1, 0)]);
        let error = sums.calibration_error().unwrap();
        assert!((error - (4.0 * 0.4 + 0.1) / 5.0).abs() < 1e-12, "{error}");
    }

    #[test]
    fn bins_cover_both_ends() {
        // 0 is alone in the first bin; 0.95 and 1 are in the last, whose mean of 0.975 is 0.475 above its label of 0.5.
        let sums = sums(&[(0.0, 0), (1.0, 1), (0.95, 0)]);
        let error = sums.calibration_error().unwrap();
        assert!((error - 2.0 * 0.475 / 3.0).abs() < 1e-12, "{error}");
        assert_eq!(Sums::default().calibration_error(), None);
    }

    /// Rotation by an angle, degrees, about an axis of length 1.
    fn about(axis: Vector, degrees: f64) -> Rotation {
        let (sine, cosine) = (0.5 * degrees.to_radians()).sin_cos();
        Rotation { w: cosine, v: axis * sine }
    }

    #[test]
    fn error_is_the_tilt_without_the_heading() {
        let (x, z) = (Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 0.0, 1.0));
        for degrees in [0.001, 1.0, 90.0, 179.0] {
            let error = inclination_error_degrees(Quaternion::IDENTITY, about(x, degrees));
            assert!((error - degrees).abs() < 1e-9, "{error}");
            assert_eq!(inclination_error_degrees(Quaternion::IDENTITY, about(z, degrees)), 0.0);
        }
    }
}
