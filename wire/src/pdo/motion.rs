//! TPDO3 to TPDO6: orientation, acceleration, angular rate and bias.
//!
//! All values are signed 16-bit codes times a step; −32768 means "no value".
//!
//! TPDO3, attitude, has no time. It is w, x, y, z in steps of 1/32767, of the same sample as the last TPDO1 that the
//! foot sent.

use estimator_core::{ContactEstimate, Flag, Quaternion, Vec3};

use super::code::{
    ACCELERATION_STEP, BIAS_STEP, Quantity, RATE_STEP, ShortTime, TEMPERATURE_STEP, UNIT_STEP,
};
use super::field::{Field, Signal, TIMESTAMP};
use crate::address::index;
use crate::fault::Faults;
use crate::value::Value;

/// Units in the DBC, which has no superscripts.
const ACCELERATION_UNIT: &str = "m/s^2";
const RATE_UNIT: &str = "rad/s";

/// Encodes four words.
fn words([a, b, c, d]: [u16; 4]) -> [u8; 8] {
    let [a, b, c, d] = [a, b, c, d].map(u16::to_le_bytes);
    let ([a0, a1], [b0, b1], [c0, c1], [d0, d1]) = (a, b, c, d);
    [a0, a1, b0, b1, c0, c1, d0, d1]
}

/// Decodes four words.
fn from_bytes([a0, a1, b0, b1, c0, c1, d0, d1]: [u8; 8]) -> [u16; 4] {
    [[a0, a1], [b0, b1], [c0, c1], [d0, d1]].map(u16::from_le_bytes)
}

/// Returns whether the motion of the foot is known: no fault of the sensor voids the estimate, up is known, and the
/// newest sample is neither stale nor invalid.
fn is_known(estimate: &ContactEstimate, faults: Faults) -> bool {
    let unknown = [Flag::AttitudeNotInitialised, Flag::Stale, Flag::InvalidSample];
    let flagged = unknown.into_iter().any(|flag| estimate.flags.contains(flag));
    !faults.void_estimate() && !flagged
}

fn codes(vector: Vec3, step: f64) -> [Quantity; 3] {
    [vector.x, vector.y, vector.z].map(|value| Quantity::new(value, step))
}

fn vector(codes: [Quantity; 3], step: f64) -> Vec3 {
    let [x, y, z] = codes.map(|code| code.value(step));
    Vec3::new(x, y, z)
}

/// The contents of TPDO3: orientation, foot → world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attitude(pub [Quantity; 4]);

impl Attitude {
    /// Creates the frame for an estimate while `faults` are active; without values if it is unknown.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, faults: Faults) -> Self {
        if !is_known(estimate, faults) {
            return Self([Quantity::NONE; 4]);
        }
        let Quaternion { w, x, y, z } = estimate.orientation;
        Self([w, x, y, z].map(|value| Quantity::new(value, UNIT_STEP)))
    }

    /// Orientation; its length is 1 to within the resolution.
    #[must_use]
    pub fn orientation(&self) -> Quaternion {
        let [w, x, y, z] = self.0.map(|code| code.value(UNIT_STEP));
        Quaternion { w, x, y, z }
    }

    /// Encodes the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        words(self.0.map(|code| code.0 as u16))
    }

    /// Decodes the frame; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        Self(from_bytes(*bytes).map(|code| Quantity(code as i16)))
    }
}

