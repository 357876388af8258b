//! One CAN FD frame with everything of a sample, for buses that have CAN FD.
//!
//! The identifier is that of TPDO1. A CAN FD frame of this length cannot be mistaken for TPDO1.
//!
//! | bytes | field |
//! |---|---|
//! | 0 to 7 | as TPDO1, [`Contact`] |
//! | 8 to 13 | P(ax), P(ay), P(az), P(wx), P(wy), P(wz), as in TPDO2 |
//! | 14 | the estimator's flags, as in TPDO7 |
//! | 15 | error register (object 0x1001) |
//! | 16 to 23 | orientation, as TPDO3 |
//! | 24 to 29 | acceleration, as in TPDO4 |
//! | 30 to 35 | angular rate, as in TPDO5 |
//! | 36 to 41 | gyroscope bias, as in TPDO6 |
//! | 42, 43 | the sensor's temperature, as in TPDO6 |
//! | 44 to 47 | the sample's time, 10 µs, modulo 2³²; its low 16 bits are the time of TPDO1 |

use estimator_core::{ContactEstimate, PerAxis};

use crate::bytes::{Reader, Writer};
use crate::fault::Faults;
use crate::pdo::{Acceleration, Attitude, Axes, Bias, Contact, LongTime, P8, Quantity, Rate};

/// The frame's length, one of those CAN FD has.
pub const LENGTH: usize = 48;

/// Everything of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// What TPDO1 holds.
    pub contact: Contact,
    /// Probability per axis that it rests.
    pub axes: PerAxis<P8>,
    /// The estimator's flags as bits.
    pub flags: u8,
    /// The error register.
    pub register: u8,
    /// What TPDO3 holds.
    pub attitude: Attitude,
    /// Codes of the acceleration without gravity.
    pub acceleration: [Quantity; 3],
    /// Codes of the angular rate without bias.
    pub rate: [Quantity; 3],
    /// What TPDO6 holds.
    pub bias: Bias,
    /// When the sample was acquired.
    pub timestamp: LongTime,
}

impl Sample {
    /// The frame for an estimate, a temperature in °C and the active faults.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, temperature: f32, sequence: u8, faults: Faults) -> Self {
        Self {
            contact: Contact::new(estimate, sequence, faults),
            axes: Axes::new(estimate, faults).probabilities,
            flags: estimate.flags.bits(),
            register: faults.register(),
            attitude: Attitude::new(estimate, faults),
            acceleration: Acceleration::new(estimate, faults).codes,
            rate: Rate::new(estimate, faults).codes,
            bias: Bias::new(estimate, temperature, faults),
            timestamp: estimate.timestamp.into(),
        }
    }

    /// The frame's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        let mut writer = Writer::new(&mut bytes);
        writer.bytes(&self.contact.encode());
        for code in self.axes.to_array() {
            writer.u8(code.0);
        }
        writer.u8(self.flags);
        writer.u8(self.register);
        writer.bytes(&self.attitude.encode());
        for code in self.acceleration.into_iter().chain(self.rate) {
            writer.i16(code.0);
        }
        writer.bytes(&self.bias.encode());
        writer.u32(self.timestamp.0);
        bytes
    }

    /// The frame with these bytes; `None` where there are not [`LENGTH`] of them.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader::new(bytes);
        let contact = Contact::decode(&reader.array()?);
        let axes = PerAxis::from_array(reader.array::<6>()?.map(P8));
        let (flags, register) = (reader.u8()?, reader.u8()?);
        let attitude = Attitude::decode(&reader.array()?);
        let mut codes = [Quantity(0); 6];
        for code in &mut codes {
            *code = Quantity(reader.i16()?);
        }
        let [ax, ay, az, wx, wy, wz] = codes;
        let bias = Bias::decode(&reader.array()?);
        let sample = Self {
            contact,
            axes,
            flags,
            register,
            attitude,
            acceleration: [ax, ay, az],
            rate: [wx, wy, wz],
            bias,
            timestamp: LongTime(reader.u32()?),
        };
        reader.finish(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{LinearAcceleration, Timestamp, Vec3};

    #[test]
    fn golden_bytes() {
        let estimate = ContactEstimate {
            timestamp: Timestamp::from_micros(0x1_0203_0405 * 10 + 9),
            linear_acceleration: LinearAcceleration(Vec3::new(0.01, 0.02, 0.03)),
            ..Default::default()
        };
        let sample = Sample::new(&estimate, 1.0, 9, Faults::NONE);
        let bytes = sample.encode();
        assert_eq!(bytes[..8], sample.contact.encode());
        assert_eq!(bytes[16..24], [0xFF, 0x7F, 0, 0, 0, 0, 0, 0]);
        assert_eq!(bytes[24..30], [1, 0, 2, 0, 3, 0]);
        assert_eq!(bytes[42..], [100, 0, 5, 4, 3, 2]);
        assert_eq!(sample.timestamp.short(), sample.contact.timestamp);
        assert_eq!(Sample::decode(&bytes), Some(sample));
        assert_eq!(Sample::decode(&bytes[1..]), None);
        assert_eq!(Sample::decode(&[0; 64]), None);
    }
}
