//! LSM6DSOX on the foot: its specimen, temperature and stimulus.
//!
//! The rest of the part (noise, filters, codes, range, clock, registers) is modelled in [`lsm6dsox::sim`]; the
//! foot's program accesses it through its own driver.
//!
//! Not modelled: scale-factor and axis-alignment errors, sensitivity of the gyroscope to acceleration, vibration
//! rectification, and the small delay between the axes.

use lsm6dsox::scale::{DEGREE, STANDARD_GRAVITY};
use lsm6dsox::sim::{Part, PartOptions, SharedPart, Stimulus};
use samples::space::{Rotation, Vector};

use crate::random::{RandomUse, SeededRandom};
use crate::track::FootState;

/// Standard gravity, m/s².
pub const GRAVITY: f64 = STANDARD_GRAVITY as f64;

/// One thousandth of standard gravity, m/s².
pub const MILLI_G: f64 = 1e-3 * GRAVITY;

/// One thousandth of a degree per second, rad/s.
pub const MILLI_DPS: f64 = 1e-3 * DEGREE as f64;

/// Duration of a byte on the bus, ns: 10 MHz.
const BYTE_TIME_NS: u32 = 800;

/// Spread of the errors of three axes between specimens. `unit` is m/s² or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisErrors {
    /// Bias of each axis at 25 °C, drawn uniformly from ± this, unit.
    pub bias_limit: f64,
    /// Temperature coefficient of each axis' bias, drawn uniformly from ± this, unit/°C.
    pub drift_limit: f64,
}

/// Temperature of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Temperature {
    /// Constant temperature, °C.
    Constant(f64),
    /// Temperature on a robot that has just been switched on.
    Warming {
        /// At the beginning, °C.
        from: f64,
        /// Final value, °C.
        to: f64,
        /// Time in which the difference falls to 1/e, s.
        time_constant: f64,
    },
}

impl Temperature {
    /// Returns the temperature at time `t` in s, °C; before 0 as at 0.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Constant(celsius) => celsius,
            Self::Warming { from, to, time_constant } => {
                to + (from - to) * libm::exp(-t.max(0.0) / time_constant)
            }
        }
    }
}

/// Spread of the sensor's specimens, and their temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorParams {
    /// The accelerometer, m/s².
    pub accelerometer: AxisErrors,
    /// The gyroscope, rad/s.
    pub gyroscope: AxisErrors,
    /// Fraction by which a specimen's clock is fast, drawn uniformly from ± this.
    pub clock_limit: f64,
    /// The sensor's temperature.
    pub temperature: Temperature,
    /// Growth of the gyroscope bias per axis, rad/s²: a failing sensor.
    pub gyroscope_drift: [f64; 3],
}

impl SensorParams {
    /// An LSM6DSOX at 25 °C. Offsets and tolerance are not checked against the part's own
    /// datasheet, DS12814.
    ///
    /// | field | accelerometer | gyroscope | source |
    /// |---|---|---|---|
    /// | `bias_limit` | 20 mg | 0.5 °/s | assumed, of the order of ST's typical offsets |
    /// | `drift_limit` | 0.1 mg/°C | 0.01 °/s/°C | assumed, of the order of ST's typical drifts |
    /// | `clock_limit` | 3 % | the same clock | assumed; others report "some per cent" |
    pub const LSM6DSOX: Self = Self {
        accelerometer: AxisErrors { bias_limit: 20.0 * MILLI_G, drift_limit: 0.1 * MILLI_G },
        gyroscope: AxisErrors { bias_limit: 500.0 * MILLI_DPS, drift_limit: 10.0 * MILLI_DPS },
        clock_limit: 0.03,
        temperature: Temperature::Constant(25.0),
        gyroscope_drift: [0.0; 3],
    };

    /// The same sensor on a robot that warms up by 20 °C with a time constant of 3 min.
    pub const LSM6DSOX_WARMING: Self = Self {
        temperature: Temperature::Warming { from: 25.0, to: 45.0, time_constant: 180.0 },
        ..Self::LSM6DSOX
    };

    /// Returns the specimen of `seed`.
    #[must_use]
    pub fn specimen(&self, seed: u64) -> PartOptions {
        let mut random = SeededRandom::new(seed, RandomUse::Specimen);
        let mut axes = |limit: f64| [(); 3].map(|()| random.uniform(-limit..limit));
        PartOptions {
            seed,
            // In the order in which they are drawn.
            accel_bias: axes(self.accelerometer.bias_limit),
            accel_drift: axes(self.accelerometer.drift_limit),
            gyro_bias: axes(self.gyroscope.bias_limit),
            gyro_drift: axes(self.gyroscope.drift_limit),
            clock_error: random.uniform(-self.clock_limit..self.clock_limit),
            byte_time_ns: BYTE_TIME_NS,
            ..PartOptions::default()
        }
    }

    /// Returns the specimen of `seed`, just powered up, on a body that begins to move `delay` s later and keeps its
    /// initial state until then. `felt` returns the stimulus at a time, s, and a temperature, °C.
    #[must_use]
    pub fn mounted(
        &self,
        felt: impl Fn(f64, f64) -> Stimulus + 'static,
        delay: f64,
        seed: u64,
    ) -> SharedPart {
        let (temperature, drift) = (self.temperature, self.gyroscope_drift);
        let felt = move |seconds: f64| {
            let t = seconds - delay;
            let mut felt = felt(t, temperature.at(t));
            for (rate, drift) in felt.angular_rate.iter_mut().zip(drift) {
                *rate += drift * t.max(0.0);
            }
            felt
        };
        Part::with_options(felt, self.specimen(seed)).shared()
    }
}

