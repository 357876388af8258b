//! Preset and configuration become parameters, as those of the program do; the load trigger of a preset
//! depends on the format of the recording, as its load does.

use std::collections::BTreeMap;

use analysis::config::{FootAxes, Overrides, Preset};
use estimator_core::{Gravity, Params};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use recordings::input::{Correction, Format};

/// Settings of the estimator, and facts about the sensor.
#[derive(Clone)]
pub(crate) struct Settings {
    pub(crate) preset: Preset,
    /// The configuration file's name and text.
    #[cfg_attr(
        not(feature = "parquet"),
        expect(dead_code, reason = "batches alone ask")
    )]
    pub(crate) config: Option<(String, String)>,
    pub(crate) overrides: Overrides,
    /// The format of the recording that is in arrays.
    pub(crate) format: Format,
    /// Mountings that win over those of the configuration.
    axes: Option<FootAxes>,
    pub(crate) correction: Correction,
    /// Corrections of single feet, by name.
    pub(crate) foot_corrections: BTreeMap<String, Correction>,
    /// Whether the accelerations contain gravity, where it is given.
    pub(crate) gravity: Option<Gravity>,
    /// The sample rate in Hz, where it is given.
    pub(crate) rate: Option<f32>,
}

/// The arguments that set the estimator.
#[derive(FromPyObject)]
pub(crate) struct SettingsArguments {
    #[pyo3(item)]
    preset: String,
    /// The name of a configuration file, and its text.
    #[pyo3(item)]
    config: Option<(String, String)>,
    #[pyo3(item)]
    gravity: Option<String>,
    #[pyo3(item)]
    rate: Option<f64>,
    /// How the sensor lies, as `--axes` has it; wins over the configuration.
    #[pyo3(item)]
    axes: Option<String>,
    /// The format of the recording, as `--format` has it.
    #[pyo3(item)]
    format: Option<String>,
}

impl SettingsArguments {
    /// Reads and checks them.
    pub(crate) fn read(&self) -> PyResult<Settings> {
        let preset: Preset = self.preset.parse().map_err(PyValueError::new_err)?;
        let overrides = match &self.config {
            None => Overrides::default(),
            Some((file, text)) => Overrides::parse(text, file)
                .map_err(|error| PyValueError::new_err(error.to_string()))?,
        };
        let mut correction = overrides
            .correction("config")
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        let mut foot_corrections = overrides
            .foot_corrections("config")
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        let axes = self.axes.as_deref().map(str::parse::<FootAxes>).transpose();
        let axes = axes.map_err(|error| PyValueError::new_err(format!("axes: {error}")))?;
        if let Some(axes) = &axes {
            axes.set(&mut correction, &mut foot_corrections);
        }
        let format = match &self.format {
            None => Format::Csv,
            Some(name) => name.parse().map_err(PyValueError::new_err)?,
        };
        if let Some(rate) = self.rate
            && !(rate > 0.0 && rate.is_finite())
        {
            return Err(PyValueError::new_err(format!(
                "rate is {rate}, but a sample rate in Hz above 0 is expected"
            )));
        }
        Ok(Settings {
            preset,
            config: self.config.clone(),
            format,
            axes,
            correction,
            foot_corrections,
            gravity: gravity(self.gravity.as_deref())?.or(overrides.gravity),
            rate: self
                .rate
                .map(|rate| rate as f32)
                .or(overrides.sample_rate_hz),
            overrides,
        })
    }
}

impl Settings {
    /// Checks that nothing is set for single feet: samples in arrays do not name theirs.
    pub(crate) fn of_unnamed_foot(self) -> PyResult<Self> {
        let mut feet = self.foot_corrections.keys();
        match feet.next() {
            None => Ok(self),
            Some(foot) => Err(PyValueError::new_err(format!(
                "there are settings of the foot {foot}, but samples in arrays are of a foot without a name: \
                 give axes of this foot alone, or use estimate_file, batch or fleet"
            ))),
        }
    }

    /// Parameters of a foot with these names in recordings of a format.
    pub(crate) fn params_of(&self, names: &[&str], format: Format) -> Params {
        let mut params = self.params(format);
        self.overrides.apply_foot(names, &mut params);
        params
    }

    /// Checks that each foot with axes of its own has one of these names.
    pub(crate) fn check_feet(&self, names: &[&str]) -> PyResult<()> {
        let axes = self.axes.as_ref();
        match axes.and_then(|axes| axes.absent(names)) {
            None => Ok(()),
            Some(foot) => Err(PyValueError::new_err(format!(
                "axes name the foot {foot}, but there is {}",
                names.join(", ")
            ))),
        }
    }

    /// The preset for recordings of a format, with what the configuration sets.
    pub(crate) fn params(&self, format: Format) -> Params {
        let mut params = self.preset.params(format);
        self.overrides.apply(&mut params);
        params
    }

    /// That the window of the preset lasts longer or shorter than the paper's.
    pub(crate) fn window_notice(&self, format: Format, name: &str, rate: f32) -> Option<String> {
        let params = self.params(format);
        self.preset.window_notice(format, &params, name, rate)
    }
}

/// Reads whether accelerations contain gravity.
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

/// The TOML of a dict that Python gave as JSON.
#[pyfunction]
pub(crate) fn toml_of(json: &str) -> PyResult<String> {
    let error = |error: &dyn std::fmt::Display| {
        PyValueError::new_err(format!("config cannot be read: {error}"))
    };
    let value: toml::Value = serde_json::from_str(json).map_err(|e| error(&e))?;
    toml::to_string(&value).map_err(|e| error(&e))
}
