//! From the paper's P to a probability that means what it says: the optional calibrated output.
//!
//! P is the share of a window's density within half-widths. It ranks well, but nothing makes it
//! come true as often as it says. Labels do: the map
//!
//! ```text
//! logit q = slope · logit P + offset
//! ```
//!
//! is fitted to them by logistic regression (J. Platt, *Probabilistic Outputs for Support Vector
//! Machines*, 1999). It is monotone, so ranking and ROC-AUC stay what they are. Two numbers do not
//! bend to one recording. It belongs to a robot and its labels, wherefore there is no default, and
//! to hosts, as it takes logarithms: the foot sends P.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::metrics::Scored;

/// P is taken for at least this and at most 1 minus this: an exact 0 or 1 says that a window of
/// fifty samples showed nothing else, not that nothing else can be.
pub const LEAST: f64 = 0.01;

/// A monotone map of [0, 1] to (0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(try_from = "Fields")]
pub struct ProbabilityMap {
    slope: f64,
    offset: f64,
}

/// A map as it is written, unchecked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    slope: f64,
    offset: f64,
}

impl TryFrom<Fields> for ProbabilityMap {
    type Error = String;

    fn try_from(Fields { slope, offset }: Fields) -> Result<Self, String> {
        if !(0.0..=100.0).contains(&slope) {
            return Err(format!("slope is {slope}, allowed is 0 to 100"));
        }
        if !(-100.0..=100.0).contains(&offset) {
            return Err(format!("offset is {offset}, allowed is -100 to 100"));
        }
        Ok(Self { slope, offset })
    }
}

impl ProbabilityMap {
    /// What leaves P as it is, but for its ends.
    pub const IDENTITY: Self = Self {
        slope: 1.0,
        offset: 0.0,
    };

    /// How many units of log-odds one unit of log-odds of P makes, 0 to 100.
    #[must_use]
    pub const fn slope(&self) -> f64 {
        self.slope
    }

    /// The log-odds at P = 0.5, −100 to 100.
    #[must_use]
    pub const fn offset(&self) -> f64 {
        self.offset
    }

    /// The calibrated probability.
    #[must_use]
    pub fn apply(&self, probability: f64) -> f64 {
        logistic(self.slope * logit(probability) + self.offset)
    }

    /// The map under which these labels are the most likely; never a falling one. `None` where only
    /// one label occurs, which every offset to that side explains better than the one before.
    #[must_use]
    pub fn learn(scored: &[Scored]) -> Option<Self> {
        let stable = scored.iter().map(Scored::truth).sum::<f64>();
        if stable == 0.0 || stable == scored.len() as f64 {
            return None;
        }
        let points: Vec<_> = scored
            .iter()
            .map(|s| (logit(s.probability), s.truth()))
            .collect();
        let mut map = Self::IDENTITY;
        for _ in 0..NEWTON_STEPS {
            map = map.improved(&points);
        }
        if map.slope > 0.0 {
            return Some(map);
        }
        let share = stable / scored.len() as f64;
        Some(Self {
            slope: 0.0,
            offset: (share / (1.0 - share)).ln(),
        })
    }

    /// After one of Newton's steps up the likelihood, which has one summit. Far from it a whole step
    /// may overshoot: it is halved until it leads up.
    fn improved(self, points: &[(f64, f64)]) -> Self {
        let (mut gradient, mut hessian) = ([-RIDGE * self.slope, -RIDGE * self.offset], [0.0; 3]);
        for (x, truth) in points {
            let q = logistic(self.slope * x + self.offset);
            let (error, weight) = (truth - q, q * (1.0 - q));
            gradient[0] += error * x;
            gradient[1] += error;
            hessian[0] += weight * x * x;
            hessian[1] += weight * x;
            hessian[2] += weight;
        }
        hessian[0] += RIDGE;
        hessian[2] += RIDGE;
        let determinant = hessian[0] * hessian[2] - hessian[1] * hessian[1];
        let slope = (hessian[2] * gradient[0] - hessian[1] * gradient[1]) / determinant;
        let offset = (hessian[0] * gradient[1] - hessian[1] * gradient[0]) / determinant;
        let before = self.log_likelihood(points);
        let halved = (0..HALVINGS).map(|k| 0.5_f64.powi(k));
        halved
            .map(|part| Self {
                slope: self.slope + part * slope,
                offset: self.offset + part * offset,
            })
            .find(|map| map.log_likelihood(points) > before)
            .unwrap_or(self)
    }

    fn log_likelihood(self, points: &[(f64, f64)]) -> f64 {
        let of_label = |(x, truth): &(f64, f64)| {
            let log_odds = self.slope * x + self.offset;
            let against = if *truth > 0.5 { -log_odds } else { log_odds };
            // ln(1 + e^z), with nothing that overflows.
            -(against.max(0.0) + libm::log1p(libm::exp(-against.abs())))
        };
        let size = self.slope.powi(2) + self.offset.powi(2);
        points.iter().map(of_label).sum::<f64>() - 0.5 * RIDGE * size
    }
}

