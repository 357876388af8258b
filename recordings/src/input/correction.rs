//! A sensor's static calibration, applied where readings become SI units and nowhere else.

use estimator_core::{AccelerometerCorrection, AngularRate, SpecificForce, Vec3};

/// What is wrong with a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// The accelerometer, corrected as the foot does it: single precision, the same bits.
    pub accelerometer: AccelerometerCorrection,
    /// What the gyroscope reads at rest, rad/s.
    pub gyroscope_bias: Vec3,
}

impl Correction {
    /// A perfect sensor.
    pub const NONE: Self = Self {
        accelerometer: AccelerometerCorrection::NONE,
        gyroscope_bias: Vec3::ZERO,
    };

    /// The truth behind a reading.
    #[must_use]
    pub fn apply(&self, force: SpecificForce, rate: AngularRate) -> (SpecificForce, AngularRate) {
        let rate = AngularRate(rate.0 - self.gyroscope_bias);
        (self.accelerometer.apply(force), rate)
    }
}

impl Default for Correction {
    fn default() -> Self {
        Self::NONE
    }
}
