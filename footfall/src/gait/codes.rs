//! The digital half of the sensor: 16-bit codes, and the scale that gives them a meaning.

use estimator_core::{
    AngularRate, ImuSample, Saturation, SpecificForce, Timestamp, Validity, Vec3,
};

use super::sensor::{MILLI_DPS, MILLI_G, Measurement};
use super::space::Vector;

/// One sample as the sensor's output registers hold it, axes in the order x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawSample {
    /// Gyroscope.
    pub angular_rate: [i16; 3],
    /// Accelerometer.
    pub specific_force: [i16; 3],
}

impl RawSample {
    /// Saturated where an axis is at an end of its range: the truth may lie anywhere beyond.
    #[must_use]
    pub fn validity(&self) -> Validity {
        let at_end = |codes: &[i16; 3]| codes.iter().any(|c| matches!(*c, i16::MIN | i16::MAX));
        match (at_end(&self.specific_force), at_end(&self.angular_rate)) {
            (false, false) => Validity::Valid,
            (true, false) => Validity::Saturated(Saturation::Accelerometer),
            (false, true) => Validity::Saturated(Saturation::Gyroscope),
            (true, true) => Validity::Saturated(Saturation::Both),
        }
    }
}

/// What one code is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// m/s² per code.
    pub specific_force: f64,
    /// rad/s per code.
    pub angular_rate: f64,
}

impl Scale {
    /// An LSM6DSOX at ±16 g and ±2000 °/s: 0.488 mg and 70 m°/s per code (ST's own driver). Codes
    /// end at ±15.99 g and ±2294 °/s.
    pub const LSM6DSOX_16G_2000DPS: Self = Self {
        specific_force: 0.488 * MILLI_G,
        angular_rate: 70.0 * MILLI_DPS,
    };

    /// Rounds to codes; what is out of range becomes the last code.
    #[must_use]
    pub fn digitise(&self, measurement: &Measurement) -> RawSample {
        RawSample {
            angular_rate: codes(measurement.angular_rate, self.angular_rate),
            specific_force: codes(measurement.specific_force, self.specific_force),
        }
    }

    /// The sample in SI units, as of `timestamp`.
    #[must_use]
    pub fn imu_sample(&self, raw: &RawSample, timestamp: Timestamp) -> ImuSample {
        ImuSample {
            timestamp,
            specific_force: SpecificForce(values(raw.specific_force, self.specific_force)),
            angular_rate: AngularRate(values(raw.angular_rate, self.angular_rate)),
            validity: raw.validity(),
        }
    }
}

fn codes(values: Vector, per_code: f64) -> [i16; 3] {
    // The cast saturates.
    values
        .to_array()
        .map(|value| libm::round(value / per_code) as i16)
}

fn values(codes: [i16; 3], per_code: f64) -> Vec3 {
    let [x, y, z] = codes.map(|code| (f64::from(code) * per_code) as f32);
    Vec3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: Scale = Scale::LSM6DSOX_16G_2000DPS;

    fn raw(force_x: f64, rate_y: f64) -> RawSample {
        SCALE.digitise(&Measurement {
            specific_force: Vector::new(force_x, 0.0, 9.806_65),
            angular_rate: Vector::new(0.0, rate_y, 0.0),
            temperature: 25.0,
        })
    }

    #[test]
    fn codes_come_back_as_si_units_to_half_a_code() {
        let raw = raw(1.0, -1.0);
        let sample = SCALE.imu_sample(&raw, Timestamp::from_micros(3000));
        assert_eq!(sample.timestamp.as_micros(), 3000);
        assert_eq!(sample.validity, Validity::Valid);
        assert_eq!(raw.specific_force[2], 2049);
        assert!((sample.specific_force.0.x - 1.0).abs() <= 0.0024);
        assert!((sample.angular_rate.0.y + 1.0).abs() <= 0.0007);
    }

    #[test]
    fn what_is_beyond_the_range_stays_at_its_end_and_says_which_sensor_it_is() {
        let (sixteen_g, forty) = (16.0 * 9.806_65, 40.0);
        let beyond = raw(-2.0 * sixteen_g, 1.1 * forty);
        assert_eq!(beyond.specific_force[0], i16::MIN);
        assert_eq!(beyond.angular_rate[1], i16::MAX);
        let cases = [
            (0.999 * sixteen_g, forty, Validity::Valid),
            (
                1.01 * sixteen_g,
                forty,
                Validity::Saturated(Saturation::Accelerometer),
            ),
            (
                0.0,
                -1.1 * forty,
                Validity::Saturated(Saturation::Gyroscope),
            ),
            (
                -2.0 * sixteen_g,
                1.1 * forty,
                Validity::Saturated(Saturation::Both),
            ),
        ];
        for (force, rate, validity) in cases {
            assert_eq!(raw(force, rate).validity(), validity);
        }
    }
}
