//! Parsing of a mounting from text, on a command line and in a file.

use core::str::FromStr;

use super::{Mounting, MountingError, MountingParams, SensorAxis};
use crate::vector::Quaternion;

fn axis(name: &str) -> Option<SensorAxis> {
    let name = name.strip_prefix('+').unwrap_or(name);
    let mut all = SensorAxis::ALL.into_iter();
    all.find(|axis| axis.name() == name)
}

impl FromStr for MountingParams {
    type Err = MountingError;

    /// Parses three axes or the four numbers w, x, y, z, separated by commas.
    fn from_str(text: &str) -> Result<Self, MountingError> {
        parts(text)
            .and_then(|axes| all(axes, axis))
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

    /// Parses [`MountingParams`] and validates them.
    fn from_str(text: &str) -> Result<Self, MountingError> {
        text.parse::<MountingParams>()?.validate()
    }
}

/// Splits a text at commas; `None` unless there are exactly `N` parts.
fn parts<const N: usize>(text: &str) -> Option<[&str; N]> {
    let mut split = text.split(',').map(str::trim);
    let parts = [(); N].map(|()| split.next());
    match split.next() {
        None => all(parts, |part| part),
        Some(_) => None,
    }
}

/// Converts each element; `None` if any conversion fails.
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
