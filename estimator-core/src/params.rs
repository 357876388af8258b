//! What can be set, and its check: parameters go in, a validated configuration comes out.
//!
//! [`Params`] is what a person writes; [`Params::validate`] turns it into the [`Config`] from
//! which an estimator is made, or says which field is wrong and what it may be.

use core::fmt;

use crate::attitude::{AttitudeCoefficients, AttitudeParams};
use crate::axis::PerAxis;
use crate::kernel::Kernel;
use crate::phase::PhaseCoefficients;
use crate::stillness::{Constants, Learning, Learnt, StillnessConfig};

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY: f32 = 9.806_65;

/// One degree in radians.
pub(crate) const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// Whether the accelerometer's samples still contain gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gravity {
    /// As an accelerometer measures. The attitude filter takes gravity and gyro bias out.
    #[default]
    Included,
    /// Something else has taken out gravity and bias already, as in simulator recordings:
    /// samples are used as they are.
    Removed,
}

/// Where the limits of stillness come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The foot finds them while it walks: see [`stillness`](crate::stillness).
    #[default]
    SelfCalibrating,
    /// They are set, axis by axis, and a density is integrated between them over a window: the paper's
    /// method, see [`probability`](crate::probability).
    HalfWidths,
}

/// How far back the estimate looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowLength {
    /// A duration in s, turned into samples with the sample rate. What a window really is.
    Duration(f32),
    /// A count of samples, to reproduce published results.
    Samples(u32),
}

/// When the probability becomes a yes or a no.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecisionParams {
    /// The probability above which contact counts as stable, in (0, 1).
    pub threshold: f32,
    /// How long the probability must be above the threshold before the decision is "stable", s.
    pub on_delay: f32,
    /// How long it must be at or below the threshold before the decision is "not stable", s.
    pub off_delay: f32,
}

/// When the foot counts as loaded: a Schmitt trigger on the load signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadParams {
    /// Loaded from this load on, in the unit of the load signal (N).
    pub on_threshold: f32,
    /// No longer loaded below this load, in the unit of the load signal (N).
    pub off_threshold: f32,
}

/// Everything that can be set in the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// The rate at which samples arrive, Hz; 20 to 10 000.
    pub sample_rate: f32,
    /// Whether samples contain gravity.
    pub gravity: Gravity,
    /// Where the limits of stillness come from.
    pub method: Method,
    /// With [`Method::SelfCalibrating`]: whether the foot goes on learning.
    pub learning: Learning,
    /// With [`Method::SelfCalibrating`]: what it starts with, where it has been learnt before.
    pub learnt: Option<Learnt>,
    /// With [`Method::SelfCalibrating`]: its constants, the same for all feet.
    pub stillness: Constants,
    /// With [`Method::HalfWidths`]: the window, at least one sample, at most the estimator's capacity.
    pub window: WindowLength,
    /// With [`Method::HalfWidths`]: kernel standard deviation h per axis, m/s² and rad/s, the
    /// sensor's noise at its filter setting. 1e-6 to 1e3.
    pub bandwidth: PerAxis<f32>,
    /// With [`Method::HalfWidths`]: half-width δ per axis, m/s² and rad/s; motion within ±δ counts
    /// as rest. It belongs to a robot and its controller. 1e-6 to 1e4.
    pub half_width: PerAxis<f32>,
    /// The attitude filter.
    pub attitude: AttitudeParams,
    /// The debounced decision.
    pub decision: DecisionParams,
    /// The load trigger.
    pub load: LoadParams,
}

