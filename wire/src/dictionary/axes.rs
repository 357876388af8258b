//! Codes of the ways in which a sensor's axes can lie along those of the foot.
//!
//! A mounting along axes is one number, so that each allowed value is a valid mounting: its digits are the
//! sensor's axes along the foot's x, y and z, as [`SensorAxis`] numbers them.

use estimator_core::SensorAxis;
use estimator_core::mounting::handedness;

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
