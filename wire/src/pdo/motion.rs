//! TPDO3 to TPDO6: orientation, acceleration, angular rate and bias.
//!
//! All are signed 16-bit codes times a step; −32768 means "no value".
//!
//! | frame | bytes 0 to 5 | bytes 6, 7 |
//! |---|---|---|
//! | TPDO4 acceleration | x, y, z without gravity, 0.01 m/s² | the sample's time, 10 µs, modulo 2¹⁶ |
//! | TPDO5 rate | x, y, z without bias, 0.00125 rad/s | the sample's time, 10 µs, modulo 2¹⁶ |
//! | TPDO6 bias | x, y, z of the gyroscope, 0.00001 rad/s | the sensor's temperature, 0.01 °C |
//!
//! TPDO3, attitude, has no room for a time: w, x, y, z in 1/32767, of the sample whose TPDO1 the
//! foot sent last.

use estimator_core::{ContactEstimate, Quaternion, Vec3};

use super::signal::{ACCELERATION_UNIT, RATE_UNIT, UNIT};
use super::{
    ACCELERATION_STEP, BIAS_STEP, Mapped, Quantity, RATE_STEP, ShortTime, Signal, TEMPERATURE_STEP,
    TIMESTAMP, UNIT_STEP,
};
use crate::dictionary::index;

/// Four words as bytes.
fn words([a, b, c, d]: [u16; 4]) -> [u8; 8] {
    let [a, b, c, d] = [a, b, c, d].map(u16::to_le_bytes);
    let ([a0, a1], [b0, b1], [c0, c1], [d0, d1]) = (a, b, c, d);
    [a0, a1, b0, b1, c0, c1, d0, d1]
}

/// Bytes as four words.
fn from_bytes([a0, a1, b0, b1, c0, c1, d0, d1]: [u8; 8]) -> [u16; 4] {
    [[a0, a1], [b0, b1], [c0, c1], [d0, d1]].map(u16::from_le_bytes)
}

fn codes(vector: Vec3, step: f64) -> [Quantity; 3] {
    [vector.x, vector.y, vector.z].map(|value| Quantity::new(value, step))
}

fn vector(codes: [Quantity; 3], step: f64) -> Vec3 {
    let [x, y, z] = codes.map(|code| code.value(step));
    Vec3::new(x, y, z)
}

/// The contents of TPDO3: orientation, sensor → world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attitude(pub [Quantity; 4]);

impl Attitude {
    /// The frame for an estimate.
    #[must_use]
    pub fn new(estimate: &ContactEstimate) -> Self {
        let Quaternion { w, x, y, z } = estimate.orientation;
        Self([w, x, y, z].map(|value| Quantity::new(value, UNIT_STEP)))
    }

    /// The orientation; its length is 1 to within the resolution.
    #[must_use]
    pub fn orientation(&self) -> Quaternion {
        let [w, x, y, z] = self.0.map(|code| code.value(UNIT_STEP));
        Quaternion { w, x, y, z }
    }

    /// The frame's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        words(self.0.map(|code| code.0 as u16))
    }

    /// The frame with these bytes, whatever they are.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        Self(from_bytes(*bytes).map(|code| Quantity(code as i16)))
    }
}

