//! Rest, and the gyroscope's bias that can be read off there.
//!
//! Rest is the IMU being still; it is not contact. A gyroscope at rest shows its bias, but a
//! robot that turns slowly and steadily looks much the same. So a bias once known is followed
//! only within a narrow gate, which opens slowly with time: as fast as temperature moves a bias,
//! far slower than a turn comes and goes.

use crate::attitude::{Continuity, Step};
use crate::params::{DEGREE, ParamsError, in_range};
use crate::vector::Vec3;

/// Time constant of the means that deviations are taken from, s.
const MEAN_TIME_CONSTANT: f32 = 0.5;

/// How far from the known bias a rest may lie to be believed at once, rad/s.
const GATE: f32 = 0.3 * DEGREE;

/// Growth of the gate, rad/s per s, since a rest last lay inside [`GATE`]: what temperature
/// moves a MEMS gyroscope's bias by while a board warms up.
const GATE_GROWTH: f32 = 0.0005 * DEGREE;

/// Growth of the gate while at rest outside it, rad/s per s: a bias that was learnt wrong, in a
/// turn at power-up, is put right within minutes of rest.
const GATE_GROWTH_AT_REST: f32 = 0.003 * DEGREE;

/// How much rest makes a bias known, s.
const KNOWN_AFTER: f32 = 0.5;

/// What can be set in rest detection and bias estimation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestParams {
    /// How long the sensor must be still before it counts as rest, s; 0.1 to 100.
    pub duration: f32,
    /// Largest deviation of the acceleration from its mean at rest, m/s²; 0.001 to 10.
    pub acceleration: f32,
    /// Largest deviation of the angular rate from its mean at rest, rad/s; 0.0001 to 1.
    pub rate: f32,
    /// Largest bias per axis that is believed, rad/s; 0 (bias is not estimated) to 1.
    pub bias_limit: f32,
    /// Time constant of the bias estimate at rest, s; 0.1 to 1000.
    pub bias_time_constant: f32,
}

impl Default for RestParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl RestParams {
    /// | field | value | reason |
    /// |---|---|---|
    /// | `duration` | 1.5 s | longer than a stance, so that walking never counts (as VQF) |
    /// | `acceleration` | 0.5 m/s² | as VQF |
    /// | `rate` | 2 °/s | as VQF; thirty times the sensor's noise |
    /// | `bias_limit` | 2 °/s | as VQF; twice the LSM6DSOX's typical zero-rate level |
    /// | `bias_time_constant` | 4 s | averages the noise to 0.002 °/s, follows temperature |
    pub const DEFAULT: Self = Self {
        duration: 1.5,
        acceleration: 0.5,
        rate: 2.0 * DEGREE,
        bias_limit: 2.0 * DEGREE,
        bias_time_constant: 4.0,
    };

    pub(crate) fn validate(&self) -> Result<RestCoefficients, ParamsError> {
        in_range("attitude.rest.duration", self.duration, 0.1, 100.0)?;
        in_range(
            "attitude.rest.acceleration",
            self.acceleration,
            1.0e-3,
            10.0,
        )?;
        in_range("attitude.rest.rate", self.rate, 1.0e-4, 1.0)?;
        in_range("attitude.rest.bias_limit", self.bias_limit, 0.0, 1.0)?;
        in_range(
            "attitude.rest.bias_time_constant",
            self.bias_time_constant,
            0.1,
            1.0e3,
        )?;
        Ok(RestCoefficients {
            duration: self.duration,
            acceleration_squared: self.acceleration * self.acceleration,
            rate_squared: self.rate * self.rate,
            bias_limit: self.bias_limit,
            bias_time_constant: self.bias_time_constant,
        })
    }
}

/// Validated [`RestParams`] in the form the estimator computes with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestCoefficients {
    duration: f32,
    acceleration_squared: f32,
    rate_squared: f32,
    bias_limit: f32,
    bias_time_constant: f32,
}

/// Detects rest and learns the gyroscope's bias there, and only there.
#[derive(Clone, Debug)]
pub(crate) struct BiasEstimator {
    coefficients: RestCoefficients,
    mean_force: Vec3,
    mean_rate: Vec3,
    /// How long the sensor has been still, s.
    still: f32,
    /// How much rest the bias rests on, s, up to the time constant.
    learnt: f32,
    /// What the gate has opened by, rad/s.
    opening: f32,
    bias: Vec3,
}

impl BiasEstimator {
    pub(crate) const fn new(coefficients: RestCoefficients) -> Self {
        Self {
            coefficients,
            mean_force: Vec3::ZERO,
            mean_rate: Vec3::ZERO,
            still: 0.0,
            learnt: 0.0,
            opening: 0.0,
            bias: Vec3::ZERO,
        }
    }

