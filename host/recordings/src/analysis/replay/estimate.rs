//! Estimation of one foot: its samples through the estimator, and the results.

use std::io;

use crate::events::{ContactEvent, Events};
use crate::input::Stored;
use crate::plausible::{Check, Finding};
use crate::replay::Replay;
use crate::samples::recording::RecordedSample;
use estimator_core::{ContactEstimate, Learnt, Params, ParamsError, Timestamp};
use thiserror::Error;

use super::estimates::{Estimates, Layout};
use super::part::Part;
use super::span::Span;
use crate::analysis::summary::{Summary, Tally};

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
    fn add_event(&mut self, _event: &ContactEvent) {}
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
    /// Learnt values; none where the estimates were recorded.
    pub learnt: Learnt,
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

/// Estimates a foot sample by sample, observed by `observer`; or takes the recorded estimates, if these
/// [are used](crate::input::Hints::contacts).
///
/// # Errors
/// A parameter is out of range, or the temporary files cannot be used.
pub fn replay(
    stored: &mut Stored,
    params: &Params,
    wanted: &Wanted,
    observer: &mut impl Observer,
) -> Result<Replayed, ReplayError> {
    let results = Results::new(stored, wanted, observer)?;
    if stored.has_estimates() {
        Ok(recorded(stored, results)?)
    } else {
        estimated(stored, params, results)
    }
}

/// Estimates a foot sample by sample.
fn estimated<O: Observer>(
    stored: &mut Stored,
    params: &Params,
    mut results: Results<'_, O>,
) -> Result<Replayed, ReplayError> {
    let about = &stored.about;
    let mut replay = Replay::new(about.sample_rate, about.gravity, params)?;
    let mut check = Check::new(about.sample_rate, about.gravity);
    for sample in stored.samples()? {
        let sample = sample?;
        if results.span.is_before(sample.imu.timestamp) {
            break;
        }
        let estimate = replay.update(&sample);
        check.add(&sample);
        results.add(&sample, &estimate, &estimate)?;
    }
    Ok(Replayed { findings: check.findings(), learnt: replay.learnt(), ..results.finish()? })
}

/// Takes the recorded estimates of a foot. Nothing is computed from the samples, which may be few, but they are checked.
fn recorded<O: Observer>(stored: &mut Stored, mut results: Results<'_, O>) -> io::Result<Replayed> {
    let check = check_samples(stored, results.span)?;
    for recorded in stored.estimates()?.into_iter().flatten() {
        let recorded = recorded?;
        if results.span.is_before(recorded.estimate.timestamp) {
            break;
        }
        results.add(&recorded.sample, &recorded.estimate, &recorded.moved)?;
    }
    Ok(Replayed { findings: findings_beside_contacts(&check), ..results.finish()? })
}

/// Returns the findings that count where a foot has sent its own estimates: its mounting is a setting of its own, a
/// sample that could not be sent is blank, and nothing here depends on the rate.
#[must_use]
pub fn findings_beside_contacts(check: &Check) -> Vec<Finding> {
    let mut findings = check.findings();
    findings.retain(|finding| {
        !matches!(
            finding,
            Finding::GravityNotAlongZ { .. } | Finding::LowRate { .. } | Finding::NotNumbers { .. }
        )
    });
    findings
}

/// Checks the samples beside recorded estimates, up to the end of the span.
///
/// # Errors
/// The temporary file with the samples cannot be read.
pub fn check_samples(stored: &mut Stored, span: Span) -> io::Result<Check> {
    let (start_us, sample_rate) = stored.clock_of_samples();
    let about = &stored.about;
    let after_us = start_us.saturating_sub(about.start_us);
    let mut check = Check::new(sample_rate, about.gravity);
    for sample in stored.samples()? {
        let sample = sample?;
        let since_us = sample.imu.timestamp.as_micros();
        let since_contacts_us = since_us.saturating_add_signed(after_us);
        if span.is_before(Timestamp::from_micros(since_contacts_us)) {
            break;
        }
        check.add(&sample);
    }
    Ok(check)
}

/// Results of a foot while its estimates are added.
struct Results<'a, O> {
    tally: Tally,
    table: Option<Estimates>,
    event_table: Option<Part>,
    events: Events,
    span: Span,
    observer: &'a mut O,
}

impl<'a, O: Observer> Results<'a, O> {
    fn new(stored: &Stored, wanted: &Wanted, observer: &'a mut O) -> io::Result<Self> {
        let name = name(stored);
        let about = &stored.about;
        // Outer: the table is wanted. Inner: the name in each of its rows.
        let named = |table| match table {
            Table::None => None,
            Table::OneFoot => Some(None),
            Table::SeveralFeet => Some(Some(about.foot_or_name().to_owned())),
            Table::SeveralRecordings => Some(Some(name.clone())),
        };
        let estimates = |foot| Estimates::new(wanted.layout, foot, about.start_us);
        Ok(Self {
            tally: Tally::new(&name, about.foot.as_deref(), about.sample_rate),
            table: named(wanted.table).map(estimates).transpose()?,
            event_table: named(wanted.events).map(|foot| Part::new(foot, about.start_us)),
            events: Events::default(),
            span: wanted.span,
            observer,
        })
    }

    /// Adds the estimate of the next sample; `moved` is the same with all that is known of the foot's motion.
    fn add(
        &mut self,
        sample: &RecordedSample,
        estimate: &ContactEstimate,
        moved: &ContactEstimate,
    ) -> io::Result<()> {
        self.events.add(moved);
        while let Some(event) = self.events.pop() {
            self.add_event(&event)?;
        }
        if self.span.contains(estimate.timestamp) {
            self.tally.add(sample, estimate);
            if let Some(table) = &mut self.table {
                table.add(estimate)?;
            }
            self.observer.add(sample, estimate);
        }
        self.observer.estimated();
        Ok(())
    }

    /// Adds an event if it is in the selected part.
    fn add_event(&mut self, event: &ContactEvent) -> io::Result<()> {
        if !self.span.contains(event.time) {
            return Ok(());
        }
        self.observer.add_event(event);
        match &mut self.event_table {
            Some(table) => table.add_event(event),
            None => Ok(()),
        }
    }

    /// Ends the recording. Findings and learnt values are empty.
    fn finish(mut self) -> io::Result<Replayed> {
        for event in std::mem::take(&mut self.events).finish() {
            self.add_event(&event)?;
        }
        Ok(Replayed {
            summary: self.tally.finish(),
            findings: Vec::new(),
            table: self.table,
            events: self.event_table,
            learnt: Learnt::default(),
        })
    }
}
