//! One foot through the estimator, and all that is made of it.

use std::io;

use estimator_core::{AngularRate, Method, Params, ParamsError};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::estimate::Estimator;
use recordings::events::{ContactEvent, Events};
use recordings::input::{About, Stored};
use recordings::output::seconds;
use recordings::plausible::{Check, Finding};
use recordings::replay::{Span, check_samples, findings_beside_contacts};
use recordings::samples::RecordedSample;
use recordings::space::components;
use thiserror::Error;

use crate::outputs::Columns;

/// Estimate of a recording.
pub(crate) struct Estimated {
    columns: Columns,
    events: Vec<ContactEvent>,
    /// Names, and sentences for people.
    findings: Vec<(&'static str, String)>,
    learnt: Vec<f32>,
    /// Upper end of stillness that was learnt, m/s²; not a number where none is.
    edge: f32,
    /// Gyroscope bias when it was first known, rad/s; empty if the foot was never at rest.
    first_gyro_bias: Vec<f32>,
    /// Properties of the recording.
    pub(crate) about: About,
}

/// Why a foot cannot be estimated.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// A parameter is out of its range.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// Samples that wait in a temporary file cannot be read.
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

/// Estimates a foot sample by sample.
pub(crate) fn run(
    samples: impl Iterator<Item = io::Result<RecordedSample>>,
    about: About,
    params: &Params,
) -> Result<Estimated, Failure> {
    let mut replay = Estimator::new(about.sample_rate, about.gravity, params)?;
    let mut check = Check::new(about.sample_rate, about.gravity);
    let mut columns = Columns::with_capacity(about.samples);
    let mut events = Events::default();
    let mut first_gyro_bias = None;
    for sample in samples {
        let sample = sample?;
        let estimate = replay.update(&sample);
        first_gyro_bias = first_gyro_bias.or_else(|| replay.gyro_bias());
        check.add(&sample);
        events.add(&estimate);
        columns.push(&estimate, about.start_us);
    }
    let findings = check.findings().into_iter();
    let findings = findings.map(|finding| finding.with_mounting(&about.correction.mounting));
    let learnt = replay.learnt();
    let edge = match params.method {
        Method::SelfCalibrating => learnt.edge(&params.constants),
        Method::HalfWidths => f32::NAN,
    };
    let first_gyro_bias = first_gyro_bias.map(|AngularRate(bias)| components(bias).to_vec());
    Ok(Estimated {
        columns,
        events: events.finish().collect(),
        findings: findings.map(sentence).collect(),
        learnt: learnt.to_array().to_vec(),
        edge,
        first_gyro_bias: first_gyro_bias.unwrap_or_default(),
        about,
    })
}

/// Takes the contacts that a foot sent as its estimates; nothing is learnt.
pub(crate) fn run_recorded(stored: &mut Stored) -> io::Result<Estimated> {
    let about = stored.about.clone();
    let check = check_samples(stored, Span::default())?;
    let mut columns = Columns::with_capacity(about.samples);
    let mut events = Events::default();
    for contact in stored.estimates()?.into_iter().flatten() {
        let contact = contact?;
        events.add(&contact.moved);
        columns.push(&contact.estimate, about.start_us);
    }
    let findings = findings_beside_contacts(&check).into_iter();
    Ok(Estimated {
        columns,
        events: events.finish().collect(),
        findings: findings.map(sentence).collect(),
        learnt: Vec::new(),
        edge: f32::NAN,
        first_gyro_bias: Vec::new(),
        about,
    })
}

/// Name of a finding, and its sentence.
fn sentence(finding: Finding) -> (&'static str, String) {
    (finding.name(), finding.to_string())
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
    /// The arrays and lists by the names of `footfall.Result`.
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
