//! Number that changes with time, together with its first two derivatives.
//!
//! Every closed form of the motion is written once, in jets; velocity and acceleration are derived from the
//! position by the rules of calculus and cannot disagree with it. [`from_roll_pitch_yaw`] does the same for angles.
//!
//! Exponential, sine and cosine come from the `libm` crate, not from the platform, so that the bits are the same
//! on every machine.

use std::ops::{Add, AddAssign, Mul, Sub};

use samples::space::{Rotation, Vector};

/// Value, first and second derivative with respect to time in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Jet {
    /// Value, in the unit of the quantity.
    pub value: f64,
    /// First derivative, in that unit per s.
    pub rate: f64,
    /// Second derivative, in that unit per s².
    pub acceleration: f64,
}

impl Jet {
    /// Creates a constant.
    pub const fn constant(value: f64) -> Self {
        Self::moving(value, 0.0)
    }

    /// Creates a value that changes at a constant rate.
    pub const fn moving(value: f64, rate: f64) -> Self {
        Self { value, rate, acceleration: 0.0 }
    }

    /// Chain rule: f(self), given f, f′ and f″ at the value.
    fn chain(self, f: f64, first: f64, second: f64) -> Self {
        Self {
            value: f,
            rate: first * self.rate,
            acceleration: second * (self.rate * self.rate) + first * self.acceleration,
        }
    }

    /// e to the power of `self`.
    pub fn exp(self) -> Self {
        let exp = libm::exp(self.value);
        self.chain(exp, exp, exp)
    }

    /// Sine and cosine of `self` in rad.
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.value);
        (self.chain(sin, cos, -sin), self.chain(cos, -sin, -cos))
    }

    /// The third power.
    pub fn cubed(self) -> Self {
        self * self * self
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            rate: self.rate + other.rate,
            acceleration: self.acceleration + other.acceleration,
        }
    }
}

impl AddAssign for Jet {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            acceleration: self.acceleration * other.value
                + 2.0 * (self.rate * other.rate)
                + self.value * other.acceleration,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            rate: self.rate * factor,
            acceleration: self.acceleration * factor,
        }
    }
}

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

    fn assert_close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() < 1e-12, "{actual} ≠ {expected}");
    }

    #[test]
    fn derivatives_match_closed_forms() {
        let t = 0.7_f64;
        let time = Jet::moving(t, 1.0);

        let cube = time.cubed();
        assert_close(cube.rate, 3.0 * t * t);
        assert_close(cube.acceleration, 6.0 * t);

        // e^(−2t) sin(5t): the ringing of a damped spring.
        let ring = (time * -2.0).exp() * (time * 5.0).sin_cos().0;
        let (e, s, c) = ((-2.0 * t).exp(), (5.0 * t).sin(), (5.0 * t).cos());
        assert_close(ring.value, e * s);
        assert_close(ring.rate, e * (5.0 * c - 2.0 * s));
        assert_close(ring.acceleration, e * ((4.0 - 25.0) * s - 20.0 * c));

        let difference = Jet::constant(1.0) - (time * 5.0).sin_cos().1;
        assert_close(difference.acceleration, 25.0 * c);
    }

    fn assert_same(actual: Vector, expected: Vector) {
        assert!((actual - expected).length() < 1e-12, "{actual:?} is not {expected:?}");
    }

    #[test]
    fn a_positive_pitch_turns_the_toes_down() {
        let pitched = [Jet::default(), Jet::constant(0.3), Jet::default()];
        let (rotation, _) = from_roll_pitch_yaw(pitched);
        let toes = rotation.to_world(Vector::new(1.0, 0.0, 0.0));
        assert_same(toes, Vector::new(libm::cos(0.3), 0.0, -libm::sin(0.3)));
        assert_same(rotation.to_sensor(toes), Vector::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn the_angular_rate_is_in_the_sensor_frame() {
        // Rolled by a quarter turn, a yaw about the world's z is a turn about the sensor's y.
        let angles =
            [Jet::constant(std::f64::consts::FRAC_PI_2), Jet::default(), Jet::moving(0.0, 2.0)];
        let (_, rate) = from_roll_pitch_yaw(angles);
        assert_same(rate, Vector::new(0.0, 2.0, 0.0));
    }
}
