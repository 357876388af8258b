//! `footfall batch`: estimates all recordings of a directory tree into Parquet tables.

use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::io::{self, IsTerminal};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use analysis::batch::pattern::PathPattern;
use analysis::batch::run::{Reason, RecordingOutcome, Results, Stale, Watch};
use analysis::batch::sources::{FoundRecording, PassedOver, Search, find};
use analysis::batch::{
    BatchRow, BatchSettings, FeetWanted, Plausibility, Progress, Status, Verify,
};
use analysis::config::parse_window;
use analysis::replay::jobs;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use estimator_core::WindowLength;
use indicatif::ProgressBar;
use recordings::input::{ContactUse, Format, Hints};
use serde::Serialize;

use super::headings::{ESTIMATOR, INPUT, OUTPUT};
use super::recording::RecordingArguments;
use crate::error::Error;
use crate::files::check_can_be_directory;
use crate::json::Described;
use crate::messages::{aside, detail, error, warn};
use crate::progress::Bars;
use crate::report::{SummaryStyle, print};

/// Arguments of `footfall batch`.
#[derive(Debug, Args)]
pub struct BatchArguments {
    /// Folders in which all recordings are taken, and recordings
    #[arg(required = true, value_name = "SOURCE")]
    pub sources: Vec<PathBuf>,
    /// The folder of the tables samples, events and recordings; what it has already is not done again
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    pub out: PathBuf,
    /// How they are read, and with which parameters.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Length of the window: a duration such as 50ms or a count such as 50samples; with half-widths
    /// only, as with --preset paper
    #[arg(long, value_name = "LENGTH", value_parser = parse_window, help_heading = ESTIMATOR)]
    pub window: Option<WindowLength>,
    /// Estimate from the samples of bags again; otherwise the contacts that their feet sent and that were recorded
    /// with the samples are the estimates, and no parameter applies
    #[arg(long, help_heading = ESTIMATOR)]
    pub estimate_again: bool,
    /// The robot of all recordings, where it is not the first folder below a SOURCE
    #[arg(long, value_name = "NAME", help_heading = INPUT)]
    pub robot: Option<String>,
    /// Meaning of the last parts of paths.
    #[arg(
        long,
        value_name = "PATTERN",
        help_heading = INPUT,
        help = "Pattern of the last parts of the paths: {robot}, {foot} and {day} are taken from it, * is \
                any text in a part, ** for any parts, such as {robot}/{day}/*_{foot}.csv"
    )]
    pub path_pattern: Option<PathPattern>,
    /// Estimate N recordings at once; by default as many as there are cores
    #[arg(long, value_name = "N", help_heading = OUTPUT)]
    pub jobs: Option<NonZeroUsize>,
    /// How it is seen that a recording is unchanged: by length and time of its files as they were noted when they were
    /// hashed (listing), or by the hash of their bytes (contents)
    #[arg(long, value_name = "HOW", default_value = "listing", value_parser = verify_parser(), help_heading = OUTPUT)]
    pub verify: Verify,
    /// List what would be done and why, and do nothing
    #[arg(long, help_heading = OUTPUT)]
    pub dry_run: bool,
    /// Remove the results of recordings that are not found any more below the sources; asks before
    #[arg(long, help_heading = OUTPUT)]
    pub prune: bool,
    /// Prune without a question
    #[arg(long, requires = "prune", help_heading = OUTPUT)]
    pub yes: bool,
    /// Print the report as one JSON object
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,
}

/// Parser of the ways to see that a recording is unchanged.
fn verify_parser() -> impl TypedValueParser<Value = Verify> {
    PossibleValuesParser::new(["listing", "contents"]).map(|word| match word.as_str() {
        "contents" => Verify::Contents,
        _ => Verify::Listing,
    })
}

/// Names of recordings in the question before results are removed.
const SHOWN: usize = 3;

/// Outcomes of all recordings. `Display` is the report for the terminal.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BatchReport {
    /// Recordings that were estimated.
    pub done: usize,
    /// Recordings that had been before, with the same settings and version.
    pub up_to_date: usize,
    /// Recordings that could not be, now or before: those of which a foot has failed.
    pub failed: usize,
    /// Recordings that would be estimated; with --dry-run only.
    pub to_do: usize,
    /// Each of them, in the order of their names.
    pub recordings: Vec<RecordingReport>,
    /// Files other than recordings, and folders that cannot be read.
    pub passed_over: Vec<PassedOver>,
    /// Results of recordings that were not found; with --prune they have been removed.
    pub stale: Vec<Stale>,
    /// Whether they have been.
    pub pruned: bool,
}

impl Described for BatchReport {
    const SCHEMA: &'static str = "urn:footfall:batch:1";
}