    /// Begins with the first sample's values as means.
    pub(crate) const fn start(&mut self, force: Vec3, rate: Vec3) {
        self.mean_force = force;
        self.mean_rate = rate;
    }

    /// Takes in a sample: specific force in m/s² and angular rate in rad/s, sensor frame.
    pub(crate) fn update(&mut self, force: Vec3, rate: Vec3, step: Step) {
        let limits = self.coefficients;
        let dt = step.seconds;
        let (force_deviation, rate_deviation) = (force - self.mean_force, rate - self.mean_rate);
        let gain = dt / (MEAN_TIME_CONSTANT + dt);
        self.mean_force += force_deviation * gain;
        self.mean_rate += rate_deviation * gain;

        self.opening = (self.opening + GATE_GROWTH * dt).min(limits.bias_limit);
        let still = step.continuity == Continuity::Continuous
            && force_deviation.dot(force_deviation) <= limits.acceleration_squared
            && rate_deviation.dot(rate_deviation) <= limits.rate_squared
            && self.mean_rate.is_within(limits.bias_limit);
        if !still {
            self.still = 0.0;
            return;
        }
        self.still = (self.still + dt).min(limits.duration);
        if self.still >= limits.duration {
            self.learn(dt);
        }
    }

    fn learn(&mut self, dt: f32) {
        let error = self.mean_rate - self.bias;
        let distance_squared = error.dot(error);
        let gate = GATE + self.opening;
        let known = self.learnt > KNOWN_AFTER;
        if !known || distance_squared < gate * gate {
            self.learnt = (self.learnt + dt).min(self.coefficients.bias_time_constant);
            self.bias += error * (dt / self.learnt);
        }
        if distance_squared < GATE * GATE {
            self.opening = 0.0;
        } else {
            self.opening += (GATE_GROWTH_AT_REST - GATE_GROWTH) * dt;
        }
    }

    /// The estimated bias, rad/s; zero until there has been rest.
    pub(crate) const fn bias(&self) -> Vec3 {
        self.bias
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f32 = 0.001;
    const UP: Vec3 = Vec3::new(0.0, 0.0, 9.81);

    fn estimator() -> BiasEstimator {
        BiasEstimator::new(RestParams::DEFAULT.validate().expect("the preset"))
    }

    /// Feeds a constant rate about x, in °/s, for some seconds and returns the bias in °/s.
    fn feed(estimator: &mut BiasEstimator, rate: f32, seconds: f32) -> f32 {
        let step = Step {
            seconds: DT,
            continuity: Continuity::Continuous,
        };
        for _ in 0..(seconds / DT) as u32 {
            estimator.update(UP, Vec3::new(rate * DEGREE, 0.0, 0.0), step);
        }
        estimator.bias().x / DEGREE
    }

    fn assert_near(actual: f32, expected: f32, tolerance: f32) {
        assert!(
            (actual - expected).abs() <= tolerance,
            "{actual} is not {expected}"
        );
    }

    #[test]
    fn at_rest_the_bias_is_learnt() {
        assert_near(feed(&mut estimator(), 0.5, 10.0), 0.5, 0.01);
    }

    #[test]
    fn nothing_is_learnt_before_rest_has_lasted() {
        assert_near(feed(&mut estimator(), 0.5, 1.4), 0.0, 0.0);
    }

    #[test]
    fn a_gap_ends_the_rest() {
        let mut estimator = estimator();
        let gap = Step {
            seconds: 0.01,
            continuity: Continuity::Gap,
        };
        for _ in 0..10 {
            feed(&mut estimator, 0.5, 1.0);
            estimator.update(UP, Vec3::new(0.5 * DEGREE, 0.0, 0.0), gap);
        }
        assert_eq!(estimator.bias(), Vec3::ZERO);
    }

    #[test]
    fn a_rate_beyond_the_limit_is_a_turn_and_no_bias() {
        assert_near(feed(&mut estimator(), 2.5, 60.0), 0.0, 0.0);
    }

    #[test]
    fn a_slow_steady_turn_of_a_minute_is_not_learnt() {
        for turn in [1.0, 1.5, -1.0] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 20.0);
            assert_near(feed(&mut estimator, 0.1 + turn, 60.0), 0.1, 0.05);
        }
    }

    #[test]
    fn slow_drift_with_temperature_is_followed() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.0, 10.0);
        let mut rate = 0.0;
        for _ in 0..600 {
            rate += 0.001;
            feed(&mut estimator, rate, 1.0);
        }
        assert_near(estimator.bias().x / DEGREE, rate, 0.02);
    }

    #[test]
    fn a_bias_learnt_in_a_turn_is_put_right_by_rest() {
        let mut estimator = estimator();
        feed(&mut estimator, 1.5, 20.0);
        assert_near(feed(&mut estimator, 0.0, 600.0), 0.0, 0.02);
    }
}
