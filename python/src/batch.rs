//! One recording of a batch, as `footfall batch` estimates it: for machines that share the work.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use analysis::batch::pattern::PathPattern;
use analysis::batch::run::{Reason, RecordingOutcome, Results, Watch};
use analysis::batch::sources::FoundRecording;
use analysis::batch::{
    BatchRow, BatchSettings, FeetWanted, Identity, Plausibility, Progress, Verify,
    estimate_recording,
};
use analysis::config::{Resolved, parse_window};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::input::{Opened, Topics};

use crate::parameters::{SettingsArguments, named, value_error};
use crate::reading::{Options, parsed};

/// Identity of a recording.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct IdentityArguments {
    name: String,
    robot: String,
    foot: Option<String>,
    /// As `YYYY-MM-DD`.
    day: Option<String>,
}

/// Further settings of a batch, in the grammar of the program's options.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BatchArguments {
    window: Option<String>,
    strict: bool,
    /// The one foot that is estimated.
    only_foot: Option<String>,
}

impl IdentityArguments {
    fn read(self) -> PyResult<Identity> {
        Ok(Identity {
            day: parsed("day", self.day.as_ref())?,
            name: self.name,
            robot: self.robot,
            foot: self.foot,
        })
    }
}

fn all_settings(
    options: &Options,
    settings: &SettingsArguments,
    batch: BatchArguments,
) -> PyResult<BatchSettings> {
    let settings = settings.read()?;
    let window = batch.window.map(|window| parse_window(&window));
    let resolved = Resolved {
        window: window.transpose().map_err(named("window"))?,
        ..settings.resolved
    };
    let (hints, format) = options.hints(&resolved)?;
    Ok(BatchSettings {
        hints,
        resolved,
        format,
        plausibility: match batch.strict {
            true => Plausibility::Required,
            false => Plausibility::Reported,
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
    let identity = identity.read()?;
    let progress: Progress = Arc::new(|_| ());
    let rows = py.detach(|| estimate_recording(&path, &identity, &settings, &out, &progress));
    json(&rows.map_err(|error| PyOSError::new_err(error.to_string()))?)
}

/// Returns rows as JSON.
fn json(rows: &[BatchRow]) -> PyResult<String> {
    serde_json::to_string(rows).map_err(value_error)
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

/// Outcome of the single recording of a plan.
#[derive(Default)]
struct Planned(Mutex<Option<RecordingOutcome>>);

impl Watch for Planned {
    fn done(&self, _: &FoundRecording, outcome: RecordingOutcome) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
    }
}

/// Why `footfall batch` would estimate a recording, as a sentence, and the rows of one that it would
/// not, as JSON. In the folder `out` are its results: the rows, and in place of its other tables any
/// files of their names.
#[pyfunction]
pub(crate) fn batch_plan(
    py: Python<'_>,
    path: PathBuf,
    identity: IdentityArguments,
    options: Options,
    settings: SettingsArguments,
    batch: BatchArguments,
    out: PathBuf,
) -> PyResult<(Option<&'static str>, String)> {
    let settings = all_settings(&options, &settings, batch)?;
    let recording = FoundRecording {
        path,
        identity: identity.read()?,
        bytes: 0,
    };
    let planned = Planned::default();
    py.detach(|| {
        let (verify, jobs) = (Verify::Contents, NonZeroUsize::MIN);
        Results::look(&out).plan(&[recording], &settings, verify, jobs, &planned);
    });
    let outcome = planned.0.into_inner();
    let (reason, rows) = match outcome.unwrap_or_else(PoisonError::into_inner) {
        Some(RecordingOutcome::UpToDate(rows)) => (None, rows),
        Some(RecordingOutcome::ToDo(reason) | RecordingOutcome::Estimated(reason, _)) => {
            (Some(reason), Vec::new())
        }
        None => (Some(Reason::Missing), Vec::new()),
    };
    Ok((reason.map(Reason::sentence), json(&rows)?))
}

/// The names of the feet in a recording that has several; none of one that has one, or that cannot be
/// read.
#[pyfunction]
pub(crate) fn batch_feet(
    py: Python<'_>,
    path: PathBuf,
    options: Options,
    settings: SettingsArguments,
    batch: BatchArguments,
) -> PyResult<Vec<String>> {
    let settings = all_settings(&options, &settings, batch)?;
    if settings.hints.bag.topics == Topics::TheOnly {
        return Ok(Vec::new());
    }
    let stored = py.detach(|| Opened::new(&path, settings.format)?.store_all(&settings.hints));
    let feet = stored.unwrap_or_default().into_iter();
    Ok(feet.filter_map(|stored| stored.about.foot).collect())
}

/// Identity of a recording from its path, as `footfall batch --path-pattern` reads it.
#[pyfunction]
pub(crate) fn batch_identity<'py>(
    py: Python<'py>,
    identity: IdentityArguments,
    pattern: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let pattern: PathPattern = pattern.parse().map_err(named("pattern"))?;
    let mut identity = identity.read()?;
    // One that is not as the pattern has it keeps what is known of it.
    let _ = pattern.apply(&mut identity);
    let dict = PyDict::new(py);
    dict.set_item("name", identity.name)?;
    dict.set_item("robot", identity.robot)?;
    dict.set_item("foot", identity.foot)?;
    dict.set_item("day", identity.day.map(|day| day.to_string()))?;
    Ok(dict)
}

/// Whether a file is a recording, by its name and its first bytes.
#[pyfunction]
pub(crate) fn is_recording(path: PathBuf, format: Option<String>) -> PyResult<bool> {
    let format = parsed("format", format.as_ref())?;
    recordings::input::is_recording(&path, format)
        .map_err(|error| PyOSError::new_err(format!("{} cannot be read: {error}", path.display())))
}
