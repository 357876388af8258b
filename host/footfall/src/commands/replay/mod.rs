//! `footfall replay`: estimates recordings and writes a table, events, a summary and pictures, or a copy of a bag with
//! the contacts of its feet.
//!
//! | step | file |
//! |---|---|
//! | the options; the request `Replay`, merged from them and checked before anything is computed; the writing of results | this one |
//! | a recording: its reading, its notices, the estimates of its feet | `recording` |
//! | a recording that is written while it is read | `stream` |
//! | pictures | `pictures` |
//! | copy of bags | `bag_copy` |

mod bag_copy;
mod pictures;
mod recording;
mod stream;

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Args;
use config::{Resolved, parse_seconds, parse_window};
use estimator_core::half_widths::WindowLength;
use replay::events::HEADER;
use replay::jobs;
use replay::summary::Summaries;
use replay::{Span, write_tables};
use tables::output::RowNames;

use self::bag_copy::CopyArguments;
#[cfg(feature = "bags")]
use self::bag_copy::{BagCopy, CopiedFoot};
use self::recording::{ReplayedFoot, ReplayedRecording};
use super::options::{self, ESTIMATOR, INPUT, OUTPUT, OverwriteArguments, RecordingArguments};
use super::span::{self, SpanError};
use crate::error::Error;
use crate::files::{self, Existing, OutputError, STANDARD, Target, write_file};
use crate::messages::{detail, warn};
use crate::progress::Bars;
use crate::report::{SummaryStyle, print};
use crate::ros::compat::Body;
use crate::words::in_words;

/// Examples of `footfall replay`.
pub const EXAMPLES: &str = "\
Examples:
  footfall replay walk.csv --output estimates.csv --plot walk.svg
  footfall replay walk.csv --config robot.toml --from 10 --to 20
  footfall replay log.csv --units g,dps --map ax=acc.x,ay=acc.y,az=acc.z,\\
    wx=gyr.x,wy=gyr.y,wz=gyr.z
  footfall replay a.csv b.csv --json | jq '.recordings[].metrics.rmse'
  footfall replay - --output - < walk.csv | head";

/// Arguments of `footfall replay`.
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// The recordings; `-` is standard input
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// Options for reading the recordings, and the parameters of the estimates.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Length of the window: a duration such as 50ms or a count such as 50samples; with half-widths
    /// only, as with --preset paper
    #[arg(long, value_name = "LENGTH", value_parser = parse_window, help_heading = ESTIMATOR)]
    pub window: Option<WindowLength>,
    /// Estimate again from the samples of a bag. By default the contacts recorded with the samples are the
    /// estimates, and parameters have no effect
    #[arg(long, help_heading = ESTIMATOR)]
    pub estimate_again: bool,
    /// Omit results before this time since the first sample; the estimator still uses the samples
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = INPUT)]
    pub from: Option<f64>,
    /// Stop at this time since the first sample
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = INPUT)]
    pub to: Option<f64>,
    /// Write the estimates, one row per sample, as CSV or Parquet; `-` is standard output. As .mcap, write a
    /// copy of the replayed bags with the contacts of their feet
    #[arg(long, short, value_name = "OUT.csv|parquet|mcap", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,
    /// Messages of all feet in a copy of a bag.
    #[command(flatten)]
    pub copied: CopyArguments,
    /// Write the events: touch-downs, lift-offs, starts and ends of slips with their distance, and starts and
    /// ends of stances that are never stable; `-` is standard output
    #[arg(long, value_name = "OUT.csv", help_heading = OUTPUT)]
    pub events: Option<PathBuf>,
    /// Draw the estimates: as .html, one page of all feet with zoom, which needs no network; as .svg, a
    /// figure per foot, whose file name contains the foot if there are several
    #[arg(long, value_name = "OUT.html|svg", help_heading = OUTPUT)]
    pub plot: Option<PathBuf>,
    /// Whether existing files are replaced.
    #[command(flatten)]
    pub overwrite: OverwriteArguments,
    /// Print the summary as one JSON object
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,
    /// Number of recordings to estimate at once; by default the number of cores
    #[arg(long, value_name = "N", help_heading = OUTPUT)]
    pub jobs: Option<NonZeroUsize>,
}

