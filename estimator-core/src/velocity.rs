//! Standard deviation of "the foot's velocity is zero", for a state estimator that uses the foot as a
//! velocity measurement at each sample instead of switching it on and off.
//!
//! ```text
//! σ² = (s (1 − P)/P)² + (r |ω|)² + σ₀²
//! ```
//!
//! σ grows with the odds against a stance. With their root a swing in which P is 0.05 would count as a measurement of
//! ±0.2 m/s at each sample, and the samples of a swing together as one of a few cm/s.
//!
//! s is the speed at even odds (P = ½), r the distance between the IMU and the point about which a standing
//! foot turns, and σ₀ the least σ. The measurement is zero velocity of the IMU, in any frame, with
//! the covariance σ² I. `docs/reference/evaluation.md` compares it with zero-velocity detectors.

use crate::flags::Flags;
use crate::math::{Order, sqrt};
use crate::vector::Vec3;

/// Parameters of the standard deviation of the zero-velocity measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityParams {
    /// Standard deviation s at P = ½ of a foot that does not turn, m/s.
    ///
    /// Default: 0.05 m/s, chosen on walks of a shoe: see `docs/reference/evaluation.md`.
    pub speed: f32,
    /// Distance r between the IMU and the point about which a standing foot turns, m.
    ///
    /// Default: 0.15 m, from the heel to the ball of a foot that rolls. For a robot's point foot it is the
    /// distance from the IMU to the ground.
    pub lever: f32,
    /// Least standard deviation σ₀, m/s, of a foot that certainly stands.
    ///
    /// Default: 0.003 m/s, for the creep of a sole and the error of an IMU at rest.
    pub floor: f32,
}

impl Default for VelocityParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl VelocityParams {
    /// For any foot of a person or of a legged robot of similar size; each field states its default and the reason.
    pub const DEFAULT: Self = Self { speed: 0.05, lever: 0.15, floor: 0.003 };
}

/// Standard deviation of the velocity of a foot, each axis, m/s: above 0 and at most
/// [`Self::MOST`].
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VelocitySigma(pub f32);

impl VelocitySigma {
    /// The largest value: no information about the velocity.
    pub const MOST: Self = Self(100.0);
}

impl Default for VelocitySigma {
    fn default() -> Self {
        Self::MOST
    }
}

/// Squares of [`VelocityParams`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityCoefficients {
    /// (m/s)².
    speed: f32,
    /// m².
    lever: f32,
    /// (m/s)².
    floor: f32,
}

impl VelocityCoefficients {
    /// Coefficients of any parameters; those rejected by [`Params::validate`](crate::Params::validate)
    /// give [`VelocitySigma::MOST`] or a number below it.
    #[must_use]
    pub const fn new(params: &VelocityParams) -> Self {
        Self {
            speed: params.speed * params.speed,
            lever: params.lever * params.lever,
            floor: params.floor * params.floor,
        }
    }

    /// Returns the standard deviation for a probability of stable contact in [0, 1] and an angular rate, rad/s.
    ///
    /// Total: never NaN. The result is [`VelocitySigma::MOST`] if the probability is 0 or not a number, and if
    /// `flags` are [doubt](Flags::are_doubt).
    #[must_use]
    pub fn sigma(&self, probability: f32, rate: Vec3, flags: Flags) -> VelocitySigma {
        const MOST: f32 = VelocitySigma::MOST.0 * VelocitySigma::MOST.0;
        // A NaN fails both comparisons.
        if probability > 0.0 && !flags.are_doubt() {
            let odds_against = (1.0 - probability.lesser(1.0)) / probability;
            let variance = self.speed * (odds_against * odds_against)
                + self.lever * rate.dot(rate)
                + self.floor;
            if variance < MOST {
                return VelocitySigma(sqrt(variance));
            }
        }
        VelocitySigma::MOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flags::Flag;

    const COEFFICIENTS: VelocityCoefficients =
        VelocityCoefficients::new(&VelocityParams { speed: 0.2, lever: 0.1, floor: 0.003 });

    fn sigma(probability: f32, rate: f32) -> f32 {
        let rate = Vec3::new(0.0, 0.6 * rate, 0.8 * rate);
        COEFFICIENTS.sigma(probability, rate, Flags::NONE).0
    }

    #[test]
    fn each_term_is_in_metres_per_second() {
        for (probability, rate, expected) in [
            (1.0, 0.0, 0.003),
            (0.5, 0.0, 0.2_f32.hypot(0.003)),
            (0.2, 0.0, 0.8_f32.hypot(0.003)),
            (1.0, 2.0, 0.2_f32.hypot(0.003)),
            (0.5, 2.0, 0.2_f32.hypot(0.2).hypot(0.003)),
        ] {
            let found = sigma(probability, rate);
            assert!((found / expected - 1.0).abs() < 1.0e-5, "{found}");
        }
    }

    #[test]
    fn vanishing_probability_gives_the_largest_value() {
        for probability in [0.0, -1.0, f32::NAN, 1.0e-9, f32::MIN_POSITIVE] {
            assert_eq!(sigma(probability, 0.0), 100.0, "{probability}");
        }
    }

    #[test]
    fn nan_or_huge_rate_gives_the_largest_value() {
        for rate in [f32::NAN, f32::INFINITY, 1.0e4] {
            assert_eq!(sigma(1.0, rate), 100.0, "{rate}");
        }
    }

    #[test]
    fn doubt_gives_the_largest_value() {
        for flag in Flag::ALL {
            let flags = Flags::NONE.with(flag);
            let VelocitySigma(found) = COEFFICIENTS.sigma(1.0, Vec3::ZERO, flags);
            let is_largest = found == 100.0;
            assert_eq!(is_largest, flags.are_doubt(), "{flag:?}: {found}");
        }
    }

    #[test]
    fn sigma_falls_with_p_and_rises_with_the_rate() {
        let mut above = f32::INFINITY;
        for hundredths in 0..=100_u8 {
            let found = sigma(f32::from(hundredths) / 100.0, 0.5);
            assert!(found < above && sigma(f32::from(hundredths) / 100.0, 0.6) >= found);
            above = found;
        }
    }
}
