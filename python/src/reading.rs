//! Files become arrays: every format that `footfall replay` reads.

use std::fmt::Display;
use std::io;
use std::path::PathBuf;
use std::str::FromStr;

use analysis::config::Resolved;
use estimator_core::{Gravity, Load, Validity, Vec3};
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::exceptions::{
    PyFileNotFoundError, PyImportError, PyIsADirectoryError, PyOSError, PyPermissionError,
    PyValueError,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::input::{
    About, BagOptions, ContactUse, ContainerError, Format, Hints, InputError, LoadTopic, Opened,
    Stored, TableOptions, Topics,
};
use recordings::output::seconds;
use recordings::recording::Label;
use recordings::validity::VALIDITIES;

use crate::parameters::{Settings, SettingsArguments, gravity, named, value_error};
use crate::run::{Estimated, Failure, Recorded, run, run_recorded};

/// Columns of a recording while no Python code runs.
struct Read {
    about: About,
    time_s: Vec<f64>,
    acc: Vec<f32>,
    gyr: Vec<f32>,
    load: Vec<f64>,
    label: Vec<i8>,
    validity: Vec<u8>,
    has_load: bool,
    has_label: bool,
}

/// Options of reading, as those of `footfall replay` of the same names.
#[derive(FromPyObject)]
pub(crate) struct Options {
    #[pyo3(item)]
    format: Option<String>,
    #[pyo3(item)]
    rate: Option<f64>,
    #[pyo3(item)]
    gravity: Option<String>,
    #[pyo3(item)]
    topic: Vec<String>,
    #[pyo3(item)]
    not_topic: Vec<String>,
    #[pyo3(item)]
    frame: Vec<String>,
    #[pyo3(item)]
    load_topic: Vec<String>,
    #[pyo3(item)]
    map: Option<String>,
    #[pyo3(item)]
    units: Option<String>,
    #[pyo3(item)]
    scale: Option<String>,
    #[pyo3(item)]
    decimal: Option<String>,
    #[pyo3(item)]
    time_unit: Option<String>,
    #[pyo3(item)]
    times: Option<String>,
    /// Whether recorded contacts are ignored.
    #[pyo3(item)]
    estimate_again: bool,
}

pub(crate) fn parsed<T: FromStr>(name: &str, text: Option<&String>) -> PyResult<Option<T>>
where
    T::Err: Display,
{
    let error = |error: T::Err| PyValueError::new_err(format!("{name}: {error}"));
    text.map(|text| text.parse().map_err(error)).transpose()
}

impl Options {
    /// Returns how tables and bags are read, and the format of the file where that is given.
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
        let bag = BagOptions {
            topics: Topics::from_names(&self.topic),
            excluded: self.not_topic.clone(),
            frames: self.frame.clone(),
            loads: loads
                .map(|topic| topic.parse().map_err(named("load_topic")))
                .collect::<PyResult<Vec<LoadTopic>>>()?,
        };
        Ok((table, bag, parsed("format", self.format.as_ref())?))
    }

    /// Returns the properties of files whose feet are estimated, and the format where that is given.
    pub(crate) fn hints(&self, resolved: &Resolved) -> PyResult<(Hints, Option<Format>)> {
        let (table, bag, format) = self.read()?;
        let hints = Hints {
            contacts: ContactUse::unless_estimated(self.estimate_again),
            ..resolved.hints(table, bag).map_err(value_error)?
        };
        Ok((hints, format))
    }
}

/// Files that cannot be read are one kind of error, what is wrong with them is another.
pub(crate) fn input_error(error: InputError) -> PyErr {
    match error {
        InputError::Unreadable { ref source, .. } | InputError::Spool { ref source, .. } => {
            let text = error.to_string();
            match source.kind() {
                io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
                io::ErrorKind::PermissionDenied => PyPermissionError::new_err(text),
                io::ErrorKind::IsADirectory => PyIsADirectoryError::new_err(text),
                _ => PyOSError::new_err(text),
            }
        }
        InputError::Container(ContainerError::NotBuilt { file, feature, .. }) => {
            PyImportError::new_err(format!(
                "{file} needs the feature {feature}, and this footfall is built without it; build it with: \
                 pip install ./python --config-settings build-args='--features {feature}'"
            ))
        }
        other => PyValueError::new_err(other.to_string()),
    }
}

/// Reads the recording of each foot in a file; see `footfall.read`.
#[pyfunction]
pub(crate) fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    options: Options,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let (table, bag, format) = options.read()?;
    let hints = Hints {
        sample_rate: options.rate.map(|rate| rate as f32),
        gravity: gravity(options.gravity.as_deref())?,
        table,
        bag,
        ..Hints::default()
    };
    let read = py.detach(|| {
        let opened = Opened::new(&path, format)?;
        let format = opened.format();
        let stored = opened.store_all(&hints)?.into_iter();
        let file = path.display().to_string();
        let columns = stored.map(columns).collect::<Result<Vec<_>, _>>();
        let columns = columns.map_err(|source| InputError::Spool { file, source })?;
        Ok((columns, format))
    });
    let (recordings, format) = read.map_err(input_error)?;
    recordings
        .into_iter()
        .map(|read| dict(py, read, format))
        .collect()
}

