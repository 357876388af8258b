//! Inclination error of an estimated orientation.
//!
//! The error is the angle between the vertical of the estimate and that of the truth. Heading is not
//! observable by an IMU on a foot, and gravity is removed by inclination only.

use estimator_core::{ContactEstimate, Quaternion};
use serde::Serialize;

use crate::samples::recording::Recording;
use crate::samples::space::{Rotation, Vector};

/// Angle between the vertical of the estimate and that of the truth in the sensor frame, 0 to 180 degrees.
#[must_use]
pub fn inclination_error_degrees(estimate: Quaternion, truth: Rotation) -> f64 {
    let estimated = Vector::from(estimate.up());
    let true_up = truth.to_sensor(Vector::new(0.0, 0.0, 1.0));
    estimated.angle_to(true_up).to_degrees()
}

/// The inclination errors of one recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InclinationScore {
    /// The recording's name.
    pub recording: String,
    /// How many samples counted.
    pub scored_samples: usize,
    /// Root of the mean square, degrees.
    pub rms_deg: f64,
    /// 95th percentile of the errors, degrees.
    pub p95_deg: f64,
}

impl InclinationScore {
    /// Scores the estimates of a recording, one per sample, at samples with a known truth; the errors are zero
    /// if there are none.
    #[must_use]
    pub fn of(
        recording: &Recording,
        estimates: &[ContactEstimate],
        truth: &[Option<Rotation>],
    ) -> Self {
        let mut errors: Vec<f64> = estimates
            .iter()
            .zip(truth)
            .filter_map(|(estimate, truth)| {
                Some(inclination_error_degrees(estimate.orientation, (*truth)?))
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        let count = errors.len();
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        // Nearest-rank method.
        let rank = (0.95 * count as f64).ceil() as usize;
        Self {
            recording: recording.name.clone(),
            scored_samples: count,
            rms_deg: (squares / count.max(1) as f64).sqrt(),
            p95_deg: errors.get(rank.saturating_sub(1)).copied().unwrap_or(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Gravity;

    fn recording() -> Recording {
        Recording {
            name: "turning".to_owned(),
            sample_rate: 100.0,
            gravity: Gravity::Included,
            load_title: String::new(),
            samples: Vec::new(),
        }
    }

    /// Rotation by an angle, degrees, about an axis of length 1.
    fn about(axis: Vector, degrees: f64) -> Rotation {
        let (sine, cosine) = (0.5 * degrees.to_radians()).sin_cos();
        Rotation { w: cosine, v: axis * sine }
    }

    #[test]
    fn error_is_the_tilt_without_the_heading() {
        let (x, z) = (Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 0.0, 1.0));
        for degrees in [0.001, 1.0, 90.0, 179.0] {
            let error = inclination_error_degrees(Quaternion::IDENTITY, about(x, degrees));
            assert!((error - degrees).abs() < 1e-9, "{error}");
            assert_eq!(inclination_error_degrees(Quaternion::IDENTITY, about(z, degrees)), 0.0);
        }
    }

    #[test]
    fn samples_without_a_truth_are_not_scored() {
        let x = Vector::new(1.0, 0.0, 0.0);
        let estimates = vec![ContactEstimate::default(); 102];
        let mut truth: Vec<_> = (1..=100).map(|k| Some(about(x, f64::from(k)))).collect();
        truth.extend([None, None]);
        let score = InclinationScore::of(&recording(), &estimates, &truth);
        assert_eq!(score.scored_samples, 100);
        assert!((score.p95_deg - 95.0).abs() < 1e-9, "{score:?}");
        // Σk² = 338 350.
        assert!((score.rms_deg - 3383.5_f64.sqrt()).abs() < 1e-9);
    }
}
