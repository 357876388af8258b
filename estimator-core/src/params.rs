//! Parameters that a user chooses: of the estimator, of the paper's estimator, and of either one if it is chosen at
//! run time, with the presets. The ranges are in [`parameter`](crate::parameter).

use crate::estimate::PerAxis;
use crate::units::DEGREE;

pub use crate::attitude::{AttitudeParams, GyroTiming};
pub use crate::constants::Constants;
pub use crate::learnt::{Learning, Learnt};
pub use crate::rest::RestParams;
pub use crate::units::STANDARD_GRAVITY;
pub use crate::velocity::VelocityParams;

/// Parameters of the estimator. The ranges are those of
/// [`Parameter`](crate::parameter::Parameter).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Whether the foot continues to learn.
    pub learning: Learning,
    /// State learnt before, for a warm start.
    pub learnt: Option<Learnt>,
    /// Constants, the same for all feet.
    pub constants: Constants,
    /// The attitude filter.
    pub attitude: AttitudeParams,
    /// The debounced decision.
    pub decision: DecisionParams,
    /// The load trigger.
    pub load: LoadParams,
    /// The zero-velocity measurement.
    pub velocity: VelocityParams,
}

impl Default for Params {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Params {
    /// For an LSM6DSOX on a robot's foot; each field states its default and the reason.
    pub const DEFAULT: Self = Self {
        learning: Learning::On,
        learnt: None,
        constants: Constants::DEFAULT,
        attitude: AttitudeParams::DEFAULT,
        decision: DecisionParams { threshold: 0.5, on_delay: 0.02, off_delay: 0.0 },
        load: LoadParams { on_threshold: 12.0, off_threshold: 6.0 },
        velocity: VelocityParams::DEFAULT,
    };
}

/// Thresholds and delays of the decision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecisionParams {
    /// Probability above which contact counts as stable. Default: 0.5, as `SERoW`.
    pub threshold: f32,
    /// Time for which the probability must exceed the threshold before the decision is "stable", s.
    ///
    /// A longer delay rejects quiet moments of a swing, and reports a stance later. Default: 20 ms, as Pronto.
    pub on_delay: f32,
    /// Time for which the probability must be at or below the threshold before the decision is "not stable", s.
    ///
    /// A longer delay bridges vibration in a stance, and reports a slip or a lift-off later. Default: 0, as Pronto.
    pub off_delay: f32,
}

/// Thresholds of a Schmitt trigger on the load signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadParams {
    /// Load from which the foot counts as loaded, in the unit of the load signal.
    ///
    /// Default: 12 N, 10 % of the weight of a GO1 of 12 kg.
    pub on_threshold: f32,
    /// Load below which the foot counts as unloaded, in the unit of the load signal; at most the on threshold.
    ///
    /// Default: 6 N, 5 % of that weight.
    pub off_threshold: f32,
}

/// Length of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowLength {
    /// A duration in s, converted to samples at the sample rate.
    Duration(f32),
    /// A count of samples, to reproduce published results.
    Samples(u32),
}

/// Parameters of the paper's method, beside those in [`Params`] that it shares: attitude, decision, load and velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfWidthParams {
    /// Window, at least one sample, at most the estimator's capacity.
    ///
    /// A longer window gives a smoother and later probability. Default: 50 ms, the paper's 50 samples at the rate of
    /// its simulation.
    pub window: WindowLength,
    /// Standard deviation h of the kernel per axis, m/s² and rad/s: the sensor's noise at its filter setting.
    ///
    /// Default: 0.0196 m/s² and 0.00122 rad/s, of an LSM6DSOX behind low-pass filters of 333 and 335 Hz: 2.0 mg at ±16
    /// g and 0.070 °/s, from noise densities of 110 µg/√Hz and 3.8 m°/s/√Hz.
    pub bandwidth: PerAxis<f32>,
    /// Half-width δ per axis, m/s² and rad/s. Motion within ±δ counts as stillness.
    ///
    /// It belongs to a robot and its controller: two robots differed by a factor of twenty. Default: 0.4 m/s² and
    /// 0.04 rad/s, the paper's values for ATLAS.
    pub half_width: PerAxis<f32>,
}

impl Default for HalfWidthParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl HalfWidthParams {
    /// For an LSM6DSOX on the paper's ATLAS; each field states its default and the reason.
    pub const DEFAULT: Self = Self {
        window: WindowLength::Duration(0.05),
        bandwidth: PerAxis::by_sensor(2.0e-3 * STANDARD_GRAVITY, 0.070 * DEGREE),
        half_width: PerAxis::by_sensor(0.4, 0.04),
    };

