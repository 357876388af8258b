//! Files as arrays or estimates, in every format that `footfall replay` reads.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;
use std::str::FromStr;

use config::{GRAVITIES, Resolved, word_of};
use estimator_core::{Load, Validity};
use numpy::IntoPyArray;
use options::{BagOptions, ContactUse, Format, InputOptions, TableOptions, Topics};
use pyo3::exceptions::{
    PyFileNotFoundError, PyImportError, PyIsADirectoryError, PyOSError, PyPermissionError,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::Opened;
use samples::space::components;
use samples::{Label, RecordedSample, VALIDITIES};
use stored::error::{InputError, Problem};
use stored::{About, Stored};
use tables::output::seconds;

use crate::arrays::table;
use crate::parameters::{Settings, SettingsArguments, gravity, named};
use crate::result::{Estimated, Failure, run, run_recorded};
use crate::words::{Origin, all_in_words, in_words, refused, value_error};

/// Columns of a recording, filled without the interpreter lock.
#[derive(Default)]
pub(crate) struct RecordingColumns {
    time_s: Vec<f64>,
    acc: Vec<f32>,
    gyr: Vec<f32>,
    load: Vec<f64>,
    label: Vec<i8>,
    validity: Vec<u8>,
    has_load: bool,
    has_label: bool,
}

/// Options of reading, as the options of the same names of `footfall replay`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ReadOptions {
    format: Option<String>,
    rate: Option<f64>,
    gravity: Option<String>,
    topic: Vec<String>,
    not_topic: Vec<String>,
    frame: Vec<String>,
    load_topic: Vec<String>,
    rename: Vec<String>,
    map: Option<String>,
    units: Option<String>,
    scale: Option<String>,
    decimal: Option<String>,
    time_unit: Option<String>,
    times: Option<String>,
    /// Whether recorded contacts are ignored.
    estimate_again: bool,
}

pub(crate) fn parsed<T: FromStr>(name: &str, text: Option<&String>) -> PyResult<Option<T>>
where
    T::Err: Display,
{
    let parsed = text.map(|text| text.parse().map_err(named(name)));
    parsed.transpose()
}

impl ReadOptions {
    /// Returns how tables and bags are read, and the format of the file if given.
    fn read(&self) -> PyResult<(TableOptions, BagOptions, Option<Format>)> {
        let table = TableOptions {
            mapping: parsed("map", self.map.as_ref())?.unwrap_or_default(),
            units: parsed("units", self.units.as_ref())?.unwrap_or_default(),
            time_unit: parsed("time_unit", self.time_unit.as_ref())?,
            times: parsed("times", self.times.as_ref())?.unwrap_or_default(),
            scale: parsed("scale", self.scale.as_ref())?.unwrap_or_default(),
            decimal: parsed("decimal", self.decimal.as_ref())?.unwrap_or_default(),
        };
        let loads = self.load_topic.iter();
        let loads = loads.map(|topic| topic.parse().map_err(named("load_topic")));
        let renames = self.rename.iter();
        let renames = renames.map(|rename| rename.parse().map_err(named("rename")));
        let bag = BagOptions {
            topics: Topics::from_names(&self.topic),
            excluded: self.not_topic.clone(),
            frames: self.frame.clone(),
            loads: loads.collect::<PyResult<_>>()?,
            renames: renames.collect::<PyResult<_>>()?,
        };
        Ok((table, bag, parsed("format", self.format.as_ref())?))
    }

    /// Returns the properties of files to estimate, and their format if given.
    pub(crate) fn input_options(
        &self,
        resolved: &Resolved,
    ) -> PyResult<(InputOptions, Option<Format>)> {
        let (table, bag, format) = self.read()?;
        let contacts = ContactUse::unless_estimated(self.estimate_again);
        Ok((resolved.input_options(table, bag, contacts), format))
    }
}

/// Returns the Python exception of an error: a subclass of `OSError` if the file cannot be read, `ImportError` if a feature
/// is missing, `ValueError` if the content is wrong.
pub(crate) fn input_error(error: InputError) -> PyErr {
    let text = in_words(&error);
    match error.problem {
        Problem::Unreadable(source) | Problem::Spool(source) => match source.kind() {
            io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
            io::ErrorKind::PermissionDenied => PyPermissionError::new_err(text),
            io::ErrorKind::IsADirectory => PyIsADirectoryError::new_err(text),
            _ => PyOSError::new_err(text),
        },
        Problem::NotBuilt { feature, .. } => PyImportError::new_err(format!(
            "{} needs the feature {feature}, and this footfall is built without it; build it with: \
             pip install ./python --config-settings build-args='--features {feature}'",
            error.file
        )),
        _ => value_error(text),
    }
}

/// Reads the recording of each foot in a file; see `footfall.read`.
#[pyfunction]
pub(crate) fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    options: ReadOptions,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let (table, bag, format) = options.read()?;
    let input_options = InputOptions {
        sample_rate: options.rate.map(|rate| rate as f32),
        gravity: gravity(options.gravity.as_deref())?,
        table,
        bag,
        ..InputOptions::default()
    };
    let read = py.detach(|| {
        let opened = Opened::new(&path, format)?;
        let format = opened.format();
        let stored = opened.store_all(&input_options)?.into_iter();
        let file = path.display().to_string();
        let columns = stored.map(columns).collect::<Result<Vec<_>, _>>();
        let columns = columns.map_err(|source| InputError::spool(&file, source))?;
        Ok((format, columns))
    });
    let (format, recordings) = read.map_err(input_error)?;
    let dict = |(about, columns): (About, RecordingColumns)| columns.into_dict(py, about, format);
    recordings.into_iter().map(dict).collect()
}

