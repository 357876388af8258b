//! Zero-velocity detectors, each as the standard deviation of a velocity measurement at each sample.
//!
//! | constant | value | source |
//! |---|---|---|
//! | σ of a yes | 0.01 m/s | `INS.py` at github.com/utiasSTARS/pyshoe, and `OpenShoe`, `settings.m` |
//! | `PyShoe`'s noise for SHOE | 0.00098 m/s², 8.7266463e-5 rad/s | `process_error_vicon.py` there |
//! | `PyShoe`'s γ | 5e7 | within the grid of 10⁵ to 10⁹ of `run_threshold_optimization.py`; that of `ins_demos.py` for its recording under `run` |
//!
//! Windows trail and have five samples: see [`published`].

use estimator_core::{ContactEstimate, Decision, Gravity, VelocityCoefficients, VelocityParams};

use super::walk::Walk;
use crate::peers::published;
use crate::peers::shoe::{self, Noise};

/// Standard deviation of the velocity if a binary detector reports that the foot stands, m/s.
pub const YES: f64 = 0.01;

/// Sensor noise of `PyShoe`.
const PYSHOE_NOISE: Noise = Noise {
    acceleration: 0.000_98,
    rate: 8.726_646_3e-5,
};

/// Threshold of `PyShoe`.
const PYSHOE_THRESHOLD: f64 = 5.0e7;

/// Lowest and highest threshold of SHOE in the search for the best of a walk, and their number.
const BEST_AMONG: (f64, f64, u32) = (1.0e6, 1.0e9, 25);

samples::named! {
    /// Source of zero-velocity measurements and their standard deviation.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ZeroVelocity {
        /// `sigma_v` at each sample.
        Sigma = "footfall, sigma_v",
        /// P above 0.9.
        NineTenths = "footfall, P > 0.9",
        /// P above 0.5.
        Half = "footfall, P > 0.5",
        /// This estimator's debounced decision.
        Decision = "footfall, decision",
        /// SHOE with the constants of `PyShoe`.
        PyShoe = "SHOE, constants of PyShoe",
        /// SHOE with the constants of `OpenShoe`.
        OpenShoe = "SHOE, constants of OpenShoe",
        /// ARED with the constants of `OpenShoe`.
        Ared = "ARED, constants of OpenShoe",
        /// SHOE with the best threshold for this walk, by its truth.
        BestShoe = "SHOE, best threshold of each walk",
    }
}

impl ZeroVelocity {
    /// Candidate standard deviations at each sample, m/s, `None` without a measurement. If there are several
    /// candidates, the best by the truth is used.
    #[must_use]
    pub fn candidates(self, walk: &Walk) -> Vec<Vec<Option<f64>>> {
        let of_estimates = |is_stable: fn(&ContactEstimate) -> bool| {
            let estimates = walk.estimates.iter();
            vec![estimates.map(|of| is_stable(of).then_some(YES)).collect()]
        };
        let pyshoe = || {
            let window = published::FEWEST_SAMPLES;
            shoe::statistic(
                &walk.labelled.readings,
                window,
                PYSHOE_NOISE,
                Gravity::Included,
            )
        };
        match self {
            Self::Sigma => vec![sigmas(&walk.estimates, &VelocityParams::DEFAULT)],
            Self::Decision => of_estimates(|of| of.decision == Decision::Stable),
            Self::Half => of_estimates(|of| of.probabilities.stable > 0.5),
            Self::NineTenths => of_estimates(|of| of.probabilities.stable > 0.9),
            Self::OpenShoe => vec![above(&published::shoe(&walk.labelled))],
            Self::Ared => vec![above(&published::ared(&walk.labelled))],
            Self::PyShoe => vec![below(&pyshoe(), PYSHOE_THRESHOLD)],
            Self::BestShoe => {
                let statistic = pyshoe();
                let (least, most, count) = BEST_AMONG;
                let step = libm::pow(most / least, 1.0 / f64::from(count - 1));
                (0..count)
                    .map(|k| below(&statistic, least * libm::pow(step, f64::from(k))))
                    .collect()
            }
        }
    }
}

/// Standard deviation of the zero-velocity measurement at each sample with these parameters, m/s.
#[must_use]
pub fn sigmas(estimates: &[ContactEstimate], params: &VelocityParams) -> Vec<Option<f64>> {
    let coefficients = VelocityCoefficients::new(params);
    let sigma = |of: &ContactEstimate| {
        coefficients.sigma(of.probabilities.stable, of.angular_rate.0, of.flags)
    };
    let sigmas = estimates.iter().map(sigma);
    sigmas.map(|sigma| Some(f64::from(sigma.0))).collect()
}

fn above(scores: &[f64]) -> Vec<Option<f64>> {
    let measured = |score: &f64| (*score > -published::THRESHOLD).then_some(YES);
    scores.iter().map(measured).collect()
}

fn below(statistic: &[f64], threshold: f64) -> Vec<Option<f64>> {
    let measured = |value: &f64| (*value < threshold).then_some(YES);
    statistic.iter().map(measured).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_parameters_give_the_estimators_sigma() {
        let estimate = ContactEstimate::default();
        assert_eq!(sigmas(&[estimate], &VelocityParams::DEFAULT), [Some(100.0)]);
    }

    #[test]
    fn small_statistic_yields_a_measurement() {
        assert_eq!(below(&[1.0, 3.0], 2.0), [Some(YES), None]);
        assert_eq!(above(&[-2.9e4, -3.1e4]), [Some(YES), None]);
    }
}
