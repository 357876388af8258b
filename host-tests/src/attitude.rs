//! How far an estimated orientation is from the truth.

use estimator_core::Quaternion;
use footfall::gait::space::{Rotation, Vector};

/// The angle in degrees between where the estimate and the truth have up, in the sensor frame.
/// Heading does not count.
#[must_use]
pub fn inclination_error_degrees(estimate: Quaternion, truth: Rotation) -> f64 {
    let up = estimate.up();
    let estimated = [up.x, up.y, up.z].map(f64::from);
    let true_up = truth.to_sensor(Vector::new(0.0, 0.0, 1.0)).to_array();
    let dot: f64 = estimated.iter().zip(true_up).map(|(a, b)| a * b).sum();
    let [a, b] = [estimated, true_up];
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    sine.atan2(dot).to_degrees()
}
