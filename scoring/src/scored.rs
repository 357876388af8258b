//! A probability beside the truth about it.

use estimator_core::{ContactEstimate, Timestamp};
use recordings::recording::{Label, RecordedSample};

/// The probability above which the answer is "stable".
pub const DECISION_THRESHOLD: f64 = 0.5;

/// A probability with the truth about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// When the sample was acquired.
    pub time: Timestamp,
    /// The estimated probability of stable contact, in [0, 1].
    pub probability: f64,
    /// Whether contact was stable.
    pub label: Label,
}

impl Scored {
    /// A sample with its total probability, where its label is known.
    #[must_use]
    pub fn of(sample: &RecordedSample, estimate: &ContactEstimate) -> Option<Self> {
        Some(Self {
            time: sample.imu.timestamp,
            probability: f64::from(estimate.probabilities.stable),
            label: sample.label?,
        })
    }

    /// The samples whose label is known, with their total probability.
    #[must_use]
    pub fn collect(samples: &[RecordedSample], estimates: &[ContactEstimate]) -> Vec<Self> {
        let pairs = samples.iter().zip(estimates);
        pairs
            .filter_map(|(sample, estimate)| Self::of(sample, estimate))
            .collect()
    }

    /// The label as a probability: 1 or 0.
    #[must_use]
    pub fn truth(&self) -> f64 {
        match self.label {
            Label::Stable => 1.0,
            Label::NotStable => 0.0,
        }
    }

    /// The answer that the probability gives.
    #[must_use]
    pub fn answer(&self) -> Label {
        if self.probability > DECISION_THRESHOLD {
            Label::Stable
        } else {
            Label::NotStable
        }
    }
}