impl Default for Params {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Params {
    /// For an LSM6DSOX at 1 kHz on a robot's foot.
    ///
    /// | field | value | reason |
    /// |---|---|---|
    /// | `sample_rate` | 1 kHz | the firmware's tick |
    /// | `method` | self-calibrating | half-widths belong to a robot, and differ by a factor of twenty between two of them |
    /// | `stillness` | | see [`StillnessParams::DEFAULT`](crate::StillnessParams::DEFAULT) |
    /// | `window` | 50 ms | the paper's 50 samples at the rate of its simulation |
    /// | `bandwidth` | 0.0196 m/s², 0.00122 rad/s | LSM6DSOX behind 333 and 335 Hz low-pass filters: 2.0 mg at ±16 g and 0.070 °/s, from noise densities of 110 µg/√Hz and 3.8 m°/s/√Hz |
    /// | `half_width` | 0.4 m/s², 0.04 rad/s | the paper's values for ATLAS |
    /// | `decision` | 0.5, 20 ms on, 0 ms off | what SERoW (P > 0.5) and Pronto (delays) use |
    /// | `load` | 12 N on, 6 N off | 10 % and 5 % of a GO1's weight of 12 kg |
    pub const DEFAULT: Self = Self {
        sample_rate: 1000.0,
        gravity: Gravity::Included,
        method: Method::SelfCalibrating,
        learning: Learning::On,
        learnt: None,
        stillness: Constants::DEFAULT,
        window: WindowLength::Duration(0.05),
        bandwidth: PerAxis::by_sensor(2.0e-3 * STANDARD_GRAVITY, 0.070 * DEGREE),
        half_width: PerAxis::by_sensor(0.4, 0.04),
        attitude: AttitudeParams::DEFAULT,
        decision: DecisionParams {
            threshold: 0.5,
            on_delay: 0.02,
            off_delay: 0.0,
        },
        load: LoadParams {
            on_threshold: 12.0,
            off_threshold: 6.0,
        },
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
        load: LoadParams {
            on_threshold: 160.0,
            off_threshold: 80.0,
        },
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
        load: LoadParams {
            on_threshold: 150.0,
            off_threshold: 90.0,
        },
        ..Self::PAPER
    };

    /// Checks every field and works out what the estimator needs.
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range; a value that is
    /// not a number is out of every range.
    pub fn validate<const CAPACITY: usize>(&self) -> Result<Config<CAPACITY>, ParamsError> {
        in_range("sample_rate", self.sample_rate, 20.0, 10_000.0)?;
        per_axis_in_range(&BANDWIDTH_FIELDS, self.bandwidth, 1.0e-6, 1.0e3)?;
        per_axis_in_range(&HALF_WIDTH_FIELDS, self.half_width, 1.0e-6, 1.0e4)?;
        in_range("decision.threshold", self.decision.threshold, 0.01, 0.99)?;
        in_range("decision.on_delay", self.decision.on_delay, 0.0, 10.0)?;
        in_range("decision.off_delay", self.decision.off_delay, 0.0, 10.0)?;
        in_range("load.on_threshold", self.load.on_threshold, -1.0e9, 1.0e9)?;
        // Hysteresis: what switches off lies no higher than what switches on.
        let (off, on) = (self.load.off_threshold, self.load.on_threshold);
        in_range("load.off_threshold", off, -1.0e9, on)?;
        Ok(Config {
            gravity: self.gravity,
            period_us: u64::from(crate::root::rounded(1.0e6 / self.sample_rate)),
            window_length: self.window_samples::<CAPACITY>()?,
            method: self.method,
            stillness: StillnessConfig::new(
                &self.stillness,
                self.learning,
                self.learnt,
                self.sample_rate,
            )?,
            kernels: self.bandwidth.zip_with(self.half_width, Kernel::new),
            attitude: self.attitude.validate(self.sample_rate)?,
            phase: PhaseCoefficients {
                threshold: self.decision.threshold,
                on_delay_us: micros(self.decision.on_delay),
                off_delay_us: micros(self.decision.off_delay),
                load_on: on,
                load_off: off,
            },
        })
    }

