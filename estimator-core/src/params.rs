//! Parameters of the estimator, presets, and the configuration. The ranges are in [`parameter`].
//!
//! [`Params`] is the user's input; [`Params::validate`] turns it into the [`Config`]
//! from which an estimator is made, or reports the invalid field and its range.

use crate::attitude::AttitudeCoefficients;
use crate::estimate::PerAxis;
use crate::kde::{KdeConfig, Kernel};
use crate::learnt::Learnt;
use crate::math::rounded;
use crate::parameter::{self, ParamsError};
use crate::phase::PhaseCoefficients;
use crate::roll::Roll;
use crate::self_calibrating::SelfCalibratingConfig;
use crate::units::DEGREE;
use crate::velocity::VelocityCoefficients;

pub use crate::attitude::{AttitudeParams, GyroTiming};
pub use crate::constants::Constants;
pub use crate::learnt::Learning;
pub use crate::rest::RestParams;
pub use crate::units::STANDARD_GRAVITY;
pub use crate::velocity::VelocityParams;

/// Whether the accelerometer's samples still contain gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gravity {
    /// As measured by an accelerometer. The attitude filter removes gravity and gyro bias.
    #[default]
    Included,
    /// Gravity and bias have been removed already, as in simulator recordings:
    /// samples are used as they are.
    Removed,
}

/// Source of the limits of stillness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The foot learns them while it walks.
    #[default]
    SelfCalibrating,
    /// Configured half-widths per axis, between which a density is integrated over a window: the paper's method.
    HalfWidths,
}

/// Length of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowLength {
    /// A duration in s, converted to samples at the sample rate.
    Duration(f32),
    /// A count of samples, to reproduce published results.
    Samples(u32),
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

/// Parameters of the estimator. The ranges are those of
/// [`Parameter`](crate::parameter::Parameter).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Rate at which samples arrive, Hz. Default: 1 kHz, the tick of the firmware.
    pub sample_rate: f32,
    /// Whether samples contain gravity. Default: included.
    pub gravity: Gravity,
    /// Source of the limits of stillness.
    ///
    /// Default: self-calibrating, since half-widths belong to a robot: those of two robots differ by a factor of
    /// twenty.
    pub method: Method,
    /// With [`Method::SelfCalibrating`]: whether the foot continues to learn.
    pub learning: Learning,
    /// With [`Method::SelfCalibrating`]: state learnt before, for a warm start.
    pub learnt: Option<Learnt>,
    /// With [`Method::SelfCalibrating`]: its constants, the same for all feet.
    pub constants: Constants,
    /// With [`Method::HalfWidths`]: the window, at least one sample, at most the estimator's capacity.
    ///
    /// A longer window gives a smoother and later probability. Default: 50 ms, the paper's 50 samples at the rate of
    /// its simulation.
    pub window: WindowLength,
    /// With [`Method::HalfWidths`]: standard deviation h of the kernel per axis, m/s² and rad/s: the sensor's noise at
    /// its filter setting.
    ///
    /// Default: 0.0196 m/s² and 0.00122 rad/s, of an LSM6DSOX behind low-pass filters of 333 and 335 Hz: 2.0 mg at ±16
    /// g and 0.070 °/s, from noise densities of 110 µg/√Hz and 3.8 m°/s/√Hz.
    pub bandwidth: PerAxis<f32>,
    /// With [`Method::HalfWidths`]: half-width δ per axis, m/s² and rad/s. Motion within ±δ counts as stillness.
    ///
    /// It belongs to a robot and its controller. Default: 0.4 m/s² and 0.04 rad/s, the paper's values for ATLAS.
    pub half_width: PerAxis<f32>,
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
    /// For an LSM6DSOX at 1 kHz on a robot's foot; each field states its default and the reason.
    pub const DEFAULT: Self = Self {
        sample_rate: 1000.0,
        gravity: Gravity::Included,
        method: Method::SelfCalibrating,
        learning: Learning::On,
        learnt: None,
        constants: Constants::DEFAULT,
        window: WindowLength::Duration(0.05),
        bandwidth: PerAxis::by_sensor(2.0e-3 * STANDARD_GRAVITY, 0.070 * DEGREE),
        half_width: PerAxis::by_sensor(0.4, 0.04),
        attitude: AttitudeParams::DEFAULT,
        decision: DecisionParams { threshold: 0.5, on_delay: 0.02, off_delay: 0.0 },
        load: LoadParams { on_threshold: 12.0, off_threshold: 6.0 },
        velocity: VelocityParams::DEFAULT,
    };

    /// The paper's settings for its simulated ATLAS: 50 samples at 1 kHz, h and δ as in
    /// section IV-A and the authors' published script, gravity removed by the simulator.
    ///
    /// The load trigger is at 10 % and 5 % of the robot's weight of about 1.6 kN.
    pub const PAPER: Self = Self {
        gravity: Gravity::Removed,
        method: Method::HalfWidths,
        window: WindowLength::Samples(50),
        bandwidth: PerAxis::by_sensor(0.024_67, 0.016_53),
        half_width: PerAxis::by_sensor(0.4, 0.04),
        load: LoadParams { on_threshold: 160.0, off_threshold: 80.0 },
        ..Self::DEFAULT
    };

    /// The settings of the authors' script for their recordings on a GO1, in SI units: 50 rows of
    /// nominally 250 Hz; h = 0.02467 g and 1 °/s; δ = (0.9, 0.5, 0.3) g and (56, 50, 100) °/s.
    ///
    /// The load trigger is in the raw units of the robot's pressure sensor: 150 on, 90 off.
    pub const PAPER_GO1: Self = Self {
        sample_rate: 250.0,
        gravity: Gravity::Included,
        bandwidth: PerAxis::by_sensor(0.024_67 * STANDARD_GRAVITY, DEGREE),
        half_width: PerAxis {
            ax: 0.9 * STANDARD_GRAVITY,
            ay: 0.5 * STANDARD_GRAVITY,
            az: 0.3 * STANDARD_GRAVITY,
            wx: 56.0 * DEGREE,
            wy: 50.0 * DEGREE,
            wz: 100.0 * DEGREE,
        },
        load: LoadParams { on_threshold: 150.0, off_threshold: 90.0 },
        ..Self::PAPER
    };
}

