//! Conversion of the sensor's samples to the estimator's (feature `estimator`).
//!
//! Sensor and estimator are independent. They meet here, on the foot and in every program on a host. Units are SI on
//! both sides, so this module adds time and validity.

use crate::{Config, RawSample, Sample};
use estimator_core::{
    AngularRate, ImuSample, Saturation, SpecificForce, Timestamp, Validity, Vec3,
};

/// Time for which a clipped sample is in the output of the accelerometer's filter, periods of the cut-off: 1.5 ms at
/// 333 Hz, 3.4 ms at 148 Hz. A tenth of the sample is left after 0.37 periods if the filter is of first order, and after
/// 0.43 periods if it is of second.
const RINGING_PERIODS: f32 = 0.5;

/// Conversion of samples in order of time.
///
/// The accelerometer clips before its filter. So a shock of a millisecond beyond the range becomes a sample near its
/// end. A sample near the full scale therefore counts as saturated, and so do the following ones while the filter rings
/// down. A shock too short to come near the full scale is not detected. The gyroscope has a margin of 15 % beyond its
/// full scale.
#[derive(Clone, Copy, Debug)]
pub struct Conversion {
    /// Time for which a clipped sample is in the output of the filter, µs.
    ringing_us: u64,
    /// Time of the last sample near the accelerometer's full scale.
    clipped: Option<Timestamp>,
}

impl Conversion {
    /// Creates a conversion of the samples of a part with this configuration.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let micros = |hertz| (RINGING_PERIODS * 1.0e6 / hertz) as u64;
        Self { ringing_us: config.accel_cutoff().map_or(0, micros), clipped: None }
    }

    /// Converts the sample read at the data-ready edge at `timestamp`.
    #[must_use]
    pub fn imu_sample(&mut self, raw: &RawSample, timestamp: Timestamp) -> ImuSample {
        let mut sample = raw.to_si();
        if raw.specific_force.is_near_full_scale() {
            self.clipped = Some(timestamp);
        }
        let since = self.clipped.and_then(|at| timestamp.micros_since(at));
        sample.accel_saturated = since.is_some_and(|us| us <= self.ringing_us);
        let vector = |[x, y, z]: [f32; 3]| Vec3::new(x, y, z);
        ImuSample {
            timestamp,
            specific_force: SpecificForce(vector(sample.specific_force)),
            angular_rate: AngularRate(vector(sample.angular_rate)),
            validity: validity(&sample),
        }
    }
}

/// Creates an invalid sample in place of one that could not be read at `timestamp`.
#[must_use]
pub fn missing_sample(timestamp: Timestamp) -> ImuSample {
    ImuSample { timestamp, validity: Validity::Invalid, ..ImuSample::default() }
}

/// A sample without new data of one sensor is stale as a whole, whatever its range.
const fn validity(sample: &Sample) -> Validity {
    if !(sample.accel_fresh && sample.gyro_fresh) {
        return Validity::Stale;
    }
    match (sample.accel_saturated, sample.gyro_saturated) {
        (false, false) => Validity::Valid,
        (true, false) => Validity::Saturated(Saturation::Accelerometer),
        (false, true) => Validity::Saturated(Saturation::Gyroscope),
        (true, true) => Validity::Saturated(Saturation::Both),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    /// A burst with these bits of new data, and with these codes on ωy and ax.
    fn read(status: u8, rate: i16, force: i16) -> ImuSample {
        let mut bytes = [0; 16];
        bytes[0] = status;
        bytes[6..8].copy_from_slice(&rate.to_le_bytes());
        bytes[10..12].copy_from_slice(&force.to_le_bytes());
        let raw = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).expect("a status");
        Conversion::new(&Config::FRESH_KILOHERTZ).imu_sample(&raw, Timestamp::from_micros(1_234))
    }

    #[test]
    fn units_axes_and_time_are_preserved() {
        let sample = read(0b11, -1000, 2000);
        assert_eq!(sample.timestamp.as_micros(), 1_234);
        assert_eq!(sample.validity, Validity::Valid);
        // 2000 codes of 0.488 mg; 1000 of 70 m°/s.
        assert!((sample.specific_force.0.x - 9.5713).abs() < 1e-3);
        assert!((sample.angular_rate.0.y + 1.22173).abs() < 1e-4);
        assert_eq!((sample.specific_force.0.y, sample.angular_rate.0.z), (0.0, 0.0));
    }

    #[test]
    fn a_saturated_sample_identifies_the_sensor() {
        for (rate, force, saturation) in [
            (0, i16::MIN, Saturation::Accelerometer),
            (28_571, 0, Saturation::Gyroscope),
            (i16::MIN, i16::MAX, Saturation::Both),
        ] {
            assert_eq!(read(0b11, rate, force).validity, Validity::Saturated(saturation));
        }
    }

    /// Number of samples that count as saturated after a sample with the code `force`. Ticks are
    /// `tick_us` apart, and edges come up to 155 µs later.
    fn marked(force: i16, config: &Config, tick_us: u64) -> usize {
        let mut conversion = Conversion::new(config);
        let samples = (0..).zip([0, force, 1_000, 0, -1_000, 0]).filter(|(tick, force)| {
            let mut bytes = [0b11, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
            bytes[10..12].copy_from_slice(&force.to_le_bytes());
            let raw = RawSample::decode(&bytes, config).expect("a status");
            let edge = Timestamp::from_micros(tick_us * tick + tick * 311 % 155);
            let validity = conversion.imu_sample(&raw, edge).validity;
            validity == Validity::Saturated(Saturation::Accelerometer)
        });
        samples.count()
    }

    /// 29 484 codes are 90 %.
    #[test]
    fn near_full_scale_saturates_the_sample_that_follows() {
        for (config, tick_us) in
            [(Config::FRESH_KILOHERTZ, 1_000), (Config::FRESH_417_HERTZ, 2_400)]
        {
            for (force, expected) in [(29_484, 0), (-29_485, 2), (i16::MAX, 2)] {
                assert_eq!(marked(force, &config, tick_us), expected, "{force}, {tick_us} µs");
            }
        }
    }

    #[test]
    fn missing_data_of_one_sensor_makes_a_saturated_sample_stale() {
        for status in [0b00, 0b01, 0b10] {
            assert_eq!(read(status, i16::MAX, 0).validity, Validity::Stale, "{status:#b}");
        }
    }

    #[test]
    fn a_missing_sample_is_invalid() {
        let sample = missing_sample(Timestamp::from_micros(7));
        assert_eq!((sample.timestamp.as_micros(), sample.validity), (7, Validity::Invalid));
    }
}