    fn window_samples<const CAPACITY: usize>(&self) -> Result<usize, ParamsError> {
        let samples = match self.window {
            WindowLength::Duration(seconds) => {
                in_range("window", seconds, 1.0e-4, 1.0e3)?;
                crate::root::rounded(seconds * self.sample_rate)
            }
            WindowLength::Samples(samples) => samples,
        };
        if (1..=CAPACITY).contains(&(samples as usize)) {
            Ok(samples as usize)
        } else {
            Err(ParamsError::WindowLength {
                samples,
                capacity: CAPACITY,
            })
        }
    }
}

const BANDWIDTH_FIELDS: PerAxis<&str> = PerAxis {
    ax: "bandwidth.ax",
    ay: "bandwidth.ay",
    az: "bandwidth.az",
    wx: "bandwidth.wx",
    wy: "bandwidth.wy",
    wz: "bandwidth.wz",
};

const HALF_WIDTH_FIELDS: PerAxis<&str> = PerAxis {
    ax: "half_width.ax",
    ay: "half_width.ay",
    az: "half_width.az",
    wx: "half_width.wx",
    wy: "half_width.wy",
    wz: "half_width.wz",
};

fn micros(seconds: f32) -> u64 {
    u64::from(crate::root::rounded(seconds * 1.0e6))
}

/// The name of a field, for people. A foot has no use for it: on a microcontroller it is empty and
/// takes no room.
const fn name(field: &'static str) -> &'static str {
    if cfg!(target_os = "none") { "" } else { field }
}

/// Accepts `min..=max`; a NaN lies in no range.
pub(crate) const fn in_range(
    field: &'static str,
    value: f32,
    min: f32,
    max: f32,
) -> Result<(), ParamsError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(ParamsError::OutOfRange {
            field: name(field),
            value,
            min,
            max,
        })
    }
}

fn per_axis_in_range(
    fields: &PerAxis<&'static str>,
    values: PerAxis<f32>,
    min: f32,
    max: f32,
) -> Result<(), ParamsError> {
    for (field, value) in fields.to_array().into_iter().zip(values.to_array()) {
        in_range(field, value, min, max)?;
    }
    Ok(())
}

/// Parameters that have been checked, in the form the estimator computes with. Only
/// [`Params::validate`] makes one.
#[derive(Clone, Debug)]
pub struct Config<const CAPACITY: usize> {
    pub(crate) gravity: Gravity,
    pub(crate) period_us: u64,
    pub(crate) window_length: usize,
    pub(crate) method: Method,
    pub(crate) stillness: StillnessConfig,
    pub(crate) kernels: PerAxis<Kernel>,
    pub(crate) attitude: AttitudeCoefficients,
    pub(crate) phase: PhaseCoefficients,
}

impl<const CAPACITY: usize> Config<CAPACITY> {
    /// Length of the window in samples.
    #[must_use]
    pub const fn window_length(&self) -> usize {
        self.window_length
    }
}

/// Why parameters were refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamsError {
    /// A number is outside its range, or not a number.
    OutOfRange {
        /// The field's path in [`Params`]; empty on a microcontroller, to save room.
        field: &'static str,
        /// What it was set to.
        value: f32,
        /// The least it may be.
        min: f32,
        /// The most it may be.
        max: f32,
    },
    /// The window comes to no sample at all or to more than there is room for.
    WindowLength {
        /// The window in samples at the sample rate set.
        samples: u32,
        /// The most it may be.
        capacity: usize,
    },
}

impl fmt::Display for ParamsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange {
                field,
                value,
                min,
                max,
            } => write!(f, "{field} is {value}, allowed is {min} to {max}"),
            Self::WindowLength { samples, capacity } => write!(
                f,
                "window comes to {samples} samples at this sample rate, allowed is 1 to {capacity}"
            ),
        }
    }
}

