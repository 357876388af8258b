//! ARED: energy of the angular rate.
//!
//! ```text
//! T = 1/N Σ ‖ω_k‖²
//! ```
//!
//! Source: Skog et al. 2010, see [`shoe`](super::shoe). The division by the variance of the noise, a constant,
//! is left to the threshold.

use crate::window::{Reading, moving_mean, rate_energy};

/// Statistic at each sample, rad²/s².
#[must_use]
pub fn statistic(readings: &[Reading], window: usize) -> Vec<f64> {
    moving_mean(readings, window, rate_energy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistic_depends_on_the_angular_rate_only() {
        let readings = [
            [9.0, 9.0, 9.0, 0.0, 3.0, 4.0],
            [9.0, 9.0, 9.0, 0.0, 0.0, 0.0],
        ];
        assert_eq!(statistic(&readings, 2), [25.0, 12.5]);
    }
}
