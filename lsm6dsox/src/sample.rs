//! One burst of bytes: status, temperature, angular rate and specific force at one instant.
//!
//! [`RawSample`] contains the part's codes. [`RawSample::to_si`] converts them to SI units, with the scales of `scale`.

use crate::config::Config;
use crate::register::{self, STATUS_REG, status_reg};
use crate::scale::{AccelFullScale, Codes, GyroFullScale, TemperatureCode};

/// Bytes of a sample, from `STATUS_REG` to `OUTZ_H_A`; 0x1F between them is reserved.
pub const SAMPLE_BYTES: usize = (register::OUTZ_H_A.address - STATUS_REG.address) as usize + 1;

/// `STATUS_REG`: outputs that have not been read before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status(u8);

impl Status {
    /// Accepts a byte that a part can send, whose reserved bits are zero.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if STATUS_REG.keeps_reserved_bits(bits) { Some(Self(bits)) } else { None }
    }

    /// Value of the register.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The accelerometer's sample is new.
    #[must_use]
    pub const fn accel_fresh(self) -> bool {
        status_reg::XLDA.is_set(self.0)
    }

    /// The gyroscope's sample is new.
    #[must_use]
    pub const fn gyro_fresh(self) -> bool {
        status_reg::GDA.is_set(self.0)
    }

    /// The temperature is new.
    #[must_use]
    pub const fn temperature_fresh(self) -> bool {
        status_reg::TDA.is_set(self.0)
    }
}

/// A sample in the part's own codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawSample {
    /// Flags of the outputs that are new.
    pub status: Status,
    /// Temperature of the die.
    pub temperature: TemperatureCode,
    /// Angular rate.
    pub angular_rate: Codes<GyroFullScale>,
    /// Specific force.
    pub specific_force: Codes<AccelFullScale>,
}

impl RawSample {
    /// Decodes the bytes of a burst.
    ///
    /// # Errors
    /// The status byte, if no part sends it: the bytes are not a sample.
    pub const fn decode(bytes: &[u8; SAMPLE_BYTES], config: &Config) -> Result<Self, u8> {
        #[rustfmt::skip]
        let &[status, _reserved, t0, t1,
            gx0, gx1, gy0, gy1, gz0, gz1,
            ax0, ax1, ay0, ay1, az0, az1] = bytes;
        let Some(fresh) = Status::from_bits(status) else {
            return Err(status);
        };
        Ok(Self {
            status: fresh,
            temperature: TemperatureCode(i16::from_le_bytes([t0, t1])),
            angular_rate: Codes {
                codes: [
                    i16::from_le_bytes([gx0, gx1]),
                    i16::from_le_bytes([gy0, gy1]),
                    i16::from_le_bytes([gz0, gz1]),
                ],
                full_scale: config.params().gyro.full_scale,
            },
            specific_force: Codes {
                codes: [
                    i16::from_le_bytes([ax0, ax1]),
                    i16::from_le_bytes([ay0, ay1]),
                    i16::from_le_bytes([az0, az1]),
                ],
                full_scale: config.params().accel.full_scale,
            },
        })
    }

    /// Returns whether both sensors' samples are new.
    #[must_use]
    pub const fn is_fresh(&self) -> bool {
        self.status.accel_fresh() && self.status.gyro_fresh()
    }

    /// Returns whether any axis of either sensor is at the end of its range.
    ///
    /// The filters can smooth a shock that exceeds the range to a value below the end of the range: see `Conversion` in
    /// `imu`.
    #[must_use]
    pub fn is_saturated(&self) -> bool {
        self.specific_force.is_saturated() || self.angular_rate.is_saturated()
    }

    /// Converts the sample to SI units.
    #[must_use]
    pub fn to_si(&self) -> Sample {
        Sample {
            specific_force: self.specific_force.to_si(),
            angular_rate: self.angular_rate.to_si(),
            temperature: self.temperature.to_celsius(),
            accel_fresh: self.status.accel_fresh(),
            gyro_fresh: self.status.gyro_fresh(),
            accel_saturated: self.specific_force.is_saturated(),
            gyro_saturated: self.angular_rate.is_saturated(),
        }
    }
}

/// A sample in SI units, with its quality. Axes are those of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Accelerometer, m/s², gravity included: at rest it points up with 9.81 m/s².
    pub specific_force: [f32; 3],
    /// Gyroscope, rad/s.
    pub angular_rate: [f32; 3],
    /// Temperature of the die, °C.
    pub temperature: f32,
    /// The specific force has not been read before.
    pub accel_fresh: bool,
    /// The angular rate has not been read before.
    pub gyro_fresh: bool,
    /// An axis of the accelerometer is at the end of its range.
    pub accel_saturated: bool,
    /// An axis of the gyroscope is at the end of its range.
    pub gyro_saturated: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: [u8; SAMPLE_BYTES] = [
        0x07, 0x00, 0x00, 0x01, 0x01, 0x00, 0xFF, 0xFF, 0x00, 0x01, 0x02, 0x00, 0xFE, 0xFF, 0x01,
        0x08,
    ];

    #[test]
    fn a_burst_is_sixteen_bytes_in_the_order_of_the_registers() {
        let raw = RawSample::decode(&BYTES, &Config::FRESH_KILOHERTZ).unwrap();
        assert_eq!(raw.temperature.to_celsius(), 26.0);
        assert_eq!(raw.angular_rate.codes, [1, -1, 256]);
        assert_eq!(raw.specific_force.codes, [2, -2, 2049]);
        assert!(raw.is_fresh() && raw.status.temperature_fresh() && !raw.is_saturated());
    }

    #[test]
    fn si_units_come_from_the_configured_full_scales() {
        let sample = RawSample::decode(&BYTES, &Config::FRESH_KILOHERTZ).unwrap().to_si();
        // 2049 × 0.488 mg is 1 g to 0.01 %; 256 × 70 m°/s is 17.92 °/s.
        assert!((sample.specific_force[2] - 9.8057).abs() < 1.0e-3);
        assert!((sample.angular_rate[2] - 0.312_763).abs() < 1.0e-5);
    }

    #[test]
    fn status_distinguishes_fresh_from_stale_for_each_sensor() {
        for (status, accel, gyro) in [(0, false, false), (1, true, false), (2, false, true)] {
            let mut bytes = BYTES;
            bytes[0] = status;
            let sample = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).unwrap().to_si();
            assert_eq!((sample.accel_fresh, sample.gyro_fresh), (accel, gyro));
        }
    }

    #[test]
    fn impossible_status_is_rejected() {
        let mut bytes = BYTES;
        for status in [0x08, 0x80, 0xFF] {
            bytes[0] = status;
            assert_eq!(RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ), Err(status));
        }
    }

    #[test]
    fn one_axis_at_the_end_of_its_range_flags_its_sensor() {
        let mut bytes = BYTES;
        [bytes[14], bytes[15]] = i16::MIN.to_le_bytes();
        let raw = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).unwrap();
        assert_eq!(raw.specific_force.saturated(), [false, false, true]);
        let sample = raw.to_si();
        assert!(sample.accel_saturated && !sample.gyro_saturated && raw.is_saturated());
    }
}