/// Outcome of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingReport {
    /// Its name.
    pub recording: String,
    /// Action taken.
    pub action: Action,
    /// Why; `null` where nothing had to be done.
    pub reason: Option<Reason>,
    /// The rows of its feet, as the table `recordings` has them.
    pub rows: Vec<BatchRow>,
}

/// Action taken for a recording.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// It was estimated, or has failed.
    Estimated,
    /// Nothing: its results are there.
    UpToDate,
    /// It would be estimated.
    ToDo,
}

impl fmt::Display for BatchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for recording in &self.recordings {
            if let (Action::ToDo, Some(reason)) = (recording.action, recording.reason) {
                writeln!(f, "to do    {}: {}", recording.recording, reason.sentence())?;
            }
        }
        match self.to_do {
            0 => write!(f, "batch    {} done", self.done)?,
            to_do => write!(f, "batch    {to_do} to do")?,
        }
        let (up_to_date, failed) = (self.up_to_date, self.failed);
        write!(f, ", {up_to_date} up to date, {failed} failed")?;
        let passed_over = self.passed_over.len();
        if passed_over > 0 {
            write!(
                f,
                "\npassed over {passed_over} that are no recordings (-v lists them)"
            )?;
        }
        let stale = self.stale.len();
        match (stale, self.pruned) {
            (0, _) => Ok(()),
            (_, true) => write!(f, "\npruned   {stale} that were not found any more"),
            (_, false) => write!(
                f,
                "\nnot found {stale} of which there are results (-v lists them, --prune removes them)"
            ),
        }
    }
}

impl BatchArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        check_can_be_directory(&self.out)?;
        let can_ask = !self.json && io::stdin().is_terminal() && io::stderr().is_terminal();
        if self.prune && !self.yes && !self.dry_run && !can_ask {
            return Err(Error::NoTerminal);
        }
        let settings = self.settings()?;
        let search = Search {
            robot: self.robot.clone(),
            pattern: self.path_pattern.clone(),
            format: self.recording.reading.format,
            out: self.out.clone(),
        };
        let found = find(&self.sources, &search)?;
        let (recordings, passed_over) = (found.recordings, found.passed_over);
        for PassedOver { path, reason } in &passed_over {
            detail(format!("{path} is passed over: {reason}"));
        }
        if let Some(example) = found.not_as_the_pattern.first() {
            let count = found.not_as_the_pattern.len();
            warn(format!(
                "{count} of {} recordings are not as --path-pattern has it, such as {example}",
                recordings.len()
            ));
        }
        let jobs = self.jobs.unwrap_or_else(jobs::all_cores);
        let watching = Watching::new(&recordings, self.json || self.dry_run);
        let results = match self.dry_run {
            true => Results::look(&self.out),
            false => Results::open(&self.out)?,
        };
        match self.dry_run {
            true => results.plan(&recordings, &settings, self.verify, jobs, &watching),
            false => results.estimate(&recordings, &settings, self.verify, jobs, &watching)?,
        }
        let stale = results.stale(&recordings, &self.sources);
        for Stale { recording, key, .. } in &stale {
            let name = recording.as_ref().unwrap_or(key);
            detail(format!("{name} was not found, but has results"));
        }
        let pruned = self.prune && !self.dry_run && self.agrees(&stale)?;
        if pruned {
            results.prune(&stale)?;
        }
        let state = watching.finish();
        let report = BatchReport {
            passed_over,
            stale,
            pruned,
            ..state.report
        };
        // Only a warning, because the results are written already.
        let feet = &state.feet;
        let without = settings.feet_without_recording(feet, &state.corrections);
        if !without.is_empty() && !feet.is_empty() {
            let first: Vec<&str> = feet.iter().take(SHOWN).map(String::as_str).collect();
            let more = match feet.len() {
                0..=SHOWN => "",
                _ => " and others",
            };
            warn(format!(
                "there are settings of {}, but no recording of it; the feet are {}{more}",
                without.join(", "),
                first.join(", ")
            ));
        }
        let written = (!self.dry_run).then_some(&self.out);
        print(&report, SummaryStyle::of(self.json), written).map_err(Error::Print)?;
        let (failed, recordings) = (report.failed, recordings.len());
        match failed > 0 && !self.dry_run {
            true => Err(Error::Failed { failed, recordings }),
            false => Ok(()),
        }
    }

    /// Asks whether results are to be removed, unless `--yes` says so or there are none.
    fn agrees(&self, stale: &[Stale]) -> Result<bool, Error> {
        if self.yes || stale.is_empty() {
            return Ok(true);
        }
        let names = stale.iter().filter_map(|stale| stale.recording.as_deref());
        let first: Vec<&str> = names.take(SHOWN).collect();
        aside(format_args!(
            "remove the results of {} recordings that are not found, such as {}? [y/N]",
            stale.len(),
            first.join(", ")
        ));
        let mut answer = String::new();
        io::stdin().read_line(&mut answer).map_err(Error::Print)?;
        Ok(["y", "yes"].contains(&answer.trim().to_lowercase().as_str()))
    }

    /// Returns the settings of the estimation. Errors that do not depend on the recording are reported before any
    /// recording is read.
    fn settings(&self) -> Result<BatchSettings, Error> {
        let reading = &self.recording.reading;
        let resolved = self.recording.resolved(self.window)?;
        let settings = BatchSettings {
            hints: Hints {
                contacts: ContactUse::unless_estimated(self.estimate_again),
                ..reading.hints(&resolved)?
            },
            resolved,
            format: reading.format,
            plausibility: match reading.strict {
                true => Plausibility::Required,
                false => Plausibility::Reported,
            },
            feet: FeetWanted::All,
        };
        let format = settings.format.unwrap_or(Format::Csv);
        settings.resolved.check_before_reading(format)?;
        Ok(settings)
    }
}

