//! The accelerometer's reading at rest: the tenth of the recording with the quietest accelerations, in pieces of 0.1 s.

use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Gravity, Validity, Vec3};
use samples::space::components;
use samples::{RecordedSample, Recording};

/// Gravity as read by the accelerometer at rest, m/s²; it points up. `None` if it was removed or if the reading
/// cannot be gravity.
#[must_use]
pub fn gravity_at_rest(recording: &Recording) -> Option<Vec3> {
    let mut search = RestSearch::new(recording.sample_rate);
    for sample in &recording.samples {
        search.add(sample);
    }
    let rest = search.rest()?;
    let is_gravity = recording.gravity == Gravity::Included && has_gravity(&rest);
    is_gravity.then_some(rest.mean)
}

/// Duration of a piece, s.
const PIECE_S: f32 = 0.1;

/// Share of the pieces that counts as rest.
const REST_SHARE: f64 = 0.1;

/// Largest deviation of a steady reading, as a fraction of the reading.
const STEADY: f32 = 0.05;

/// Smallest number of pieces in a steady reading.
const LEAST_PIECES: usize = 5;

/// Tolerance of |a| at rest, as a factor.
const NEAR: f32 = 1.2;

/// Accelerometer reading at rest.
pub(crate) struct Rest {
    /// Median of |a|, m/s².
    pub(crate) size: f32,
    /// Mean, m/s².
    pub(crate) mean: Vec3,
    /// Whether |a| is the same throughout the rest, as while a foot stands. A foot that never stops moving has no
    /// such rest.
    pub(crate) is_steady: bool,
}

/// Collects the variance and mean of each piece of a recording.
pub(crate) struct RestSearch {
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
    pub(crate) fn new(sample_rate: f32) -> Self {
        Self {
            length: (sample_rate * PIECE_S).max(5.0) as usize,
            samples: 0,
            sums: [0.0; 3],
            squares: 0.0,
            valid: true,
            pieces: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, sample: &RecordedSample) {
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
    pub(crate) fn rest(&self) -> Option<Rest> {
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
pub(crate) fn size(Vec3 { x, y, z }: Vec3) -> f32 {
    libm::sqrtf(x * x + y * y + z * z)
}

/// Returns whether all components are finite.
pub(crate) const fn is_number(v: Vec3) -> bool {
    v.x.is_finite() && v.y.is_finite() && v.z.is_finite()
}

/// Returns whether the reading at rest is as large as gravity.
pub(crate) fn has_gravity(rest: &Rest) -> bool {
    is_near(rest.size, STANDARD_GRAVITY)
}

pub(crate) fn is_near(value: f32, expected: f32) -> bool {
    (expected / NEAR..=expected * NEAR).contains(&value)
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::fixtures::{scaled, walk, with_force};

    #[test]
    fn gravity_at_rest_is_returned_if_present() {
        let up = gravity_at_rest(&walk()).expect("gravity");
        assert!((up - Vec3::new(0.0, 0.0, 9.81)).length() < 0.1, "{up:?}");
        let removed = Recording { gravity: Gravity::Removed, ..walk() };
        assert_eq!(gravity_at_rest(&removed), None);
        assert_eq!(gravity_at_rest(&with_force(scaled(0.1))), None);
    }
}
