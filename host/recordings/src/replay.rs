//! Replay of a stored recording: the samples of a foot through the estimator, into tables, events and a summary.
//!
//! Each sample is read, estimated, written and discarded, so memory does not grow with the length of a recording. Rows
//! of a foot wait in a temporary file until those of the previous feet are written.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use estimator_core::any::AnyParams;
use estimator_core::{ContactEstimate, Learnt, ParamsError, Timestamp};
use tempfile::SpooledTempFile;
use thiserror::Error;

use crate::estimate::Estimator;
use crate::events::{ContactEvent, Events, write_event};
use crate::input::{About, Stored};
use crate::output::{HEADER, RowNames, write_row};
use crate::plausible::{Check, Finding};
use crate::samples::RecordedSample;
use crate::summary::{Summary, Tally};

#[cfg(feature = "parquet")]
use crate::parquet_output::{ParquetEstimates, join};
#[cfg(feature = "parquet")]
use std::fs::File;

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

/// Estimates a foot sample by sample, observed by `observer`; or takes the recorded estimates, if these
/// [are used](crate::input::InputOptions::contacts).
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

/// Part of a recording, counted from its first sample. The estimator also processes the samples before it, because
/// an estimate depends on the past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    from_us: u64,
    to_us: u64,
}

impl Default for Span {
    fn default() -> Self {
        Self { from_us: 0, to_us: u64::MAX }
    }
}

impl Span {
    /// Creates a span from start and end in s; `None` extends it to that end of the recording.
    #[must_use]
    pub fn new(from_s: Option<f64>, to_s: Option<f64>) -> Self {
        let whole = Self::default();
        // Casts saturate.
        let micros = |seconds: f64| (seconds * 1.0e6).round() as u64;
        Self {
            from_us: from_s.map_or(whole.from_us, micros),
            to_us: to_s.map_or(whole.to_us, micros),
        }
    }

    /// Returns whether the span contains no time.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.from_us >= self.to_us
    }

    /// Returns whether a time is in the span, including its start and excluding its end.
    #[must_use]
    pub const fn contains(self, time: Timestamp) -> bool {
        self.from_us <= time.as_micros() && time.as_micros() < self.to_us
    }

    /// Returns whether a time is after the span.
    #[must_use]
    pub const fn is_before(self, time: Timestamp) -> bool {
        self.to_us <= time.as_micros()
    }

    /// Returns the first and last time of the span in a recording of this duration, s.
    #[must_use]
    pub fn within(self, duration_us: u64) -> (f64, f64) {
        let seconds = |micros: u64| micros.min(duration_us) as f64 / 1.0e6;
        (seconds(self.from_us), seconds(self.to_us))
    }
}

/// Layout of a table, given by the name of its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// CSV text.
    #[default]
    Csv,
    /// Parquet.
    Parquet,
}

impl Layout {
    /// File extensions of the layouts.
    pub const EXTENSIONS: [&'static str; 2] = ["csv", "parquet"];

    /// Returns Parquet for a file name with that extension, and text for any other, such as a pipe's.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("parquet") { Self::Parquet } else { Self::Csv }
    }
}

/// Estimates of one foot, buffered until those of the preceding feet are written.
pub enum EstimateTable {
    /// CSV text.
    Csv(CsvRows),
    /// Parquet.
    #[cfg(feature = "parquet")]
    Parquet {
        /// Name of the foot, if the table names it.
        foot: Option<String>,
        /// Time of the recording's clock at timestamp 0, µs.
        start_us: i64,
        /// Rows, in a temporary file.
        rows: Box<ParquetEstimates<File>>,
    },
}

impl EstimateTable {
    /// Creates an empty table of a foot, with these names in its rows.
    ///
    /// # Errors
    /// The temporary file cannot be written, or Parquet is not built in.
    pub fn new(layout: Layout, names: RowNames, about: &About) -> io::Result<Self> {
        let (foot, start_us) = (names.of(about), about.start_us);
        Ok(match layout {
            Layout::Csv => Self::Csv(CsvRows::new(foot, start_us)),
            #[cfg(not(feature = "parquet"))]
            Layout::Parquet => {
                let what = "this program was built without the feature parquet";
                return Err(io::Error::new(io::ErrorKind::Unsupported, what));
            }
            #[cfg(feature = "parquet")]
            Layout::Parquet => Self::Parquet {
                foot,
                start_us,
                rows: Box::new(ParquetEstimates::new(tempfile::tempfile()?, names)?),
            },
        })
    }

    /// Appends an estimate.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn add(&mut self, estimate: &ContactEstimate) -> io::Result<()> {
        match self {
            Self::Csv(part) => part.add(estimate),
            #[cfg(feature = "parquet")]
            Self::Parquet { foot, start_us, rows } => {
                rows.add(foot.as_deref(), estimate, *start_us)
            }
        }
    }
}

/// Writes the tables of all feet as one.
///
/// # Errors
/// The errors of the writer and the temporary files.
pub fn write_tables(
    tables: Vec<EstimateTable>,
    names: RowNames,
    to: &mut dyn Write,
) -> io::Result<()> {
    #[cfg(feature = "parquet")]
    let mut files = Vec::new();
    let mut has_header = false;
    for table in tables {
        match table {
            EstimateTable::Csv(mut part) => {
                if !std::mem::replace(&mut has_header, true) {
                    names.write_header(HEADER, to)?;
                }
                part.write(to)?;
            }
            #[cfg(feature = "parquet")]
            EstimateTable::Parquet { rows, .. } => files.push(rows.finish()?),
        }
    }
    #[cfg(feature = "parquet")]
    if !files.is_empty() {
        join(files, to)?;
    }
    Ok(())
}

/// Bytes kept in memory.
const IN_MEMORY: usize = 8 << 20;

/// Rows of one foot in the table of estimates or of events.
pub struct CsvRows {
    foot: Option<String>,
    start_us: i64,
    rows: BufWriter<SpooledTempFile>,
}

impl CsvRows {
    /// Creates an empty part. `foot`, if given, is named in each row; `start_us` is the time of the recording's
    /// clock at timestamp 0, µs.
    #[must_use]
    pub fn new(foot: Option<String>, start_us: i64) -> Self {
        Self {
            foot,
            start_us,
            rows: BufWriter::with_capacity(1 << 16, SpooledTempFile::new(IN_MEMORY)),
        }
    }

    /// Appends an estimate.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn add(&mut self, estimate: &ContactEstimate) -> io::Result<()> {
        write_row(self.foot.as_deref(), estimate, self.start_us, &mut self.rows)
    }

    /// Appends an event.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn add_event(&mut self, event: &ContactEvent) -> io::Result<()> {
        write_event(self.foot.as_deref(), event, self.start_us, &mut self.rows)
    }

    /// Writes all rows.
    ///
    /// # Errors
    /// The errors of the writer and the temporary file.
    pub fn write(&mut self, to: &mut dyn Write) -> io::Result<()> {
        self.rows.seek(SeekFrom::Start(0))?;
        io::copy(self.rows.get_mut(), to)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn span_includes_its_start_and_excludes_its_end() {
        let span = Span::new(Some(0.5), Some(1.0));
        let holds = |micros| span.contains(Timestamp::from_micros(micros));
        assert_eq!([499_999, 500_000, 999_999, 1_000_000].map(holds), [false, true, true, false]);
        assert!(span.is_before(Timestamp::from_micros(1_000_000)));
        assert_eq!(span.within(800_000), (0.5, 0.8));
        assert!(Span::new(Some(2.0), Some(2.0)).is_empty());
        assert!(Span::default().contains(Timestamp::from_micros(0)));
    }
}
