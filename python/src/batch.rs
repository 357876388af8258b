//! One recording of a batch, as `footfall batch` estimates it: for machines that share the work.

use std::path::PathBuf;

use analysis::batch::{FeetWanted, Identity, Plausibility, Settings, estimate_recording};
use analysis::config::parse_window;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use recordings::input::Hints;

use crate::parameters::SettingsArguments;
use crate::reading::{Options, named, parsed};

/// What a recording is called.
#[derive(FromPyObject)]
pub(crate) struct IdentityArguments {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    robot: String,
    #[pyo3(item)]
    foot: Option<String>,
    /// As `YYYY-MM-DD`.
    #[pyo3(item)]
    day: Option<String>,
}

/// What is asked for beside, as the options of the program have it.
#[derive(FromPyObject)]
pub(crate) struct BatchArguments {
    #[pyo3(item)]
    window: Option<String>,
    #[pyo3(item)]
    strict: bool,
    /// The one foot that is estimated.
    #[pyo3(item)]
    only_foot: Option<String>,
}

fn all_settings(
    options: &Options,
    settings: &SettingsArguments,
    batch: BatchArguments,
) -> PyResult<Settings> {
    let (hints, format) = options.read()?;
    let settings = settings.read()?;
    let window = batch.window.map(|window| parse_window(&window));
    Ok(Settings {
        preset: settings.preset,
        config: settings.config,
        hints: Hints {
            sample_rate: settings.rate,
            gravity: settings.gravity,
            correction: settings.correction,
            ..hints
        },
        overrides: settings.overrides,
        window: window.transpose().map_err(named("window"))?,
        format,
        plausibility: if batch.strict {
            Plausibility::Required
        } else {
            Plausibility::Reported
        },
        feet: batch.only_foot.map_or(FeetWanted::All, FeetWanted::Named),
    })
}

/// Estimates all feet of a recording and writes their tables below the folder `out`, as
/// `footfall batch` does. Returns the rows as JSON.
#[pyfunction]
pub(crate) fn batch_recording(
    py: Python<'_>,
    path: PathBuf,
    identity: IdentityArguments,
    options: Options,
    settings: SettingsArguments,
    batch: BatchArguments,
    out: PathBuf,
) -> PyResult<String> {
    let settings = all_settings(&options, &settings, batch)?;
    let identity = Identity {
        name: identity.name,
        robot: identity.robot,
        foot: identity.foot,
        day: parsed("day", identity.day.as_ref())?,
    };
    let rows = py
        .detach(|| estimate_recording(&path, &identity, &settings, &out))
        .map_err(|error| PyOSError::new_err(error.to_string()))?;
    serde_json::to_string(&rows).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// The name of the files of a recording, without extension.
#[pyfunction]
pub(crate) fn batch_key(name: &str) -> String {
    Identity::new(name, "").key()
}

/// The hash of all that results depend on beside the recording and the version.
#[pyfunction]
pub(crate) fn batch_settings_hash(
    options: Options,
    settings: SettingsArguments,
    batch: BatchArguments,
) -> PyResult<String> {
    Ok(all_settings(&options, &settings, batch)?.blake3())
}