/// Defines a frame of three codes and a time.
macro_rules! timed_vector {
    ($(#[$doc:meta])* $name:ident, $step:ident, $field:ident, $(#[$value_doc:meta])* $value:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name {
            /// Codes along x, y and z.
            pub codes: [Quantity; 3],
            /// Acquisition time of the sample.
            pub timestamp: ShortTime,
        }

        impl $name {
            /// Creates the frame for an estimate while `faults` are active; without values if it is unknown.
            #[must_use]
            pub fn new(estimate: &ContactEstimate, faults: Faults) -> Self {
                let known = is_known(estimate, faults);
                Self {
                    codes: if known {
                        codes(estimate.$field.0, $step)
                    } else {
                        [Quantity::NONE; 3]
                    },
                    timestamp: estimate.timestamp.into(),
                }
            }

            $(#[$value_doc])*
            #[must_use]
            pub fn $value(&self) -> Vec3 {
                vector(self.codes, $step)
            }

            /// Encodes the frame.
            #[must_use]
            pub fn encode(&self) -> [u8; 8] {
                let [x, y, z] = self.codes.map(|code| code.0 as u16);
                words([x, y, z, self.timestamp.0])
            }

            /// Decodes the frame; accepts any bytes.
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
    /// The contents of TPDO4: acceleration without gravity, frame of the foot.
    Acceleration,
    ACCELERATION_STEP,
    linear_acceleration,
    /// The acceleration, m/s².
    acceleration
);

timed_vector!(
    /// The contents of TPDO5: angular rate without bias, frame of the foot.
    Rate,
    RATE_STEP,
    angular_rate,
    /// The angular rate, rad/s.
    rate
);

/// The contents of TPDO6: gyroscope bias and the sensor's temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bias {
    /// Codes of the bias along x, y and z.
    pub codes: [Quantity; 3],
    /// Code of the temperature.
    pub temperature: Quantity,
}

impl Bias {
    /// Creates the frame for an estimate and a temperature in °C while `faults` are active. Unknown values are left
    /// out.
    #[must_use]
    pub fn new(estimate: &ContactEstimate, temperature: f32, faults: Faults) -> Self {
        Self {
            codes: if is_known(estimate, faults) {
                codes(estimate.gyro_bias.0, BIAS_STEP)
            } else {
                [Quantity::NONE; 3]
            },
            temperature: if faults.void_estimate() {
                Quantity::NONE
            } else {
                Quantity::new(temperature, TEMPERATURE_STEP)
            },
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

    /// Encodes the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [x, y, z] = self.codes.map(|code| code.0 as u16);
        words([x, y, z, self.temperature.0 as u16])
    }

    /// Decodes the frame; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [x, y, z, temperature] = from_bytes(*bytes).map(|code| Quantity(code as i16));
        Self { codes: [x, y, z], temperature }
    }
}

/// Creates a 16-bit quantity, with its step as text and as a number.
const fn quantity(
    index: u16,
    subindex: u8,
    name: &'static str,
    step: &'static str,
    signals: &'static [Signal],
) -> Field {
    Field::new(index, subindex, name, Value::I16(0), signals).unit(step)
}

pub(super) const ATTITUDE: [Field; 4] = {
    const fn part(subindex: u8, name: &'static str, signals: &'static [Signal]) -> Field {
        quantity(index::ATTITUDE, subindex, name, "1/32767", signals)
    }
    const fn signal(name: &'static str) -> Signal {
        Signal::quantity(
            name,
            UNIT_STEP,
            "",
            "Orientation quaternion (Hamilton), foot to world, z up, heading arbitrary; of the same sample as the previous Contact message.",
        )
    }
    [
        part(1, "w", &[signal("QuaternionW")]),
        part(2, "x", &[signal("QuaternionX")]),
        part(3, "y", &[signal("QuaternionY")]),
        part(4, "z", &[signal("QuaternionZ")]),
    ]
};

pub(super) const ACCELERATION: [Field; 4] = {
    const fn along(subindex: u8, name: &'static str, signals: &'static [Signal]) -> Field {
        quantity(index::ACCELERATION, subindex, name, "0.01 m/s²", signals)
    }
    const fn signal(name: &'static str) -> Signal {
        let about = "Acceleration without gravity, frame of the foot.";
        Signal::quantity(name, ACCELERATION_STEP, ACCELERATION_UNIT, about)
    }
    [
        along(1, "x", &[signal("AccelerationX")]),
        along(2, "y", &[signal("AccelerationY")]),
        along(3, "z", &[signal("AccelerationZ")]),
        TIMESTAMP,
    ]
};

pub(super) const RATE: [Field; 4] = {
    const fn about(subindex: u8, name: &'static str, signals: &'static [Signal]) -> Field {
        quantity(index::RATE, subindex, name, "0.00125 rad/s", signals)
    }
    const fn signal(name: &'static str) -> Signal {
        let about = "Angular rate without bias, frame of the foot.";
        Signal::quantity(name, RATE_STEP, RATE_UNIT, about)
    }
    [
        about(1, "x", &[signal("RateX")]),
        about(2, "y", &[signal("RateY")]),
        about(3, "z", &[signal("RateZ")]),
        TIMESTAMP,
    ]
};

pub(super) const BIAS: [Field; 4] = {
    const fn about(subindex: u8, name: &'static str, signals: &'static [Signal]) -> Field {
        quantity(index::BIAS, subindex, name, "0.00001 rad/s", signals)
    }
    const fn signal(name: &'static str) -> Signal {
        let about = "Estimated bias of the gyroscope, frame of the foot.";
        Signal::quantity(name, BIAS_STEP, RATE_UNIT, about)
    }
    [
        about(1, "x", &[signal("BiasX")]),
        about(2, "y", &[signal("BiasY")]),
        about(3, "z", &[signal("BiasZ")]),
        quantity(
            index::TEMPERATURE,
            0,
            "Sensor temperature",
            "0.01 °C",
            &[Signal::quantity(
                "Temperature",
                TEMPERATURE_STEP,
                "degC",
                "Temperature of the sensor.",
            )],
        ),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use estimator_core::{AngularRate, Flags, LinearAcceleration, Timestamp};

    fn estimate() -> ContactEstimate {
        ContactEstimate {
            timestamp: Timestamp::from_micros(655_360 + 0x1230),
            orientation: Quaternion { w: 0.5, x: -0.5, y: 1.0, z: -1.0 },
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
            Attitude::new(&estimate, Faults::NONE).encode(),
            [0x00, 0x40, 0x00, 0xC0, 0xFF, 0x7F, 0x01, 0x80]
        );
        assert_eq!(
            Acceleration::new(&estimate, Faults::NONE).encode(),
            [100, 0, 0x9C, 0xFF, 0xFF, 0x7F, 0xD1, 0x01]
        );
        assert_eq!(
            Rate::new(&estimate, Faults::NONE).encode(),
            [100, 0, 0xF0, 0x92, 0x00, 0x80, 0xD1, 0x01]
        );
        assert_eq!(
            Bias::new(&estimate, 25.5, Faults::NONE).encode(),
            [100, 0, 0x9C, 0xFF, 0, 0, 0xF6, 0x09]
        );
    }

    #[test]
    fn unknown_motion_has_no_value() {
        let all = |estimate: &ContactEstimate, faults| {
            let Bias { codes, temperature } = Bias::new(estimate, 25.0, faults);
            let motion = [
                &Attitude::new(estimate, faults).0[..],
                &Acceleration::new(estimate, faults).codes,
                &Rate::new(estimate, faults).codes,
                &codes,
            ];
            (motion.concat(), temperature)
        };
        let mut estimate = estimate();
        estimate.angular_rate.0 = Vec3::default();
        let known = all(&estimate, Faults::NONE.with(Fault::LateTick));
        assert!(known.0.iter().all(|code| *code != Quantity::NONE));
        let (motion, temperature) = all(&estimate, Faults::NONE.with(Fault::SensorFrozen));
        assert!(motion.iter().all(|code| *code == Quantity::NONE));
        assert_eq!(temperature, Quantity::NONE);
        for flag in Flag::ALL {
            estimate.flags = Flags::NONE.with(flag);
            let (motion, temperature) = all(&estimate, Faults::NONE);
            let unknown =
                matches!(flag, Flag::AttitudeNotInitialised | Flag::Stale | Flag::InvalidSample);
            for code in motion {
                assert_eq!(code == Quantity::NONE, unknown, "{flag:?}");
            }
            assert_eq!(temperature, Quantity(2500));
        }
    }

    #[test]
    fn decoding_restores_the_encoded_motion() {
        let estimate = estimate();
        let attitude = Attitude::new(&estimate, Faults::NONE);
        assert_eq!(Attitude::decode(&attitude.encode()), attitude);
        assert!((attitude.orientation().w - 0.5).abs() < 1.0 / 65_534.0 + 1e-7);
        let acceleration = Acceleration::new(&estimate, Faults::NONE);
        assert_eq!(Acceleration::decode(&acceleration.encode()), acceleration);
        // The last component saturates.
        let error = acceleration.acceleration() - Vec3::new(1.0, -1.0, 327.67);
        assert!(error.is_within(1.0e-4), "off by {error:?}");
        let rate = Rate::new(&estimate, Faults::NONE);
        assert_eq!(Rate::decode(&rate.encode()), rate);
        assert!(rate.rate().z.is_nan());
        let bias = Bias::new(&estimate, -40.0, Faults::NONE);
        assert_eq!(Bias::decode(&bias.encode()), bias);
        assert_eq!(bias.temperature(), -40.0);
    }
}
