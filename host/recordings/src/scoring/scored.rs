//! Probability with the truth.

use crate::samples::recording::{Label, RecordedSample};
use estimator_core::{ContactEstimate, Timestamp};

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