/// A frame of three codes and a time.
macro_rules! timed_vector {
    ($(#[$doc:meta])* $name:ident, $step:ident, $field:ident, $(#[$value_doc:meta])* $value:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name {
            /// The codes along x, y and z.
            pub codes: [Quantity; 3],
            /// When the sample was acquired.
            pub timestamp: ShortTime,
        }

        impl $name {
            /// The frame for an estimate.
            #[must_use]
            pub fn new(estimate: &ContactEstimate) -> Self {
                Self {
                    codes: codes(estimate.$field.0, $step),
                    timestamp: estimate.timestamp.into(),
                }
            }

            $(#[$value_doc])*
            #[must_use]
            pub fn $value(&self) -> Vec3 {
                vector(self.codes, $step)
            }

            /// The frame's bytes.
            #[must_use]
            pub fn encode(&self) -> [u8; 8] {
                let [x, y, z] = self.codes.map(|code| code.0 as u16);
                words([x, y, z, self.timestamp.0])
            }

            /// The frame with these bytes, whatever they are.
            #[must_use]
            pub fn decode(bytes: &[u8; 8]) -> Self {
                let [x, y, z, time] = from_bytes(*bytes);
                Self {
                    codes: [x, y, z].map(|code| Quantity(code as i16)),
                    timestamp: ShortTime(time),
                }
            }
        }
    };
}

timed_vector!(
    /// The contents of TPDO4: acceleration without gravity, sensor frame.
    Acceleration,
    ACCELERATION_STEP,
    linear_acceleration,
    /// The acceleration, m/s².
    acceleration
);

timed_vector!(
    /// The contents of TPDO5: angular rate without bias, sensor frame.
    Rate,
    RATE_STEP,
    angular_rate,
    /// The angular rate, rad/s.
    rate
);

/// The contents of TPDO6: gyroscope bias and the sensor's temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bias {
    /// The codes of the bias along x, y and z.
    pub codes: [Quantity; 3],
    /// The code of the temperature.
    pub temperature: Quantity,
}

impl Bias {
    /// The frame for an estimate and a temperature in °C.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, temperature: f32) -> Self {
        Self {
            codes: codes(estimate.gyro_bias.0, BIAS_STEP),
            temperature: Quantity::new(temperature, TEMPERATURE_STEP),
        }
    }

    /// The bias, rad/s.
    #[must_use]
    pub fn bias(&self) -> Vec3 {
        vector(self.codes, BIAS_STEP)
    }

    /// The sensor's temperature, °C.
    #[must_use]
    pub fn temperature(&self) -> f32 {
        self.temperature.value(TEMPERATURE_STEP)
    }

    /// The frame's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [x, y, z] = self.codes.map(|code| code.0 as u16);
        words([x, y, z, self.temperature.0 as u16])
    }

    /// The frame with these bytes, whatever they are.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [x, y, z, temperature] = from_bytes(*bytes).map(|code| Quantity(code as i16));
        Self {
            codes: [x, y, z],
            temperature,
        }
    }
}

const fn words_of<const N: usize>(index: u16, mut mapping: [Mapped; N]) -> [Mapped; N] {
    let mut i = 0;
    while i < N {
        if let Some(mapped) = mapping.split_at_mut(i).1.first_mut() {
            *mapped = Mapped::new(index, i as u8 + 1, 16);
        }
        i += 1;
    }
    mapping
}

pub(super) const ATTITUDE_MAPPING: &[Mapped] = &words_of(index::ATTITUDE, [TIMESTAMP; 4]);

const fn vector_and(index: u16, last: Mapped) -> [Mapped; 4] {
    let [x, y, z] = words_of(index, [TIMESTAMP; 3]);
    [x, y, z, last]
}

pub(super) const ACCELERATION_MAPPING: &[Mapped] = &vector_and(index::ACCELERATION, TIMESTAMP);
pub(super) const RATE_MAPPING: &[Mapped] = &vector_and(index::RATE, TIMESTAMP);
pub(super) const BIAS_MAPPING: &[Mapped] =
    &vector_and(index::BIAS, Mapped::new(index::TEMPERATURE, 0, 16));

const ORIENTATION: &str = "Orientation quaternion (Hamilton), sensor to world, z up, heading arbitrary; of the sample of the Contact message before it.";

pub(super) const ATTITUDE_SIGNALS: &[Signal] = &[
    Signal::quantity("QuaternionW", 0, UNIT, "", ORIENTATION),
    Signal::quantity("QuaternionX", 16, UNIT, "", ORIENTATION),
    Signal::quantity("QuaternionY", 32, UNIT, "", ORIENTATION),
    Signal::quantity("QuaternionZ", 48, UNIT, "", ORIENTATION),
];

const ACCELERATED: &str = "Acceleration without gravity, sensor frame; 0 where it is not known.";

