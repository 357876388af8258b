//! Parameters from preset, configuration and arguments, with the rules of the program. The load thresholds of a preset
//! depend on the format of the recording, because the unit of its load does.

use std::fmt::Display;

use config::{ConfigFile, FootAxes, Preset, Resolved};
use estimator_core::Gravity;
use estimator_core::any::AnyParams;
use options::hint::Notice;
use options::{BagOptions, ContactUse, Format, InputOptions, TableOptions, Units};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::result::Failure;
use crate::words::{Origin, in_words_of, value_error};

/// Settings of the estimator, and properties of the recording.
#[derive(Clone)]
pub(crate) struct Settings {
    /// Settings of preset, configuration and arguments.
    pub(crate) resolved: Resolved,
    /// Format from which the arrays of a recording were read.
    pub(crate) format: Format,
    /// Origin of the arrays.
    pub(crate) origin: Origin,
    /// Properties of a recording in arrays: sample rate, gravity and corrections.
    pub(crate) input_options: InputOptions,
}

/// Arguments with settings of the estimator.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SettingsArguments {
    preset: String,
    /// Name and text of a configuration file.
    config: Option<(String, String)>,
    gravity: Option<String>,
    rate: Option<f64>,
    /// Mounting of the sensor in the form of `--axes`; overrides the configuration.
    axes: Option<String>,
    /// Format of the recording in the form of `--format`.
    format: Option<String>,
    /// Units of samples in the form of `--units`.
    units: Option<String>,
}

impl SettingsArguments {
    /// Parses and checks the arguments.
    pub(crate) fn read(&self) -> PyResult<Settings> {
        let preset: Preset = self.preset.parse().map_err(value_error)?;
        let file = self.config.clone();
        let file = file.map(|(name, text)| ConfigFile { name, text });
        let of_file = file.map(Resolved::of_file).transpose();
        let of_file = of_file.map_err(value_error)?;
        let axes = self.axes.as_deref().map(str::parse::<FootAxes>).transpose();
        let axes = axes.map_err(named("axes"))?;
        let format = match &self.format {
            None => Format::Csv,
            Some(name) => name.parse().map_err(value_error)?,
        };
        if let Some(rate) = self.rate
            && !(rate > 0.0 && rate.is_finite())
        {
            return Err(PyValueError::new_err(format!(
                "rate is {rate}, but a sample rate in Hz above 0 is expected"
            )));
        }
        let resolved = Resolved {
            preset,
            sample_rate: self.rate.map(|rate| rate as f32),
            gravity: gravity(self.gravity.as_deref())?,
            axes,
            ..of_file.unwrap_or_default()
        };
        let units = self.units.as_deref().map(str::parse::<Units>).transpose();
        let units = units.map_err(named("units"))?.unwrap_or_default();
        let (table, bag) =
            (TableOptions { units, ..TableOptions::default() }, BagOptions::default());
        Ok(Settings {
            input_options: resolved.input_options(table, bag, ContactUse::Ignored),
            resolved,
            format,
            // Arrays of a recording that was read have its format.
            origin: self.format.as_ref().map_or(Origin::Arrays, |_| Origin::File),
        })
    }
}

impl Settings {
    /// Checks that there are no settings of single feet, because arrays do not name their foot.
    pub(crate) fn of_unnamed_foot(self) -> PyResult<Self> {
        let mut feet = self.input_options.foot_corrections.keys();
        match feet.next() {
            None => Ok(self),
            Some(foot) => Err(PyValueError::new_err(format!(
                "there are settings of the foot {foot}, but samples in arrays are of a foot without a name: \
                 give axes of this foot alone, or use estimate_file or fleet"
            ))),
        }
    }

    /// Checks that each foot with axes of its own has one of these names.
    pub(crate) fn check_feet(&self, names: &[&str]) -> PyResult<()> {
        match self.resolved.absent_foot(names) {
            None => Ok(()),
            Some(foot) => Err(PyValueError::new_err(format!(
                "axes name the foot {foot}, but there is {}",
                names.join(", ")
            ))),
        }
    }

    /// Returns whether accelerations in arrays contain gravity.
    pub(crate) fn gravity(&self) -> Gravity {
        self.input_options.gravity.unwrap_or(Gravity::Included)
    }

    /// Returns the parameters for a recording in arrays.
    pub(crate) fn params(&self) -> AnyParams {
        self.resolved.params(self.format)
    }

    /// Returns the exception of a failed estimate of `recording`, or of the times `t` in arrays.
    pub(crate) fn failed(&self, failure: Failure, recording: &str, origin: Origin) -> PyErr {
        match failure {
            Failure::Params(error) => {
                let explained = self.resolved.origins(recording).explain(&error);
                value_error(in_words_of(origin, &explained))
            }
            other => other.into(),
        }
    }

    /// Returns a notice if the window of the preset lasts longer or shorter than the paper's.
    pub(crate) fn window_notice(&self, format: Format, name: &str, rate: f32) -> Option<Notice> {
        let params = self.resolved.params(format);
        let preset = self.resolved.preset;
        preset.window_notice(format, &params, name, rate)
    }
}

/// Returns an error about an argument.
pub(crate) fn named<E: Display>(name: &str) -> impl Fn(E) -> PyErr {
    move |error| value_error(format!("{name}: {error}"))
}

/// Parses whether accelerations contain gravity.
pub(crate) fn gravity(name: Option<&str>) -> PyResult<Option<Gravity>> {
    match name {
        None => Ok(None),
        Some("included") => Ok(Some(Gravity::Included)),
        Some("removed") => Ok(Some(Gravity::Removed)),
        Some(other) => Err(PyValueError::new_err(format!(
            "gravity is {other:?}, but \"included\" or \"removed\" is expected"
        ))),
    }
}

/// Converts a dict, given as JSON, to TOML.
#[pyfunction]
pub(crate) fn toml_of(json: &str) -> PyResult<String> {
    let value: toml::Value = serde_json::from_str(json).map_err(named("config cannot be read"))?;
    toml::to_string(&value).map_err(named("config cannot be read"))
}
