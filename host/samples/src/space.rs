//! Vectors and rotations in f64: the truth needs more digits than the estimator.

use estimator_core::Vec3;

/// Components of a vector in the order x, y, z.
#[must_use]
pub const fn components(v: Vec3) -> [f32; 3] {
    [v.x, v.y, v.z]
}

/// Three components along the axes of a frame.
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

    /// Angle to another vector, rad; 0 to π.
    #[must_use]
    pub fn angle_to(self, other: Self) -> f64 {
        libm::atan2(self.cross(other).length(), self.dot(other))
    }

    /// The inner product.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The cross product.
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }
}

impl From<Vec3> for Vector {
    fn from(v: Vec3) -> Self {
        Self::from_array(components(v).map(f64::from))
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
        let inverse = Self { w: self.w, v: self.v * -1.0 };
        inverse.to_world(vector)
    }

    /// Composes two rotations: first `other`, then this.
    #[must_use]
    pub fn after(self, other: Self) -> Self {
        Self {
            w: self.w * other.w - self.v.dot(other.v),
            v: other.v * self.w + self.v * other.w + self.v.cross(other.v),
        }
    }
}
