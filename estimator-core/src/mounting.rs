//! The mounting: orientation of the sensor's axes in the foot.
//!
//! The foot's frame has z up while the foot stands. By convention x points to the front. A mounting turns readings from
//! the sensor's frame to that of the foot. It is applied after the accelerometer's [correction](crate::correction),
//! which belongs to the sensor's own axes, and before the estimator. So all axes of an estimate are in the frame of the
//! foot. Foot and host both apply it here, so that the same readings give the same bits.
//!
//! Saturation applies to a sensor as a whole, whichever axis is affected, so [`Validity`](crate::Validity) is
//! unchanged.

use core::fmt::{self, Display, Formatter};

use crate::math::sqrt;
use crate::sample::{AngularRate, SpecificForce};
use crate::vector::{Quaternion, Vec3};

/// An axis of the sensor or its opposite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SensorAxis {
    /// x.
    #[default]
    X = 1,
    /// y.
    Y,
    /// z.
    Z,
    /// The opposite of x.
    MinusX,
    /// The opposite of y.
    MinusY,
    /// The opposite of z.
    MinusZ,
}

impl SensorAxis {
    /// All axes, in the order of their numbers, which begin with 1.
    pub const ALL: [Self; 6] =
        [Self::X, Self::Y, Self::Z, Self::MinusX, Self::MinusY, Self::MinusZ];

    /// Returns the axis that points the other way.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::X => Self::MinusX,
            Self::Y => Self::MinusY,
            Self::Z => Self::MinusZ,
            Self::MinusX => Self::X,
            Self::MinusY => Self::Y,
            Self::MinusZ => Self::Z,
        }
    }

    /// Returns the component of a vector along the axis: its own bits, except for the sign.
    #[inline]
    #[must_use]
    pub fn component(self, vector: Vec3) -> f32 {
        match self {
            Self::X => vector.x,
            Self::Y => vector.y,
            Self::Z => vector.z,
            Self::MinusX => -vector.x,
            Self::MinusY => -vector.y,
            Self::MinusZ => -vector.z,
        }
    }

    /// Short name: `x` … `-z`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        }
    }

    /// Returns the index of the axis, 0 for x to 2 for z, and its sign.
    const fn parts(self) -> (u8, i8) {
        match self {
            Self::X => (0, 1),
            Self::Y => (1, 1),
            Self::Z => (2, 1),
            Self::MinusX => (0, -1),
            Self::MinusY => (1, -1),
            Self::MinusZ => (2, -1),
        }
    }
}

/// Mounting as configured: orientation of the sensor's axes in the foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MountingParams {
    /// The sensor axis along the foot's x, y and z each. Right-handed: 24 combinations.
    Axes([SensorAxis; 3]),
    /// A unit quaternion in Hamilton's convention that turns a vector's components in the sensor's frame
    /// into those in the foot's.
    Rotation(Quaternion),
}

/// Least length of a quaternion; allows for three written decimals.
const LEAST_LENGTH: f32 = 0.999;
/// Largest length; see [`LEAST_LENGTH`].
const MOST_LENGTH: f32 = 1.001;

/// Tolerance of a squared length that is 1 except for rounding: such a quaternion keeps its bits.
const ROUNDED: f32 = 2.0e-6;

impl MountingParams {
    /// The sensor's axes are those of the foot.
    pub const IDENTITY: Self = Self::Axes([SensorAxis::X, SensorAxis::Y, SensorAxis::Z]);

    /// Checks that the mounting is possible.
    ///
    /// # Errors
    /// A sensor axis is used twice, the axes are left-handed, or the quaternion's length is not 1.
    pub fn validate(&self) -> Result<Mounting, MountingError> {
        match *self {
            Self::Axes(axes) => match handedness(axes) {
                1 if *self == Self::IDENTITY => Ok(Mounting::IDENTITY),
                1 => Ok(Mounting(Turn::Axes(axes))),
                -1 => Err(MountingError::LeftHanded { axes }),
                _ => Err(MountingError::AxisTwice { axes }),
            },
            Self::Rotation(quaternion) => {
                let Quaternion { w, x, y, z } = quaternion;
                let square = w * w + x * x + y * y + z * z;
                let length = sqrt(square);
                // A NaN is outside every range.
                if !(LEAST_LENGTH..=MOST_LENGTH).contains(&length) {
                    return Err(MountingError::Length { length });
                }
                if x == 0.0 && y == 0.0 && z == 0.0 {
                    return Ok(Mounting::IDENTITY);
                }
                Ok(Mounting(Turn::Rotation(if (square - 1.0).abs() <= ROUNDED {
                    quaternion
                } else {
                    quaternion.normalised()
                })))
            }
        }
    }
}

