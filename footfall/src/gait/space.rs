//! Vectors and rotations in f64: the truth wants more digits than the estimator has.

use super::jet::Jet;

/// Three components along the axes of some frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector {
    /// Component along x.
    pub x: f64,
    /// Component along y.
    pub y: f64,
    /// Component along z.
    pub z: f64,
}

impl Vector {
    /// A vector from its components.
    #[must_use]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { x, y, z }
    }

    /// A vector from its components in the order x, y, z.
    #[must_use]
    pub const fn from_array([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }

    /// The components in the order x, y, z.
    #[must_use]
    pub const fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    /// Euclidean length.
    #[must_use]
    pub fn length(self) -> f64 {
        libm::sqrt(self.x * self.x + self.y * self.y + self.z * self.z)
    }

    /// The angle to another vector, rad; 0 to π.
    #[must_use]
    pub fn angle_to(self, other: Self) -> f64 {
        let dot = self.x * other.x + self.y * other.y + self.z * other.z;
        libm::atan2(self.cross(other).length(), dot)
    }

    fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }
}

impl std::ops::Add for Vector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl std::ops::Sub for Vector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl std::ops::Mul<f64> for Vector {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// A unit quaternion in Hamilton's convention, sensor → world, world z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Scalar part.
    pub w: f64,
    /// Vector part.
    pub v: Vector,
}

impl Rotation {
    /// World-frame components of a vector given in the sensor frame.
    #[must_use]
    pub fn to_world(self, vector: Vector) -> Vector {
        let twice = self.v.cross(vector) * 2.0;
        vector + twice * self.w + self.v.cross(twice)
    }

    /// Sensor-frame components of a vector given in the world frame.
    #[must_use]
    pub fn to_sensor(self, vector: Vector) -> Vector {
        let inverse = Self {
            w: self.w,
            v: self.v * -1.0,
        };
        inverse.to_world(vector)
    }

    /// From roll about x, pitch about y and yaw about z in rad, applied in this order (world from
    /// sensor = yaw · pitch · roll): the rotation, and the angular rate in the sensor frame, rad/s.
    pub(super) fn from_roll_pitch_yaw([roll, pitch, yaw]: [Jet; 3]) -> (Self, Vector) {
        let (sr, cr) = (roll * 0.5).sin_cos();
        let (sp, cp) = (pitch * 0.5).sin_cos();
        let (sy, cy) = (yaw * 0.5).sin_cos();
        let w = cr * cp * cy + sr * sp * sy;
        let x = sr * cp * cy - cr * sp * sy;
        let y = cr * sp * cy + sr * cp * sy;
        let z = cr * cp * sy - sr * sp * cy;
        let rotation = Self {
            w: w.value,
            v: Vector::new(x.value, y.value, z.value),
        };
        // ω = 2 q* ⊗ q̇, its vector part.
        let change = Vector::new(x.rate, y.rate, z.rate);
        let rate = change * rotation.w - rotation.v * w.rate - rotation.v.cross(change);
        (rotation, rate * 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(actual: Vector, expected: Vector) {
        assert!(
            (actual - expected).length() < 1e-12,
            "{actual:?} is not {expected:?}"
        );
    }

    #[test]
    fn a_positive_pitch_turns_the_toes_down() {
        let pitched = [Jet::default(), Jet::constant(0.3), Jet::default()];
        let (rotation, _) = Rotation::from_roll_pitch_yaw(pitched);
        let toes = rotation.to_world(Vector::new(1.0, 0.0, 0.0));
        assert_close(toes, Vector::new(libm::cos(0.3), 0.0, -libm::sin(0.3)));
        assert_close(rotation.to_sensor(toes), Vector::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn the_angular_rate_is_in_the_sensor_frame() {
        // Rolled by a quarter turn, a yaw about the world's z is a turn about the sensor's y.
        let angles = [
            Jet::constant(std::f64::consts::FRAC_PI_2),
            Jet::default(),
            Jet::moving(0.0, 2.0),
        ];
        let (_, rate) = Rotation::from_roll_pitch_yaw(angles);
        assert_close(rate, Vector::new(0.0, 2.0, 0.0));
    }
}
