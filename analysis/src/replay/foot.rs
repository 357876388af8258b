//! One foot: its samples through the estimator, and all that is made of them.

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

/// What is made of a foot beside its summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// The part of the recording that it is made of.
    pub span: Span,
    /// Whether there is a table, and whether it names the foot.
    pub table: Table,
    /// How the table is laid out.
    pub layout: Layout,
    /// The same of the table of events.
    pub events: Table,
}

/// A table of estimates or events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Table {
    /// There is none.
    #[default]
    None,
    /// It is of one foot.
    OneFoot,
    /// It is of several and names them.
    SeveralFeet,
}

/// Watches a foot while it is estimated, such as to draw it or to show how far it is.
pub trait Observer {
    /// A sample was estimated, whether or not it is in the part that is asked for.
    fn estimated(&mut self) {}

    /// A sample in the part that is asked for, and its estimate.
    fn add(&mut self, _sample: &RecordedSample, _estimate: &ContactEstimate) {}

    /// An event in the part that is asked for.
    fn add_event(&mut self, _event: &Event) {}
}

/// Nothing watches.
impl Observer for () {}

/// What was made of a foot.
pub struct Replayed {
    /// What it comes to.
    pub summary: Summary,
    /// What is not plausible about it.
    pub findings: Vec<Finding>,
    /// Its rows of the table.
    pub table: Option<Estimates>,
    /// Its events.
    pub events: Option<Part>,
    /// What has been learnt about it.
    pub learnt: Learnt,
    /// The gyroscope's bias where it was first known, and at the end; `None` where the foot never was at
    /// rest.
    pub gyro_bias: Option<[AngularRate; 2]>,
}

/// Why a foot cannot be estimated.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// A parameter is out of its range.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// Its samples or rows cannot be kept.
    #[error(
        "temporary files cannot be used in {}: {source}; the variable TMPDIR names another folder",
        std::env::temp_dir().display()
    )]
    Temporary {
        /// What the operating system says.
        #[from]
        source: io::Error,
    },
}

/// The name of a foot in tables and pictures: that of its file, and its own where it has one.
#[must_use]
pub fn name(stored: &Stored) -> String {
    let about = &stored.about;
    match &about.foot {
        Some(foot) => format!("{} {foot}", about.name),
        None => about.name.clone(),
    }
}

/// Estimates a foot sample by sample, while `observer` watches.
///
/// # Errors
/// A parameter out of its range, or the temporary files cannot be used.
pub fn replay(
    stored: &mut Stored,
    params: &Params,
    wanted: &Wanted,
    observer: &mut impl Observer,
) -> Result<Replayed, ReplayError> {
    let name = name(stored);
    let about = stored.about.clone();
    let mut replay = Replay::new(about.sample_rate, about.gravity, params)?;
    let mut check = Check::new(about.sample_rate, about.gravity).with_units(about.units);
    let mut tally = Tally::new(&name, about.foot.as_deref(), about.sample_rate);
    let part = |table| match table {
        Table::None => None,
        Table::OneFoot => Some(Part::new(None, about.start_us)),
        Table::SeveralFeet => Some(Part::new(Some(name.clone()), about.start_us)),
    };
    let mut table = match wanted.table {
        Table::None => None,
        Table::OneFoot => Some(Estimates::new(wanted.layout, None, about.start_us)?),
        Table::SeveralFeet => {
            let foot = Some(name.clone());
            Some(Estimates::new(wanted.layout, foot, about.start_us)?)
        }
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

/// Where events go.
struct Found<'a, O> {
    span: Span,
    table: Option<Part>,
    observer: &'a mut O,
}

impl<O: Observer> Found<'_, O> {
    /// Takes in an event, if it is in the part that is asked for.
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
