//! An accelerometer's static calibration: what is wrong with it, put right before anything else.
//!
//! Foot and host both apply it here, so that the same readings give the same bits.

use crate::sample::SpecificForce;
use crate::vector::Vec3;

/// What is wrong with an accelerometer: it reads the truth over `scale` plus `bias`, axis by axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerometerCorrection {
    /// What it reads in free fall, m/s².
    pub bias: Vec3,
    /// What a reading without its bias is multiplied by.
    pub scale: Vec3,
}

impl AccelerometerCorrection {
    /// A perfect accelerometer, whose readings keep their bits.
    pub const NONE: Self = Self {
        bias: Vec3::ZERO,
        scale: Vec3::new(1.0, 1.0, 1.0),
    };

    /// The truth behind a reading: (reading − bias) × scale.
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
    fn the_bias_is_taken_off_before_the_scale_is_applied() {
        let correction = AccelerometerCorrection {
            bias: Vec3::new(0.5, 0.0, -1.0),
            scale: Vec3::new(2.0, 0.5, 1.0),
        };
        let reading = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
        let truth = SpecificForce(Vec3::new(1.0, 1.0, 4.0));
        assert_eq!(correction.apply(reading), truth);
    }

    #[test]
    fn a_perfect_accelerometer_keeps_its_bits() {
        let bits = |Vec3 { x, y, z }| [x, y, z].map(f32::to_bits);
        for reading in [
            Vec3::new(0.0, -0.0, 9.80665),
            Vec3::new(f32::MIN_POSITIVE / 2.0, -156.9, 1.0e4),
        ] {
            let corrected = AccelerometerCorrection::NONE.apply(SpecificForce(reading));
            assert_eq!(bits(corrected.0), bits(reading));
        }
    }
}
