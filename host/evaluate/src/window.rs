//! Trailing windows over readings, for published detectors.

use std::collections::VecDeque;

/// Duration of the paper's window, s: 50 samples at 1 kHz. At other rates, the duration is kept and not the
/// number of samples, for the paper's preset and for all peers with a tuned threshold.
pub const PAPER_WINDOW: f32 = 0.05;

/// The six readings of a sample: ax, ay, az in m/s², wx, wy, wz in rad/s.
pub type Reading = [f64; 6];

/// Computes a statistic over each sample's trailing window of `length` samples, itself included; at the start,
/// over the samples so far.
pub fn over_windows(
    readings: &[Reading],
    length: usize,
    mut statistic: impl FnMut(&VecDeque<Reading>) -> f64,
) -> Vec<f64> {
    let mut window = VecDeque::with_capacity(length + 1);
    let of_sample = |reading: &Reading| {
        window.push_back(*reading);
        if window.len() > length {
            window.pop_front();
        }
        statistic(&window)
    };
    readings.iter().map(of_sample).collect()
}

/// Mean of a value per sample over each trailing window.
pub fn moving_mean(
    readings: &[Reading],
    length: usize,
    value: impl Fn(&Reading) -> f64,
) -> Vec<f64> {
    over_windows(readings, length, |window| {
        window.iter().map(&value).sum::<f64>() / window.len() as f64
    })
}

/// Squared length of the acceleration, m²/s⁴.
pub fn acceleration_energy([x, y, z, ..]: &Reading) -> f64 {
    x * x + y * y + z * z
}

/// Squared length of the angular rate, rad²/s².
pub fn rate_energy([_, _, _, x, y, z]: &Reading) -> f64 {
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_ends_with_its_sample() {
        let readings: Vec<Reading> = (0..5).map(|k| [f64::from(k); 6]).collect();
        let means = moving_mean(&readings, 3, |reading| reading[0]);
        assert_eq!(means, [0.0, 0.5, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn energies_are_squared_lengths() {
        let reading = [1.0, 2.0, 2.0, 2.0, 3.0, 6.0];
        assert_eq!(acceleration_energy(&reading), 9.0);
        assert_eq!(rate_energy(&reading), 49.0);
    }
}
