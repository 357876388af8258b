//! Parameters from preset, file format, configuration file and options.
//!
//! Later sources override earlier ones: preset, then the configuration file, then options.
//!
//! | step | file |
//! |---|---|
//! | the merged settings, and the parameters that they give a foot: [`Resolved`] | `resolved` |
//! | settings to start from | `preset` |
//! | a file: its settings, read by the table of keys; its errors by line and key | `file` |
//! | the keys: meaning, unit, range, object on a foot; a file with all of them | `keys` |
//! | values as text, such as `50ms` | `value` |
//! | refused parameters, by the option or key that sets them | `refusal` |
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
//! version = 1                     # and crc, which is checked if it is there
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
//! params.validate_for::<256>()?;
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
//! A calibration writes `[learnt]` and `axes`, or from rests `[accelerometer]` and `[gyroscope]`. On a foot
//! the values of `[learnt]` are in object 0x2018, those of `[accelerometer]` in 0x2017, and `axes` in 0x2019. A foot
//! learns its gyroscope bias without a setting. Sensor errors are given along the sensor's own axes and corrected
//! before `axes` turns the readings. Half-widths and bandwidths are along the axes of the foot.
//!
//! The keys in the tables `[attitude]`, `[attitude.rest]`, `[decision]`, `[load]` and `[velocity]` are the
//! names in the estimator's table of limits ([`estimator_core::parameter::Parameter`]), with the unit at the end: `_s`,
//! `_m`, `_m_s`, `_m_s2` or `_rad_s`. `attitude.gyro_timing` is written as [`parse_gyro_timing`] reads it.

mod file;
mod keys;
pub(super) mod preset;
mod refusal;
mod resolved;
pub(super) mod value;

pub use file::{ConfigError, ConfigFile, KeyError, Overrides, Position, Settings};
pub use keys::{Key, example, keys};
pub use preset::{Preset, default_params};
pub use refusal::{Origins, ParameterRefusal, RateOrigin};
pub use resolved::{FootAxes, NoSuchFoot, Resolved};
pub use value::{
    GRAVITIES, LEARNINGS, METHODS, gyro_timing_text, parse_gravity, parse_gyro_timing,
    parse_sample_rate, parse_seconds, parse_window, window_text, word_of,
};

#[cfg(test)]
mod tests;
