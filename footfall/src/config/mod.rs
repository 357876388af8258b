//! From preset, file format, configuration file and options to parameters.
//!
//! What comes later wins: preset, then the configuration file, then options.
//!
//! A configuration file is TOML. Every key is optional and carries its unit; an unknown key is
//! an error. What is given per sensor may be one number for its three axes or a table of axes.
//!
//! ```
//! let text = r#"
//! sample_rate_hz = 500.0
//! gravity = "included"            # or "removed"
//! method = "self_calibrating"     # or "half_widths", see below
//! learning = "on"                 # or "frozen": the classes stay as they are
//!
//! [learnt]                        # warm start, as `footfall calibrate` writes it
//! still_seconds = 8.6
//! moving_seconds = 8.6
//! idle_seconds = 0.0
//! acceleration = { still = -0.9, moving = 2.4, width = 0.6 } # ln of m/s²
//! rate = { still = -2.6, moving = 0.6, width = 0.4 }         # ln of rad/s
//! velocity = { still = -3.8, moving = 1.1, width = 0.7 }     # ln of m/s²
//!
//! [decision]
//! threshold = 0.5
//! on_delay_s = 0.02
//! off_delay_s = 0.0
//!
//! [load]                          # in the unit of the load signal
//! on_threshold = 12.0
//! off_threshold = 6.0
//!
//! [accelerometer]                 # applied to the recording's readings: (reading - bias) * scale
//! bias_m_s2 = { ax = 0.11, ay = -0.05, az = 0.08 }
//! scale = { ax = 1.002, ay = 0.998, az = 1.001 }
//!
//! [gyroscope]                     # taken off the recording's readings
//! bias_rad_s = { wx = 0.004, wy = -0.002, wz = 0.001 }
//! "#;
//! let overrides = footfall::config::Overrides::parse(text, "robot.toml")?;
//! let mut params = estimator_core::Params::DEFAULT;
//! overrides.apply(&mut params);
//! assert_eq!(params.learnt.unwrap().rate.still, -2.6);
//! params.validate::<256>()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! These keys belong to the method with half-widths, and are refused with the other one:
//!
//! ```
//! let text = r#"
//! method = "half_widths"
//! window = "50ms"                 # or "25samples"
//!
//! [bandwidth]                     # kernel standard deviation h: the sensor's noise
//! acceleration_m_s2 = 0.02
//! angular_rate_rad_s = 0.0012
//!
//! [half_width]                    # δ: motion within ±δ counts as rest
//! acceleration_m_s2 = { ax = 0.4, ay = 0.4, az = 0.8 }
//! angular_rate_rad_s = 0.04
//! "#;
//! let overrides = footfall::config::Overrides::parse(text, "robot.toml")?;
//! let mut params = estimator_core::Params::DEFAULT;
//! overrides.apply(&mut params);
//! assert_eq!(params.half_width.az, 0.8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `footfall calibrate` writes `[learnt]`, or with `--rests` `[accelerometer]` and `[gyroscope]`. A
//! foot has the values of `[learnt]` in its object 0x2018 and those of `[accelerometer]` in 0x2017; it
//! learns its gyroscope's bias by itself.
//!
//! The keys in the tables `[attitude]`, `[attitude.rest]`, `[decision]` and `[load]` are the names in the
//! estimator's table of limits ([`estimator_core::Parameter`]), with the unit at the end: `_s`, `_m_s2` or
//! `_rad_s`. `attitude.gyro_timing` is written as [`parse_gyro_timing`] reads it.

mod axes;
mod correction;
mod learnt;
mod numbers;
mod refusal;
mod value;

use std::io;

use clap::ValueEnum;
use estimator_core::{Gravity, Learning, Method, Params, WindowLength};
use firmware::imu::default_params;
use serde::{Deserialize, Deserializer};
use thiserror::Error;

pub use axes::{AccelerationAxes, AngularRateAxes, AxisOverrides, SensorOverrides};
pub use correction::{AccelerometerOverrides, GyroscopeOverrides};
pub use learnt::{ClassesValues, LearntValues};
pub use numbers::Numbers;
pub use refusal::{Origins, RateOrigin, Refusal};
pub use value::{
    parse_gravity, parse_gyro_timing, parse_learning, parse_method, parse_sample_rate, parse_window,
};

use crate::input::{Correction, Format};
use crate::recording::Recording;
use value::checked_sample_rate;

/// Durations that differ by less, as a part of themselves, are the same: a rate that was measured.
const SAME_DURATION: f64 = 0.05;

/// Where parameters start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// For an LSM6DSOX on a robot's foot
    #[default]
    Default,
    /// The paper's settings: those for the GO1 with --format pce-go1, else those for ATLAS
    Paper,
}