impl Params {
    /// Checks every field and computes the configuration of the estimator, for [`Method::SelfCalibrating`].
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range; NaN is out of every
    /// range. With [`Method::HalfWidths`] the window has to fit one sample: use
    /// [`Self::validate_for`].
    pub fn validate(&self) -> Result<Config, ParamsError> {
        self.validate_for()
    }

    /// Checks every field and computes the configuration of an estimator with room for `CAPACITY` samples in the window
    /// of [`Method::HalfWidths`]. With the other method the window is not checked.
    ///
    /// # Errors
    /// As those of [`Self::validate`].
    pub fn validate_for<const CAPACITY: usize>(&self) -> Result<Config<CAPACITY>, ParamsError> {
        self.check()?;
        Ok(Config { params: *self, window_length: self.window_samples::<CAPACITY>()? })
    }

    /// Checks every field as [`Self::validate`] does, except the window.
    ///
    /// # Errors
    /// As those of [`Self::validate`].
    pub fn check(&self) -> Result<(), ParamsError> {
        parameter::check(self)?;
        if let GyroTiming::Delay(delay) = self.attitude.gyro_timing {
            parameter::GYRO_DELAY.check(delay)?;
        }
        match &self.learnt {
            Some(learnt) => learnt.validate(),
            None => Ok(()),
        }
    }

    /// Length of the window in samples; without half-widths the nearest length that fits.
    fn window_samples<const CAPACITY: usize>(&self) -> Result<usize, ParamsError> {
        const { assert!(CAPACITY > 0) };
        let is_used = self.method == Method::HalfWidths;
        let samples = match self.window {
            WindowLength::Duration(seconds) => {
                if is_used {
                    parameter::WINDOW.check(seconds)?;
                }
                rounded(seconds * self.sample_rate)
            }
            WindowLength::Samples(samples) => samples,
        };
        let fitting = (samples as usize).clamp(1, CAPACITY);
        if is_used && fitting != samples as usize {
            return Err(ParamsError::WindowLength { samples, capacity: CAPACITY });
        }
        Ok(fitting)
    }
}

