//! Estimate and calibration of whole recordings in arrays.

use calibration::learnt::LearntCalibration;
use calibration::robot_file::RobotFile;
use estimator_core::{Timestamp, Validity};
use numpy::PyReadonlyArray1;
use numpy::ndarray::{Ix1, Ix2};

use options::Correction;
use options::hint::Hint;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use samples::{RecordedSample, Recording, VALIDITIES, finite_load, imu_sample, steady_time};
use stored::About;
use stored::rate::{rate_of_times, unit_of_step};

use crate::arrays::{Numbers, View};
use crate::parameters::{Settings, SettingsArguments};
use crate::result::run;
use crate::words::{Origin, in_words_of, refused, value_error};

/// Arrays of a recording, for use without the interpreter lock.
struct Recorded<'a> {
    acc: View<'a, Ix2>,
    gyr: View<'a, Ix2>,
    load: Option<View<'a, Ix1>>,
    /// Index of each sample's validity in [`VALIDITIES`]; `None` if all are valid.
    validity: Option<&'a [u8]>,
    /// Time of each sample, µs since the first; `None` if samples are one period apart.
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
        let place = self.validity.map(|places| places[index]);
        let validity = place.map_or(Some(Validity::Valid), validity_at);
        let validity = validity.unwrap_or(Validity::Invalid);
        let readings = readings(self.acc.at(index), self.gyr.at(index));
        let load = self.load.as_ref();
        let measured = imu_sample(self.timestamp(index), readings, validity);
        RecordedSample {
            imu: correction.corrected(measured),
            load: load.and_then(|load| finite_load(load.at(index))),
            label: None,
        }
    }
}

/// Joins the readings of both sensors.
pub(crate) const fn readings([ax, ay, az]: [f64; 3], [wx, wy, wz]: [f64; 3]) -> [f64; 6] {
    [ax, ay, az, wx, wy, wz]
}

/// Returns the validity with this index in [`VALIDITIES`].
pub(crate) fn validity_at(place: u8) -> Option<Validity> {
    let known = VALIDITIES.get(usize::from(place));
    known.map(|(_, validity)| *validity)
}

/// Converts a time in s to µs, rounded as the program rounds the times of a file; `name` is the argument.
pub(crate) fn micros(name: impl std::fmt::Display, time: f64) -> PyResult<i64> {
    micros_of(time)
        .ok_or_else(|| value_error(format!("{name} is {time}, but a time in s is expected")))
}

/// Time in µs; `None` if it is not finite, or too far from zero.
fn micros_of(time: f64) -> Option<i64> {
    (-9.0e12..=9.0e12).contains(&time).then(|| (time * 1.0e6).round() as i64)
}

/// Converts times in s to µs, and checks that they increase.
fn all_micros(times: &View<'_, Ix1>, samples: usize) -> PyResult<Vec<i64>> {
    let step = if samples > 1 { times.at(1) - times.at(0) } else { f64::NAN };
    let mut all = Vec::with_capacity(samples);
    for sample in 0..samples {
        let time = times.at(sample);
        let now = micros_of(time).ok_or_else(|| {
            let problem = format!("t[{sample}] is {time}, but a time in s is expected");
            let unit = unit_of_step(step).filter(|_| time.is_finite());
            value_error(match unit.map(Hint::TimesLookLike) {
                Some(hint) => format!("{problem}; {}", in_words_of(Origin::Arrays, &hint)),
                None => problem,
            })
        })?;
        if let Some(previous) = all.last()
            && now <= *previous
        {
            return Err(value_error(format!(
                "t[{sample}] is {time} s, which does not come after {} s, the time before; times must advance by 1 µs at least",
                *previous as f64 / 1.0e6
            )));
        }
        all.push(now);
    }
    Ok(all)
}

/// Checks the validities of `samples` samples, each an index into [`VALIDITIES`].
fn check_validity(places: &[u8], samples: usize) -> PyResult<()> {
    let values = places.len();
    if values != samples {
        return Err(value_error(format!(
            "validity has {values} values, but acc has {samples} samples"
        )));
    }
    let mut places = places.iter().enumerate();
    let unknown = places.find(|(_, place)| validity_at(**place).is_none());
    unknown.map_or(Ok(()), |(sample, place)| {
        let names = VALIDITIES.map(|(name, _)| name);
        Err(value_error(format!(
            "validity[{sample}] is {place}, but 0 to {} are expected: {}",
            names.len() - 1,
            names.join(", ")
        )))
    })
}