impl ReplayArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let replay = self.merged()?;
        if replay.stream()? {
            return Ok(());
        }
        let recordings = replay.recordings()?;
        replay.check_names(&recordings)?;
        let feet = replay.report(recordings)?;
        replay.write(feet)
    }

    /// Merges the arguments with the configuration file, and checks them before anything is computed.
    ///
    /// # Errors
    /// The span is empty, the configuration file cannot be used, an input is given twice, or a result cannot be
    /// written.
    fn merged(self) -> Result<Replay, Error> {
        let span = span::span(self.from, self.to)?;
        let resolved = self.recording.resolved(self.window)?;
        files::check_inputs(&self.inputs)?;
        let output = self.output.clone().map(Output::of);
        self.check_targets(output.as_ref())?;
        let body = Body::of(&self.copied.compat)?;
        self.copied.check_lowstate(body)?;
        self.check_stdout()?;
        Ok(Replay {
            resolved,
            span,
            jobs: self.jobs.unwrap_or_else(jobs::all_cores),
            bars: Bars::default(),
            output,
            existing: self.overwrite.existing(),
            body,
            arguments: self,
        })
    }

    /// Checks that the files of all results can be written.
    fn check_targets(&self, output: Option<&Output>) -> Result<(), OutputError> {
        let estimates = output.map(Output::target);
        let events = self.events.as_deref().map(Target::Events);
        let picture = self.plot.as_deref().map(Target::Drawing);
        let all: Vec<_> = [estimates, events, picture].into_iter().flatten().collect();
        files::check(&self.inputs, &all, self.overwrite.existing())?;
        self.copied.check_output(&self.inputs, output)
    }

    /// Checks that a summary as JSON is alone on standard output.
    fn check_stdout(&self) -> Result<(), OutputError> {
        if self.json && self.fills_stdout() {
            return Err(OutputError::StdoutTwice);
        }
        Ok(())
    }

    /// Returns whether a result other than the summary goes to standard output.
    fn fills_stdout(&self) -> bool {
        let results = [&self.output, &self.events, &self.plot];
        let mut paths = results.into_iter().flatten();
        paths.any(|path| path == Path::new(STANDARD))
    }
}

/// Output of the estimates.
#[derive(Debug)]
enum Output {
    /// Table of the estimates, one row per sample.
    Table(PathBuf),
    /// Copy of the replayed bags with the contacts of their feet.
    Copy(PathBuf),
}

impl Output {
    /// Returns the kind of output of this name.
    fn of(path: PathBuf) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("mcap") { Self::Copy(path) } else { Self::Table(path) }
    }

    fn target(&self) -> Target<'_> {
        match self {
            Self::Table(path) => Target::Estimates(path),
            Self::Copy(path) => Target::Bag(path),
        }
    }
}

/// Checked request of a replay: the arguments, and the values that are derived from them once.
struct Replay {
    arguments: ReplayArguments,
    /// Preset, configuration file and options.
    resolved: Resolved,
    /// Part of each recording in the results.
    span: Span,
    /// Number of recordings, or of feet of an only recording, that are estimated at once.
    jobs: NonZeroUsize,
    bars: Bars,
    /// Output of the estimates, if they are written.
    output: Option<Output>,
    /// Treatment of files that have the names of results.
    existing: Existing,
    /// The body whose feet are in messages of all feet.
    body: Body,
}

impl Replay {
    /// Reads and estimates all recordings.
    fn recordings(&self) -> Result<Vec<ReplayedRecording>, Error> {
        let inputs = self.arguments.inputs.iter();
        jobs::run(inputs, self.jobs, |input| self.recording(input)).into_iter().collect()
    }

    /// Checks the names of feet in the settings against the names in the recordings.
    fn check_names(&self, recordings: &[ReplayedRecording]) -> Result<(), Error> {
        let feet = recordings.iter().flat_map(|recording| &recording.feet);
        let names = feet.flat_map(|foot| foot.names.iter().map(String::as_str));
        let names: Vec<&str> = names.collect();
        self.resolved.check_axes(&names)?;
        self.resolved.unused_feet(&names).into_iter().for_each(warn);
        Ok(())
    }

