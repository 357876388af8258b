//! The self-test by ST's procedure, and its limits.
//!
//! At rest, the mean of five samples with the test signal on is compared with the mean of five
//! without: the accelerometer at 52 Hz and ±4 g, then the gyroscope at 208 Hz and ±2000 °/s,
//! each after 100 ms and one discarded sample \[P example\]. The drivers' `self_test` runs it.

use crate::scale::{DEGREE, STANDARD_GRAVITY};

/// Least and largest valid change of an accelerometer axis, mg \[P example\].
pub const ACCEL_LIMITS_MILLI_G: (f32, f32) = (50.0, 1700.0);

/// Least and largest valid change of a gyroscope axis, °/s \[P example\].
pub const GYRO_LIMITS_DPS: (f32, f32) = (150.0, 700.0);

/// Delay after each change of the setting, ms \[P example\].
pub(crate) const SETTLING_MILLIS: u32 = 100;

/// Samples per mean \[P example\].
pub(crate) const SAMPLES: u8 = 5;

/// `ST_XL` for a negative test signal, which ST's example uses.
pub(crate) const ST_XL_NEGATIVE: u8 = 0b10;

/// `ST_G` for a positive test signal, which ST's example uses.
pub(crate) const ST_G_POSITIVE: u8 = 0b01;

/// Change caused by the test signal, per axis, as a magnitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfTest {
    /// Accelerometer, m/s².
    pub specific_force: [f32; 3],
    /// Gyroscope, rad/s.
    pub angular_rate: [f32; 3],
}

impl SelfTest {
    /// Returns per axis of the accelerometer whether the change is within its limits.
    #[must_use]
    pub fn accel_passed(&self) -> [bool; 3] {
        within(self.specific_force, ACCEL_LIMITS_MILLI_G, 1.0e-3 * STANDARD_GRAVITY)
    }

    /// Returns per axis of the gyroscope whether the change is within its limits.
    #[must_use]
    pub fn gyro_passed(&self) -> [bool; 3] {
        within(self.angular_rate, GYRO_LIMITS_DPS, DEGREE)
    }

    /// Returns whether every axis is within its limits.
    #[must_use]
    pub fn passed(&self) -> bool {
        !self.accel_passed().contains(&false) && !self.gyro_passed().contains(&false)
    }
}

fn within(changes: [f32; 3], (min, max): (f32, f32), unit: f32) -> [bool; 3] {
    changes.map(|change| change >= min * unit && change <= max * unit)
}

/// Returns the magnitudes of the changes between two means.
pub(crate) fn changes(off: [f32; 3], on: [f32; 3]) -> [f32; 3] {
    let ([x0, y0, z0], [x1, y1, z1]) = (off, on);
    [(x1 - x0).abs(), (y1 - y0).abs(), (z1 - z0).abs()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_fails_below_and_above_its_limits() {
        let mut result = SelfTest { specific_force: [4.9; 3], angular_rate: [7.0; 3] };
        assert!(result.passed());
        result.specific_force[1] = 0.4;
        assert_eq!(result.accel_passed(), [true, false, true]);
        result.specific_force[1] = 17.0;
        assert!(!result.passed());
        result.specific_force[1] = 5.0;
        result.angular_rate = [2.5, 2.7, 12.3];
        assert_eq!(result.gyro_passed(), [false, true, false]);
    }

    #[test]
    fn change_is_the_distance_between_the_means_of_an_axis() {
        let changed = changes([1.0, 2.0, -3.0], [5.0, -6.0, -4.0]);
        assert_eq!(changed, [4.0, 8.0, 1.0]);
    }

    #[test]
    fn nan_fails() {
        let result = SelfTest { specific_force: [f32::NAN; 3], angular_rate: [7.0; 3] };
        assert_eq!(result.accel_passed(), [false; 3]);
    }
}
