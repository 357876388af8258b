//! The analogue half of an LSM6DSOX on the foot: what its outputs would read with endless digits.
//!
//! One conversion at a time, at the sensor's own rate: true specific force and angular rate, plus
//! bias with temperature drift, plus white noise, through the low-pass filters. What happens next
//! (codes, range) is in [`codes`](super::codes), so that a register-level model can take its place.
//!
//! Left out: scale-factor and axis-alignment errors, sensitivity of the gyroscope to
//! acceleration, vibration rectification, and the small delay between the axes. The converter's
//! own range is taken to be wider than that of the output codes.

use estimator_core::params::STANDARD_GRAVITY;

use super::low_pass::LowPass;
use super::motion::FootState;
use super::random::{Random, Stream};
use super::space::Vector;

/// Standard gravity, m/s².
pub const GRAVITY: f64 = STANDARD_GRAVITY as f64;

/// One thousandth of standard gravity, m/s².
pub const MILLI_G: f64 = 1e-3 * GRAVITY;

/// One thousandth of a degree per second, rad/s.
pub const MILLI_DPS: f64 = 1e-3 * std::f64::consts::PI / 180.0;

/// Time between conversions at the sensor's highest rate, µs. ST writes 6667 Hz for it; the rate
/// is nominally 20 kHz / 3.
pub const CONVERSION_PERIOD_US: u64 = 150;

/// Conversions per second.
const CONVERSION_RATE: f64 = 1e6 / CONVERSION_PERIOD_US as f64;

/// Temperature at which biases are given, °C.
const REFERENCE_TEMPERATURE: f64 = 25.0;

/// The errors of three axes of one kind. `unit` is m/s² or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisErrors {
    /// White noise before the filter, unit/√Hz.
    pub noise_density: f64,
    /// Cutoff of the low-pass filter, Hz; below 3333.
    pub cutoff: f64,
    /// Each axis has a bias evenly drawn from ± this, unit.
    pub bias_limit: f64,
    /// Each axis' bias changes with temperature by a coefficient evenly drawn from ± this,
    /// unit/°C.
    pub drift_limit: f64,
}

/// How warm the sensor is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Temperature {
    /// Always the same, °C.
    Constant(f64),
    /// A robot that has just been switched on.
    Warming {
        /// At the beginning, °C.
        from: f64,
        /// In the end, °C.
        to: f64,
        /// Time in which the difference falls to 1/e, s.
        time_constant: f64,
    },
}

impl Temperature {
    /// At time `t` in s, in °C.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Constant(celsius) => celsius,
            Self::Warming {
                from,
                to,
                time_constant,
            } => to + (from - to) * libm::exp(-t / time_constant),
        }
    }
}

/// What the sensor is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorParams {
    /// The accelerometer, m/s².
    pub accelerometer: AxisErrors,
    /// The gyroscope, rad/s.
    pub gyroscope: AxisErrors,
    /// The sensor's temperature.
    pub temperature: Temperature,
}

impl SensorParams {
    /// An LSM6DSOX at ±16 g, ±2000 °/s and 6667 Hz, with filters below the 500 Hz that 1 kHz
    /// sampling allows, at 25 °C. Noise and offsets are not checked against the part's own
    /// datasheet, DS12814.
    ///
    /// | field | accelerometer | gyroscope | source |
    /// |---|---|---|---|
    /// | `noise_density` | 110 µg/√Hz | 3.8 m°/s/√Hz | ST's figures for the family, second-hand |
    /// | `cutoff` | 333 Hz | 335 Hz | LPF2 at ODR/20; LPF1 with FTYPE 0 |
    /// | `bias_limit` | 20 mg | 0.5 °/s | assumed, of the order of ST's typical offsets |
    /// | `drift_limit` | 0.1 mg/°C | 0.01 °/s/°C | assumed, of the order of ST's typical drifts |
    pub const LSM6DSOX: Self = Self {
        accelerometer: AxisErrors {
            noise_density: 0.110 * MILLI_G,
            cutoff: 333.0,
            bias_limit: 20.0 * MILLI_G,
            drift_limit: 0.1 * MILLI_G,
        },
        gyroscope: AxisErrors {
            noise_density: 3.8 * MILLI_DPS,
            cutoff: 335.0,
            bias_limit: 500.0 * MILLI_DPS,
            drift_limit: 10.0 * MILLI_DPS,
        },
        temperature: Temperature::Constant(REFERENCE_TEMPERATURE),
    };

