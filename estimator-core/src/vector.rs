//! Three-vectors and unit quaternions, as required by the attitude filter.
//!
//! The module uses only additions, multiplications, divisions and square roots, which IEEE 754 rounds the same way
//! everywhere, and never a fused multiply-add. So the bits agree on every machine.

use core::ops::{Add, AddAssign, Mul, Neg, Sub};

use crate::math::{Order, sqrt};

/// Three components along the axes of some frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vec3 {
    /// Component along x.
    pub x: f32,
    /// Component along y.
    pub y: f32,
    /// Component along z.
    pub z: f32,
}

impl Vec3 {
    /// The zero vector.
    pub const ZERO: Self = Self::new(0.0, 0.0, 0.0);

    /// Creates a vector from its components.
    #[must_use]
    pub const fn new(x: f32, y: f32, z: f32) -> Self {
        Self { x, y, z }
    }

    /// Inner product.
    #[inline]
    #[must_use]
    pub fn dot(self, other: Self) -> f32 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Vector product.
    #[inline]
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// Euclidean length.
    #[inline]
    #[must_use]
    pub fn length(self) -> f32 {
        sqrt(self.dot(self))
    }

    /// The vector, shortened to a length of `most`, unless it is shorter than 10⁻¹⁹.
    #[must_use]
    pub fn clipped(self, most: f32) -> Self {
        let square = self.dot(self);
        // The root of a lesser number is 0.
        let is_longer = square > (most * most).greater(f32::MIN_POSITIVE);
        if is_longer { self * (most / sqrt(square)) } else { self }
    }

    /// The vector after a rotation by the small rotation vector `rotation`, rad, to first order.
    #[inline]
    #[must_use]
    pub(crate) fn turned(self, rotation: Self) -> Self {
        self + rotation.cross(self)
    }

    /// Returns whether every component is a number of magnitude at most `limit`.
    #[inline]
    #[must_use]
    pub fn is_within(self, limit: f32) -> bool {
        // A comparison with NaN is false, so this also rejects values that are not finite.
        self.x.abs() <= limit && self.y.abs() <= limit && self.z.abs() <= limit
    }
}

impl Add for Vec3 {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl AddAssign for Vec3 {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Vec3 {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl Neg for Vec3 {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl Mul<f32> for Vec3 {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f32) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// A unit quaternion in Hamilton's convention, sensor → world unless stated otherwise: it rotates a
/// vector's sensor-frame components into world-frame components. World z points up; heading is arbitrary.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Quaternion {
    /// Scalar part.
    pub w: f32,
    /// Vector part along x.
    pub x: f32,
    /// Vector part along y.
    pub y: f32,
    /// Vector part along z.
    pub z: f32,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self { w: 1.0, x: 0.0, y: 0.0, z: 0.0 };

    /// The shortest rotation that takes the direction of `up` (a sensor-frame vector) to world z.
    /// `None` if `up` has no usable length.
    #[must_use]
    pub fn from_up(up: Vec3) -> Option<Self> {
        let length = up.length();
        // Not `length <= …`: a NaN must fail as well.
        if !(length > f32::MIN_POSITIVE && length <= f32::MAX) {
            return None;
        }
        let unit = up * (1.0 / length);
        let horizontal2 = unit.x * unit.x + unit.y * unit.y;
        // 1 + z, without the cancellation near upside down.
        let one_plus_z = if unit.z >= 0.0 { 1.0 + unit.z } else { horizontal2 / (1.0 - unit.z) };
        // Half-angle formula for the rotation from `unit` to +z.
        let twice_w = sqrt(2.0 * one_plus_z);
        if twice_w > 1.0e-6 {
            let inverse = 1.0 / twice_w;
            Some(
                Self { w: 0.5 * twice_w, x: unit.y * inverse, y: -unit.x * inverse, z: 0.0 }
                    .normalised(),
            )
        } else {
            // Upside down, any horizontal axis will do.
            Some(Self { w: 0.0, x: 1.0, y: 0.0, z: 0.0 })
        }
    }

    /// A rotation by the small rotation vector `angle` (rad), accurate to the fifth power of its length.
    #[inline]
    #[must_use]
    pub fn from_small_rotation(angle: Vec3) -> Self {
        // Series of cos(θ/2) and sin(θ/2)/θ.
        let theta2 = angle.dot(angle);
        let vector = 0.5 - theta2 * (1.0 / 48.0);
        Self {
            w: 1.0 - theta2 * (0.125 - theta2 * (1.0 / 384.0)),
            x: angle.x * vector,
            y: angle.y * vector,
            z: angle.z * vector,
        }
        .renormalised()
    }

    /// Hamilton product `self ⊗ other`.
    #[inline]
    #[must_use]
    pub fn multiply(self, other: Self) -> Self {
        Self {
            w: self.w * other.w - self.x * other.x - self.y * other.y - self.z * other.z,
            x: self.w * other.x + self.x * other.w + self.y * other.z - self.z * other.y,
            y: self.w * other.y - self.x * other.z + self.y * other.w + self.z * other.x,
            z: self.w * other.z + self.x * other.y - self.y * other.x + self.z * other.w,
        }
    }

    /// The inverse rotation.
    #[inline]
    #[must_use]
    pub fn conjugate(self) -> Self {
        Self { w: self.w, x: -self.x, y: -self.y, z: -self.z }
    }

    /// Returns the world-frame components of a vector given in the sensor frame.
    #[inline]
    #[must_use]
    pub fn rotate(self, vector: Vec3) -> Vec3 {
        let axis = Vec3::new(self.x, self.y, self.z);
        let twice = axis.cross(vector) * 2.0;
        vector + twice * self.w + axis.cross(twice)
    }

