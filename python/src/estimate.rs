//! A whole recording that is in arrays.

use analysis::calibrate::learnt::LearntCalibration;
use analysis::calibrate::robot_file::RobotFile;
use estimator_core::{Gravity, Timestamp, Validity};
use numpy::ndarray::{Ix1, Ix2};
use numpy::{PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::input::{Correction, finite_load, imu_sample, rate_of_times, steady_time};
use recordings::recording::{RecordedSample, Recording};
use recordings::validity::VALIDITIES;

use crate::arrays::{Numbers, View};
use crate::parameters::{Settings, SettingsArguments};
use crate::run::{self, run};

/// The arrays of a recording while no Python code runs.
struct Recorded<'a> {
    acc: View<'a, Ix2>,
    gyr: View<'a, Ix2>,
    load: Option<View<'a, Ix1>>,
    /// The place of each sample's validity in [`VALIDITIES`]; `None` where all are valid.
    validity: Option<&'a [u8]>,
    /// The time of each sample, µs since the first; `None` where they are a period apart.
    times_us: Option<Vec<u64>>,
    rate: f32,
    samples: usize,
}

impl Recorded<'_> {
    fn timestamp(&self, sample: usize) -> Timestamp {
        match &self.times_us {
            Some(times) => Timestamp::from_micros(times[sample]),
            None => steady_time(sample, self.rate),
        }
    }

    fn sample(&self, index: usize, correction: &Correction) -> RecordedSample {
        let validity = self.validity.map_or(Validity::Valid, |places| {
            validity_at(places[index]).unwrap_or(Validity::Invalid)
        });
        let readings = readings(self.acc.at(index), self.gyr.at(index));
        let load = self.load.as_ref();
        RecordedSample {
            imu: imu_sample(self.timestamp(index), readings, validity, correction),
            load: load.and_then(|load| finite_load(load.at(index))),
            label: None,
        }
    }
}

/// Joins the readings of both sensors.
pub(crate) const fn readings([ax, ay, az]: [f64; 3], [wx, wy, wz]: [f64; 3]) -> [f64; 6] {
    [ax, ay, az, wx, wy, wz]
}

/// The validity of this number: its place in [`VALIDITIES`].
pub(crate) fn validity_at(place: u8) -> Option<Validity> {
    let known = VALIDITIES.get(usize::from(place));
    known.map(|(_, validity)| *validity)
}

/// The times in µs, rounded as the program rounds those of a file.
fn micros(times: &View<'_, Ix1>, samples: usize) -> PyResult<Vec<i64>> {
    let mut micros = Vec::with_capacity(samples);
    for sample in 0..samples {
        let time = times.at(sample);
        if !(-9.0e12..=9.0e12).contains(&time) {
            return Err(PyValueError::new_err(format!(
                "t[{sample}] is {time}, but a time in s is expected"
            )));
        }
        let now = (time * 1.0e6).round() as i64;
        if let Some(previous) = micros.last()
            && now <= *previous
        {
            return Err(PyValueError::new_err(format!(
                "t[{sample}] is {time} s, which does not come after {} s, the time before; times must advance by 1 µs at least",
                *previous as f64 / 1.0e6
            )));
        }
        micros.push(now);
    }
    Ok(micros)
}

/// The first sample whose validity is not known.
fn unknown_validity(places: &[u8]) -> Option<(usize, u8)> {
    let mut numbered = places.iter().copied().enumerate();
    numbered.find(|(_, place)| validity_at(*place).is_none())
}

/// The arguments that hold a recording.
#[derive(FromPyObject)]
pub(crate) struct Arguments<'py> {
    #[pyo3(item)]
    acc: Bound<'py, PyAny>,
    #[pyo3(item)]
    gyr: Bound<'py, PyAny>,
    #[pyo3(item)]
    t: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    load: Option<Bound<'py, PyAny>>,
    /// The place of each sample's validity in [`VALIDITIES`].
    #[pyo3(item)]
    validity: Option<PyReadonlyArray1<'py, u8>>,
}

/// The arrays of a recording, which fit together.
struct Arrays<'py> {
    acc: Numbers<'py, Ix2>,
    gyr: Numbers<'py, Ix2>,
    load: Option<Numbers<'py, Ix1>>,
    validity: Option<PyReadonlyArray1<'py, u8>>,
    times_us: Option<Vec<i64>>,
    rate: f32,
}