    /// The same sensor on a robot that warms up by 20 °C with a time constant of 3 min.
    pub const LSM6DSOX_WARMING: Self = Self {
        temperature: Temperature::Warming {
            from: REFERENCE_TEMPERATURE,
            to: REFERENCE_TEMPERATURE + 20.0,
            time_constant: 180.0,
        },
        ..Self::LSM6DSOX
    };
}

impl Default for SensorParams {
    fn default() -> Self {
        Self::LSM6DSOX
    }
}

/// One conversion, before it is rounded to codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Sensor frame, gravity included, m/s².
    pub specific_force: Vector,
    /// Sensor frame, rad/s.
    pub angular_rate: Vector,
    /// °C.
    pub temperature: f64,
}

/// The analogue half of one sensor, with its own biases and noise.
#[derive(Clone, Debug)]
pub struct Analogue {
    accelerometer: Axes,
    gyroscope: Axes,
    temperature: Temperature,
    noise: Random,
}

/// Three axes of one kind.
#[derive(Clone, Debug)]
struct Axes {
    /// At the reference temperature.
    bias: Vector,
    /// Per °C.
    drift: Vector,
    /// Standard deviation of the noise of one conversion, before the filter.
    noise: f64,
    filters: [LowPass; 3],
}

impl Axes {
    fn new(errors: &AxisErrors, biases: &mut Random) -> Self {
        let mut draw =
            |limit: f64| Vector::from_array([(); 3].map(|()| biases.uniform(-limit..limit)));
        Self {
            bias: draw(errors.bias_limit),
            drift: draw(errors.drift_limit),
            // White noise sampled at a rate has its whole power below half that rate.
            noise: errors.noise_density * libm::sqrt(0.5 * CONVERSION_RATE),
            filters: [LowPass::new(errors.cutoff, CONVERSION_RATE); 3],
        }
    }

    fn bias_at(&self, temperature: f64) -> Vector {
        let warmth = temperature - REFERENCE_TEMPERATURE;
        self.bias + self.drift * warmth
    }

    fn convert(&mut self, truth: Vector, temperature: f64, noise: &mut Random) -> Vector {
        let mut output = (truth + self.bias_at(temperature)).to_array();
        for (value, filter) in output.iter_mut().zip(&mut self.filters) {
            *value = filter.push(*value + self.noise * noise.normal());
        }
        Vector::from_array(output)
    }
}

impl Analogue {
    /// The sensor with the biases and the noise that belong to `seed`.
    #[must_use]
    pub fn new(params: &SensorParams, seed: u64) -> Self {
        let mut biases = Random::new(seed, Stream::Biases);
        Self {
            accelerometer: Axes::new(&params.accelerometer, &mut biases),
            gyroscope: Axes::new(&params.gyroscope, &mut biases),
            temperature: params.temperature,
            noise: Random::new(seed, Stream::Noise),
        }
    }

    /// The next conversion, [`CONVERSION_PERIOD_US`] after the one before, of a foot whose state
    /// at that moment, `t` in s, is `foot`.
    pub fn convert(&mut self, foot: &FootState, t: f64) -> Measurement {
        let temperature = self.temperature.at(t);
        let against_gravity = foot.acceleration + Vector::new(0.0, 0.0, GRAVITY);
        let force = foot.orientation.to_sensor(against_gravity);
        Measurement {
            specific_force: self
                .accelerometer
                .convert(force, temperature, &mut self.noise),
            angular_rate: self
                .gyroscope
                .convert(foot.angular_rate, temperature, &mut self.noise),
            temperature,
        }
    }

