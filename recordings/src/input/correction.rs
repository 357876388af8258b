//! A sensor's static calibration and its mounting, applied where readings become SI units and nowhere
//! else.

use estimator_core::{AccelerometerCorrection, AngularRate, Mounting, SpecificForce, Vec3};

/// What is wrong with a sensor, and how it lies in the foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// The accelerometer, corrected as the foot does it: single precision, the same bits.
    pub accelerometer: AccelerometerCorrection,
    /// What the gyroscope reads at rest, rad/s.
    pub gyroscope_bias: Vec3,
    /// How the sensor's axes lie in the foot: what is wrong with the sensor is along its own.
    pub mounting: Mounting,
}

impl Correction {
    /// A perfect sensor whose axes are those of the foot.
    pub const NONE: Self = Self {
        accelerometer: AccelerometerCorrection::NONE,
        gyroscope_bias: Vec3::ZERO,
        mounting: Mounting::IDENTITY,
    };

    /// The truth behind a reading, in the frame of the foot.
    #[must_use]
    pub fn apply(&self, force: SpecificForce, rate: AngularRate) -> (SpecificForce, AngularRate) {
        let mut force = self.accelerometer.apply(force);
        let mut rate = AngularRate(rate.0 - self.gyroscope_bias);
        self.mounting.apply(&mut force, &mut rate);
        (force, rate)
    }
}

impl Default for Correction {
    fn default() -> Self {
        Self::NONE
    }
}