/// Returns the determinant of the axes: 1 if they are right-handed, −1 if they are left-handed, 0 if an axis is used
/// twice.
#[must_use]
pub const fn handedness([x, y, z]: [SensorAxis; 3]) -> i8 {
    let ((x, along_x), (y, along_y), (z, along_z)) = (x.parts(), y.parts(), z.parts());
    let order = match (x, y, z) {
        (0, 1, 2) | (1, 2, 0) | (2, 0, 1) => 1,
        (0, 2, 1) | (2, 1, 0) | (1, 0, 2) => -1,
        _ => 0,
    };
    order * along_x * along_y * along_z
}

/// A validated mounting. Only [`MountingParams::validate`] creates it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mounting(Turn);

/// Operation applied to a vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Turn {
    #[default]
    None,
    Axes([SensorAxis; 3]),
    Rotation(Quaternion),
}

impl Mounting {
    /// The sensor's axes are those of the foot: readings keep their bits.
    pub const IDENTITY: Self = Self(Turn::None);

    /// The parameters that describe it.
    #[must_use]
    pub const fn params(&self) -> MountingParams {
        match self.0 {
            Turn::None => MountingParams::IDENTITY,
            Turn::Axes(axes) => MountingParams::Axes(axes),
            Turn::Rotation(quaternion) => MountingParams::Rotation(quaternion),
        }
    }

    /// Returns the components of a vector in the foot's frame, given its components in the sensor's frame.
    /// If the sensor's axes lie along those of the foot, components keep their bits except for the sign.
    #[must_use]
    pub fn turn(&self, vector: Vec3) -> Vec3 {
        match self.0 {
            Turn::None => vector,
            Turn::Axes([x, y, z]) => {
                Vec3::new(x.component(vector), y.component(vector), z.component(vector))
            }
            Turn::Rotation(quaternion) => quaternion.rotate(vector),
        }
    }

    /// Rotates the readings of both sensors to the foot's frame.
    // In place and in the caller, so that a sensor with the foot's axes costs a comparison.
    #[inline(always)]
    pub fn apply(&self, force: &mut SpecificForce, rate: &mut AngularRate) {
        if !matches!(self.0, Turn::None) {
            self.turn_both(&mut force.0, &mut rate.0);
        }
    }

    #[inline(never)]
    fn turn_both(&self, force: &mut Vec3, rate: &mut Vec3) {
        *force = self.turn(*force);
        *rate = self.turn(*rate);
    }
}

/// Reason why a mounting is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MountingError {
    /// An axis of the sensor is used for two axes of the foot.
    AxisTwice {
        /// The axes.
        axes: [SensorAxis; 3],
    },
    /// The axes form a mirror image.
    LeftHanded {
        /// The axes.
        axes: [SensorAxis; 3],
    },
    /// The quaternion's length is not 1.
    Length {
        /// Length of the quaternion.
        length: f32,
    },
}

impl Display for MountingError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match *self {
            Self::AxisTwice { axes } => {
                let [x, y, z] = axes.map(SensorAxis::name);
                write!(
                    f,
                    "{x},{y},{z} has an axis twice: each of the sensor's x, y and z lies along one axis of the foot, such as x,-z,y"
                )
            }
            Self::LeftHanded { axes: [a, b, c] } => {
                let [x, y, z] = [a, b, c].map(SensorAxis::name);
                let (other_x, other_y) = (a.opposite().name(), b.opposite().name());
                write!(
                    f,
                    "{x},{y},{z} is left-handed, and a sensor is not: flip the sign of one axis, as in {x},{other_y},{z} or {other_x},{y},{z}"
                )
            }
            Self::Length { length } => write!(
                f,
                "the quaternion has the length {length}, allowed is 0.999 to 1.001: divide its four numbers by their length"
            ),
        }
    }
}

impl core::error::Error for MountingError {}

#[cfg(test)]
mod tests {
    use super::SensorAxis::{MinusX, MinusY, MinusZ, X, Y, Z};
    use super::*;
    use std::format;
    use std::string::{String, ToString};
    use std::vec::Vec;

    /// All combinations of three axes.
    fn all_ways() -> Vec<[SensorAxis; 3]> {
        let mut ways = Vec::new();
        for x in SensorAxis::ALL {
            for y in SensorAxis::ALL {
                ways.extend(SensorAxis::ALL.map(|z| [x, y, z]));
            }
        }
        ways
    }

    fn along(axes: [SensorAxis; 3]) -> Mounting {
        MountingParams::Axes(axes).validate().expect("possible")
    }

    fn quaternion([w, x, y, z]: [f32; 4]) -> Result<Mounting, MountingError> {
        MountingParams::Rotation(Quaternion { w, x, y, z }).validate()
    }

    fn rotation(parts: [f32; 4]) -> Mounting {
        quaternion(parts).expect("a unit quaternion")
    }

    fn refusal(axes: [SensorAxis; 3]) -> String {
        MountingParams::Axes(axes).validate().expect_err("impossible").to_string()
    }

