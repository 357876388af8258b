//! Rest, and the gyroscope's bias that can be read off there.
//!
//! Rest is the IMU being still; it is not contact. A gyroscope at rest shows its bias, but a
//! robot that turns slowly and steadily looks much the same. Three things tell them apart:
//!
//! * A turn about anything but the vertical moves gravity through the sensor: it is no rest.
//! * Temperature moves a bias slowly and not far, so one once known is followed only within a
//!   narrow gate, which opens as fast as temperature does and no further.
//! * A bias is there in every rest and a turn is not: what contradicts the known bias must have
//!   been seen at rest for twice as long as the known bias itself.
//!
//! What is left is a steady turn about the vertical: one slower than the gate, and one that lasts
//! for minutes and twice as long as all rest before it. It costs heading, which is not observed
//! anyway, and not inclination.

use crate::attitude::{Continuity, Step};
use crate::params::{DEGREE, ParamsError, in_range};
use crate::vector::Vec3;

/// Time constant of the means that deviations are taken from, s.
const MEAN_TIME_CONSTANT: f32 = 0.5;

/// How far gravity may move through the sensor in a rest, m/s²: by 0.2°, as it does in the second
/// that is left of a rest's least duration at 0.2 °/s. Far above the noise of the mean.
const LARGEST_SWAY: f32 = 0.03;

/// How far from the known bias a rest may lie to be believed at once, rad/s.
const GATE: f32 = 0.3 * DEGREE;

/// Growth of the gate, rad/s per s, since a rest last lay inside [`GATE`]: what temperature
/// moves a MEMS gyroscope's bias by while a board warms up.
const GATE_GROWTH: f32 = 0.0005 * DEGREE;

/// How far the gate opens by itself, rad/s: 30 °C at the LSM6DSOX's typical 0.01 °/s per °C.
const LARGEST_OPENING: f32 = 0.3 * DEGREE;

/// Rest that contradicts the known bias must last this many times as long as the rest that the
/// known bias rests on, …
const CONTRADICTION: f32 = 2.0;

/// … but at least this long, s: a bias that was learnt in a turn at power-up is put right within
/// minutes of rest, …
const LEAST_CONTRADICTION: f32 = 240.0;

/// … and no more than this counts as the rest that the known bias rests on, s. Twice of it is what
/// an f32 can count up to in steps of 0.1 ms.
const LONGEST_KNOWN: f32 = 900.0;

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
    /// The mean force when this stillness began and the mean had settled.
    first_force: Vec3,
    /// How long the sensor has been still, s.
    still: f32,
    /// How much rest the bias rests on, s, up to the time constant: what the mean is over.
    learnt: f32,
    /// How much rest the bias rests on, s, up to [`LONGEST_KNOWN`]: what contradicts it must last
    /// as long.
    known: f32,
    /// How much rest has contradicted the bias since a rest last agreed with it, s.
    contradicted: f32,
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
            first_force: Vec3::ZERO,
            still: 0.0,
            learnt: 0.0,
            known: 0.0,
            contradicted: 0.0,
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

        self.opening = (self.opening + GATE_GROWTH * dt).min(LARGEST_OPENING);
        let still = step.continuity == Continuity::Continuous
            && force_deviation.dot(force_deviation) <= limits.acceleration_squared
            && rate_deviation.dot(rate_deviation) <= limits.rate_squared
            && self.mean_rate.is_within(limits.bias_limit)
            && !self.sways();
        if !still {
            self.still = 0.0;
            return;
        }
        self.still = (self.still + dt).min(limits.duration);
        if self.still < MEAN_TIME_CONSTANT {
            self.first_force = self.mean_force;
        }
        if self.still >= limits.duration {
            self.learn(dt);
        }
    }

    /// Whether gravity has moved through the sensor since the stillness began.
    fn sways(&self) -> bool {
        let sway = self.mean_force - self.first_force;
        // In the beginning the mean has yet to settle.
        self.still >= MEAN_TIME_CONSTANT && sway.dot(sway) > LARGEST_SWAY * LARGEST_SWAY
    }

    fn learn(&mut self, dt: f32) {
        let error = self.mean_rate - self.bias;
        let distance_squared = error.dot(error);
        let gate = GATE + self.opening;
        if self.learnt > KNOWN_AFTER && distance_squared >= gate * gate {
            self.contradicted += dt;
            if self.contradicted < (CONTRADICTION * self.known).max(LEAST_CONTRADICTION) {
                return;
            }
            self.learnt = 0.0;
            self.known = 0.0;
        }
        self.contradicted = 0.0;
        self.learnt = (self.learnt + dt).min(self.coefficients.bias_time_constant);
        self.known = (self.known + dt).min(LONGEST_KNOWN);
        self.bias += error * (dt / self.learnt);
        if distance_squared < GATE * GATE {
            self.opening = 0.0;
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
    fn a_slow_steady_turn_of_minutes_is_not_learnt() {
        for turn in [0.7, 1.0, 1.5, -1.0] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 20.0);
            assert_near(feed(&mut estimator, 0.1 + turn, 220.0), 0.1, 0.05);
            // And every rest in between begins the count anew.
            feed(&mut estimator, 0.1, 5.0);
            assert_near(feed(&mut estimator, 0.1 + turn, 220.0), 0.1, 0.05);
        }
    }

    #[test]
    fn the_longer_a_bias_is_known_the_longer_a_turn_has_to_last() {
        let mut estimator = estimator();
        feed(&mut estimator, 0.1, 900.0);
        assert_near(feed(&mut estimator, 1.1, 1700.0), 0.1, 0.03);
        assert_near(feed(&mut estimator, 1.1, 200.0), 1.1, 0.01);
    }

    #[test]
    fn a_turn_that_moves_gravity_is_no_rest_however_slow_and_long() {
        for turn in [0.25, 0.5, 1.0, 1.9] {
            let mut estimator = estimator();
            feed(&mut estimator, 0.1, 20.0);
            let step = Step {
                seconds: DT,
                continuity: Continuity::Continuous,
            };
            for k in 0..600_000 {
                let angle = turn * DEGREE * k as f32 * DT;
                let force = Vec3::new(0.0, 9.81 * libm::sinf(angle), 9.81 * libm::cosf(angle));
                let rate = Vec3::new((0.1 + turn) * DEGREE, 0.0, 0.0);
                estimator.update(force, rate, step);
            }
            assert_near(estimator.bias().x / DEGREE, 0.1, 0.05);
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
