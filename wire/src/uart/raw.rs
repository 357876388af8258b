//! Type 0x02: the sensor's measurement, as codes with their scale.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 7 | the sample's time, µs |
//! | 8 | validity: 0 valid; saturated: 1 accelerometer, 2 gyroscope, 3 both; 4 stale; 5 invalid |
//! | 9, 10 | temperature, 0.01 °C, signed |
//! | 11 to 16 | accelerometer x, y, z, codes, signed |
//! | 17 to 22 | gyroscope x, y, z, codes, signed |
//! | 23 to 26 | m/s² per code of the accelerometer, REAL32 |
//! | 27 to 30 | rad/s per code of the gyroscope, REAL32 |

use estimator_core::{
    AngularRate, ImuSample, Saturation, SpecificForce, Timestamp, Validity, Vec3,
};

use crate::bytes::{Reader, Writer};
use crate::pdo::Quantity;

/// The sensor's measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RawMessage {
    /// Acquisition time.
    pub timestamp: Timestamp,
    /// Validity reported by the driver.
    pub validity: Validity,
    /// The sensor's temperature, 0.01 °C.
    pub temperature: Quantity,
    /// Codes of the accelerometer.
    pub acceleration: [i16; 3],
    /// Codes of the gyroscope.
    pub rate: [i16; 3],
    /// m/s² per code.
    pub acceleration_scale: f32,
    /// rad/s per code.
    pub rate_scale: f32,
}

/// Validities by code: the code is the index in this list.
const VALIDITIES: [Validity; 6] = [
    Validity::Valid,
    Validity::Saturated(Saturation::Accelerometer),
    Validity::Saturated(Saturation::Gyroscope),
    Validity::Saturated(Saturation::Both),
    Validity::Stale,
    Validity::Invalid,
];

const fn validity_code(validity: Validity) -> u8 {
    match validity {
        Validity::Valid => 0,
        Validity::Saturated(Saturation::Accelerometer) => 1,
        Validity::Saturated(Saturation::Gyroscope) => 2,
        Validity::Saturated(Saturation::Both) => 3,
        Validity::Stale => 4,
        Validity::Invalid => 5,
    }
}

impl RawMessage {
    /// Converts the sample to SI units, for the estimator.
    #[must_use]
    pub fn to_si(&self) -> ImuSample {
        let scaled = |codes: [i16; 3], scale: f32| {
            let [x, y, z] = codes.map(|code| f32::from(code) * scale);
            Vec3::new(x, y, z)
        };
        ImuSample {
            timestamp: self.timestamp,
            specific_force: SpecificForce(scaled(self.acceleration, self.acceleration_scale)),
            angular_rate: AngularRate(scaled(self.rate, self.rate_scale)),
            validity: self.validity,
        }
    }

    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.u64(self.timestamp.as_micros());
        writer.u8(validity_code(self.validity));
        writer.i16(self.temperature.0);
        for code in self.acceleration.into_iter().chain(self.rate) {
            writer.i16(code);
        }
        writer.f32(self.acceleration_scale);
        writer.f32(self.rate_scale);
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let timestamp = Timestamp::from_micros(reader.u64()?);
        let validity = *VALIDITIES.get(usize::from(reader.u8()?))?;
        let temperature = Quantity(reader.i16()?);
        let mut codes = [0; 6];
        for code in &mut codes {
            *code = reader.i16()?;
        }
        let [ax, ay, az, wx, wy, wz] = codes;
        let sample = Self {
            timestamp,
            validity,
            temperature,
            acceleration: [ax, ay, az],
            rate: [wx, wy, wz],
            acceleration_scale: reader.f32()?,
            rate_scale: reader.f32()?,
        };
        reader.finish(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uart::{Kind, Message};

    #[test]
    fn golden_bytes() {
        let sample = RawMessage {
            timestamp: Timestamp::from_micros(1),
            validity: Validity::Stale,
            temperature: Quantity(2550),
            acceleration: [1, -1, 2048],
            rate: [i16::MAX, i16::MIN, 0],
            acceleration_scale: 0.5,
            rate_scale: -2.0,
        };
        let mut payload = [0; 31];
        let mut writer = Writer::new(&mut payload);
        sample.write(&mut writer);
        assert_eq!(writer.finish(), Some(31));
        assert_eq!(
            payload,
            [
                1, 0, 0, 0, 0, 0, 0, 0, 4, 0xF6, 0x09, // time, validity, temperature
                1, 0, 0xFF, 0xFF, 0, 8, // accelerometer
                0xFF, 0x7F, 0, 0x80, 0, 0, // gyroscope
                0, 0, 0, 0x3F, 0, 0, 0, 0xC0,
            ]
        );
        let decoded = Message::decode(Kind::Raw, &payload);
        assert_eq!(decoded, Some(Message::Raw(sample)));
        let si = sample.to_si();
        assert_eq!(si.specific_force.0, Vec3::new(0.5, -0.5, 1024.0));
        payload[8] = 6;
        assert_eq!(Message::decode(Kind::Raw, &payload), None);
    }

    #[test]
    fn validities_are_listed_by_code() {
        for (i, validity) in VALIDITIES.into_iter().enumerate() {
            assert_eq!(usize::from(validity_code(validity)), i);
        }
    }
}
