//! Replay of a stored recording: the samples of a foot through the estimator, into tables, events and a summary.
//!
//! Each sample is read, estimated, written and discarded, so memory does not grow with the length of a recording. Rows
//! of a foot wait in a temporary file until the rows of the previous feet are written.

use std::io;

use estimator_core::any::AnyParams;
use estimator_core::{ContactEstimate, Learnt, ParamsError, Timestamp};
use thiserror::Error;

use plausible::{Check, Finding};
use samples::RecordedSample;
use samples::estimate::Estimator;
use stored::Stored;
use tables::output::RowNames;

use crate::events::{ContactEvent, Events};
use crate::span::Span;
use crate::summary::{Summary, Tally};
use crate::table::{CsvRows, EstimateTable, Layout};

/// Requested results of a foot besides its summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RequestedResults {
    /// Part of the recording in the results.
    pub span: Span,
    /// Names in the table of estimates; `None` for no table.
    pub table: Option<RowNames>,
    /// Layout of the table.
    pub layout: Layout,
    /// Names in the table of events; `None` for no table.
    pub events: Option<RowNames>,
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
    pub table: Option<EstimateTable>,
    /// Rows of the table of events.
    pub events: Option<CsvRows>,
    /// Learnt values; empty if the estimates were recorded.
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

/// Estimates a foot sample by sample, observed by `observer`. If recorded contacts
/// [are used](options::InputOptions::contacts), takes their estimates instead.
///
/// # Errors
/// A parameter is out of range, or the temporary files cannot be used.
pub fn replay(
    stored: &mut Stored,
    params: &AnyParams,
    requested: &RequestedResults,
    observer: &mut impl Observer,
) -> Result<Replayed, ReplayError> {
    let results = Results::new(stored, requested, observer)?;
    if stored.has_estimates() {
        Ok(recorded(stored, results)?)
    } else {
        estimated(stored, params, results)
    }
}

/// Estimates a foot sample by sample.
fn estimated<O: Observer>(
    stored: &mut Stored,
    params: &AnyParams,
    mut results: Results<'_, O>,
) -> Result<Replayed, ReplayError> {
    let about = &stored.about;
    let mut estimator = Estimator::new(about.sample_rate, about.gravity, params)?;
    let mut check =
        Check::new(about.sample_rate, about.gravity).with_thresholds(params.params.load);
    for sample in stored.samples()? {
        let sample = sample?;
        if results.span.is_before(sample.imu.timestamp) {
            break;
        }
        let estimate = estimator.update(&sample);
        check.add(&sample);
        results.add(&sample, &estimate, &estimate)?;
    }
    Ok(Replayed { findings: check.findings(), learnt: estimator.learnt(), ..results.finish()? })
}

/// Takes the recorded estimates of a foot. Nothing is computed from the samples, which may be few, but they are checked.
fn recorded<O: Observer>(stored: &mut Stored, mut results: Results<'_, O>) -> io::Result<Replayed> {
    let check = check_samples(stored, results.span)?;
    for recorded in stored.estimates()?.into_iter().flatten() {
        let recorded = recorded?;
        if results.span.is_before(recorded.estimate.timestamp) {
            break;
        }
        results.add(&recorded.sample, &recorded.estimate, &recorded.with_motion)?;
    }
    Ok(Replayed { findings: findings_beside_contacts(&check), ..results.finish()? })
}

/// Returns the findings that matter if a foot has sent its own estimates. The foot has its own mounting, a sample
/// that could not be sent is blank, and the rate has no effect.
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
    let clock = stored.clock_of_samples();
    let about = &stored.about;
    let after_us = clock.start_us.saturating_sub(about.start_us);
    let mut check = Check::new(clock.sample_rate, about.gravity);
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
    table: Option<EstimateTable>,
    event_table: Option<CsvRows>,
    events: Events,
    span: Span,
    observer: &'a mut O,
}

impl<'a, O: Observer> Results<'a, O> {
    fn new(stored: &Stored, requested: &RequestedResults, observer: &'a mut O) -> io::Result<Self> {
        let about = &stored.about;
        let estimates = |names| EstimateTable::new(requested.layout, names, about);
        let events = |names: RowNames| CsvRows::new(names.of(about), about.start_us);
        Ok(Self {
            tally: Tally::new(&about.title(), about.foot.as_deref(), about.sample_rate),
            table: requested.table.map(estimates).transpose()?,
            event_table: requested.events.map(events),
            events: Events::default(),
            span: requested.span,
            observer,
        })
    }

    /// Adds the estimate of the next sample. `with_motion` is the same estimate with everything known about the foot's motion.
    fn add(
        &mut self,
        sample: &RecordedSample,
        estimate: &ContactEstimate,
        with_motion: &ContactEstimate,
    ) -> io::Result<()> {
        self.events.add(with_motion);
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
