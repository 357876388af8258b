//! Parameters from preset, file format, configuration file and options.
//!
//! Later sources override earlier ones: preset, then the configuration file, then options.
//!
//! | step | file |
//! |---|---|
//! | the public type [`Resolved`]: the merged settings, and the parameters that they give a foot; presets; mountings of feet | this one |
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
//! [feet.FR]                       # of this foot: axes, learnt, accelerometer, gyroscope, decision, load, velocity
//! axes = "-x,z,y"
//! load = { on_threshold = 20.0, off_threshold = 14.0 }
//! "#;
//! let overrides = config::Overrides::parse(text, "robot.toml")?;
//! let mut params = estimator_core::any::AnyParams::DEFAULT;
//! overrides.apply(&mut params);
//! assert_eq!(params.params.learnt.unwrap().still, -0.9);
//! params.params.validate()?;
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
//! let overrides = config::Overrides::parse(text, "robot.toml")?;
//! let mut params = estimator_core::any::AnyParams::DEFAULT;
//! overrides.apply(&mut params);
//! assert_eq!(params.half_widths.half_width.az, 0.8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A calibration writes `[learnt]`, `axes` and `velocity.lever_m`, or from rests `[accelerometer]` and `[gyroscope]`. On a foot
//! the values of `[learnt]` are in object 0x2018, those of `[accelerometer]` in 0x2017, and `axes` in 0x2019. A foot
//! learns its gyroscope bias without a setting. Sensor errors are given along the sensor's own axes and corrected
//! before `axes` turns the readings. Half-widths and bandwidths are along the axes of the foot.
//!
//! The keys in the tables `[attitude]`, `[attitude.rest]`, `[decision]`, `[load]` and `[velocity]` are the
//! names in the estimator's table of limits ([`estimator_core::parameter::Parameter`]), with the unit at the end: `_s`,
//! `_m`, `_m_s`, `_m_s2` or `_rad_s`. `attitude.gyro_timing` is written as [`parse_gyro_timing`] reads it.

mod file;
mod keys;
mod refusal;
mod value;

use std::collections::BTreeMap;
use std::fmt::{self, Formatter};
use std::str::FromStr;

use estimator_core::any::AnyParams;
use estimator_core::half_widths::{HalfWidthParams, WindowLength};
use estimator_core::mounting::Mounting;
use estimator_core::parameter::Parameter;
use estimator_core::{Gravity, Params, ParamsError, PerAxis, Stream};
use lsm6dsox::{Config, Noise};

use options::display_in_plain_words;
use options::format::{ATLAS_SAMPLE_RATE, GO1_SAMPLE_RATE};
use options::hint::{Hint, InWords, Notice, Setting, Vocabulary};
use options::{BagOptions, ContactUse, Correction, Format, InputOptions, TableOptions, is_among};
use samples::estimate;
use samples::mounting::parse_axes;

pub use file::{ConfigError, ConfigFile, KeyError, Overrides, Position, Settings};
pub use keys::{Key, example, keys};
pub use options::words::{GRAVITIES, word_of};
pub use refusal::{Origins, ParameterRefusal, RateOrigin};
pub use value::{
    LEARNINGS, METHODS, gyro_timing_text, parse_gravity, parse_gyro_timing, parse_sample_rate,
    parse_seconds, parse_window, window_text,
};

/// Settings of preset, configuration file and options. Options override the file, and the file overrides the
/// preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Resolved {
    /// Preset from which the parameters start.
    pub preset: Preset,
    /// Configuration file.
    pub file: Option<ConfigFile>,
    /// Settings in the file.
    pub overrides: Overrides,
    /// Option: length of the window.
    pub window: Option<WindowLength>,
    /// Option: sample rate, Hz.
    pub sample_rate: Option<f32>,
    /// Option: whether samples contain gravity.
    pub gravity: Option<Gravity>,
    /// Option: mounting of the sensors.
    pub axes: Option<FootAxes>,
}

impl Resolved {
    /// Takes the settings of a configuration file.
    ///
    /// # Errors
    /// The first error in the file.
    pub fn of_file(file: ConfigFile) -> Result<Self, ConfigError> {
        Ok(Self {
            overrides: Overrides::parse(&file.text, &file.name)?,
            file: Some(file),
            ..Self::default()
        })
    }

