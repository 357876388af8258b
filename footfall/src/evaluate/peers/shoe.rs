//! SHOE: the generalised likelihood-ratio test for "does not move".
//!
//! ```text
//! T = 1/N Σ ( ‖a_k‖² / σ_a² + ‖ω_k‖² / σ_ω² )
//! ```
//!
//! Source: I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, *Zero-Velocity Detection — An
//! Algorithm Evaluation*, IEEE Trans. Biomedical Engineering 57(11), 2010. There gravity is in the
//! signal, and its direction is estimated by the window's mean acceleration; where it has been
//! removed, its length is 0 and that term falls away.

use crate::evaluate::window::{Motion, acceleration_energy, moving_mean, rate_energy};

/// The statistic at each sample. `sigma` is the noise of acceleration, m/s², and rate, rad/s.
#[must_use]
pub fn statistic(motions: &[Motion], window: usize, sigma: (f64, f64)) -> Vec<f64> {
    let (variance_a, variance_w) = (sigma.0.powi(2), sigma.1.powi(2));
    moving_mean(motions, window, |motion| {
        acceleration_energy(motion) / variance_a + rate_energy(motion) / variance_w
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sensor_counts_in_units_of_its_noise() {
        let motions = [[2.0, 0.0, 0.0, 0.0, 0.3, 0.0], [0.0; 6]];
        let statistic = statistic(&motions, 2, (1.0, 0.1));
        assert!((statistic[0] - 13.0).abs() < 1e-9, "{statistic:?}");
        assert!((statistic[1] - 6.5).abs() < 1e-9, "{statistic:?}");
    }
}