/// Estimates each foot in a file; see `footfall.estimate_file`.
#[pyfunction]
pub(crate) fn estimate_file<'py>(
    py: Python<'py>,
    path: PathBuf,
    options: Options,
    settings: SettingsArguments,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let settings = settings.read()?;
    let (hints, format) = options.hints(&settings.resolved)?;
    let feet = py.detach(|| {
        let opened = Opened::new(&path, format).map_err(input_error)?;
        let format = opened.format();
        let feet = opened.store_all(&hints).map_err(input_error)?;
        let names = feet.iter().flat_map(|stored| stored.about.names());
        settings.check_feet(&names.collect::<Vec<_>>())?;
        let feet = feet.into_iter();
        feet.map(|stored| estimate_stored(stored, &settings, format))
            .collect::<PyResult<Vec<_>>>()
    })?;
    let into_dict = |(about, estimated): (About, Estimated)| {
        let dict = estimated.into_dict(py)?;
        dict.set_item("recording", about.name)?;
        dict.set_item("foot", about.foot)?;
        dict.set_item("notices", about.notices)?;
        Ok(dict)
    };
    feet.into_iter().map(into_dict).collect()
}

fn estimate_stored(
    mut stored: Stored,
    settings: &Settings,
    format: Format,
) -> PyResult<(About, Estimated)> {
    let mut about = stored.about.clone();
    let recorded = Recorded {
        rate: about.sample_rate,
        gravity: about.gravity,
        start_us: about.start_us,
        samples: about.samples,
        mounting: about.correction.mounting,
    };
    if stored.has_estimates() {
        let estimated = run_recorded(&mut stored, recorded).map_err(Failure::Samples)?;
        return Ok((about, estimated));
    }
    let notice = settings.window_notice(format, &about.name, about.sample_rate);
    about.notices.extend(notice);
    let samples = stored.samples().map_err(Failure::Samples)?;
    let params = settings.resolved.params_of(&about.names(), format);
    let estimated = run(samples, recorded, &params)?;
    Ok((about, estimated))
}

fn columns(mut stored: Stored) -> io::Result<Read> {
    let about = stored.about.clone();
    let samples = about.samples;
    let mut read = Read {
        time_s: Vec::with_capacity(samples),
        acc: Vec::with_capacity(3 * samples),
        gyr: Vec::with_capacity(3 * samples),
        load: Vec::with_capacity(samples),
        label: Vec::with_capacity(samples),
        validity: Vec::with_capacity(samples),
        has_load: false,
        has_label: false,
        about,
    };
    for sample in stored.samples()? {
        let sample = sample?;
        let start_us = read.about.start_us;
        read.time_s.push(seconds(sample.imu.timestamp, start_us));
        let Vec3 { x, y, z } = sample.imu.specific_force.0;
        read.acc.extend([x, y, z]);
        let Vec3 { x, y, z } = sample.imu.angular_rate.0;
        read.gyr.extend([x, y, z]);
        read.load
            .push(sample.load.map_or(f64::NAN, |Load(load)| f64::from(load)));
        read.has_load |= sample.load.is_some();
        read.label.push(match sample.label {
            None => -1,
            Some(Label::NotStable) => 0,
            Some(Label::Stable) => 1,
        });
        read.has_label |= sample.label.is_some();
        read.validity.push(validity_place(sample.imu.validity));
    }
    Ok(read)
}

/// The number of a validity: its place in [`VALIDITIES`].
pub(crate) fn validity_place(validity: Validity) -> u8 {
    let place = VALIDITIES.iter().position(|(_, known)| *known == validity);
    place.unwrap_or(0) as u8
}

fn dict(py: Python<'_>, read: Read, format: Format) -> PyResult<Bound<'_, PyDict>> {
    let about = read.about;
    let dict = PyDict::new(py);
    let vectors = |numbers: Vec<f32>| {
        let rows = numbers.len() / 3;
        Array2::from_shape_vec((rows, 3), numbers).unwrap_or_default()
    };
    dict.set_item("name", about.name)?;
    dict.set_item("foot", about.foot)?;
    dict.set_item("format", format.name())?;
    dict.set_item("rate", f64::from(about.sample_rate))?;
    dict.set_item(
        "gravity",
        match about.gravity {
            Gravity::Included => "included",
            Gravity::Removed => "removed",
        },
    )?;
    dict.set_item("notices", about.notices)?;
    dict.set_item("t", read.time_s.into_pyarray(py))?;
    dict.set_item("acc", vectors(read.acc).into_pyarray(py))?;
    dict.set_item("gyr", vectors(read.gyr).into_pyarray(py))?;
    let load = read.has_load.then(|| read.load.into_pyarray(py));
    dict.set_item("load", load)?;
    let label = read.has_label.then(|| read.label.into_pyarray(py));
    dict.set_item("label", label)?;
    dict.set_item("validity", read.validity.into_pyarray(py))?;
    Ok(dict)
}
