//! A simulated foot: its recording and the truth about it.

use estimator_core::Vec3;
use gait::{GaitName, Ground, Plan, SensorParams};
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::recording::{Label, RecordedSample};

/// The longest walk, s.
const LONGEST_S: f64 = 86_400.0;

/// Simulates a foot with a sensor of its own; see `footfall.simulate`.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    gait: &str,
    ground: &str,
    seconds: f64,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let gait: GaitName = gait
        .parse()
        .map_err(|error: gait::plan::UnknownGait| PyValueError::new_err(error.to_string()))?;
    let ground = Ground::ALL
        .into_iter()
        .find(|known| known.name() == ground)
        .ok_or_else(|| {
            let known = Ground::ALL.map(Ground::name).join(", ");
            PyValueError::new_err(format!(
                "ground is {ground:?}, but one of {known} is expected"
            ))
        })?;
    if !(0.001..=LONGEST_S).contains(&seconds) {
        return Err(PyValueError::new_err(format!(
            "seconds is {seconds}, but 0.001 to {LONGEST_S} is expected"
        )));
    }
    let recording = py.detach(|| {
        let plan = Plan::steady(gait, ground, seconds, seed);
        gait::record(&plan, &SensorParams::LSM6DSOX, seed)
    });
    let samples = &recording.samples;
    let vectors = |pick: fn(&RecordedSample) -> Vec3| {
        let numbers = samples
            .iter()
            .map(pick)
            .flat_map(|Vec3 { x, y, z }| [x, y, z]);
        Array2::from_shape_vec((samples.len(), 3), numbers.collect()).unwrap_or_default()
    };
    let time: Vec<f64> = samples.iter().map(RecordedSample::time_s).collect();
    let load: Vec<f64> = samples
        .iter()
        .map(|sample| sample.load.map_or(f64::NAN, |load| f64::from(load.0)))
        .collect();
    let label: Vec<i8> = samples
        .iter()
        .map(|sample| i8::from(sample.label == Some(Label::Stable)))
        .collect();
    let dict = PyDict::new(py);
    dict.set_item("name", &recording.name)?;
    dict.set_item("foot", None::<String>)?;
    dict.set_item("format", "csv")?;
    dict.set_item("rate", f64::from(recording.sample_rate))?;
    dict.set_item("gravity", "included")?;
    dict.set_item("notices", Vec::<String>::new())?;
    dict.set_item("t", time.into_pyarray(py))?;
    dict.set_item("acc", vectors(|s| s.imu.specific_force.0).into_pyarray(py))?;
    dict.set_item("gyr", vectors(|s| s.imu.angular_rate.0).into_pyarray(py))?;
    dict.set_item("load", load.into_pyarray(py))?;
    dict.set_item("label", label.into_pyarray(py))?;
    dict.set_item("validity", vec![0_u8; samples.len()].into_pyarray(py))?;
    Ok(dict)
}