/// Recording as an argument.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct RecordingArguments<'py> {
    acc: Bound<'py, PyAny>,
    gyr: Bound<'py, PyAny>,
    t: Option<Bound<'py, PyAny>>,
    load: Option<Bound<'py, PyAny>>,
    /// Index of each sample's validity in [`VALIDITIES`].
    validity: Option<PyReadonlyArray1<'py, u8>>,
}

/// Arrays of a recording, checked to be of one length.
struct Arrays<'py> {
    acc: Numbers<'py, Ix2>,
    gyr: Numbers<'py, Ix2>,
    load: Option<Numbers<'py, Ix1>>,
    validity: Option<PyReadonlyArray1<'py, u8>>,
    times_us: Option<Vec<i64>>,
    rate: f32,
}

impl<'py> Arrays<'py> {
    fn of(arguments: RecordingArguments<'py>, settings: &Settings) -> PyResult<Self> {
        let acc = Numbers::triples("acc", &arguments.acc)?;
        let gyr = Numbers::triples("gyr", &arguments.gyr)?;
        let samples = acc.len();
        let of_gyr = gyr.len();
        if of_gyr != samples {
            return Err(value_error(format!("gyr has {of_gyr} samples, but acc has {samples}")));
        }
        if samples == 0 {
            return Err(value_error("acc is empty: there is no sample"));
        }
        let numbers = |name: &str, value: &Option<Bound<'py, PyAny>>| {
            let value = value.as_ref();
            let column = value.map(|value| Numbers::column(name, value, samples));
            column.transpose()
        };
        let load = numbers("load", &arguments.load)?;
        let t = numbers("t", &arguments.t)?;
        if let Some(places) = &arguments.validity {
            check_validity(places.as_slice()?, samples)?;
        }
        let times_us = t.map(|t| all_micros(&t.view(), samples)).transpose()?;
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
            validity: self.validity.as_ref().map(|of| of.as_slice()).transpose()?,
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
    recording: RecordingArguments<'py>,
    settings: SettingsArguments,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = settings.read()?.of_unnamed_foot()?;
    let arrays = Arrays::of(recording, &settings)?;
    let recorded = arrays.recorded()?;
    let about = About {
        start_us: arrays.start_us(),
        samples: recorded.samples,
        correction: settings.input_options.correction,
        ..About::new(String::new(), arrays.rate, settings.gravity())
    };
    let params = settings.params();
    let origin = settings.origin;
    let estimated = py.detach(|| {
        let samples = (0..recorded.samples)
            .map(|index| Ok(recorded.sample(index, &settings.input_options.correction)));
        run(samples, about, &params, origin)
    });
    estimated.map_err(|failure| settings.failed(failure, "t", origin))?.into_dict(py)
}

/// Learns a foot from recordings; see `footfall.calibrate`. Returns the keys of the given configuration with the learnt
/// ones, and a report, both as JSON.
#[pyfunction]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    recordings: Vec<RecordingArguments<'py>>,
    settings: SettingsArguments,
) -> PyResult<(String, String)> {
    let settings = settings.read()?.of_unnamed_foot()?;
    let mut calibration = LearntCalibration::new(&settings.params()).map_err(refused)?;
    for (place, arguments) in recordings.into_iter().enumerate() {
        let arrays = Arrays::of(arguments, &settings)?;
        let recorded = arrays.recorded()?;
        let recording = Recording {
            name: format!("recording {place}"),
            sample_rate: recorded.rate,
            gravity: settings.gravity(),
            load_title: String::new(),
            samples: (0..recorded.samples)
                .map(|index| recorded.sample(index, &settings.input_options.correction))
                .collect(),
        };
        let learnt = py.detach(|| calibration.add(&recording, || ()));
        learnt.map_err(|error| value_error(format!("parameter {error}")))?;
    }
    let foot = calibration.finish().map_err(refused)?;
    let mut file = RobotFile::keeping(settings.resolved.file_text()).map_err(value_error)?;
    file.set_learnt(&foot);
    let keys: toml::Value = toml::from_str(&file.text()).map_err(value_error)?;
    let keys = serde_json::to_string(&keys).map_err(value_error)?;
    let report = serde_json::to_string(&foot).map_err(value_error)?;
    Ok((keys, report))
}

/// Returns the sample rate, Hz, on which times and argument must agree.
fn rate_of(times_us: Option<&[i64]>, settings: &Settings) -> PyResult<f32> {
    let rate = settings.input_options.sample_rate;
    match times_us {
        Some(times) => rate_of_times(times, rate)
            .map_err(|error| value_error(in_words_of(settings.origin, &error))),
        None => rate
            .ok_or_else(|| value_error("give the times t in s, or the sample rate in Hz as rate")),
    }
}