    /// Returns the parameters for recordings of a format.
    #[must_use]
    pub fn params(&self, format: Format) -> AnyParams {
        let mut params = self.preset.params(format);
        self.overrides.apply(&mut params);
        if let Some(window) = self.window {
            params.half_widths.window = window;
        }
        params
    }

    /// Returns the parameters for a foot with these names in recordings of a format.
    #[must_use]
    pub fn params_of(&self, names: &[&str], format: Format) -> AnyParams {
        let mut params = self.params(format);
        self.overrides.apply_foot(names, &mut params);
        params
    }

    /// Returns the properties of files that their format does not define.
    #[must_use]
    pub fn input_options(
        &self,
        table: TableOptions,
        bag: BagOptions,
        contacts: ContactUse,
    ) -> InputOptions {
        let mut correction = self.overrides.correction();
        let mut foot_corrections = self.overrides.foot_corrections();
        if let Some(axes) = &self.axes {
            axes.set(&mut correction, &mut foot_corrections);
        }
        InputOptions {
            sample_rate: self.sample_rate.or(self.overrides.all.sample_rate),
            gravity: self.gravity.or(self.overrides.all.gravity),
            correction,
            foot_corrections,
            table,
            bag,
            contacts,
        }
    }

    /// Returns the sources of the parameters, for errors about a recording.
    #[must_use]
    pub fn origins<'a>(&'a self, recording: &'a str) -> Origins<'a> {
        Origins {
            file: self.file.as_ref().map(|file| file.name.as_str()),
            text: self.file_text(),
            overrides: &self.overrides,
            window: self.window,
            recording,
            sample_rate: match (self.sample_rate, self.overrides.all.sample_rate) {
                (Some(_), _) => RateOrigin::Option,
                (None, Some(_)) => RateOrigin::Configuration,
                (None, None) => RateOrigin::Recording,
            },
        }
    }

    /// Checks the settings at the preset's sample rate.
    ///
    /// # Errors
    /// Each setting that is out of range, or the first without an effect.
    pub fn check(&self, format: Format) -> Result<(), ParameterRefusal> {
        self.check_params(format, |_| true)
    }

    /// Checks the parameters that do not depend on the recording. The length of the window in samples depends on it,
    /// and is checked after reading.
    ///
    /// # Errors
    /// Each parameter that is out of range, or the first without an effect.
    pub fn check_before_reading(&self, format: Format) -> Result<(), ParameterRefusal> {
        self.check_params(format, |error| !matches!(error, ParamsError::WindowLength { .. }))
    }

    fn check_params(
        &self,
        format: Format,
        counts: impl Fn(&ParamsError) -> bool,
    ) -> Result<(), ParameterRefusal> {
        let mut params = self.params(format);
        let origins = self.origins("");
        origins.check_effects(&params)?;
        let mut refusals = Vec::new();
        let mut stream = self.preset.stream(format);
        if let Some(rate) = self.overrides.all.sample_rate {
            match Stream::new(rate, stream.gravity()) {
                Ok(as_configured) => stream = as_configured,
                Err(error) => refusals.push(origins.explain(&error)),
            }
        }
        while let Err(error) = estimate::check(&params, stream)
            && counts(&error)
        {
            refusals.push(origins.explain(&error));
            // With the preset's number in place of the refused one, the next check finds the next error.
            let ParamsError::OutOfRange { field, .. } = error else {
                break;
            };
            let Some(parameter) = value::parameter_named(field) else {
                break;
            };
            let preset = parameter.get(&self.preset.params(format));
            // A pair of thresholds is one error.
            if parameter == Parameter::LoadOffThreshold || parameter.get(&params) == preset {
                break;
            }
            parameter.set(&mut params, preset);
        }
        ParameterRefusal::of_all(refusals)
    }

