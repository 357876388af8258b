//! Estimation of one foot: its samples through the estimator, and the results.

use std::io;

use estimator_core::{AngularRate, ContactEstimate, Learnt, Params, ParamsError};
use recordings::events::{Event, Events};
use recordings::input::Stored;
use recordings::plausible::{Check, Finding};
use recordings::recording::RecordedSample;
use recordings::replay::Replay;
use thiserror::Error;

use super::estimates::{Estimates, Layout};
use super::part::Part;
use super::span::Span;
use crate::summary::{Summary, Tally};

/// Requested results of a foot besides its summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// Part of the recording in the results.
    pub span: Span,
    /// Table of estimates, and whether it names the foot.
    pub table: Table,
    /// Layout of the table.
    pub layout: Layout,
    /// Table of events, and whether it names the foot.
    pub events: Table,
}

/// A table of estimates or events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Table {
    /// No table.
    #[default]
    None,
    /// Table of one foot.
    OneFoot,
    /// Table of the feet of a recording, named in each row.
    SeveralFeet,
    /// Table of several recordings, in each row the recording's name, with the foot's if it has one.
    SeveralRecordings,
}

/// Observes a foot while it is estimated, such as for a plot or for progress.
pub trait Observer {
    /// Called for each estimated sample, inside or outside the selected part.
    fn estimated(&mut self) {}

    /// Called for each sample in the selected part, with its estimate.
    fn add(&mut self, _sample: &RecordedSample, _estimate: &ContactEstimate) {}

    /// Called for each event in the selected part.
    fn add_event(&mut self, _event: &Event) {}
}

/// Observer that does nothing.
impl Observer for () {}

/// Results of a foot.
pub struct Replayed {
    /// Summary of the replay.
    pub summary: Summary,
    /// Implausible properties of the recording.
    pub findings: Vec<Finding>,
    /// Rows of the table of estimates.
    pub table: Option<Estimates>,
    /// Rows of the table of events.
    pub events: Option<Part>,
    /// Learnt values.
    pub learnt: Learnt,
    /// Gyroscope bias when it was first known and at the end; `None` if the foot was never at rest.
    pub gyro_bias: Option<[AngularRate; 2]>,
}

/// Error of a foot's estimation.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// A parameter is out of its range.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// Samples or rows cannot be stored.
    #[error(
        "temporary files cannot be used in {}: {source}; the variable TMPDIR names another folder",
        std::env::temp_dir().display()
    )]
    Temporary {
        /// Error of the operating system.
        #[from]
        source: io::Error,
    },
}

/// Returns the name of a foot in tables and plots: the file's name, then the foot's own if it has one.
#[must_use]
pub fn name(stored: &Stored) -> String {
    let about = &stored.about;
    match &about.foot {
        Some(foot) => format!("{} {foot}", about.name),
        None => about.name.clone(),
    }
}

/// Estimates a foot sample by sample, observed by `observer`.
///
/// # Errors
/// A parameter is out of range, or the temporary files cannot be used.
pub fn replay(
    stored: &mut Stored,
    params: &Params,
    wanted: &Wanted,
    observer: &mut impl Observer,
) -> Result<Replayed, ReplayError> {
    let name = name(stored);
    let about = stored.about.clone();
    let own = Some(about.foot_or_name().to_owned());
    let mut replay = Replay::new(about.sample_rate, about.gravity, params)?;
    let mut check = Check::new(about.sample_rate, about.gravity).with_units(about.units);
    let mut tally = Tally::new(&name, about.foot.as_deref(), about.sample_rate);
    let part = |table| match table {
        Table::None => None,
        Table::OneFoot => Some(Part::new(None, about.start_us)),
        Table::SeveralFeet => Some(Part::new(own.clone(), about.start_us)),
        Table::SeveralRecordings => Some(Part::new(Some(name.clone()), about.start_us)),
    };
    let estimates = |foot| Estimates::new(wanted.layout, foot, about.start_us);
    let mut table = match wanted.table {
        Table::None => None,
        Table::OneFoot => Some(estimates(None)?),
        Table::SeveralFeet => Some(estimates(own.clone())?),
        Table::SeveralRecordings => Some(estimates(Some(name.clone()))?),
    };
    let mut found = Found {
        span: wanted.span,
        table: part(wanted.events),
        observer,
    };
    let mut events = Events::default();
    let mut gyro_bias = None;
    for sample in stored.samples()? {
        let sample = sample?;
        if wanted.span.is_before(sample.imu.timestamp) {
            break;
        }
        let estimate = replay.update(&sample);
        if let Some(now) = replay.gyro_bias() {
            gyro_bias.get_or_insert([now, now])[1] = now;
        }
        check.add(&sample);
        check.add_estimate(&sample, &estimate);
        events.add(&estimate);
        while let Some(event) = events.pop() {
            found.add(&event)?;
        }
        if wanted.span.contains(sample.imu.timestamp) {
            tally.add(&sample, &estimate);
            if let Some(table) = &mut table {
                table.add(&estimate)?;
            }
            found.observer.add(&sample, &estimate);
        }
        found.observer.estimated();
    }
    events.finish().try_for_each(|event| found.add(&event))?;
    Ok(Replayed {
        summary: tally.finish(),
        findings: check.findings(),
        table,
        events: found.table,
        learnt: replay.finish(),
        gyro_bias,
    })
}

/// Receiver of events.
struct Found<'a, O> {
    span: Span,
    table: Option<Part>,
    observer: &'a mut O,
}

impl<O: Observer> Found<'_, O> {
    /// Adds an event if it is in the selected part.
    fn add(&mut self, event: &Event) -> io::Result<()> {
        if !self.span.contains(event.time) {
            return Ok(());
        }
        self.observer.add_event(event);
        match &mut self.table {
            Some(table) => table.add_event(event),
            None => Ok(()),
        }
    }
}