impl core::error::Error for ParamsError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::GyroTiming;
    use crate::stillness::Classes;

    fn field_refused(change: impl FnOnce(&mut Params)) -> &'static str {
        let mut params = Params::DEFAULT;
        change(&mut params);
        match params.validate::<256>() {
            Err(ParamsError::OutOfRange { field, .. }) => field,
            Err(ParamsError::WindowLength { .. }) => "window",
            Ok(_) => "nothing",
        }
    }

    #[test]
    fn the_presets_are_valid() {
        for preset in [Params::DEFAULT, Params::PAPER, Params::PAPER_GO1] {
            assert_eq!(
                preset.validate::<256>().map(|config| config.window_length),
                Ok(50)
            );
        }
    }

    #[test]
    fn a_window_is_a_duration_times_the_sample_rate() {
        let params = Params {
            sample_rate: 200.0,
            ..Params::DEFAULT
        };
        assert_eq!(params.validate::<256>().map(|c| c.window_length), Ok(10));
    }

    #[test]
    fn the_papers_presets_are_the_papers_method_and_the_default_calibrates_itself() {
        for preset in [Params::PAPER, Params::PAPER_GO1] {
            assert_eq!(preset.method, Method::HalfWidths);
        }
        assert_eq!(Params::DEFAULT.method, Method::SelfCalibrating);
        assert_eq!(Params::DEFAULT.learnt, None);
    }

    #[test]
    fn a_number_out_of_its_range_is_refused_with_the_name_of_its_field() {
        type Set = fn(&mut Params, f32);
        const APART: Classes = Classes {
            still: -1.0,
            moving: 1.0,
            width: 0.5,
        };
        const LEARNT: Learnt = Learnt {
            acceleration: APART,
            rate: APART,
            velocity: APART,
            still_seconds: 1.0,
            moving_seconds: 1.0,
            idle_seconds: 0.0,
        };
        // Each field with a value that is just too small and one that is just too large.
        let fields: [(&str, Set, f32, f32); 20] = [
            ("sample_rate", |p, v| p.sample_rate = v, 19.9, 10_001.0),
            ("bandwidth.ax", |p, v| p.bandwidth.ax = v, 0.9e-6, 1.1e3),
            ("bandwidth.wz", |p, v| p.bandwidth.wz = v, 0.9e-6, 1.1e3),
            ("half_width.ay", |p, v| p.half_width.ay = v, 0.9e-6, 1.1e4),
            ("half_width.wx", |p, v| p.half_width.wx = v, -0.04, 1.1e4),
            (
                "decision.threshold",
                |p, v| p.decision.threshold = v,
                0.0,
                1.0,
            ),
            (
                "decision.on_delay",
                |p, v| p.decision.on_delay = v,
                -0.1,
                10.1,
            ),
            (
                "decision.off_delay",
                |p, v| p.decision.off_delay = v,
                -0.1,
                10.1,
            ),
            (
                "load.on_threshold",
                |p, v| p.load.on_threshold = v,
                -2.0e9,
                2.0e9,
            ),
            (
                "load.off_threshold",
                |p, v| p.load.off_threshold = v,
                -2.0e9,
                12.1,
            ),
            (
                "learnt.rate.width",
                |p, v| {
                    p.learnt = Some(Learnt {
                        rate: Classes { width: v, ..APART },
                        ..LEARNT
                    });
                },
                -0.1,
                10.0,
            ),
            (
                "learnt.moving_seconds",
                |p, v| {
                    p.learnt = Some(Learnt {
                        moving_seconds: v,
                        ..LEARNT
                    });
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
                "attitude.motion_time_constant",
                |p, v| p.attitude.motion_time_constant = v,
                0.09,
                101.0,
            ),
            (
                "attitude.quiet_gain",
                |p, v| p.attitude.quiet_gain = v,
                0.9,
                1.1e4,
            ),
            (
                "attitude.quiet_acceleration",
                |p, v| p.attitude.quiet_acceleration = v,
                0.9e-3,
                11.0,
            ),
            (
                "attitude.quiet_rate",
                |p, v| p.attitude.quiet_rate = v,
                0.9e-4,
                1.1,
            ),
            (
                "attitude.rest.duration",
                |p, v| p.attitude.rest.duration = v,
                0.09,
                101.0,
            ),
            (
                "attitude.rest.bias_limit",
                |p, v| p.attitude.rest.bias_limit = v,
                -0.1,
                1.1,
            ),
            (
                "attitude.rest.bias_time_constant",
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
            (
                "attitude.rest.acceleration",
                (|p, v| p.attitude.rest.acceleration = v) as Set,
            ),
            ("attitude.rest.rate", |p, v| p.attitude.rest.rate = v),
        ] {
            assert_eq!(field_refused(|p| set(p, 0.0)), field);
            assert_eq!(field_refused(|p| set(p, 11.0)), field);
        }
    }

    #[test]
    fn a_window_without_a_sample_or_beyond_the_capacity_is_refused() {
        for window in [
            WindowLength::Duration(0.3),
            WindowLength::Duration(-0.05),
            WindowLength::Duration(f32::NAN),
            WindowLength::Samples(0),
            WindowLength::Samples(257),
        ] {
            assert_eq!(field_refused(|p| p.window = window), "window", "{window:?}");
        }
    }

    #[test]
    fn the_message_names_field_value_and_range() {
        let error = in_range("half_width.ax", -0.5, 1.0e-6, 1.0e4).unwrap_err();
        assert_eq!(
            std::format!("{error}"),
            "half_width.ax is -0.5, allowed is 0.000001 to 10000"
        );
    }
}
