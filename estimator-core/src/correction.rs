//! Static calibration of an accelerometer, applied before any other processing.
//!
//! Foot and host both apply it here, so that the same readings give the same bits.

use crate::sample::SpecificForce;
use crate::vector::Vec3;

/// Errors of an accelerometer, per axis: true value = (reading − `bias`) × `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerometerCorrection {
    /// Reading in free fall, m/s².
    pub bias: Vec3,
    /// Factor applied to a reading after its bias is subtracted.
    pub scale: Vec3,
}

impl AccelerometerCorrection {
    /// A perfect accelerometer, whose readings keep their bits.
    pub const NONE: Self = Self { bias: Vec3::ZERO, scale: Vec3::new(1.0, 1.0, 1.0) };

    /// Returns the corrected reading: (reading − bias) × scale.
    #[inline]
    #[must_use]
    pub fn apply(&self, reading: SpecificForce) -> SpecificForce {
        let unbiased = reading.0 - self.bias;
        SpecificForce(Vec3::new(
            unbiased.x * self.scale.x,
            unbiased.y * self.scale.y,
            unbiased.z * self.scale.z,
        ))
    }
}

impl Default for AccelerometerCorrection {
    fn default() -> Self {
        Self::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_is_subtracted_before_the_scale_is_applied() {
        let correction = AccelerometerCorrection {
            bias: Vec3::new(0.5, 0.0, -1.0),
            scale: Vec3::new(2.0, 0.5, 1.0),
        };
        let reading = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
        let truth = SpecificForce(Vec3::new(1.0, 1.0, 4.0));
        assert_eq!(correction.apply(reading), truth);
    }

    #[test]
    fn readings_of_a_perfect_accelerometer_keep_their_bits() {
        let bits = |Vec3 { x, y, z }| [x, y, z].map(f32::to_bits);
        for reading in
            [Vec3::new(0.0, -0.0, 9.80665), Vec3::new(f32::MIN_POSITIVE / 2.0, -156.9, 1.0e4)]
        {
            let corrected = AccelerometerCorrection::NONE.apply(SpecificForce(reading));
            assert_eq!(bits(corrected.0), bits(reading));
        }
    }
}