    /// The paper's settings for its simulated ATLAS: 50 samples at 1 kHz, h and δ as in section IV-A and the authors'
    /// published script. The simulator had removed gravity.
    pub const PAPER: Self = Self {
        window: WindowLength::Samples(50),
        bandwidth: PerAxis::by_sensor(0.024_67, 0.016_53),
        half_width: PerAxis::by_sensor(0.4, 0.04),
    };

    /// The settings of the authors' script for their recordings on a GO1, in SI units: 50 rows of nominally 250 Hz;
    /// h = 0.02467 g and 1 °/s; δ = (0.9, 0.5, 0.3) g and (56, 50, 100) °/s.
    pub const PAPER_GO1: Self = Self {
        bandwidth: PerAxis::by_sensor(0.024_67 * STANDARD_GRAVITY, DEGREE),
        half_width: PerAxis {
            ax: 0.9 * STANDARD_GRAVITY,
            ay: 0.5 * STANDARD_GRAVITY,
            az: 0.3 * STANDARD_GRAVITY,
            wx: 56.0 * DEGREE,
            wy: 50.0 * DEGREE,
            wz: 100.0 * DEGREE,
        },
        ..Self::PAPER
    };
}

/// Method of an estimator: the source of its limits of stillness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The foot learns them while it walks.
    #[default]
    SelfCalibrating,
    /// Configured half-widths per axis, between which a density is integrated over a window: the paper's method.
    HalfWidths,
}

/// Parameters of an estimator whose method is chosen at run time, as on a foot and in the program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnyParams {
    /// The method. Default: self-calibrating, since half-widths belong to a robot.
    pub method: Method,
    /// Parameters of both methods, and parameters of the self-calibrating one.
    pub params: Params,
    /// With [`Method::HalfWidths`]: its own parameters.
    pub half_widths: HalfWidthParams,
}

impl AnyParams {
    /// The default method with its defaults.
    pub const DEFAULT: Self = Self {
        method: Method::SelfCalibrating,
        params: Params::DEFAULT,
        half_widths: HalfWidthParams::DEFAULT,
    };

    /// The paper's method as for its simulated ATLAS: see [`HalfWidthParams::PAPER`].
    ///
    /// The load trigger is at 10 % and 5 % of the robot's weight of about 1.6 kN.
    pub const PAPER: Self = Self {
        method: Method::HalfWidths,
        params: Params {
            load: LoadParams { on_threshold: 160.0, off_threshold: 80.0 },
            ..Params::DEFAULT
        },
        half_widths: HalfWidthParams::PAPER,
    };

    /// The paper's method as for its recordings on a GO1: see [`HalfWidthParams::PAPER_GO1`].
    ///
    /// The load trigger is in the raw units of the robot's pressure sensor: 150 on, 90 off.
    pub const PAPER_GO1: Self = Self {
        params: Params {
            load: LoadParams { on_threshold: 150.0, off_threshold: 90.0 },
            ..Params::DEFAULT
        },
        half_widths: HalfWidthParams::PAPER_GO1,
        ..Self::PAPER
    };
}

impl From<Params> for AnyParams {
    /// The self-calibrating method with these parameters.
    fn from(params: Params) -> Self {
        Self { params, ..Self::DEFAULT }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn papers_go1_has_half_widths_in_si_units() {
        // 0.9, 0.5 and 0.3 g; 56, 50 and 100 °/s.
        let expected = [8.825_985, 4.903_325, 2.941_995, 0.977_384, 0.872_665, 1.745_329];
        let half_width = HalfWidthParams::PAPER_GO1.half_width;
        let found = [
            half_width.ax,
            half_width.ay,
            half_width.az,
            half_width.wx,
            half_width.wy,
            half_width.wz,
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            let difference: f32 = found - expected;
            assert!(difference.abs() < 1.0e-5, "{found} for {expected}");
        }
    }

    #[test]
    fn gravities_and_degrees_of_the_presets_are_in_si_units() {
        let near = |found: f32, expected: f32| {
            assert!((found / expected - 1.0).abs() < 1.0e-5, "{found} for {expected}");
        };
        // 2 mg and 0.07 °/s; 24.67 mg and 1 °/s.
        near(HalfWidthParams::DEFAULT.bandwidth.ax, 0.019_613_3);
        near(HalfWidthParams::DEFAULT.bandwidth.wx, 0.001_221_73);
        near(HalfWidthParams::PAPER_GO1.bandwidth.ax, 0.241_930);
        near(HalfWidthParams::PAPER_GO1.bandwidth.wx, 0.017_453_3);
        // 25 mg and 3 °/s; 2 °/s and 6 °/s.
        let attitude = AttitudeParams::DEFAULT;
        near(attitude.quiet_acceleration, 0.245_166);
        near(attitude.quiet_rate, 0.052_359_9);
        near(attitude.rest.rate, 0.034_906_6);
        near(attitude.rest.bias_limit, 0.104_719_8);
    }
}
