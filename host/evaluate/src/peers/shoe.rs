//! SHOE: generalised likelihood-ratio test for standstill.
//!
//! ```text
//! T = 1/N Σ ( ‖a_k − g ā/‖ā‖‖² / σ_a² + ‖ω_k‖² / σ_ω² ), ā the window's mean
//! ```
//!
//! Source: I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, *Zero-Velocity Detection — An
//! Algorithm Evaluation*, IEEE Trans. Biomedical Engineering 57(11), 2010. If gravity has been removed
//! from the acceleration, g is 0.

use std::collections::VecDeque;

use estimator_core::Gravity;
use estimator_core::params::STANDARD_GRAVITY;

use crate::window::{Reading, acceleration_energy, over_windows, rate_energy};

/// Standard deviations by which SHOE scales the two sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of the acceleration, m/s².
    pub acceleration: f64,
    /// Standard deviation of the angular rate, rad/s.
    pub rate: f64,
}

/// Statistic at each sample.
#[must_use]
pub fn statistic(readings: &[Reading], window: usize, noise: Noise, gravity: Gravity) -> Vec<f64> {
    let gravity = match gravity {
        Gravity::Included => f64::from(STANDARD_GRAVITY),
        Gravity::Removed => 0.0,
    };
    over_windows(readings, window, |window| {
        let mean = |value: fn(&Reading) -> f64| mean(window, value);
        let [x, y, z] = [mean(|m| m[0]), mean(|m| m[1]), mean(|m| m[2])];
        let force = (x * x + y * y + z * z).sqrt();
        // The mean of ‖a_k − g ā/‖ā‖‖², multiplied out.
        let off_gravity = mean(acceleration_energy) - 2.0 * gravity * force + gravity * gravity;
        off_gravity / noise.acceleration.powi(2) + mean(rate_energy) / noise.rate.powi(2)
    })
}

fn mean(window: &VecDeque<Reading>, value: fn(&Reading) -> f64) -> f64 {
    window.iter().map(value).sum::<f64>() / window.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise {
        acceleration: 1.0,
        rate: 0.1,
    };

    #[test]
    fn sensors_are_scaled_by_their_noise() {
        let readings = [[2.0, 0.0, 0.0, 0.0, 0.3, 0.0], [0.0; 6]];
        let statistic = statistic(&readings, 2, NOISE, Gravity::Removed);
        assert!((statistic[0] - 13.0).abs() < 1e-9, "{statistic:?}");
        assert!((statistic[1] - 6.5).abs() < 1e-9, "{statistic:?}");
    }

    #[test]
    fn gravity_is_removed_along_the_mean_force() {
        let g = f64::from(STANDARD_GRAVITY);
        let tilted = [[0.6 * g, 0.0, -0.8 * g, 0.0, 0.0, 0.0]; 3];
        let at_rest = statistic(&tilted, 2, NOISE, Gravity::Included);
        assert!(at_rest.iter().all(|t| t.abs() < 1e-9), "{at_rest:?}");
        // 0.5 m/s² to either side of gravity, and along it.
        let aside = [[0.5, 0.0, g, 0.0, 0.0, 0.0], [-0.5, 0.0, g, 0.0, 0.0, 0.0]];
        let along = [[0.0, 0.0, g + 0.5, 0.0, 0.0, 0.0]; 2];
        for readings in [aside, along] {
            let moved = statistic(&readings, 2, NOISE, Gravity::Included)[1];
            assert!((moved - 0.25).abs() < 1e-9, "{moved}");
        }
    }
}
