//! Inclination error of an estimated orientation.
//!
//! The error is the angle between the vertical of the estimate and that of the truth. Heading is not
//! observable by an IMU on a foot, and gravity is removed by inclination only.

use estimator_core::Quaternion;

use crate::samples::space::{Rotation, Vector};

/// Angle between the vertical of the estimate and that of the truth in the sensor frame, 0 to 180 degrees.
#[must_use]
pub fn inclination_error_degrees(estimate: Quaternion, truth: Rotation) -> f64 {
    let estimated = Vector::from(estimate.up());
    let true_up = truth.to_sensor(Vector::new(0.0, 0.0, 1.0));
    estimated.angle_to(true_up).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
