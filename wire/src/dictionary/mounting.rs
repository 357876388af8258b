//! 0x2019: orientation of the sensor's axes in the foot.
//!
//! A mounting along axes is one number, so that each allowed value is a valid mounting: its digits are the
//! sensor's axes along the foot's x, y and z, as [`SensorAxis`] numbers them.

use estimator_core::SensorAxis;
use estimator_core::mounting::handedness;

use super::entry::Choice;
use super::{Concern, Entry, Object, Shape, Text, index};
use crate::value::Value;

/// Code for a mounting that the quaternion gives.
pub(crate) const AS_QUATERNION: u16 = 0;

/// Number of ways in which a sensor's axes can lie along those of the foot.
const WAYS: usize = 24;

/// Code of the sensor's axes along the foot's x, y and z.
#[must_use]
pub const fn code_of_axes([x, y, z]: [SensorAxis; 3]) -> u16 {
    100 * x as u16 + 10 * y as u16 + z as u16
}

/// Allowed values, in ascending order. Built by the compiler, which would report an index
/// out of range.
#[allow(clippy::indexing_slicing)]
pub(super) const AXES: &[Value] = &{
    let mut values = [Value::U16(AS_QUATERNION); 1 + WAYS];
    let (mut count, mut i) = (1, 0);
    while i < 6 * 6 * 6 {
        const ALL: [SensorAxis; 6] = SensorAxis::ALL;
        let axes = [ALL[i / 36], ALL[i / 6 % 6], ALL[i % 6]];
        if handedness(axes) == 1 {
            values[count] = Value::U16(code_of_axes(axes));
            count += 1;
        }
        i += 1;
    }
    assert!(count == values.len());
    values
};

pub(super) const OBJECT: Object = {
    const fn part(subindex: u8, name: &'static str, default: f32) -> Entry {
        Entry::setting(subindex, name, Concern::Correction, Value::F32(default))
            .range(Value::F32(-1.0), Value::F32(1.0))
    }
    const IDENTITY: u16 = code_of_axes([SensorAxis::X, SensorAxis::Y, SensorAxis::Z]);
    Object {
        index: index::MOUNTING,
        name: Text::new("Mounting"),
        shape: Shape::Record,
        doc: Text::new(
            "how the sensor's axes lie in the foot, whose z is up: samples are turned by it after 0x2017 and before the estimate; `footfall calibrate` finds it",
        ),
        entries: &[
            Entry::setting(1, "Axes", Concern::Correction, Value::U16(IDENTITY))
                .one_of(Choice::Axes)
                .key("axes")
                .doc("one digit each for the foot's x, y and z: the sensor's axis along it, 1 x, 2 y, 3 z, 4 −x, 5 −y, 6 −z; 0: as 2 to 5 say, which must then be of length 1 within a thousandth"),
            part(2, "Rotation w", 1.0).doc("2 to 5: quaternion, Hamilton, sensor → foot"),
            part(3, "Rotation x", 0.0),
            part(4, "Rotation y", 0.0),
            part(5, "Rotation z", 0.0),
        ],
    }
};

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_code_is_a_quaternion_or_axes_in_ascending_order() {
        let codes: Vec<u32> = AXES.iter().map(|value| value.to_raw()).collect();
        assert!(codes.is_sorted_by(|a, b| a < b));
        assert_eq!((codes[0], codes[1], codes.len()), (0, 123, 25));
        // x, −z, y, and its mirror image.
        assert!(codes.contains(&162) && !codes.contains(&132));
    }
}