/// Counts results of recordings and shows the progress.
struct Watching {
    bar: ProgressBar,
    count: usize,
    /// Whether the report lists each recording.
    is_detailed: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    report: BatchReport,
    /// Names of the feet that were read, now or before.
    feet: BTreeSet<String>,
    /// Corrections of their readings, as JSON.
    corrections: BTreeSet<String>,
    /// Bytes of each recording counted by the bar, by name.
    counted: HashMap<String, Arc<AtomicU64>>,
}

impl Watching {
    fn new(recordings: &[FoundRecording], is_detailed: bool) -> Self {
        let bytes = recordings.iter().map(|recording| recording.bytes).sum();
        Self {
            bar: Bars::default().batch(bytes),
            count: recordings.len(),
            is_detailed,
            state: Mutex::default(),
        }
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn finish(self) -> State {
        self.bar.finish_and_clear();
        let state = self.state.into_inner();
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        let recordings = &mut state.report.recordings;
        recordings.sort_by(|a, b| a.recording.cmp(&b.recording));
        state
    }
}

impl Watch for Watching {
    fn progress(&self, recording: &FoundRecording) -> Progress {
        let counted = Arc::new(AtomicU64::new(0));
        let name = recording.identity.name.clone();
        self.state().counted.insert(name, counted.clone());
        let (bar, bytes) = (self.bar.clone(), recording.bytes);
        Arc::new(move |share| {
            let now = (share * bytes as f64) as u64;
            let before = counted.fetch_max(now, Ordering::Relaxed);
            bar.inc(now.saturating_sub(before));
        })
    }

    fn done(&self, recording: &FoundRecording, outcome: RecordingOutcome) {
        let name = &recording.identity.name;
        let mut state = self.state();
        let counted = state.counted.remove(name);
        let counted = counted.map_or(0, |counted| counted.load(Ordering::Relaxed));
        self.bar.inc(recording.bytes.saturating_sub(counted));
        let is_failed = outcome.error().is_some();
        let (action, reason, rows) = match outcome {
            RecordingOutcome::Estimated(reason, rows) => (Action::Estimated, Some(reason), rows),
            RecordingOutcome::UpToDate(rows) => (Action::UpToDate, None, rows),
            RecordingOutcome::ToDo(reason) => (Action::ToDo, Some(reason), Vec::new()),
        };
        for row in &rows {
            if let Some(found) = &row.found {
                state.feet.insert(row.foot.clone());
                state.corrections.insert(found.correction.clone());
            }
        }
        let report = &mut state.report;
        let count = match action {
            _ if is_failed => &mut report.failed,
            Action::Estimated => &mut report.done,
            Action::UpToDate => &mut report.up_to_date,
            Action::ToDo => &mut report.to_do,
        };
        *count += 1;
        let finished = report.done + report.up_to_date + report.failed + report.to_do;
        self.bar
            .set_message(format!("{finished} of {}", self.count));
        self.bar.suspend(|| say(name, action, &rows));
        if self.is_detailed {
            report.recordings.push(RecordingReport {
                recording: name.clone(),
                action,
                reason,
                rows,
            });
        }
    }
}

/// Prints the findings of a recording when it is estimated, and its failure in each run.
fn say(name: &str, action: Action, rows: &[BatchRow]) {
    for row in rows {
        let of_feet = match rows.len() {
            0 | 1 => name.to_owned(),
            _ => format!("{name} {}", row.foot),
        };
        let found = row.found.iter().filter(|_| action == Action::Estimated);
        for finding in found.flat_map(|found| &found.finding_messages) {
            warn(format!("{of_feet}: {finding}"));
        }
        if row.origin.status == Status::Failed {
            error(row.origin.error.as_deref().unwrap_or(name));
        }
    }
}