    /// The accelerometer's bias at a temperature in °C, m/s².
    #[must_use]
    pub fn accelerometer_bias(&self, temperature: f64) -> Vector {
        self.accelerometer.bias_at(temperature)
    }

    /// The gyroscope's bias at a temperature in °C, rad/s.
    #[must_use]
    pub fn gyroscope_bias(&self, temperature: f64) -> Vector {
        self.gyroscope.bias_at(temperature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::motion::Motion;
    use crate::gait::plan::{GaitName, Ground, Plan};

    fn standing(seconds: u32, params: &SensorParams, seed: u64) -> (Analogue, Vec<Measurement>) {
        let plan = Plan::steady(GaitName::Stand, Ground::Hard, f64::from(seconds), 1);
        let foot = Motion::new(&plan).at(0.0);
        let mut sensor = Analogue::new(params, seed);
        let conversions = f64::from(seconds) * CONVERSION_RATE;
        let measurements = (0..conversions as u32)
            .map(|k| sensor.convert(&foot, f64::from(k) / CONVERSION_RATE))
            .collect();
        (sensor, measurements)
    }

    fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        libm::sqrt(values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / n)
    }

    #[test]
    fn the_noise_at_rest_is_two_milli_g_and_seventy_milli_degrees_per_second() {
        let (_, measurements) = standing(20, &SensorParams::LSM6DSOX, 1);
        for axis in 0..3 {
            let force = measurements
                .iter()
                .map(|m| m.specific_force.to_array()[axis]);
            let rate = measurements.iter().map(|m| m.angular_rate.to_array()[axis]);
            let (force, rate) = (deviation(force) / MILLI_G, deviation(rate) / MILLI_DPS);
            assert!((1.8..2.2).contains(&force), "{force} mg");
            assert!((63.0..77.0).contains(&rate), "{rate} m°/s");
        }
    }

    #[test]
    fn at_rest_the_specific_force_is_gravity_pointing_up_plus_bias() {
        for seed in 0..20 {
            let (sensor, measurements) = standing(1, &SensorParams::LSM6DSOX, seed);
            let sum = measurements.iter().map(|m| m.specific_force);
            let mean =
                sum.fold(Vector::default(), |a, b| a + b) * (1.0 / measurements.len() as f64);
            let error = mean - Vector::new(0.0, 0.0, GRAVITY);
            assert!((error - sensor.accelerometer_bias(25.0)).length() < 0.003);
            assert!(error.to_array().iter().all(|e| e.abs() < 21.0 * MILLI_G));
            assert!(error.length() > 1.0 * MILLI_G);
        }
    }

    #[test]
    fn a_warming_sensor_drifts_by_its_coefficients() {
        let quiet = |errors: AxisErrors| AxisErrors {
            noise_density: 0.0,
            ..errors
        };
        let params = SensorParams {
            accelerometer: quiet(SensorParams::LSM6DSOX.accelerometer),
            gyroscope: quiet(SensorParams::LSM6DSOX.gyroscope),
            temperature: Temperature::Warming {
                from: 25.0,
                to: 45.0,
                time_constant: 1.0,
            },
        };
        let (sensor, measurements) = standing(12, &params, 3);
        let (cold, warm) = (measurements[0], measurements[measurements.len() - 1]);
        assert_eq!(cold.temperature, 25.0);
        assert!((warm.temperature - 45.0).abs() < 0.01);
        let drift = warm.angular_rate - cold.angular_rate;
        assert!(drift.length() > 1.0 * MILLI_DPS);
        assert!(
            drift
                .to_array()
                .iter()
                .all(|d| d.abs() <= 200.0 * MILLI_DPS)
        );
        assert!((warm.angular_rate - sensor.gyroscope_bias(45.0)).length() < 1e-6);
    }
}