    fn bits(vector: Vec3) -> [u32; 3] {
        [vector.x, vector.y, vector.z].map(f32::to_bits)
    }

    const READING: Vec3 = Vec3::new(0.25, -0.0, 9.81);

    #[test]
    fn axes_are_given_in_the_order_of_the_foots_axes() {
        // The foot's z is along the sensor's y.
        let mounting = along([X, MinusZ, Y]);
        let up = Vec3::new(0.0, 9.81, 0.0);
        assert_eq!(mounting.turn(up), Vec3::new(0.0, 0.0, 9.81));
        let mut force = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
        let mut rate = AngularRate(Vec3::new(4.0, 5.0, 6.0));
        mounting.apply(&mut force, &mut rate);
        assert_eq!(force.0, Vec3::new(1.0, -3.0, 2.0));
        assert_eq!(rate.0, Vec3::new(4.0, -6.0, 5.0));
    }

    #[test]
    fn identity_mounting_keeps_every_bit_in_every_notation() {
        let rotations = [[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, -0.0, 0.0], [0.9995, 0.0, 0.0, 0.0]];
        for mounting in rotations.map(rotation).into_iter().chain([along([X, Y, Z])]) {
            assert_eq!(mounting, Mounting::IDENTITY);
            assert_eq!(bits(mounting.turn(READING)), bits(READING));
        }
        assert_eq!(Mounting::default(), Mounting::IDENTITY);
    }

    #[test]
    fn quaternion_rotates_like_the_equivalent_axes() {
        let half = 0.5_f32.sqrt();
        for (quaternion, axes) in [
            ([half, half, 0.0, 0.0], [X, MinusZ, Y]),
            ([half, 0.0, half, 0.0], [Z, Y, MinusX]),
            ([half, 0.0, 0.0, -half], [Y, MinusX, Z]),
            ([0.5; 4], [Z, X, Y]),
            ([0.0, 1.0, 0.0, 0.0], [X, MinusY, MinusZ]),
        ] {
            let vector = Vec3::new(3.0, -5.0, 7.0);
            let difference = rotation(quaternion).turn(vector) - along(axes).turn(vector);
            assert!(difference.length() < 3e-6, "{quaternion:?}: {difference:?}");
        }
    }

    #[test]
    fn quaternion_with_three_decimals_is_normalised() {
        let vector = Vec3::new(3.0, -5.0, 7.0);
        let turned = rotation([0.707, 0.707, 0.0, 0.0]).turn(vector);
        assert!((turned.length() - vector.length()).abs() < 1e-5);
        assert!((turned - along([X, MinusZ, Y]).turn(vector)).length() < 1e-5);
    }

    #[test]
    fn params_of_a_mounting_make_it_again() {
        let quaternions =
            [[0.707, 0.707, 0.0, 0.0], [0.1, -0.7, 0.5, 0.4998], [1e-3, 0.6, 0.8, 0.0]];
        for mounting in quaternions.map(rotation) {
            assert_eq!(mounting.params().validate(), Ok(mounting));
        }
    }

    #[test]
    fn mirror_image_is_rejected_with_the_axis_to_flip() {
        assert_eq!(
            refusal([X, Z, Y]),
            "x,z,y is left-handed, and a sensor is not: flip the sign of one axis, as in x,-z,y or -x,z,y"
        );
        for axes in all_ways() {
            if let Err(MountingError::LeftHanded { axes: refused @ [x, y, z] }) =
                MountingParams::Axes(axes).validate()
            {
                assert_eq!(refused, axes);
                for flipped in [[x, y.opposite(), z], [x.opposite(), y, z]] {
                    assert!(MountingParams::Axes(flipped).validate().is_ok());
                }
            }
        }
    }

    #[test]
    fn axis_used_twice_is_rejected() {
        for axes in [[X, X, Z], [X, MinusX, Z], [Z, Y, Z]] {
            let expected = format!("{} has an axis twice: ", axes.map(SensorAxis::name).join(","));
            assert!(refusal(axes).starts_with(&expected), "{}", refusal(axes));
        }
    }

    #[test]
    fn quaternion_of_wrong_length_is_rejected_with_its_length() {
        assert_eq!(
            quaternion([1.0, 1.0, 0.0, 0.0]).expect_err("long").to_string(),
            "the quaternion has the length 1.4142135, allowed is 0.999 to 1.001: \
             divide its four numbers by their length"
        );
        for parts in [
            [0.0; 4],
            [f32::NAN, 0.0, 0.0, 1.0],
            [f32::INFINITY, 0.0, 0.0, 0.0],
            [1.002, 0.0, 0.0, 0.0],
            [0.0, 0.998, 0.0, 0.0],
        ] {
            assert!(matches!(quaternion(parts), Err(MountingError::Length { .. })), "{parts:?}");
        }
    }
}
