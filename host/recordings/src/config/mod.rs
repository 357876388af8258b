//! Parameters from preset, file format, configuration file and options.
//!
//! Later sources override earlier ones: preset, then the configuration file, then options. [`Resolved`] merges them.
//!
//! A configuration file is TOML. Every key is optional and carries its unit; an unknown key is an error. A setting
//! per sensor is one number for its three axes or a table of axes.
//!
//! ```
//! let text = r#"
//! sample_rate_hz = 500.0
//! gravity = "included"            # or "removed"
//! axes = "x,-z,y"                 # the sensor's axes along the foot's x, y and z (up), or "w,x,y,z"
//! method = "self_calibrating"     # or "half_widths", see below
//! learning = "on"                 # or "frozen": the classes stay as they are
//!
//! [learnt]                        # warm start, as `footfall calibrate` writes it
//! still = -0.9                    # ln of m/s²
//! moving = 2.4                    # ln of m/s²
//! speed = -7.4                    # ln of m/s
//! still_seconds = 1.5
//! moving_seconds = 1.5
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
//! [velocity]                      # sigma_v
//! speed_m_s = 0.05
//! lever_m = 0.15
//! floor_m_s = 0.003
//!
//! [accelerometer]                 # applied to the recording's readings: (reading - bias) * scale
//! bias_m_s2 = { ax = 0.11, ay = -0.05, az = 0.08 }
//! scale = { ax = 1.002, ay = 0.998, az = 1.001 }
//!
//! [gyroscope]                     # taken off the recording's readings
//! bias_rad_s = { wx = 0.004, wy = -0.002, wz = 0.001 }
//!
//! [feet.FR]                       # of this foot: axes, learnt, accelerometer, gyroscope, decision and load
//! axes = "-x,z,y"
//! load = { on_threshold = 20.0, off_threshold = 14.0 }
//! "#;
//! let overrides = recordings::config::Overrides::parse(text, "robot.toml")?;
//! let mut params = estimator_core::Params::DEFAULT;
//! overrides.apply(&mut params);
//! assert_eq!(params.learnt.unwrap().still, -0.9);
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
//! let overrides = recordings::config::Overrides::parse(text, "robot.toml")?;
//! let mut params = estimator_core::Params::DEFAULT;
//! overrides.apply(&mut params);
//! assert_eq!(params.half_width.az, 0.8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `footfall calibrate` writes `[learnt]` and `axes`, or with `--rests` `[accelerometer]` and `[gyroscope]`. A
//! foot has the values of `[learnt]` in its object 0x2018, those of `[accelerometer]` in 0x2017 and `axes` in
//! 0x2019; it learns its gyroscope bias by itself. Sensor errors are given along the sensor's own axes and
//! corrected before `axes` turns the readings. Half-widths and bandwidths are along the axes of the foot.
//!
//! The keys in the tables `[attitude]`, `[attitude.rest]`, `[decision]`, `[load]` and `[velocity]` are the
//! names in the estimator's table of limits ([`estimator_core::Parameter`]), with the unit at the end: `_s`,
//! `_m`, `_m_s`, `_m_s2` or `_rad_s`. `attitude.gyro_timing` is written as [`parse_gyro_timing`] reads it.

mod axes;
mod correction;
mod example;
mod keys;
mod learnt;
mod notation;
mod position;
mod preset;
mod refusal;
mod resolved;
mod settings;
mod value;

use std::collections::BTreeMap;
use std::io;

use crate::input::{Correction, is_among};
use estimator_core::Params;
use thiserror::Error;
use toml::de::DeTable;

pub use axes::{FootAxes, axes_text, parse_axes};
pub use example::example;
pub use keys::{Key, keys};
pub use learnt::LearntValues;
pub use position::Position;
pub use preset::{Preset, default_params};
pub use refusal::{Origins, ParameterRefusal, RateOrigin};
pub use resolved::{ConfigFile, NoSuchFoot, Resolved};
pub use settings::Settings;
pub use value::{
    GRAVITIES, LEARNINGS, METHODS, gyro_timing_text, parse_gravity, parse_gyro_timing,
    parse_sample_rate, parse_seconds, parse_window, window_text, word_of,
};

use settings::Reader;

/// A configuration file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Settings for all feet.
    pub all: Settings,
    /// Settings of single feet, by name; they override those for all feet.
    pub feet: BTreeMap<String, Settings>,
}

/// Error of a configuration file.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// Name of the file, as given.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not valid TOML, or has unknown keys or invalid values: a line for each.
    #[error("{}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Wrong {
        /// The errors, in the order of the file; at least one.
        errors: Vec<KeyError>,
    },
}

/// Error of a key or a line of a configuration file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{file}, {position}{}: {message}", key.as_ref().map(|key| format!(", key {key}")).unwrap_or_default())]
pub struct KeyError {
    /// Name of the file, as given.
    pub file: String,
    /// Position in the file.
    pub position: Position,
    /// Key with its table, if the line has one.
    pub key: Option<String>,
    /// Description of the error.
    pub message: String,
}

/// Number of errors that are shown.
const MOST_ERRORS: usize = 20;

impl Overrides {
    /// Parses the text of a configuration file; `file` names it in errors.
    ///
    /// # Errors
    /// The errors of all keys, each with its line, or the first of the syntax.
    pub fn parse(text: &str, file: &str) -> Result<Self, ConfigError> {
        let mut reader = Reader::default();
        let all = match DeTable::parse(text) {
            Ok(table) => reader.all(table.get_ref()),
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                reader.errors.push((at, error.message().trim().replace('\n', ", ")));
                Settings::default()
            }
        };
        if reader.errors.is_empty() {
            return Ok(Self { all, feet: reader.feet });
        }
        reader.errors.sort_by_key(|(at, _)| *at);
        let errors = reader.errors.into_iter().take(MOST_ERRORS);
        let errors = errors.map(|(at, message)| {
            let position = Position::of_byte(text, at);
            KeyError {
                file: file.to_owned(),
                position,
                key: key_on_line(text, position.line),
                message,
            }
        });
        Err(ConfigError::Wrong { errors: errors.collect() })
    }

    /// Returns the correction of the sensor's errors and its mounting in the foot.
    #[must_use]
    pub fn correction(&self) -> Correction {
        self.all.corrected(Correction::NONE)
    }

    /// Returns the corrections of single feet, by name.
    #[must_use]
    pub fn foot_corrections(&self) -> BTreeMap<String, Correction> {
        let all = self.correction();
        let feet = self.feet.iter();
        feet.map(|(name, foot)| (name.clone(), foot.corrected(all))).collect()
    }

    /// Applies the settings of a foot with these names to `params`, after those of all.
    pub fn apply_foot(&self, names: &[&str], params: &mut Params) {
        let mut feet = self.feet.iter();
        let own = feet.find(|(foot, _)| is_among(foot, names));
        if let Some((_, own)) = own {
            own.apply(params);
        }
    }

    /// Applies the settings for all feet to `params`.
    pub fn apply(&self, params: &mut Params) {
        self.all.apply(params);
    }
}

/// Returns the key on a line (from 1), with the table it is in.
fn key_on_line(text: &str, line: usize) -> Option<String> {
    let so_far: Vec<&str> = text.lines().take(line).map(str::trim).collect();
    let (key, _) = so_far.last()?.split_once('=')?;
    let table = so_far.iter().rev().find_map(|line| line.strip_prefix('[')?.split(']').next());
    Some(match table {
        Some(table) => format!("{}.{}", table.trim(), key.trim()),
        None => key.trim().to_owned(),
    })
}

#[cfg(test)]
mod tests;