    /// Checks that each foot with axes of its own, set by the option, is among these names.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check_axes(&self, names: &[&str]) -> Result<(), NoSuchFoot> {
        match self.absent_foot(names) {
            None => Ok(()),
            Some(foot) => Err(NoSuchFoot { foot: foot.to_owned(), feet: names.join(", ") }),
        }
    }

    /// Returns the first foot with axes of its own, set by the option, that is not among these names.
    #[must_use]
    pub fn absent_foot(&self, names: &[&str]) -> Option<&str> {
        self.axes.as_ref().and_then(|axes| axes.absent(names))
    }

    /// Returns a sentence if the file has settings of single feet, and none of these feet is among these names.
    #[must_use]
    pub fn unused_feet(&self, names: &[&str]) -> Option<String> {
        let feet = &self.overrides.feet;
        let is_unused = !feet.is_empty() && !feet.keys().any(|foot| is_among(foot, names));
        let feet: Vec<&str> = feet.keys().map(String::as_str).collect();
        is_unused.then(|| {
            format!(
                "{} has settings of {}, but there is {}",
                self.file_name(),
                feet.join(", "),
                names.join(", ")
            )
        })
    }

    /// Returns the name of the file; empty without one.
    #[must_use]
    pub fn file_name(&self) -> &str {
        self.file.as_ref().map_or("", |file| file.name.as_str())
    }

    /// Returns the text of the file; empty without one.
    #[must_use]
    pub fn file_text(&self) -> &str {
        self.file.as_ref().map_or("", |file| file.text.as_str())
    }
}

samples::named! {
    /// Preset from which the parameters start.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Preset {
        /// Settings for an LSM6DSOX on a robot's foot.
        #[default]
        Default = "default",
        /// Settings of the paper.
        Paper = "paper",
    } or |name| {
        let names = Self::ALL.map(|preset| format!("{:?}", preset.name()));
        format!("preset is {name:?}, but {} is expected", names.join(" or "))
    }
}

impl Preset {
    /// Returns the purpose, in one line.
    #[must_use]
    pub const fn help(self) -> &'static str {
        match self {
            Self::Default => "Self-calibrating, for any foot and sensor",
            Self::Paper => {
                "The paper's settings: those for the GO1 with the format pce-go1, else those for ATLAS"
            }
        }
    }

    /// Returns the parameters for recordings of a format; the load trigger is in the unit of its load.
    #[must_use]
    pub fn params(self, format: Format) -> AnyParams {
        let with_load_of = |params: AnyParams, other: AnyParams| AnyParams {
            params: Params { load: other.params.load, ..params.params },
            ..params
        };
        let (default, paper) = (default_params(), AnyParams::PAPER);
        match (self, format) {
            (Self::Default, Format::PceAtlas) => with_load_of(default, paper),
            (Self::Default, Format::PceGo1) => with_load_of(default, AnyParams::PAPER_GO1),
            // A NAO weighs a third of the load from which the paper's ATLAS is loaded.
            (Self::Paper, Format::Lcd) => with_load_of(paper, default),
            (Self::Paper, Format::PceGo1) => AnyParams::PAPER_GO1,
            (Self::Default, _) => default,
            (Self::Paper, _) => paper,
        }
    }

    /// Returns the samples that the preset is meant for. The samples of a recording may differ.
    #[must_use]
    pub fn stream(self, format: Format) -> Stream {
        let paper = match (self, format) {
            (Self::Default, _) => return Stream::KILOHERTZ,
            (Self::Paper, Format::PceGo1) => Stream::new(GO1_SAMPLE_RATE, Gravity::Included),
            (Self::Paper, _) => Stream::new(ATLAS_SAMPLE_RATE, Gravity::Removed),
        };
        paper.unwrap_or(Stream::KILOHERTZ)
    }

    /// Returns a notice if the paper's window, a count of samples, has another duration than at the paper's rate.
    /// Returns `None` otherwise, or if `params` have another window. Rows of the authors' GO1 are counted as by the
    /// authors.
    #[must_use]
    pub fn window_notice(
        self,
        format: Format,
        params: &AnyParams,
        recording: &str,
        sample_rate: f32,
    ) -> Option<Notice> {
        let preset = self.params(format);
        let WindowLength::Samples(samples) = preset.half_widths.window else {
            return None;
        };
        if params.half_widths.window != preset.half_widths.window || format == Format::PceGo1 {
            return None;
        }
        let [there, here] = [self.stream(format).sample_rate(), sample_rate]
            .map(|rate| 1.0e3 * f64::from(samples) / f64::from(rate));
        ((here / there - 1.0).abs() > SAME_DURATION).then(|| {
            let text = format!(
                "{recording}: the window of the paper's preset, {samples} samples, lasts {here:.0} ms at {sample_rate} Hz \
                 and {there:.0} ms at the paper's rate"
            );
            Notice::with_hint(text, Hint::Window(there))
        })
    }
}

