//! Estimates of one foot, and their result as arrays: one allocation each, which Python then owns.

use std::io;

use estimator_core::any::{AnyParams, Method};
use estimator_core::{
    AngularRate, ContactEstimate, Decision, ParamsError, PerAxis, Phase, Quaternion, Vec3,
};
use numpy::{IntoPyArray, PyArray1};
use plausible::{Check, Finding};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use replay::events::{ContactEvent, Events};
use replay::{Span, check_samples, findings_beside_contacts};
use samples::estimate::Estimator;
use samples::space::components;
use samples::{RecordedSample, phase_code};
use stored::{About, Stored};
use tables::output::seconds;
use thiserror::Error;

use crate::arrays::table;
use crate::words::{Origin, in_words_of};

/// Estimate of a recording.
pub(crate) struct Estimated {
    columns: EstimateColumns,
    events: Vec<ContactEvent>,
    /// Names of findings, and their sentences.
    findings: Vec<(&'static str, String)>,
    learnt: Vec<f32>,
    /// Learnt acceleration below which the foot is still, m/s²; NaN if none was learnt.
    edge: f32,
    /// Gyroscope bias when it was first known, rad/s; empty if the foot was never at rest.
    first_gyro_bias: Vec<f32>,
    /// Properties of the recording.
    pub(crate) about: About,
}

/// Reason a foot cannot be estimated.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// A parameter is out of its range.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// The temporary file with the samples cannot be read.
    #[error("the samples in the temporary folder cannot be read: {0}")]
    Samples(#[from] io::Error),
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Params(_) => PyValueError::new_err(failure.to_string()),
            Failure::Samples(_) => PyOSError::new_err(failure.to_string()),
        }
    }
}

/// Estimates a foot sample by sample. Its findings name what can be done about samples of this origin.
pub(crate) fn run(
    samples: impl Iterator<Item = io::Result<RecordedSample>>,
    about: About,
    params: &AnyParams,
    origin: Origin,
) -> Result<Estimated, Failure> {
    let mut estimator = Estimator::new(about.sample_rate, about.gravity, params)?;
    let mut check = Check::new(about.sample_rate, about.gravity);
    let mut columns = EstimateColumns::with_capacity(about.samples);
    let mut events = Events::default();
    let mut first_gyro_bias = None;
    for sample in samples {
        let sample = sample?;
        let estimate = estimator.update(&sample);
        first_gyro_bias = first_gyro_bias.or_else(|| estimator.gyro_bias());
        check.add(&sample);
        events.add(&estimate);
        columns.push(&estimate, about.start_us);
    }
    let findings = check.findings().into_iter();
    let findings = findings.map(|finding| finding.with_mounting(&about.correction.mounting));
    let learnt = estimator.learnt();
    let edge = match params.method {
        Method::SelfCalibrating => learnt.edge(&params.params.constants),
        Method::HalfWidths => f32::NAN,
    };
    let first_gyro_bias = first_gyro_bias.map(|AngularRate(bias)| components(bias).to_vec());
    Ok(Estimated {
        columns,
        events: events.finish().collect(),
        findings: findings.map(|finding| sentence(origin, &finding)).collect(),
        learnt: learnt.to_array().to_vec(),
        edge,
        first_gyro_bias: first_gyro_bias.unwrap_or_default(),
        about,
    })
}

/// Returns the contacts that a foot sent as its estimates; nothing is learnt.
pub(crate) fn run_recorded(stored: &mut Stored) -> io::Result<Estimated> {
    let about = stored.about.clone();
    let check = check_samples(stored, Span::default())?;
    let mut columns = EstimateColumns::with_capacity(about.samples);
    let mut events = Events::default();
    for contact in stored.estimates()?.into_iter().flatten() {
        let contact = contact?;
        events.add(&contact.with_motion);
        columns.push(&contact.estimate, about.start_us);
    }
    let findings = findings_beside_contacts(&check).into_iter();
    Ok(Estimated {
        columns,
        events: events.finish().collect(),
        findings: findings.map(|finding| sentence(Origin::File, &finding)).collect(),
        learnt: Vec::new(),
        edge: f32::NAN,
        first_gyro_bias: Vec::new(),
        about,
    })
}

/// Name of a finding, and its sentence.
fn sentence(origin: Origin, finding: &Finding) -> (&'static str, String) {
    (finding.name(), in_words_of(origin, finding))
}

/// Fields of `footfall.Event`, in order.
pub(crate) type EventRow = (&'static str, f64, Option<f64>, f32, Option<f64>);

/// An event of a recording whose clock begins at `start_us`.
pub(crate) fn event_row(event: &ContactEvent, start_us: i64) -> EventRow {
    let duration_s = event.duration_us.map(|micros| micros as f64 / 1.0e6);
    let time_s = seconds(event.time, start_us);
    let kind = event.kind.name();
    (kind, time_s, duration_s, event.peak, event.distance_m)
}

impl Estimated {
    /// Returns the arrays and lists by the names of `footfall.Result`.
    pub(crate) fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict: Bound<'_, PyDict> = self.columns.into_dict(py)?;
        let about = self.about;
        let events = self.events.iter();
        let events = events.map(|event| event_row(event, about.start_us));
        dict.set_item("events", events.collect::<Vec<_>>())?;
        dict.set_item("rate", f64::from(about.sample_rate))?;
        dict.set_item("findings", self.findings)?;
        dict.set_item("learnt", self.learnt)?;
        dict.set_item("edge", self.edge)?;
        dict.set_item("first_gyro_bias", self.first_gyro_bias)?;
        Ok(dict)
    }
}

/// Columns of estimates while no Python code runs.
#[derive(Default)]
struct EstimateColumns {
    time_s: Vec<f64>,
    common: CommonColumns,
    sigma_v: Vec<f32>,
    flags: Vec<u8>,
}

impl EstimateColumns {
    fn with_capacity(samples: usize) -> Self {
        Self {
            time_s: Vec::with_capacity(samples),
            common: CommonColumns::with_capacity(samples),
            sigma_v: Vec::with_capacity(samples),
            flags: Vec::with_capacity(samples),
        }
    }

    /// Appends an estimate, whose time is `start_us` later on the caller's clock, µs.
    fn push(&mut self, estimate: &ContactEstimate, start_us: i64) {
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
    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", self.time_s.into_pyarray(py))?;
        self.common.add_to(&dict)?;
        dict.set_item("sigma_v", self.sigma_v.into_pyarray(py))?;
        dict.set_item("flags", self.flags.into_pyarray(py))?;
        Ok(dict)
    }
}

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
