//! AMVD: moving variance of the acceleration.
//!
//! ```text
//! T = 1/N Σ ‖a_k − ā‖², ā the window's mean
//! ```
//!
//! Source: Skog et al. 2010, see [`shoe`](super::shoe). The division by the variance of the noise, a constant,
//! is left to the threshold.

use crate::window::{Reading, over_windows};

/// Statistic at each sample, m²/s⁴.
#[must_use]
pub fn statistic(readings: &[Reading], window: usize) -> Vec<f64> {
    over_windows(readings, window, |window| {
        let samples = window.len() as f64;
        (0..3)
            .map(|axis| {
                let mean = window.iter().map(|m| m[axis]).sum::<f64>() / samples;
                let squares = window.iter().map(|m| (m[axis] - mean).powi(2));
                squares.sum::<f64>() / samples
            })
            .sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_acceleration_counts_as_rest() {
        assert_eq!(statistic(&[[3.0; 6]; 4], 3), [0.0; 4]);
    }

    #[test]
    fn variances_of_the_axes_add_up() {
        let readings = [
            [1.0, 0.0, 2.0, 9.0, 9.0, 9.0],
            [-1.0, 0.0, -2.0, 0.0, 0.0, 0.0],
        ];
        assert_eq!(statistic(&readings, 2)[1], 1.0 + 4.0);
    }
}