impl Preset {
    /// The parameters for recordings of a format; the load trigger is in the unit of its load.
    /// Sample rate and gravity are the recording's to say, so those in here mean nothing.
    #[must_use]
    pub fn params(self, format: Format) -> Params {
        let default_with_load_of = |other: Params| Params {
            load: other.load,
            ..default_params()
        };
        match (self, format) {
            (Self::Default, Format::Csv | Format::Lcd) => default_params(),
            (Self::Default, Format::PceAtlas) => default_with_load_of(Params::PAPER),
            (Self::Default, Format::PceGo1) => default_with_load_of(Params::PAPER_GO1),
            (Self::Paper, Format::Csv | Format::PceAtlas) => Params::PAPER,
            // A NAO weighs a third of the load from which the paper's ATLAS is loaded.
            (Self::Paper, Format::Lcd) => Params {
                load: default_params().load,
                ..Params::PAPER
            },
            (Self::Paper, Format::PceGo1) => Params::PAPER_GO1,
        }
    }

    /// That the paper's window, a count of samples, lasts longer or shorter than it does at the
    /// paper's rate; `None` where it lasts as long, or `params` have another window. Rows of the
    /// authors' GO1 are counted as the authors count them.
    #[must_use]
    pub fn window_notice(
        self,
        format: Format,
        params: &Params,
        recording: &Recording,
    ) -> Option<String> {
        let preset = self.params(format);
        let WindowLength::Samples(samples) = preset.window else {
            return None;
        };
        if params.window != preset.window || format == Format::PceGo1 {
            return None;
        }
        let [there, here] = [preset.sample_rate, recording.sample_rate]
            .map(|rate| 1.0e3 * f64::from(samples) / f64::from(rate));
        ((here / there - 1.0).abs() > SAME_DURATION).then(|| {
            format!(
                "{}: the window of the paper's preset, {samples} samples, lasts {here:.0} ms at {} Hz \
                 and {there:.0} ms at the paper's rate: --window {there:.0}ms has the same duration",
                recording.name, recording.sample_rate
            )
        })
    }
}

/// A configuration file: what it sets differs from the preset, the rest does not.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Overrides {
    /// Sample rate in Hz, where the recording does not tell, as [`parse_sample_rate`] takes it.
    #[serde(default, deserialize_with = "sample_rate")]
    pub sample_rate_hz: Option<f32>,
    /// Whether samples contain gravity.
    #[serde(default, deserialize_with = "gravity")]
    pub gravity: Option<Gravity>,
    /// Where the limits of stillness come from, as [`parse_method`] reads it.
    #[serde(default, deserialize_with = "method")]
    pub method: Option<Method>,
    /// Whether the foot goes on learning, as [`parse_learning`] reads it.
    #[serde(default, deserialize_with = "learning")]
    pub learning: Option<Learning>,
    /// What the foot has learnt before: a warm start.
    pub learnt: Option<LearntValues>,
    /// Length of the window, as [`parse_window`] reads it.
    #[serde(default, deserialize_with = "window")]
    pub window: Option<WindowLength>,
    /// Kernel standard deviations h.
    #[serde(default)]
    pub bandwidth: SensorOverrides,
    /// Half-widths δ.
    #[serde(default)]
    pub half_width: SensorOverrides,
    /// The attitude filter.
    #[serde(default, deserialize_with = "numbers::attitude")]
    pub attitude: Numbers,
    /// What is wrong with the accelerometer that recorded.
    #[serde(default)]
    pub accelerometer: AccelerometerOverrides,
    /// What is wrong with the gyroscope that recorded.
    #[serde(default)]
    pub gyroscope: GyroscopeOverrides,
    /// The debounced decision.
    #[serde(default, deserialize_with = "numbers::decision")]
    pub decision: Numbers,
    /// The load trigger.
    #[serde(default, deserialize_with = "numbers::load")]
    pub load: Numbers,
}

/// Why a configuration file cannot be used.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// It cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// The file, as it was named.
        file: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// It does not say anything that can be set, or says it wrongly.
    #[error("{file}, line {line}{}: {message}", key.as_ref().map(|key| format!(", key {key}")).unwrap_or_default())]
    Wrong {
        /// The file, as it was named.
        file: String,
        /// The line, from 1.
        line: usize,
        /// The key with the table it stands in, where the line has one.
        key: Option<String>,
        /// What is wrong.
        message: String,
    },
}

