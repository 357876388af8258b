//! Reliability of a probability: among the samples with P near 0.8, four in five should be stable.
//!
//! Samples are sorted into [`BINS`] bins of equal width by their probability, as in M. P. Naeini,
//! G. F. Cooper, M. Hauskrecht, *Obtaining Well Calibrated Probabilities Using Bayesian Binning*,
//! AAAI 2015. A reliability diagram shows each bin's mean label over its mean probability; the
//! expected calibration error is their mean distance, weighted by the samples in the bin.

use crate::scoring::scored::Scored;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::recording::Label;
    use estimator_core::Timestamp;

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
        let sums = sums(&[(0.0, 0), (1.0, 1), (0.95, 0)]);
        let samples: Vec<_> = sums.0.iter().map(|bin| bin.samples).collect();
        assert_eq!(samples, [1, 0, 0, 0, 0, 0, 0, 0, 0, 2]);
        assert_eq!(Sums::default().calibration_error(), None);
    }
}
