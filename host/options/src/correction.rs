//! Errors of a sensor and its mounting in the foot, applied to its readings.

use estimator_core::correction::AccelerometerCorrection;
use estimator_core::mounting::Mounting;
use estimator_core::{AngularRate, ImuSample, SpecificForce, Vec3};

/// Errors of a sensor, and its mounting in the foot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// Correction of the accelerometer, in single precision and bit-exact with the foot's.
    pub accelerometer: AccelerometerCorrection,
    /// Gyroscope reading at rest, rad/s.
    pub gyroscope_bias: Vec3,
    /// Mounting of the sensor in the foot; the errors above are along the sensor's own axes.
    pub mounting: Mounting,
}

impl Correction {
    /// An ideal sensor whose axes are the axes of the foot.
    pub const NONE: Self = Self {
        accelerometer: AccelerometerCorrection::NONE,
        gyroscope_bias: Vec3::ZERO,
        mounting: Mounting::IDENTITY,
    };

    /// Returns the corrected readings in the frame of the foot.
    #[must_use]
    pub fn apply(&self, force: SpecificForce, rate: AngularRate) -> (SpecificForce, AngularRate) {
        let mut force = self.accelerometer.apply(force);
        let mut rate = AngularRate(rate.0 - self.gyroscope_bias);
        self.mounting.apply(&mut force, &mut rate);
        (force, rate)
    }

    /// Returns a sample with the corrected readings.
    #[must_use]
    pub fn corrected(&self, imu: ImuSample) -> ImuSample {
        let (specific_force, angular_rate) = self.apply(imu.specific_force, imu.angular_rate);
        ImuSample { specific_force, angular_rate, ..imu }
    }
}
