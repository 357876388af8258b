//! A mounting as text, on a command line and in a file: `x,-z,y`, or a quaternion such as `0.8,0.6,0,0`.

use core::fmt::{self, Display, Formatter};
use core::str::FromStr;

use super::{Mounting, MountingError, MountingParams, SensorAxis};
use crate::vector::Quaternion;

impl SensorAxis {
    /// Its name: `x` … `-z`.
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

    fn from_name(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|axis| axis.name() == name.strip_prefix('+').unwrap_or(name))
    }
}

/// As [`MountingParams::from_str`] reads it, to the bit.
impl Display for MountingParams {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axes(axes) => Axes(*axes).fmt(f),
            Self::Rotation(Quaternion { w, x, y, z }) => write!(f, "{w},{x},{y},{z}"),
        }
    }
}

/// As [`Mounting::from_str`] reads it, to the bit.
impl Display for Mounting {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.params().fmt(f)
    }
}

impl FromStr for MountingParams {
    type Err = MountingError;

    /// Reads three axes or the four numbers w, x, y, z, separated by commas.
    fn from_str(text: &str) -> Result<Self, MountingError> {
        parts(text)
            .and_then(|axes| all(axes, SensorAxis::from_name))
            .map(Self::Axes)
            .or_else(|| {
                let [w, x, y, z] = all(parts(text)?, |number| number.parse().ok())?;
                Some(Self::Rotation(Quaternion { w, x, y, z }))
            })
            .ok_or(MountingError::Unreadable)
    }
}

impl FromStr for Mounting {
    type Err = MountingError;

    /// Reads what [`MountingParams`] reads, and checks it.
    fn from_str(text: &str) -> Result<Self, MountingError> {
        text.parse::<MountingParams>()?.validate()
    }
}

/// The parts of a text, where there are as many.
fn parts<const N: usize>(text: &str) -> Option<[&str; N]> {
    let mut split = text.split(',').map(str::trim);
    let parts = [(); N].map(|()| split.next());
    match split.next() {
        None => all(parts, |part| part),
        Some(_) => None,
    }
}

/// Each of them as something else, where all can be.
fn all<T: Copy, U: Copy + Default, const N: usize>(
    from: [T; N],
    read: impl Fn(T) -> Option<U>,
) -> Option<[U; N]> {
    let mut to = [U::default(); N];
    for (to, from) in to.iter_mut().zip(from) {
        *to = read(from)?;
    }
    Some(to)
}

/// Axes for people.
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
