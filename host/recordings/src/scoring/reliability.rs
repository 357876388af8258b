//! Reliability of a probability: among the samples with P near 0.8, four in five should be stable.
//!
//! Samples are sorted into [`BINS`] bins of equal width by their probability, as in M. P. Naeini,
//! G. F. Cooper, M. Hauskrecht, *Obtaining Well Calibrated Probabilities Using Bayesian Binning*,
//! AAAI 2015. A reliability diagram shows each bin's mean label over its mean probability; the
//! expected calibration error is their mean distance, weighted by the samples in the bin.

use serde::Serialize;

use crate::scoring::scored::Scored;

/// Number of bins over [0, 1].
pub const BINS: usize = 10;

/// The samples whose probability lies in one bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Bin {
    /// How many there are.
    pub samples: usize,
    /// Their mean probability, in [0, 1].
    pub probability: f64,
    /// The share of them that is stable, in [0, 1].
    pub stable: f64,
}

/// Bins that are not empty, in order of probability. A bin includes its lower end, the last one also 1.
#[must_use]
pub fn bins(scored: &[Scored]) -> Vec<Bin> {
    let mut sums = Sums::default();
    scored.iter().for_each(|sample| sums.add(sample));
    sums.bins()
}

/// Expected calibration error over [`bins`], in [0, 1], best 0; `None` if there is no sample.
#[must_use]
pub fn calibration_error(scored: &[Scored]) -> Option<f64> {
    let mut sums = Sums::default();
    scored.iter().for_each(|sample| sums.add(sample));
    sums.calibration_error()
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

    fn bins(&self) -> Vec<Bin> {
        let filled = self.0.iter().filter(|bin| bin.samples > 0);
        filled
            .map(|bin| Bin {
                samples: bin.samples,
                probability: bin.probability / bin.samples as f64,
                stable: bin.stable / bin.samples as f64,
            })
            .collect()
    }

    pub(crate) fn calibration_error(&self) -> Option<f64> {
        let apart = |bin: Bin| bin.samples as f64 * (bin.probability - bin.stable).abs();
        let samples: usize = self.0.iter().map(|bin| bin.samples).sum();
        let sum: f64 = self.bins().into_iter().map(apart).sum();
        (samples > 0).then(|| sum / samples as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::recording::Label;
    use estimator_core::Timestamp;

    fn scored(pairs: &[(f64, u8)]) -> Vec<Scored> {
        let sample = |(probability, label): &(f64, u8)| Scored {
            time: Timestamp::from_micros(0),
            probability: *probability,
            label: match label {
                1 => Label::Stable,
                _ => Label::NotStable,
            },
        };
        pairs.iter().map(sample).collect()
    }

    #[test]
    fn calibrated_probability_has_no_error() {
        let samples = scored(&[
            (0.25, 1),
            (0.25, 0),
            (0.25, 0),
            (0.25, 0),
            (1.0, 1),
            (0.0, 0),
        ]);
        assert_eq!(calibration_error(&samples), Some(0.0));
    }

    #[test]
    fn bins_are_weighted_by_their_samples() {
        // Four at 0.9, half of them stable: distance 0.4; one at 0.1: distance 0.1.
        let samples = scored(&[(0.9, 1), (0.9, 0), (0.9, 1), (0.9, 0), (0.1, 0)]);
        let error = calibration_error(&samples).unwrap();
        assert!((error - (4.0 * 0.4 + 0.1) / 5.0).abs() < 1e-12, "{error}");
    }

    #[test]
    fn bins_cover_both_ends_and_empty_bins_are_omitted() {
        let bins = bins(&scored(&[(0.0, 0), (1.0, 1), (0.95, 0)]));
        let samples: Vec<_> = bins.iter().map(|bin| bin.samples).collect();
        assert_eq!(samples, [1, 2]);
        assert_eq!(calibration_error(&[]), None);
    }
}