    /// Prints details, notices and findings of the recordings, and returns all their feet.
    ///
    /// # Errors
    /// There are findings and `--strict` is given, or no sample is in the span.
    fn report(&self, recordings: Vec<ReplayedRecording>) -> Result<Vec<ReplayedFoot>, Error> {
        let mut feet = Vec::new();
        for recording in recordings {
            recording.feet.iter().map(|foot| &foot.recognised).for_each(detail);
            recording.details.iter().for_each(detail);
            recording.notices.iter().map(in_words).for_each(warn);
            for ReplayedFoot { results, .. } in &recording.feet {
                let place = options::place(&recording.file, results.summary.foot.as_deref());
                self.arguments.recording.reading.report(&place, &results.findings)?;
            }
            feet.extend(recording.feet);
        }
        if feet.iter().all(|foot| foot.results.summary.samples == 0) {
            let files = self.arguments.inputs.iter().map(|input| input.display().to_string());
            return Err(SpanError::NoSample(files.collect::<Vec<_>>().join(", ")).into());
        }
        Ok(feet)
    }

    /// Writes the results, and prints the summary.
    fn write(&self, mut feet: Vec<ReplayedFoot>) -> Result<(), Error> {
        let arguments = &self.arguments;
        let row_names = self.row_names(feet.len());
        let pictures = self.picture_paths(&feet);
        // `check_targets` checked only the name in `--plot`, because the names of several pictures depend on the feet.
        pictures.iter().try_for_each(|path| self.existing.check(path))?;
        let mut written = Vec::new();
        #[cfg(feature = "bags")]
        if let Some(Output::Copy(path)) = &self.output {
            let copied = feet.iter_mut().filter_map(|foot| foot.copied.take());
            let mut copied: Vec<CopiedFoot> = copied.collect();
            let copy = BagCopy::new(
                &arguments.inputs,
                &arguments.copied,
                self.body,
                arguments.estimate_again,
            );
            copy.check(&copied)?;
            write_file(path, self.existing, |to| copy.write(&mut copied, to))?;
            written.push(path.clone());
        }
        if let Some(Output::Table(path)) = &self.output {
            let tables = feet.iter_mut().filter_map(|foot| foot.results.table.take());
            let tables = tables.collect();
            write_file(path, self.existing, |to| write_tables(tables, row_names, to))?;
            written.push(path.clone());
        }
        if let Some(path) = &arguments.events {
            write_file(path, self.existing, |to| write_events(&mut feet, row_names, to))?;
            written.push(path.clone());
        }
        let drawn = feet.iter_mut().filter_map(|foot| foot.picture.take());
        pictures::write(&pictures, self.existing, drawn)?;
        written.extend(pictures);
        // The summary would be mixed into a result on standard output.
        let is_silent = arguments.fills_stdout();
        let style = if is_silent { SummaryStyle::Silent } else { SummaryStyle::of(arguments.json) };
        let summaries =
            Summaries { recordings: feet.into_iter().map(|foot| foot.results.summary).collect() };
        print(&summaries, style, &written).map_err(Error::Print)
    }

    /// Returns the paths of the pictures. The paths for several feet are known only when the feet are.
    fn picture_paths(&self, feet: &[ReplayedFoot]) -> Vec<PathBuf> {
        let Some(path) = &self.arguments.plot else {
            return Vec::new();
        };
        let titles = feet.iter().map(|foot| foot.results.summary.recording.as_str());
        pictures::paths(path, &titles.collect::<Vec<_>>())
    }

    /// Returns the names in the rows of tables of this number of feet.
    const fn row_names(&self, feet: usize) -> RowNames {
        if self.arguments.inputs.len() > 1 {
            RowNames::Recording
        } else if feet > 1 {
            RowNames::Foot
        } else {
            RowNames::Absent
        }
    }
}

/// Writes the table of the events of all feet, with these names in its rows.
fn write_events(
    feet: &mut [ReplayedFoot],
    row_names: RowNames,
    to: &mut dyn Write,
) -> io::Result<()> {
    row_names.write_header(HEADER, to)?;
    let mut parts = feet.iter_mut().filter_map(|foot| foot.results.events.as_mut());
    parts.try_for_each(|part| part.write(to))
}
