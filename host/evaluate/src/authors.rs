//! The method as computed by its authors' script, which is not causal.
//!
//! Differences from the formula, all as published in `offline/src` of
//! <https://github.com/MichaelMarav/ProbabilisticContactEstimation>:
//!
//! * The window of a sample begins with it and looks ahead. The first window's result is used for
//!   all of its samples, and the samples of the last window have no result.
//! * The density is summed at [`POINTS`] points from −δ to δ, both ends in full, times their
//!   distance, which is more than the integral; each axis is rounded to four decimals.

use std::f64::consts::PI;

use estimator_core::Params;

use crate::window::Reading;

/// Number of points at which the density is evaluated.
pub const POINTS: u32 = 50;

/// P(stable) per sample for windows of `length` samples, without the samples of the last window. Only the
/// bandwidths and half-widths of `params` are used.
#[must_use]
pub fn probabilities(readings: &[Reading], length: usize, params: &Params) -> Vec<f64> {
    let bandwidths = params.bandwidth.to_array().map(f64::from);
    let half_widths = params.half_width.to_array().map(f64::from);
    // The density of a window is a sum over its samples, so each sample's part is computed once.
    let masses: Vec<[f64; 6]> = readings
        .iter()
        .map(|reading| std::array::from_fn(|i| mass(reading[i], bandwidths[i], half_widths[i])))
        .collect();
    let of_window = |window: &[[f64; 6]]| -> f64 {
        let axis = |i: usize| window.iter().map(|mass| mass[i]).sum::<f64>() / length as f64;
        (0..6).map(|i| (axis(i) * 1.0e4).round() / 1.0e4).product()
    };
    let scored = readings.len().saturating_sub(length);
    let first = |sample: usize| if sample < length { 0 } else { sample };
    (0..scored)
        .map(|sample| of_window(&masses[first(sample)..first(sample) + length]))
        .collect()
}

/// Integrates one sample's kernel by the rectangle rule.
fn mass(value: f64, bandwidth: f64, half_width: f64) -> f64 {
    let step = 2.0 * half_width / f64::from(POINTS - 1);
    let points = (0..POINTS).map(|k| f64::from(k) * step - half_width);
    let kernel = |x: f64| libm::exp(-0.5 * ((x - value) / bandwidth).powi(2));
    points.map(kernel).sum::<f64>() * step / (bandwidth * (2.0 * PI).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step_at(start: usize, samples: usize) -> Vec<Reading> {
        let reading = |k| if k < start { [0.0; 6] } else { [9.0; 6] };
        (0..samples).map(reading).collect()
    }

    #[test]
    fn motion_is_detected_before_it_begins() {
        let p = probabilities(&step_at(200, 300), 50, &Params::PAPER);
        assert!(p[150] > 0.9, "{}", p[150]);
        assert!(p[175] < 0.1, "{}", p[175]);
        assert_eq!(p.len(), 250);
    }

    #[test]
    fn first_window_result_applies_to_all_its_samples() {
        let p = probabilities(&step_at(20, 300), 50, &Params::PAPER);
        assert!(p[..50].iter().all(|early| *early == p[0]));
    }

    #[test]
    fn rectangle_rule_exceeds_the_integral() {
        // At the edge of the interval, half of the kernel lies inside.
        let whole = mass(0.04, 0.016_53, 0.04);
        assert!(whole > 0.5 && whole < 0.6, "{whole}");
    }
}