impl Overrides {
    /// Reads the text of a configuration file; `file` names it in errors.
    ///
    /// # Errors
    /// The first thing that is wrong, with its line and key.
    pub fn parse(text: &str, file: &str) -> Result<Self, ConfigError> {
        toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start.min(text.len()));
            let lines_before = text.as_bytes()[..start].iter().filter(|b| **b == b'\n');
            let line = lines_before.count() + 1;
            ConfigError::Wrong {
                file: file.to_owned(),
                line,
                key: key_on_line(text, line),
                message: error.message().trim().replace('\n', ", "),
            }
        })
    }

    /// What the file says is wrong with the sensor; `file` names it in errors.
    ///
    /// # Errors
    /// A value that no sensor has.
    pub fn correction(&self, file: &str) -> Result<Correction, Refusal> {
        correction::correction(&self.accelerometer, &self.gyroscope, file)
    }

    /// Sets in `params` what the file sets.
    pub fn apply(&self, params: &mut Params) {
        set(&mut params.sample_rate, self.sample_rate_hz);
        set(&mut params.gravity, self.gravity);
        set(&mut params.method, self.method);
        set(&mut params.learning, self.learning);
        if let Some(learnt) = self.learnt {
            params.learnt = Some(learnt.into());
        }
        set(&mut params.window, self.window);
        self.bandwidth.apply(&mut params.bandwidth);
        self.half_width.apply(&mut params.half_width);
        for numbers in [&self.attitude, &self.decision, &self.load] {
            numbers.apply(params);
        }
    }
}

fn set<T: Copy>(field: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *field = value;
    }
}

fn sample_rate<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f32>, D::Error> {
    let rate = f32::deserialize(deserializer)?;
    checked_sample_rate(rate)
        .map(Some)
        .map_err(serde::de::Error::custom)
}

/// A value that is written as a word.
fn word<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    parse: impl FnOnce(&str) -> Result<T, String>,
) -> Result<Option<T>, D::Error> {
    let text = String::deserialize(deserializer)?;
    parse(&text).map(Some).map_err(serde::de::Error::custom)
}

fn window<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<WindowLength>, D::Error> {
    word(deserializer, parse_window)
}

fn method<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Method>, D::Error> {
    word(deserializer, parse_method)
}

fn learning<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Learning>, D::Error> {
    word(deserializer, parse_learning)
}

fn gravity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Gravity>, D::Error> {
    word(deserializer, parse_gravity)
}