impl<'py> Arrays<'py> {
    fn of(arguments: Arguments<'py>, settings: &Settings) -> PyResult<Self> {
        let acc = Numbers::triples("acc", &arguments.acc)?;
        let gyr = Numbers::triples("gyr", &arguments.gyr)?;
        let samples = acc.len();
        if gyr.len() != samples {
            return Err(PyValueError::new_err(format!(
                "gyr has {} samples, but acc has {samples}",
                gyr.len()
            )));
        }
        if samples == 0 {
            return Err(PyValueError::new_err("acc is empty: there is no sample"));
        }
        let numbers = |name: &str, value: Option<&Bound<'py, PyAny>>| {
            value
                .map(|value| Numbers::column(name, value, samples))
                .transpose()
        };
        let load = numbers("load", arguments.load.as_ref())?;
        let t = numbers("t", arguments.t.as_ref())?;
        if let Some(places) = &arguments.validity
            && places.len() != samples
        {
            return Err(PyValueError::new_err(format!(
                "validity has {} values, but acc has {samples} samples",
                places.len()
            )));
        }
        if let Some(places) = &arguments.validity
            && let Some((sample, place)) = unknown_validity(places.as_slice()?)
        {
            let names = VALIDITIES.map(|(name, _)| name).join(", ");
            return Err(PyValueError::new_err(format!(
                "validity[{sample}] is {place}, but 0 to {} are expected: {names}",
                VALIDITIES.len() - 1
            )));
        }
        let times_us = t.map(|t| micros(&t.view(), samples)).transpose()?;
        Ok(Self {
            rate: rate_of(times_us.as_deref(), settings)?,
            acc,
            gyr,
            load,
            validity: arguments.validity,
            times_us,
        })
    }

    /// Time of the first sample on the caller's clock, µs.
    fn start_us(&self) -> i64 {
        let first = self.times_us.as_ref().and_then(|times| times.first());
        first.copied().unwrap_or(0)
    }

    fn recorded(&self) -> PyResult<Recorded<'_>> {
        let start_us = self.start_us();
        let since_start = |times: &Vec<i64>| times.iter().map(|t| t.abs_diff(start_us)).collect();
        Ok(Recorded {
            acc: self.acc.view(),
            gyr: self.gyr.view(),
            load: self.load.as_ref().map(Numbers::view),
            validity: match &self.validity {
                Some(places) => Some(places.as_slice()?),
                None => None,
            },
            times_us: self.times_us.as_ref().map(since_start),
            rate: self.rate,
            samples: self.acc.len(),
        })
    }
}

/// Estimates a whole recording; see `footfall.estimate`.
#[pyfunction]
pub(crate) fn estimate<'py>(
    py: Python<'py>,
    recording: Arguments<'py>,
    settings: SettingsArguments,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = settings.read()?.of_unnamed_foot()?;
    let arrays = Arrays::of(recording, &settings)?;
    let start_us = arrays.start_us();
    let recorded = arrays.recorded()?;
    let about = run::Recorded {
        rate: arrays.rate,
        gravity: settings.hints.gravity.unwrap_or(Gravity::Included),
        start_us,
        samples: recorded.samples,
        mounting: settings.hints.correction.mounting,
    };
    let params = settings.params();
    let estimated = py.detach(|| {
        let samples = (0..recorded.samples)
            .map(|index| Ok(recorded.sample(index, &settings.hints.correction)));
        run(samples, about, &params)
    });
    estimated?.into_dict(py)
}

/// Learns a foot from recordings; see `footfall.calibrate`. Returns the keys of a configuration and
/// a report, both as JSON.
#[pyfunction]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    recordings: Vec<Arguments<'py>>,
    settings: SettingsArguments,
) -> PyResult<(String, String)> {
    let settings = settings.read()?.of_unnamed_foot()?;
    let error = |error: &dyn std::fmt::Display| PyValueError::new_err(error.to_string());
    let mut calibration = LearntCalibration::new(&settings.params()).map_err(|e| error(&e))?;
    for (place, arguments) in recordings.into_iter().enumerate() {
        let arrays = Arrays::of(arguments, &settings)?;
        let recorded = arrays.recorded()?;
        let recording = Recording {
            name: format!("recording {place}"),
            sample_rate: recorded.rate,
            gravity: settings.hints.gravity.unwrap_or(Gravity::Included),
            load_title: String::new(),
            samples: (0..recorded.samples)
                .map(|index| recorded.sample(index, &settings.hints.correction))
                .collect(),
        };
        py.detach(|| calibration.add(&recording))
            .map_err(|e| PyValueError::new_err(format!("parameter {e}")))?;
    }
    let foot = calibration.finish().map_err(|e| error(&e))?;
    let mut file = RobotFile::keeping("").map_err(|e| error(&e))?;
    file.set_learnt(&foot);
    let keys: toml::Value = toml::from_str(&file.text()).map_err(|e| error(&e))?;
    let keys = serde_json::to_string(&keys).map_err(|e| error(&e))?;
    let report = serde_json::to_string(&foot).map_err(|e| error(&e))?;
    Ok((keys, report))
}

/// The sample rate in Hz, which times and argument agree on.
fn rate_of(times_us: Option<&[i64]>, settings: &Settings) -> PyResult<f32> {
    let error = |error: recordings::input::InputError| PyValueError::new_err(error.to_string());
    match times_us {
        Some(times) => rate_of_times(times, settings.hints.sample_rate).map_err(error),
        None => settings.hints.sample_rate.ok_or_else(|| {
            PyValueError::new_err("give the times t in s, or the sample rate in Hz as rate")
        }),
    }
}