pub(super) const ACCELERATION_SIGNALS: &[Signal] = &[
    Signal::quantity(
        "AccelerationX",
        0,
        ACCELERATION_STEP,
        ACCELERATION_UNIT,
        ACCELERATED,
    ),
    Signal::quantity(
        "AccelerationY",
        16,
        ACCELERATION_STEP,
        ACCELERATION_UNIT,
        ACCELERATED,
    ),
    Signal::quantity(
        "AccelerationZ",
        32,
        ACCELERATION_STEP,
        ACCELERATION_UNIT,
        ACCELERATED,
    ),
    Signal::timestamp(48),
];

const TURNING: &str = "Angular rate without bias, sensor frame; 0 where it is not known.";

pub(super) const RATE_SIGNALS: &[Signal] = &[
    Signal::quantity("RateX", 0, RATE_STEP, RATE_UNIT, TURNING),
    Signal::quantity("RateY", 16, RATE_STEP, RATE_UNIT, TURNING),
    Signal::quantity("RateZ", 32, RATE_STEP, RATE_UNIT, TURNING),
    Signal::timestamp(48),
];

const BIASED: &str = "Estimated bias of the gyroscope, sensor frame.";

pub(super) const BIAS_SIGNALS: &[Signal] = &[
    Signal::quantity("BiasX", 0, BIAS_STEP, RATE_UNIT, BIASED),
    Signal::quantity("BiasY", 16, BIAS_STEP, RATE_UNIT, BIASED),
    Signal::quantity("BiasZ", 32, BIAS_STEP, RATE_UNIT, BIASED),
    Signal::quantity(
        "Temperature",
        48,
        TEMPERATURE_STEP,
        "degC",
        "Temperature of the sensor.",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{AngularRate, LinearAcceleration, Timestamp};

    fn estimate() -> ContactEstimate {
        ContactEstimate {
            timestamp: Timestamp::from_micros(655_360 + 0x1230),
            orientation: Quaternion {
                w: 0.5,
                x: -0.5,
                y: 1.0,
                z: -1.0,
            },
            linear_acceleration: LinearAcceleration(Vec3::new(1.0, -1.0, 1.0e6)),
            angular_rate: AngularRate(Vec3::new(0.125, -34.9, f32::NAN)),
            gyro_bias: AngularRate(Vec3::new(0.001, -0.001, 0.0)),
            ..Default::default()
        }
    }

    #[test]
    fn golden_bytes() {
        let estimate = estimate();
        assert_eq!(
            Attitude::new(&estimate).encode(),
            [0x00, 0x40, 0x00, 0xC0, 0xFF, 0x7F, 0x01, 0x80]
        );
        assert_eq!(
            Acceleration::new(&estimate).encode(),
            [100, 0, 0x9C, 0xFF, 0xFF, 0x7F, 0xD1, 0x01]
        );
        assert_eq!(
            Rate::new(&estimate).encode(),
            [100, 0, 0xF0, 0x92, 0x00, 0x80, 0xD1, 0x01]
        );
        assert_eq!(
            Bias::new(&estimate, 25.5).encode(),
            [100, 0, 0x9C, 0xFF, 0, 0, 0xF6, 0x09]
        );
    }

    #[test]
    fn decoding_gives_back_what_was_encoded() {
        let estimate = estimate();
        let attitude = Attitude::new(&estimate);
        assert_eq!(Attitude::decode(&attitude.encode()), attitude);
        assert!((attitude.orientation().w - 0.5).abs() < 1.0 / 65_534.0 + 1e-7);
        let acceleration = Acceleration::new(&estimate);
        assert_eq!(Acceleration::decode(&acceleration.encode()), acceleration);
        // The last one saturates.
        let error = acceleration.acceleration() - Vec3::new(1.0, -1.0, 327.67);
        assert!(error.is_within(1.0e-4), "off by {error:?}");
        let rate = Rate::new(&estimate);
        assert_eq!(Rate::decode(&rate.encode()), rate);
        assert!(rate.rate().z.is_nan());
        let bias = Bias::new(&estimate, -40.0);
        assert_eq!(Bias::decode(&bias.encode()), bias);
        assert_eq!(bias.temperature(), -40.0);
    }
}
