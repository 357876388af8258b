//! ARED: the angular rate's energy.
//!
//! ```text
//! T = 1/N Σ ‖ω_k‖²
//! ```
//!
//! Source: Skog et al. 2010, as of [`shoe`](super::shoe), where the noise's variance divides it: a
//! constant, which the threshold takes up.

use crate::window::{Reading, moving_mean, rate_energy};

/// The statistic at each sample, rad²/s².
#[must_use]
pub fn statistic(readings: &[Reading], window: usize) -> Vec<f64> {
    moving_mean(readings, window, rate_energy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_turning_counts() {
        let readings = [
            [9.0, 9.0, 9.0, 0.0, 3.0, 4.0],
            [9.0, 9.0, 9.0, 0.0, 0.0, 0.0],
        ];
        assert_eq!(statistic(&readings, 2), [25.0, 12.5]);
    }
}