/// The key that stands on a line (from 1), with the table it is in.
fn key_on_line(text: &str, line: usize) -> Option<String> {
    let so_far: Vec<&str> = text.lines().take(line).map(str::trim).collect();
    let (key, _) = so_far.last()?.split_once('=')?;
    let table = so_far
        .iter()
        .rev()
        .find_map(|line| line.strip_prefix('[')?.split(']').next());
    Some(match table {
        Some(table) => format!("{}.{}", table.trim(), key.trim()),
        None => key.trim().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{
        AttitudeParams, DecisionParams, GyroTiming, Learnt, LoadParams, PerAxis, RestParams,
    };

    fn applied(text: &str) -> Params {
        let mut params = Params::DEFAULT;
        Overrides::parse(text, "x.toml").unwrap().apply(&mut params);
        params
    }

    fn message(text: &str) -> String {
        Overrides::parse(text, "x.toml").unwrap_err().to_string()
    }

    #[test]
    fn an_empty_file_changes_nothing() {
        assert_eq!(applied(""), Params::DEFAULT);
    }

    #[test]
    fn every_key_reaches_its_parameter() {
        let params = applied(
            "sample_rate_hz = 500\ngravity = 'removed'\nwindow = '25samples'\n\
             method = 'half_widths'\nlearning = 'frozen'\n\
             [learnt]\nstill_seconds = 31\nmoving_seconds = 32\nidle_seconds = 33\n\
             acceleration = { still = 22, moving = 23, width = 24 }\n\
             rate = { still = 25, moving = 26, width = 27 }\n\
             velocity = { still = 28, moving = 29, width = 30 }\n\
             [bandwidth]\nacceleration_m_s2 = 1\nangular_rate_rad_s = 2.0\n\
             [half_width]\nacceleration_m_s2 = { ax = 3, ay = 4, az = 5 }\n\
             angular_rate_rad_s = { wx = 6, wy = 7, wz = 8 }\n\
             [attitude]\ngyro_timing = '9ms'\nmotion_time_constant_s = 10\nquiet_gain = 11\n\
             quiet_acceleration_m_s2 = 12\nquiet_rate_rad_s = 13\n\
             [attitude.rest]\nduration_s = 14\nacceleration_m_s2 = 15\nrate_rad_s = 16\n\
             bias_limit_rad_s = 17\nbias_time_constant_s = 18\n\
             [decision]\nthreshold = 0.6\non_delay_s = 0.1\noff_delay_s = 0.2\n\
             [load]\non_threshold = 20\noff_threshold = 10\n",
        );
        let expected = Params {
            sample_rate: 500.0,
            gravity: Gravity::Removed,
            method: Method::HalfWidths,
            learning: Learning::Frozen,
            learnt: Some(Learnt::from_array([
                22.0, 23.0, 24.0, 25.0, 26.0, 27.0, 28.0, 29.0, 30.0, 31.0, 32.0, 33.0,
            ])),
            // No key reaches these.
            stillness: Params::DEFAULT.stillness,
            window: WindowLength::Samples(25),
            bandwidth: PerAxis::by_sensor(1.0, 2.0),
            half_width: PerAxis::from_array([3.0, 4.0, 5.0, 6.0, 7.0, 8.0]),
            attitude: AttitudeParams {
                gyro_timing: GyroTiming::Delay(0.009),
                motion_time_constant: 10.0,
                quiet_gain: 11.0,
                quiet_acceleration: 12.0,
                quiet_rate: 13.0,
                rest: RestParams {
                    duration: 14.0,
                    acceleration: 15.0,
                    rate: 16.0,
                    bias_limit: 17.0,
                    bias_time_constant: 18.0,
                },
            },
            decision: DecisionParams {
                threshold: 0.6,
                on_delay: 0.1,
                off_delay: 0.2,
            },
            load: LoadParams {
                on_threshold: 20.0,
                off_threshold: 10.0,
            },
        };
        assert_eq!(params, expected);
    }

    #[test]
    fn what_was_learnt_is_given_whole() {
        assert_eq!(
            message("[learnt]\nstill_seconds = 1\nmoving_seconds = 1\n"),
            "x.toml, line 1: missing field `idle_seconds`"
        );
        assert_eq!(
            message("method = 'kernel'\n"),
            "x.toml, line 1, key method: \"kernel\" is neither \"self_calibrating\" nor \"half_widths\""
        );
    }

    #[test]
    fn an_axis_that_is_not_named_keeps_its_value() {
        let params = applied("half_width.acceleration_m_s2 = { az = 0.8 }");
        assert_eq!(params.half_width.to_array()[..3], [0.4, 0.4, 0.8]);
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line() {
        assert_eq!(
            message("\n[half_width]\nacceleration = 1.0\n"),
            "x.toml, line 3, key half_width.acceleration: unknown field `acceleration`, \
             expected `acceleration_m_s2` or `angular_rate_rad_s`"
        );
    }

    #[test]
    fn a_value_of_the_wrong_kind_is_named_with_its_key() {
        assert_eq!(
            message("[load]\non_threshold = 'high'\n"),
            "x.toml, line 2, key load.on_threshold: invalid type: string \"high\", expected f32"
        );
        assert_eq!(
            message("[bandwidth]\nangular_rate_rad_s = 'low'\n"),
            "x.toml, line 2, key bandwidth.angular_rate_rad_s: \
             invalid type: string \"low\", expected a number or a table of axes"
        );
    }

    #[test]
    fn an_unknown_axis_is_named() {
        let message = message("[bandwidth]\nangular_rate_rad_s = { ax = 1 }\n");
        assert!(
            message.starts_with(
                "x.toml, line 2, key bandwidth.angular_rate_rad_s: unknown field `ax`"
            ),
            "{message}"
        );
    }

    #[test]
    fn a_sample_rate_is_checked_as_the_option_is() {
        for wrong in ["0", "-5", "nan", "inf"] {
            assert!(
                message(&format!("sample_rate_hz = {wrong}\n"))
                    .starts_with("x.toml, line 1, key sample_rate_hz: "),
            );
        }
        assert_eq!(
            message("sample_rate_hz = -5\n"),
            "x.toml, line 1, key sample_rate_hz: -5 is no sample rate: write a number of Hz above 0"
        );
    }

    #[test]
    fn the_load_trigger_is_in_the_unit_of_the_formats_load() {
        for (format, with_its_load) in [
            (Format::Csv, Params::DEFAULT),
            (Format::PceAtlas, Params::PAPER),
            (Format::Lcd, Params::DEFAULT),
            (Format::PceGo1, Params::PAPER_GO1),
        ] {
            let expected = Params {
                load: with_its_load.load,
                ..default_params()
            };
            assert_eq!(Preset::Default.params(format), expected, "{format:?}");
        }
    }

    #[test]
    fn every_preset_is_valid_for_every_format() {
        for preset in [Preset::Default, Preset::Paper] {
            for format in Format::value_variants() {
                let params = preset.params(*format);
                assert!(params.validate::<256>().is_ok(), "{preset:?}, {format:?}");
            }
        }
    }
}