    /// World z (up) in sensor-frame components.
    #[inline]
    #[must_use]
    pub fn up(self) -> Vec3 {
        Vec3::new(
            2.0 * (self.x * self.z - self.w * self.y),
            2.0 * (self.y * self.z + self.w * self.x),
            self.w * self.w - self.x * self.x - self.y * self.y + self.z * self.z,
        )
    }

    /// Restores unit length after rounding errors: one Newton step, no root.
    #[inline]
    #[must_use]
    pub fn renormalised(self) -> Self {
        self.scaled(1.5 - 0.5 * self.norm_squared())
    }

    /// Restores unit length from any length; the identity if the length is unusable.
    #[must_use]
    pub fn normalised(self) -> Self {
        let length = sqrt(self.norm_squared());
        if length > f32::MIN_POSITIVE && length <= f32::MAX {
            self.scaled(1.0 / length)
        } else {
            Self::IDENTITY
        }
    }

    #[inline]
    fn norm_squared(self) -> f32 {
        self.w * self.w + self.x * self.x + self.y * self.y + self.z * self.z
    }

    #[inline]
    fn scaled(self, factor: f32) -> Self {
        Self { w: self.w * factor, x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(actual: Vec3, expected: Vec3, tolerance: f32) {
        assert!((actual - expected).length() <= tolerance, "{actual:?} is not {expected:?}");
    }

    #[test]
    fn vector_of_any_length_is_clipped_to_numbers() {
        for exponent in -45..38 {
            let length = 10.0_f32.powi(exponent);
            for most in [0.0, 1.0e-30, 0.5] {
                let clipped = Vec3::new(0.0, length, 0.0).clipped(most);
                assert!(
                    clipped.y <= (1.000_001 * most).max(1.1e-19),
                    "{length} to {most}: {clipped:?}"
                );
            }
        }
    }

    #[test]
    fn attitude_from_an_up_vector_turns_it_to_world_z() {
        let directions = [
            Vec3::new(0.0, 0.0, 9.81),
            Vec3::new(0.0, 0.0, -9.81),
            Vec3::new(3.0, -4.0, 1.0),
            Vec3::new(-0.2, 0.1, -9.7),
            Vec3::new(9.81, 0.0, 0.0),
        ];
        for up in directions {
            let attitude = Quaternion::from_up(up).expect("a usable length");
            let unit = up * (1.0 / up.length());
            assert_close(attitude.rotate(unit), Vec3::new(0.0, 0.0, 1.0), 1e-6);
            assert_close(attitude.up(), unit, 1e-6);
        }
    }

    #[test]
    fn vector_without_length_gives_no_attitude() {
        for up in [Vec3::ZERO, Vec3::new(f32::NAN, 0.0, 1.0), Vec3::new(0.0, f32::INFINITY, 0.0)] {
            assert_eq!(Quaternion::from_up(up), None);
        }
    }

    #[test]
    fn small_rotations_add_up_to_a_large_one() {
        // A quarter turn about z in 1000 steps takes x to y.
        let step = Quaternion::from_small_rotation(Vec3::new(
            0.0,
            0.0,
            core::f32::consts::FRAC_PI_2 / 1000.0,
        ));
        let turned = (0..1000)
            .fold(Quaternion::IDENTITY, |attitude, _| attitude.multiply(step).renormalised());
        assert_close(turned.rotate(Vec3::new(1.0, 0.0, 0.0)), Vec3::new(0.0, 1.0, 0.0), 1e-5);
    }

    #[test]
    fn rotation_and_its_conjugate_cancel() {
        let attitude = Quaternion::from_up(Vec3::new(1.0, 2.0, -0.5)).expect("a usable length");
        let vector = Vec3::new(0.3, -7.0, 2.0);
        assert_close(attitude.conjugate().rotate(attitude.rotate(vector)), vector, 1e-5);
    }

    #[test]
    fn units_multiply_by_hamiltons_rules() {
        let unit = |x: f32, y: f32, z: f32| Quaternion { w: 0.0, x, y, z };
        let (i, j, k) = (unit(1.0, 0.0, 0.0), unit(0.0, 1.0, 0.0), unit(0.0, 0.0, 1.0));
        let negative = |q: Quaternion| q.scaled(-1.0);
        for (a, b, product) in [(i, j, k), (j, k, i), (k, i, j)] {
            assert_eq!(a.multiply(b), product);
            assert_eq!(b.multiply(a), negative(product));
            assert_eq!(a.multiply(a), negative(Quaternion::IDENTITY));
            assert_eq!(a.multiply(Quaternion::IDENTITY), a);
            assert_eq!(Quaternion::IDENTITY.multiply(a), a);
        }
    }

    #[test]
    fn normalised_restores_unit_length_or_gives_identity() {
        let long = Quaternion { w: 1.0, x: -2.0, y: 3.0, z: -4.0 };
        for factor in [1.0e-3, 1.0, 1.0e3] {
            let unit = long.scaled(factor).normalised();
            assert!((unit.norm_squared() - 1.0).abs() < 1.0e-6, "{unit:?}");
            assert!((unit.z / unit.x - 2.0).abs() < 1.0e-6, "{unit:?}");
        }
        for nothing in [0.0, f32::INFINITY, f32::NAN] {
            assert_eq!(long.scaled(nothing).normalised(), Quaternion::IDENTITY);
        }
    }
}
