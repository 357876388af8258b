//! Estimates as arrays: one allocation each, which Python then owns.

use estimator_core::{ContactEstimate, Decision, PerAxis, Phase, Quaternion, Vec3};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::output::seconds;
use recordings::samples::phase_code;
use recordings::space::components;

/// Columns that estimates and decoded rows have, while no Python code runs.
#[derive(Default)]
pub(crate) struct CommonColumns {
    stable: Vec<f32>,
    tangential: Vec<f32>,
    vertical: Vec<f32>,
    axes: Vec<f32>,
    quaternion: Vec<f32>,
    linear_acceleration: Vec<f32>,
    angular_rate: Vec<f32>,
    gyro_bias: Vec<f32>,
    state: Vec<u8>,
    decision: Vec<bool>,
}

impl CommonColumns {
    pub(crate) fn with_capacity(samples: usize) -> Self {
        Self {
            stable: Vec::with_capacity(samples),
            tangential: Vec::with_capacity(samples),
            vertical: Vec::with_capacity(samples),
            axes: Vec::with_capacity(6 * samples),
            quaternion: Vec::with_capacity(4 * samples),
            linear_acceleration: Vec::with_capacity(3 * samples),
            angular_rate: Vec::with_capacity(3 * samples),
            gyro_bias: Vec::with_capacity(3 * samples),
            state: Vec::with_capacity(samples),
            decision: Vec::with_capacity(samples),
        }
    }

    /// Appends the probabilities (stable, tangential, vertical), phase and decision of a row.
    pub(crate) fn push(&mut self, [p, pt, pv]: [f32; 3], phase: Phase, decision: Decision) {
        self.stable.push(p);
        self.tangential.push(pt);
        self.vertical.push(pv);
        self.state.push(phase_code(phase));
        self.decision.push(decision == Decision::Stable);
    }

    /// Appends the vectors of that row; a missing one as NaN.
    pub(crate) fn push_vectors(
        &mut self,
        axes: Option<PerAxis<f32>>,
        orientation: Option<Quaternion>,
        [acceleration, rate, bias]: [Option<Vec3>; 3],
    ) {
        let axes = axes.unwrap_or(PerAxis::splat(f32::NAN));
        self.axes.extend(axes.to_array());
        let quaternion = orientation.map(|q| [q.w, q.x, q.y, q.z]);
        self.quaternion.extend(quaternion.unwrap_or([f32::NAN; 4]));
        let vector = |of: Option<Vec3>| of.map_or([f32::NAN; 3], components);
        self.linear_acceleration.extend(vector(acceleration));
        self.angular_rate.extend(vector(rate));
        self.gyro_bias.extend(vector(bias));
    }

    /// Adds the arrays by the names of `footfall.Result` and `footfall.Decoded`.
    pub(crate) fn add_to(self, dict: &Bound<'_, PyDict>) -> PyResult<()> {
        let py = dict.py();
        dict.set_item("p_stable", self.stable.into_pyarray(py))?;
        dict.set_item("p_tangential", self.tangential.into_pyarray(py))?;
        dict.set_item("p_vertical", self.vertical.into_pyarray(py))?;
        for (name, numbers, width) in [
            ("p_axes", self.axes, 6),
            ("quaternion", self.quaternion, 4),
            ("linear_acceleration", self.linear_acceleration, 3),
            ("angular_rate", self.angular_rate, 3),
            ("gyro_bias", self.gyro_bias, 3),
        ] {
            dict.set_item(name, table(numbers, width).into_pyarray(py))?;
        }
        dict.set_item("state", self.state.into_pyarray(py))?;
        dict.set_item("decision", PyArray1::from_vec(py, self.decision))
    }
}

/// Columns of estimates while no Python code runs.
#[derive(Default)]
pub(crate) struct Columns {
    time_s: Vec<f64>,
    common: CommonColumns,
    sigma_v: Vec<f32>,
    flags: Vec<u8>,
}

impl Columns {
    pub(crate) fn with_capacity(samples: usize) -> Self {
        Self {
            time_s: Vec::with_capacity(samples),
            common: CommonColumns::with_capacity(samples),
            sigma_v: Vec::with_capacity(samples),
            flags: Vec::with_capacity(samples),
        }
    }

    /// Appends an estimate, whose time is `start_us` later on the caller's clock, µs.
    pub(crate) fn push(&mut self, estimate: &ContactEstimate, start_us: i64) {
        self.time_s.push(seconds(estimate.timestamp, start_us));
        let p = estimate.probabilities;
        let (acceleration, rate) = (estimate.linear_acceleration.0, estimate.angular_rate.0);
        let vectors = [acceleration, rate, estimate.gyro_bias.0].map(Some);
        let values = [p.stable, p.tangential, p.vertical];
        self.common.push(values, estimate.phase, estimate.decision);
        let orientation = Some(estimate.orientation);
        self.common.push_vectors(Some(p.axes), orientation, vectors);
        self.sigma_v.push(estimate.velocity_sigma.0);
        self.flags.push(estimate.flags.bits());
    }

    /// The arrays by the names of `footfall.Result`.
    pub(crate) fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", self.time_s.into_pyarray(py))?;
        self.common.add_to(&dict)?;
        dict.set_item("sigma_v", self.sigma_v.into_pyarray(py))?;
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