/// Estimates each foot in a file; see `footfall.estimate_file`.
#[pyfunction]
pub(crate) fn estimate_file<'py>(
    py: Python<'py>,
    path: PathBuf,
    options: ReadOptions,
    settings: SettingsArguments,
    foot: Option<String>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let settings = settings.read()?;
    let (input_options, format) = options.input_options(&settings.resolved)?;
    let checked = settings.resolved.check_before_reading(format.unwrap_or(Format::Csv));
    checked.map_err(refused)?;
    let feet = py.detach(|| {
        let opened = Opened::new(&path, format).map_err(input_error)?;
        let format = opened.format();
        let foot = foot.as_deref();
        let feet = opened.store_as(&input_options, foot).map_err(input_error)?;
        let names = feet.iter().flat_map(|stored| stored.about.names());
        // A foot named by the caller is one of several in separate files, so axes may name the others.
        if foot.is_none() {
            settings.check_feet(&names.collect::<Vec<_>>())?;
        }
        let feet = feet.into_iter();
        feet.map(|stored| {
            let name = stored.about.name.clone();
            let estimated = estimate_stored(stored, &settings, format, foot);
            estimated.map_err(|failure| settings.failed(failure, &name, Origin::File))
        })
        .collect::<PyResult<Vec<_>>>()
    })?;
    let into_dict = |estimated: Estimated| {
        let about = estimated.about.clone();
        let dict = estimated.into_dict(py)?;
        dict.set_item("recording", about.name)?;
        dict.set_item("foot", about.foot.or_else(|| foot.clone()))?;
        dict.set_item("notices", all_in_words(&about.notices))?;
        Ok(dict)
    };
    feet.into_iter().map(into_dict).collect()
}

fn estimate_stored(
    mut stored: Stored,
    settings: &Settings,
    format: Format,
    foot: Option<&str>,
) -> Result<Estimated, Failure> {
    if stored.has_estimates() {
        return Ok(run_recorded(&mut stored)?);
    }
    let mut about = stored.about.clone();
    let notice = settings.window_notice(format, &about.name, about.sample_rate);
    about.notices.extend(notice);
    let params = settings.resolved.params_of(&about.names_with(foot), format);
    run(stored.samples()?, about, &params, Origin::File)
}

fn columns(mut stored: Stored) -> io::Result<(About, RecordingColumns)> {
    let about = stored.about.clone();
    let mut columns = RecordingColumns::with_capacity(about.samples);
    for sample in stored.samples()? {
        columns.push(&sample?, about.start_us);
    }
    Ok((about, columns))
}

/// Returns the index of a validity in [`VALIDITIES`].
fn validity_place(validity: Validity) -> u8 {
    let place = VALIDITIES.iter().position(|(_, known)| *known == validity);
    place.unwrap_or(0) as u8
}

impl RecordingColumns {
    pub(crate) fn with_capacity(samples: usize) -> Self {
        Self {
            time_s: Vec::with_capacity(samples),
            acc: Vec::with_capacity(3 * samples),
            gyr: Vec::with_capacity(3 * samples),
            load: Vec::with_capacity(samples),
            label: Vec::with_capacity(samples),
            validity: Vec::with_capacity(samples),
            ..Self::default()
        }
    }

    /// Appends a sample, whose time is `start_us` later on the caller's clock, µs.
    pub(crate) fn push(&mut self, sample: &RecordedSample, start_us: i64) {
        self.time_s.push(seconds(sample.imu.timestamp, start_us));
        self.acc.extend(components(sample.imu.specific_force.0));
        self.gyr.extend(components(sample.imu.angular_rate.0));
        let load = sample.load.map_or(f64::NAN, |Load(load)| f64::from(load));
        self.load.push(load);
        self.has_load |= sample.load.is_some();
        self.label.push(match sample.label {
            None => -1,
            Some(Label::NotStable) => 0,
            Some(Label::Stable) => 1,
        });
        self.has_label |= sample.label.is_some();
        self.validity.push(validity_place(sample.imu.validity));
    }

    /// Returns the arrays by the names of `footfall.Recording`.
    pub(crate) fn into_dict(
        self,
        py: Python<'_>,
        about: About,
        format: Format,
    ) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("name", about.name)?;
        dict.set_item("foot", about.foot)?;
        dict.set_item("format", format.name())?;
        dict.set_item("rate", f64::from(about.sample_rate))?;
        dict.set_item("gravity", word_of(&GRAVITIES, about.gravity))?;
        dict.set_item("notices", all_in_words(&about.notices))?;
        dict.set_item("t", self.time_s.into_pyarray(py))?;
        dict.set_item("acc", table(self.acc, 3).into_pyarray(py))?;
        dict.set_item("gyr", table(self.gyr, 3).into_pyarray(py))?;
        let load = self.has_load.then(|| self.load.into_pyarray(py));
        dict.set_item("load", load)?;
        let label = self.has_label.then(|| self.label.into_pyarray(py));
        dict.set_item("label", label)?;
        dict.set_item("validity", self.validity.into_pyarray(py))?;
        Ok(dict)
    }
}