/// Returns the stimulus of a sensor at `temperature`, °C, on a foot in this state.
#[must_use]
pub fn felt_by(foot: &FootState, temperature: f64) -> Stimulus {
    felt(foot.acceleration, foot.orientation, foot.angular_rate, temperature)
}

/// Returns the stimulus of a sensor on a body, from its acceleration in the world, m/s², its orientation, its angular
/// rate in its own frame, rad/s, and its temperature, °C.
pub(crate) fn felt(
    acceleration: Vector,
    orientation: Rotation,
    angular_rate: Vector,
    temperature: f64,
) -> Stimulus {
    let against_gravity = acceleration + Vector::new(0.0, 0.0, GRAVITY);
    Stimulus {
        specific_force: orientation.to_sensor(against_gravity).to_array(),
        angular_rate: angular_rate.to_array(),
        temperature,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{GaitName, Ground, Plan};
    use crate::record::record;

    /// Returns force and rate of each sample of a standing foot.
    fn standing(seconds: u32, params: &SensorParams, seed: u64) -> Vec<[Vector; 2]> {
        let plan = Plan::steady(GaitName::Stand, Ground::Hard, f64::from(seconds), 1);
        record(&plan, params, seed)
            .samples
            .iter()
            .map(|sample| {
                [sample.imu.specific_force.0, sample.imu.angular_rate.0].map(Vector::from)
            })
            .collect()
    }

    fn mean(values: impl ExactSizeIterator<Item = Vector>) -> Vector {
        let n = values.len() as f64;
        values.fold(Vector::default(), |a, b| a + b) * (1.0 / n)
    }

    fn deviation(values: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
        let n = values.len() as f64;
        let mean = values.clone().sum::<f64>() / n;
        libm::sqrt(values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / n)
    }

    #[test]
    fn noise_at_rest_is_2_mg_and_70_mdps() {
        let samples = standing(20, &SensorParams::LSM6DSOX, 1);
        for axis in 0..3 {
            let of = |sensor: usize| deviation(samples.iter().map(|s| s[sensor].to_array()[axis]));
            let (force, rate) = (of(0) / MILLI_G, of(1) / MILLI_DPS);
            assert!((1.8..2.2).contains(&force), "{force} mg");
            assert!((63.0..77.0).contains(&rate), "{rate} m°/s");
        }
    }

    #[test]
    fn force_at_rest_is_gravity_pointing_up_plus_bias() {
        for seed in 0..20 {
            let samples = standing(1, &SensorParams::LSM6DSOX, seed);
            let bias = Vector::from_array(SensorParams::LSM6DSOX.specimen(seed).accel_bias);
            let error = mean(samples.iter().map(|s| s[0])) - Vector::new(0.0, 0.0, GRAVITY);
            assert!((error - bias).length() < 0.003);
            assert!(error.to_array().iter().all(|e| e.abs() < 21.0 * MILLI_G));
            assert!(error.length() > 1.0 * MILLI_G);
        }
    }

    #[test]
    fn a_warming_sensor_drifts_by_its_coefficients() {
        let params = SensorParams {
            temperature: Temperature::Warming { from: 25.0, to: 45.0, time_constant: 1.0 },
            ..SensorParams::LSM6DSOX
        };
        let samples = standing(12, &params, 3);
        let cold = mean(samples[..20].iter().map(|s| s[1]));
        let warm = mean(samples[11_000..].iter().map(|s| s[1]));
        let drift = (warm - cold).to_array();
        assert!(Vector::from_array(drift).length() > 50.0 * MILLI_DPS);
        let specimen = params.specimen(3);
        for (drift, per_degree) in drift.into_iter().zip(specimen.gyro_drift) {
            // Noise of the mean of 20 samples; 0.2 °C in the first of them.
            assert!((drift - 20.0 * per_degree).abs() < 60.0 * MILLI_DPS);
        }
    }

    #[test]
    fn a_failing_gyroscope_drifts_evenly() {
        let params =
            SensorParams { gyroscope_drift: [0.0, 0.002, -0.001], ..SensorParams::LSM6DSOX };
        let samples = standing(10, &params, 3);
        let sound = standing(10, &SensorParams::LSM6DSOX, 3);
        let rate = |samples: &[[Vector; 2]]| mean(samples[9_900..].iter().map(|s| s[1]));
        let drift = (rate(&samples) - rate(&sound)).to_array();
        for (drift, expected) in drift.into_iter().zip([0.0, 0.0199, -0.00995]) {
            // A code is 70 m°/s, 0.0012 rad/s.
            assert!((drift - expected).abs() < 2e-4, "{drift} is not {expected}");
        }
    }

    #[test]
    fn each_seed_gives_its_own_specimen_within_limits() {
        let specimens = [1, 2, 3].map(|seed| SensorParams::LSM6DSOX.specimen(seed));
        assert_eq!(specimens[0], SensorParams::LSM6DSOX.specimen(1));
        assert_ne!(specimens[0].gyro_bias, specimens[1].gyro_bias);
        assert_ne!(specimens[1].clock_error, specimens[2].clock_error);
        for specimen in specimens {
            assert!(specimen.clock_error.abs() <= 0.03);
            assert!(specimen.gyro_bias.iter().all(|b| b.abs() <= 500.0 * MILLI_DPS));
            assert!(specimen.accel_drift.iter().all(|d| d.abs() <= 0.1 * MILLI_G));
        }
    }
}