impl fmt::Display for ProbabilityMap {
    /// As a configuration file calls it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { slope, offset } = self;
        write!(f, "[probability_map] slope {slope:.3}, offset {offset:.3}")
    }
}

/// Newton's method doubles the digits with each step; from the identity a few are enough.
const NEWTON_STEPS: usize = 20;

const HALVINGS: i32 = 20;

/// Weight of the wish for small numbers. So little that it matters only where all P are alike or
/// labels are told apart for sure, when the likelihood has no summit.
const RIDGE: f64 = 1.0e-3;

fn logit(probability: f64) -> f64 {
    let p = probability.clamp(LEAST, 1.0 - LEAST);
    libm::log(p / (1.0 - p))
}

fn logistic(log_odds: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-log_odds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::roc_auc;
    use crate::recording::Label;
    use crate::reliability::calibration_error;
    use estimator_core::Timestamp;

    /// Samples that say 0.05, 0.15, … and come true with a probability that `truth` makes of it.
    fn samples(truth: impl Fn(f64) -> f64) -> Vec<Scored> {
        let each = |bin: u32| {
            let probability = 0.05 + 0.1 * f64::from(bin);
            let stable = (1000.0 * truth(probability)).round() as u32;
            (0..1000).map(move |k| Scored {
                time: Timestamp::from_micros(0),
                probability,
                label: if k < stable {
                    Label::Stable
                } else {
                    Label::NotStable
                },
            })
        };
        (0..10).flat_map(each).collect()
    }

    fn mapped(samples: &[Scored], map: ProbabilityMap) -> Vec<Scored> {
        let through = |sample: &Scored| Scored {
            probability: map.apply(sample.probability),
            ..*sample
        };
        samples.iter().map(through).collect()
    }

    #[test]
    fn a_probability_that_means_what_it_says_is_left_alone() {
        let map = ProbabilityMap::learn(&samples(|p| p)).unwrap();
        for k in 1..100 {
            let p = f64::from(k) / 100.0;
            assert!(
                (map.apply(p) - p).abs() < 0.002,
                "{p} became {}",
                map.apply(p)
            );
        }
    }

    #[test]
    fn what_is_learnt_is_the_map_that_made_the_labels() {
        let made = ProbabilityMap {
            slope: 0.6,
            offset: -1.2,
        };
        let samples = samples(|p| made.apply(p));
        let learnt = ProbabilityMap::learn(&samples).unwrap();
        assert!((learnt.slope - 0.6).abs() < 0.01, "{learnt:?}");
        assert!((learnt.offset + 1.2).abs() < 0.01, "{learnt:?}");
        assert!(calibration_error(&samples).unwrap() > 0.2);
        assert!(calibration_error(&mapped(&samples, learnt)).unwrap() < 0.002);
    }

    #[test]
    fn a_probability_that_is_nearly_always_certain_teaches_as_well() {
        // A whole step of Newton's from the identity would leave for good.
        let certain = |probability, label, count| {
            (0..count).map(move |_| Scored {
                time: Timestamp::from_micros(0),
                probability,
                label,
            })
        };
        let samples: Vec<_> = certain(1.0, Label::Stable, 600)
            .chain(certain(1.0, Label::NotStable, 400))
            .chain(certain(0.0, Label::Stable, 400))
            .chain(certain(0.0, Label::NotStable, 9600))
            .collect();
        let map = ProbabilityMap::learn(&samples).unwrap();
        assert!((map.apply(1.0) - 0.6).abs() < 1e-3, "{map:?}");
        assert!((map.apply(0.0) - 0.04).abs() < 1e-3, "{map:?}");
    }

    #[test]
    fn the_order_of_samples_stays_what_it_is() {
        let samples = samples(|p| p * p);
        let map = ProbabilityMap::learn(&samples).unwrap();
        assert_eq!(roc_auc(&samples), roc_auc(&mapped(&samples, map)));
    }

    #[test]
    fn labels_against_the_probability_make_a_level_map_and_not_a_falling_one() {
        let map = ProbabilityMap::learn(&samples(|p| 0.9 - 0.8 * p)).unwrap();
        assert_eq!(map.slope(), 0.0);
        assert!((map.apply(0.0) - 0.5).abs() < 0.001);
    }

    #[test]
    fn labels_that_are_told_apart_for_sure_give_a_steep_map_and_no_nonsense() {
        let samples = samples(|p| f64::from(u8::from(p > 0.5)));
        let map = ProbabilityMap::learn(&samples).unwrap();
        assert!(map.apply(0.65) > 0.99 && map.apply(0.35) < 0.01, "{map:?}");
    }

    #[test]
    fn one_label_alone_teaches_nothing() {
        assert_eq!(ProbabilityMap::learn(&samples(|_| 1.0)), None);
        assert_eq!(ProbabilityMap::learn(&[]), None);
    }

    #[test]
    fn a_falling_map_is_refused() {
        let error = toml::from_str::<ProbabilityMap>("slope = -1.0\noffset = 0.0").unwrap_err();
        assert!(
            error
                .to_string()
                .contains("slope is -1, allowed is 0 to 100")
        );
    }
}
