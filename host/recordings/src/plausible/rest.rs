//! Accelerometer reading at rest, from the quietest accelerations.

use crate::samples::recording::RecordedSample;
use crate::samples::space::components;
use estimator_core::{Validity, Vec3};

use super::is_number;

/// Duration of a piece, s.
const PIECE_S: f32 = 0.1;

/// Share of the pieces that counts as rest.
const REST_SHARE: f64 = 0.1;

/// Largest deviation of a steady reading, as a fraction of it, …
const STEADY: f32 = 0.05;

/// … and the least number of its pieces.
const LEAST_PIECES: usize = 5;

/// Accelerometer reading at rest.
pub(super) struct Rest {
    /// Median of |a|, m/s².
    pub(super) size: f32,
    /// Mean, m/s².
    pub(super) mean: Vec3,
    /// Whether |a| is the same in all of it, as while a foot stands: a foot that moves at its quietest has no such
    /// reading.
    pub(super) is_steady: bool,
}

/// Collects the variance and mean of each piece of a recording.
pub(super) struct RestSearch {
    /// Samples per piece.
    length: usize,
    /// Samples in the current piece.
    samples: usize,
    sums: [f64; 3],
    squares: f64,
    /// Whether all its samples are valid.
    valid: bool,
    /// Variance and mean of the accelerations of each piece.
    pieces: Vec<(f32, Vec3)>,
}

impl RestSearch {
    pub(super) fn new(sample_rate: f32) -> Self {
        Self {
            length: (sample_rate * PIECE_S).max(5.0) as usize,
            samples: 0,
            sums: [0.0; 3],
            squares: 0.0,
            valid: true,
            pieces: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, sample: &RecordedSample) {
        // A reading beyond any sensor's range may be in another unit, which this check is to find.
        let force = sample.imu.specific_force.0;
        self.valid &= is_number(force) && sample.imu.validity == Validity::Valid;
        for (sum, value) in self.sums.iter_mut().zip(components(force)) {
            *sum += f64::from(value);
            self.squares += f64::from(value) * f64::from(value);
        }
        self.samples += 1;
        if self.samples == self.length {
            self.end_piece();
        }
    }

    fn end_piece(&mut self) {
        if self.valid {
            let mean = self.sums.map(|sum| sum / self.samples as f64);
            let squared_mean: f64 = mean.iter().map(|value| value * value).sum();
            let variance = self.squares / self.samples as f64 - squared_mean;
            let [x, y, z] = mean.map(|value| value as f32);
            self.pieces.push((variance.max(0.0) as f32, Vec3::new(x, y, z)));
        }
        (self.samples, self.sums, self.squares) = (0, [0.0; 3], 0.0);
        self.valid = true;
    }

    /// Reading at rest; `None` if too few samples are valid.
    pub(super) fn rest(&self) -> Option<Rest> {
        let mut pieces = self.pieces.clone();
        let count = ((pieces.len() as f64 * REST_SHARE).ceil() as usize).min(pieces.len());
        pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quiet = &pieces[..count];
        let mut sizes: Vec<f32> = quiet.iter().map(|(_, mean)| size(*mean)).collect();
        sizes.sort_by(f32::total_cmp);
        let mean = |component: fn(Vec3) -> f32| {
            let sum: f32 = quiet.iter().map(|(_, mean)| component(*mean)).sum();
            sum / count as f32
        };
        let size = *sizes.get(count / 2)?;
        let is_near = |other: &f32| (other - size).abs() < STEADY * size;
        let is_quiet = |(variance, _): &(f32, Vec3)| libm::sqrtf(*variance) < STEADY * size;
        Some(Rest {
            size,
            is_steady: count >= LEAST_PIECES
                && sizes.iter().all(is_near)
                && quiet.iter().all(is_quiet),
            mean: Vec3::new(mean(|v| v.x), mean(|v| v.y), mean(|v| v.z)),
        })
    }
}

/// Length of a vector.
pub(super) fn size(Vec3 { x, y, z }: Vec3) -> f32 {
    libm::sqrtf(x * x + y * y + z * z)
}