/// Validated parameters in the form used by the estimator. Only
/// [`Params::validate`] and [`Params::validate_for`] create it.
#[derive(Clone, Debug)]
pub struct Config<const CAPACITY: usize = 1> {
    /// The checked parameters. Derived values are computed where they are kept, so that a start needs little stack.
    params: Params,
    /// Length of the window in samples, 1 to the capacity.
    window_length: usize,
}

impl<const CAPACITY: usize> Config<CAPACITY> {
    /// Length of the window in samples.
    #[must_use]
    pub const fn window_length(&self) -> usize {
        self.window_length
    }

    pub(crate) const fn gravity(&self) -> Gravity {
        self.params.gravity
    }

    pub(crate) const fn method(&self) -> Method {
        self.params.method
    }

    /// Time between samples, µs.
    pub(crate) fn period_us(&self) -> u64 {
        u64::from(rounded(1.0e6 / self.params.sample_rate))
    }

    pub(crate) fn kde(&self) -> KdeConfig {
        KdeConfig {
            kernels: self.params.bandwidth.zip_with(self.params.half_width, Kernel::new),
            window_length: self.window_length,
        }
    }

    pub(crate) const fn self_calibrating(&self) -> SelfCalibratingConfig<'_> {
        let Params { constants, learning, learnt, sample_rate, .. } = &self.params;
        SelfCalibratingConfig::new(constants, *learning, *learnt, *sample_rate)
    }

    pub(crate) fn attitude(&self) -> AttitudeCoefficients {
        AttitudeCoefficients::new(&self.params.attitude, self.params.sample_rate)
    }

    pub(crate) fn phase(&self) -> PhaseCoefficients {
        let Params { decision, load, .. } = &self.params;
        PhaseCoefficients {
            threshold: decision.threshold,
            on_delay_us: micros(decision.on_delay),
            off_delay_us: micros(decision.off_delay),
            load_on: load.on_threshold,
            load_off: load.off_threshold,
        }
    }

    pub(crate) fn roll(&self) -> Roll {
        Roll::new(self.period_us(), &self.params.velocity)
    }

    pub(crate) const fn velocity(&self) -> VelocityCoefficients {
        VelocityCoefficients::new(&self.params.velocity)
    }
}

