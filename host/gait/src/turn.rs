//! Conversion of changing angles to a rotation and its angular rate.

use recordings::samples::space::{Rotation, Vector};

use crate::jet::Jet;

/// Converts roll about x, pitch about y and yaw about z in rad, applied in this order (world from sensor = yaw ·
/// pitch · roll), to the rotation and the angular rate in the sensor frame, rad/s.
pub(crate) fn from_roll_pitch_yaw([roll, pitch, yaw]: [Jet; 3]) -> (Rotation, Vector) {
    let (sr, cr) = (roll * 0.5).sin_cos();
    let (sp, cp) = (pitch * 0.5).sin_cos();
    let (sy, cy) = (yaw * 0.5).sin_cos();
    let w = cr * cp * cy + sr * sp * sy;
    let x = sr * cp * cy - cr * sp * sy;
    let y = cr * sp * cy + sr * cp * sy;
    let z = cr * cp * sy - sr * sp * cy;
    let rotation = Rotation { w: w.value, v: Vector::new(x.value, y.value, z.value) };
    // ω = 2 q* ⊗ q̇, its vector part.
    let change = Vector::new(x.rate, y.rate, z.rate);
    let rate = change * rotation.w - rotation.v * w.rate - rotation.v.cross(change);
    (rotation, rate * 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(actual: Vector, expected: Vector) {
        assert!((actual - expected).length() < 1e-12, "{actual:?} is not {expected:?}");
    }

    #[test]
    fn a_positive_pitch_turns_the_toes_down() {
        let pitched = [Jet::default(), Jet::constant(0.3), Jet::default()];
        let (rotation, _) = from_roll_pitch_yaw(pitched);
        let toes = rotation.to_world(Vector::new(1.0, 0.0, 0.0));
        assert_close(toes, Vector::new(libm::cos(0.3), 0.0, -libm::sin(0.3)));
        assert_close(rotation.to_sensor(toes), Vector::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn the_angular_rate_is_in_the_sensor_frame() {
        // Rolled by a quarter turn, a yaw about the world's z is a turn about the sensor's y.
        let angles =
            [Jet::constant(std::f64::consts::FRAC_PI_2), Jet::default(), Jet::moving(0.0, 2.0)];
        let (_, rate) = from_roll_pitch_yaw(angles);
        assert_close(rate, Vector::new(0.0, 2.0, 0.0));
    }
}
