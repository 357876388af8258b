//! A mounting as text: `x,-z,y`, or a quaternion such as `0.8,0.6,0,0`.

use core::fmt::{self, Display, Formatter};

use super::{Mounting, MountingError, MountingParams, SensorAxis};
use crate::vector::Quaternion;

impl SensorAxis {
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
}

/// Formats so that parsing restores every bit.
impl Display for MountingParams {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axes(axes) => Axes(*axes).fmt(f),
            Self::Rotation(Quaternion { w, x, y, z }) => write!(f, "{w},{x},{y},{z}"),
        }
    }
}

/// Formats so that parsing restores every bit.
impl Display for Mounting {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.params().fmt(f)
    }
}

/// Formats axes for display.
struct Axes([SensorAxis; 3]);

impl Display for Axes {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0.map(SensorAxis::name);
        write!(f, "{x},{y},{z}")
    }
}

impl Display for MountingError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match *self {
            Self::AxisTwice { axes } => write!(
                f,
                "{} has an axis twice: each of the sensor's x, y and z lies along one axis of the foot, such as x,-z,y",
                Axes(axes)
            ),
            Self::LeftHanded { axes } => {
                let [x, y, z] = axes;
                write!(
                    f,
                    "{} is left-handed, and a sensor is not: flip the sign of one axis, as in {} or {}",
                    Axes(axes),
                    Axes([x, y.opposite(), z]),
                    Axes([x.opposite(), y, z])
                )
            }
            Self::Length { length } => write!(
                f,
                "the quaternion has the length {length}, allowed is 0.999 to 1.001: divide its four numbers by their length"
            ),
            Self::Unreadable => f.write_str(
                "write for the foot's x, y and z (up) the axis of the sensor that lies along it, such as x,-z,y, or a unit quaternion w,x,y,z from the sensor's frame to the foot's",
            ),
        }
    }
}