/// Microseconds of a duration in s.
fn micros(seconds: f32) -> u64 {
    u64::from(rounded(seconds * 1.0e6))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field_refused(change: impl FnOnce(&mut Params)) -> &'static str {
        let mut params = Params::DEFAULT;
        change(&mut params);
        match params.validate_for::<256>() {
            Err(ParamsError::OutOfRange { field, .. }) => field,
            Err(ParamsError::WindowLength { .. }) => "window",
            Ok(_) => "nothing",
        }
    }

    #[test]
    fn presets_are_valid() {
        for preset in [Params::DEFAULT, Params::PAPER, Params::PAPER_GO1] {
            assert_eq!(preset.validate_for::<256>().map(|config| config.window_length()), Ok(50));
        }
    }

    #[test]
    fn window_length_is_its_duration_times_the_sample_rate() {
        let params = Params { sample_rate: 200.0, ..Params::DEFAULT };
        assert_eq!(params.validate_for::<256>().map(|c| c.window_length()), Ok(10));
    }

    #[test]
    fn out_of_range_number_is_rejected_with_its_field_name() {
        type Set = fn(&mut Params, f32);
        const LEARNT: Learnt = Learnt {
            still: -1.0,
            moving: 1.0,
            speed: -5.0,
            still_seconds: 1.0,
            moving_seconds: 1.0,
        };
        // Each field with a value just below its range and one just above it.
        let fields: [(&str, Set, f32, f32); 20] = [
            ("sample_rate_hz", |p, v| p.sample_rate = v, 19.9, 10_001.0),
            ("bandwidth.acceleration_m_s2.ax", |p, v| p.bandwidth.ax = v, 0.9e-6, 1.1e3),
            ("bandwidth.angular_rate_rad_s.wz", |p, v| p.bandwidth.wz = v, 0.9e-6, 1.1e3),
            ("half_width.acceleration_m_s2.ay", |p, v| p.half_width.ay = v, 0.9e-6, 10.1),
            ("half_width.angular_rate_rad_s.wx", |p, v| p.half_width.wx = v, -0.04, 3.1),
            ("decision.threshold", |p, v| p.decision.threshold = v, 0.0, 1.0),
            ("decision.on_delay_s", |p, v| p.decision.on_delay = v, -0.1, 10.1),
            ("decision.off_delay_s", |p, v| p.decision.off_delay = v, -0.1, 0.21),
            ("load.on_threshold", |p, v| p.load.on_threshold = v, -2.0e9, 2.0e9),
            ("load.off_threshold", |p, v| p.load.off_threshold = v, -2.0e9, 12.1),
            ("learnt.speed", |p, v| p.learnt = Some(Learnt { speed: v, ..LEARNT }), -12.0, 0.1),
            (
                "learnt.moving_seconds",
                |p, v| {
                    p.learnt = Some(Learnt { moving_seconds: v, ..LEARNT });
                },
                -0.1,
                1.1e3,
            ),
            (
                "attitude.gyro_timing",
                |p, v| p.attitude.gyro_timing = GyroTiming::Delay(v),
                -0.001,
                0.051,
            ),
            (
                "attitude.motion_time_constant_s",
                |p, v| p.attitude.motion_time_constant = v,
                0.09,
                101.0,
            ),
            ("attitude.quiet_gain", |p, v| p.attitude.quiet_gain = v, 0.9, 1.1e4),
            (
                "attitude.quiet_acceleration_m_s2",
                |p, v| p.attitude.quiet_acceleration = v,
                0.9e-3,
                11.0,
            ),
            ("attitude.quiet_rate_rad_s", |p, v| p.attitude.quiet_rate = v, 0.9e-4, 1.1),
            ("attitude.rest.duration_s", |p, v| p.attitude.rest.duration = v, 0.09, 101.0),
            ("attitude.rest.bias_limit_rad_s", |p, v| p.attitude.rest.bias_limit = v, -0.1, 1.1),
            (
                "attitude.rest.bias_time_constant_s",
                |p, v| p.attitude.rest.bias_time_constant = v,
                0.09,
                1.1e3,
            ),
        ];
        for (field, set, low, high) in fields {
            for value in [low, high, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert_eq!(field_refused(|p| set(p, value)), field, "{value}");
            }
        }
        for (field, set) in [
            ("attitude.rest.acceleration_m_s2", (|p, v| p.attitude.rest.acceleration = v) as Set),
            ("attitude.rest.rate_rad_s", |p, v| p.attitude.rest.rate = v),
        ] {
            assert_eq!(field_refused(|p| set(p, 0.0)), field);
            assert_eq!(field_refused(|p| set(p, 11.0)), field);
        }
    }

    #[test]
    fn empty_or_oversized_window_is_rejected() {
        for window in [
            WindowLength::Duration(0.3),
            WindowLength::Duration(-0.05),
            WindowLength::Duration(f32::NAN),
            WindowLength::Samples(0),
            WindowLength::Samples(257),
        ] {
            let half_widths = |p: &mut Params| {
                (p.method, p.window) = (Method::HalfWidths, window);
            };
            assert_eq!(field_refused(half_widths), "window", "{window:?}");
            // The other method has no window.
            assert_eq!(field_refused(|p| p.window = window), "nothing", "{window:?}");
        }
    }

    #[test]
    fn papers_go1_has_half_widths_in_si_units() {
        // 0.9, 0.5 and 0.3 g; 56, 50 and 100 °/s.
        let expected = [8.825_985, 4.903_325, 2.941_995, 0.977_384, 0.872_665, 1.745_329];
        let half_width = Params::PAPER_GO1.half_width;
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
        near(Params::DEFAULT.bandwidth.ax, 0.019_613_3);
        near(Params::DEFAULT.bandwidth.wx, 0.001_221_73);
        near(Params::PAPER_GO1.bandwidth.ax, 0.241_930);
        near(Params::PAPER_GO1.bandwidth.wx, 0.017_453_3);
        // 25 mg and 3 °/s; 2 °/s and 6 °/s.
        let attitude = AttitudeParams::DEFAULT;
        near(attitude.quiet_acceleration, 0.245_166);
        near(attitude.quiet_rate, 0.052_359_9);
        near(attitude.rest.rate, 0.034_906_6);
        near(attitude.rest.bias_limit, 0.104_719_8);
    }
}
