//! Estimates as arrays: one allocation each, which Python then owns.

use estimator_core::{ContactEstimate, Decision, Quaternion};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::output::seconds;
use samples::phase::code_of;
use samples::space::components;

/// Columns of estimates while no Python code runs.
#[derive(Default)]
pub(crate) struct Columns {
    time_s: Vec<f64>,
    stable: Vec<f32>,
    tangential: Vec<f32>,
    vertical: Vec<f32>,
    axes: Vec<f32>,
    quaternion: Vec<f32>,
    linear_acceleration: Vec<f32>,
    angular_rate: Vec<f32>,
    gyro_bias: Vec<f32>,
    sigma_v: Vec<f32>,
    state: Vec<u8>,
    decision: Vec<bool>,
    flags: Vec<u8>,
}

impl Columns {
    pub(crate) fn with_capacity(samples: usize) -> Self {
        Self {
            time_s: Vec::with_capacity(samples),
            stable: Vec::with_capacity(samples),
            tangential: Vec::with_capacity(samples),
            vertical: Vec::with_capacity(samples),
            axes: Vec::with_capacity(6 * samples),
            quaternion: Vec::with_capacity(4 * samples),
            linear_acceleration: Vec::with_capacity(3 * samples),
            angular_rate: Vec::with_capacity(3 * samples),
            gyro_bias: Vec::with_capacity(3 * samples),
            sigma_v: Vec::with_capacity(samples),
            state: Vec::with_capacity(samples),
            decision: Vec::with_capacity(samples),
            flags: Vec::with_capacity(samples),
        }
    }

    /// Appends an estimate, whose time is `start_us` later on the caller's clock, µs.
    pub(crate) fn push(&mut self, estimate: &ContactEstimate, start_us: i64) {
        self.time_s.push(seconds(estimate.timestamp, start_us));
        let p = estimate.probabilities;
        self.stable.push(p.stable);
        self.tangential.push(p.tangential);
        self.vertical.push(p.vertical);
        self.axes.extend(p.axes.to_array());
        let Quaternion { w, x, y, z } = estimate.orientation;
        self.quaternion.extend([w, x, y, z]);
        let acceleration = components(estimate.linear_acceleration.0);
        self.linear_acceleration.extend(acceleration);
        self.angular_rate
            .extend(components(estimate.angular_rate.0));
        self.gyro_bias.extend(components(estimate.gyro_bias.0));
        self.sigma_v.push(estimate.velocity_sigma.0);
        self.state.push(code_of(estimate.phase));
        self.decision.push(estimate.decision == Decision::Stable);
        self.flags.push(estimate.flags.bits());
    }

    /// The arrays by the names of `footfall.Result`.
    pub(crate) fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", self.time_s.into_pyarray(py))?;
        dict.set_item("p_stable", self.stable.into_pyarray(py))?;
        dict.set_item("p_tangential", self.tangential.into_pyarray(py))?;
        dict.set_item("p_vertical", self.vertical.into_pyarray(py))?;
        dict.set_item("p_axes", table(self.axes, 6).into_pyarray(py))?;
        dict.set_item("quaternion", table(self.quaternion, 4).into_pyarray(py))?;
        let acceleration = table(self.linear_acceleration, 3).into_pyarray(py);
        dict.set_item("linear_acceleration", acceleration)?;
        dict.set_item("angular_rate", table(self.angular_rate, 3).into_pyarray(py))?;
        dict.set_item("gyro_bias", table(self.gyro_bias, 3).into_pyarray(py))?;
        dict.set_item("sigma_v", self.sigma_v.into_pyarray(py))?;
        dict.set_item("state", self.state.into_pyarray(py))?;
        dict.set_item("decision", PyArray1::from_vec(py, self.decision))?;
        dict.set_item("flags", self.flags.into_pyarray(py))?;
        Ok(dict)
    }
}

/// Rows of `width` numbers.
pub(crate) fn table<T: Default>(numbers: Vec<T>, width: usize) -> Array2<T> {
    let rows = numbers.len() / width;
    // The numbers are appended by rows, so there are none left over.
    Array2::from_shape_vec((rows, width), numbers).unwrap_or_default()
}