/// Relative difference below which durations count as equal, because the rate is measured.
const SAME_DURATION: f64 = 0.05;

/// Returns the default parameters of the estimator for the foot's sensor: its own defaults, with the bandwidths
/// that follow from the noise of the sensor's setting.
#[must_use]
pub fn default_params() -> AnyParams {
    let half_widths = HalfWidthParams::DEFAULT;
    AnyParams {
        half_widths: with_bandwidth_of(&Config::FRESH_KILOHERTZ.noise(), half_widths),
        ..AnyParams::DEFAULT
    }
}

/// Sets the bandwidths to a sensor's noise. Unknown noise leaves them unchanged.
fn with_bandwidth_of(noise: &Noise, params: HalfWidthParams) -> HalfWidthParams {
    HalfWidthParams {
        bandwidth: PerAxis::by_sensor(
            noise.specific_force.unwrap_or(params.bandwidth.ax),
            noise.angular_rate.unwrap_or(params.bandwidth.wx),
        ),
        ..params
    }
}

/// Axes are given for a foot that is not in the recordings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoSuchFoot {
    /// Name of the foot, as given.
    pub foot: String,
    /// Names of the feet in the recordings, separated by commas.
    pub feet: String,
}

impl std::error::Error for NoSuchFoot {}

display_in_plain_words!(NoSuchFoot);

impl InWords for NoSuchFoot {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        let (axes, Self { foot, feet }) = (words.name(Setting::Axes), self);
        write!(f, "{axes} names the foot {foot}, but there is {feet}")
    }
}

/// Mounting of the sensors: the same in all feet, or one of each foot.
#[derive(Clone, Debug, PartialEq)]
pub enum FootAxes {
    /// Mounting of the sensors of all feet.
    All(Mounting),
    /// Mountings by the name of the foot.
    Each(BTreeMap<String, Mounting>),
}

impl FootAxes {
    /// The first foot with a mounting that is not among these names.
    pub fn absent(&self, names: &[&str]) -> Option<&str> {
        let Self::Each(mountings) = self else {
            return None;
        };
        let mut feet = mountings.keys().map(String::as_str);
        feet.find(|foot| !is_among(foot, names))
    }

    /// Replaces the mountings in the correction of all feet and in the corrections of single feet.
    pub fn set(&self, all: &mut Correction, feet: &mut BTreeMap<String, Correction>) {
        match self {
            Self::All(mounting) => {
                all.mounting = *mounting;
                for correction in feet.values_mut() {
                    correction.mounting = *mounting;
                }
            }
            Self::Each(mountings) => {
                for (foot, mounting) in mountings {
                    let mut names = feet.keys();
                    let known = names.find(|name| name.eq_ignore_ascii_case(foot)).cloned();
                    let own = feet.entry(known.unwrap_or_else(|| foot.clone()));
                    own.or_insert(*all).mounting = *mounting;
                }
            }
        }
    }
}

impl FromStr for FootAxes {
    type Err = String;

    /// Reads a mounting as [`parse_axes`] does, or one for each foot, such as `FL=x,y,z,FR=-x,-y,z`.
    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains('=') {
            return parse_axes(text).map(Self::All);
        }
        let mut feet: BTreeMap<String, String> = BTreeMap::new();
        let mut name: Option<&str> = None;
        for part in text.split(',') {
            if let Some((foot, first)) = part.split_once('=') {
                let foot = foot.trim();
                if foot.is_empty() || is_among(foot, feet.keys()) {
                    return Err(format!("{text:?} names no foot before =, or one twice"));
                }
                feet.insert(foot.to_owned(), first.to_owned());
                name = Some(foot);
            } else if let Some(axes) = name.and_then(|name| feet.get_mut(name)) {
                *axes = format!("{axes},{part}");
            } else {
                return Err(format!("{text:?} has {part:?} before the name of a foot"));
            }
        }
        let parsed = feet.into_iter().map(|(foot, axes)| {
            let mounting = parse_axes(&axes).map_err(|error| format!("{foot}: {error}"))?;
            Ok((foot, mounting))
        });
        parsed.collect::<Result<_, String>>().map(Self::Each)
    }
}

#[cfg(test)]
mod tests;
