//! Files become arrays: every format that `footfall replay` reads.

use std::path::PathBuf;

use estimator_core::{Gravity, Load, Vec3};
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::input::{Format, Hints, InputError, Opened, Stored, TableOptions};
use recordings::recording::Label;
use recordings::validity::VALIDITIES;

use crate::parameters::gravity;

/// Columns of a recording while no Python code runs.
struct Read {
    about: recordings::input::About,
    time_s: Vec<f64>,
    acc: Vec<f32>,
    gyr: Vec<f32>,
    load: Vec<f64>,
    label: Vec<i8>,
    validity: Vec<u8>,
    has_load: bool,
    has_label: bool,
}

/// Options of tables, as `--map`, `--units`, `--time-unit` and `--times` have them.
#[derive(FromPyObject)]
pub(crate) struct Options {
    #[pyo3(item)]
    format: Option<String>,
    #[pyo3(item)]
    rate: Option<f64>,
    #[pyo3(item)]
    gravity: Option<String>,
    #[pyo3(item)]
    map: Option<String>,
    #[pyo3(item)]
    units: Option<String>,
    #[pyo3(item)]
    time_unit: Option<String>,
    #[pyo3(item)]
    times: Option<String>,
}

fn parsed<T: std::str::FromStr>(name: &str, text: Option<&String>) -> PyResult<Option<T>>
where
    T::Err: std::fmt::Display,
{
    let error = |error: T::Err| PyValueError::new_err(format!("{name}: {error}"));
    text.map(|text| text.parse().map_err(error)).transpose()
}

/// Reads the recording of each foot in a file; see `footfall.read`.
#[pyfunction]
pub(crate) fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    options: Options,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let hints = Hints {
        sample_rate: options.rate.map(|rate| rate as f32),
        gravity: gravity(options.gravity.as_deref())?,
        table: TableOptions {
            mapping: parsed("map", options.map.as_ref())?.unwrap_or_default(),
            units: parsed("units", options.units.as_ref())?.unwrap_or_default(),
            time_unit: parsed("time_unit", options.time_unit.as_ref())?,
            times: parsed("times", options.times.as_ref())?.unwrap_or_default(),
        },
        ..Hints::default()
    };
    let format = parsed("format", options.format.as_ref())?;
    let (recordings, format) = py
        .detach(|| {
            let opened = Opened::new(&path, format)?;
            let format = opened.format();
            let stored = opened.store_all(&hints)?;
            let file = path.display().to_string();
            let columns = stored
                .into_iter()
                .map(columns)
                .collect::<Result<Vec<_>, _>>();
            let columns = columns.map_err(|source| InputError::Spool { file, source })?;
            Ok((columns, format))
        })
        .map_err(|error| match error {
            InputError::Unreadable { .. } => PyOSError::new_err(error.to_string()),
            other => PyValueError::new_err(other.to_string()),
        })?;
    recordings
        .into_iter()
        .map(|read| dict(py, read, format))
        .collect()
}

fn columns(mut stored: Stored) -> std::io::Result<Read> {
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
        let since_start = i128::from(sample.imu.timestamp.as_micros());
        let micros = since_start + i128::from(read.about.start_us);
        read.time_s.push(micros as f64 / 1.0e6);
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
        let place = VALIDITIES
            .iter()
            .position(|(_, validity)| *validity == sample.imu.validity);
        read.validity.push(place.unwrap_or(0) as u8);
    }
    Ok(read)
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
