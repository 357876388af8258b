//! `footfall replay`: recordings through the estimator, to a table, a picture and a summary.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use clap::Args;
use estimator_core::WindowLength;
use recordings::output::{Feet, write_header};

use super::recording::{Configuration, RecordingArguments, with_mounting};
use crate::config::{parse_seconds, parse_window};
use crate::error::Error;
use crate::files::{OutputError, STANDARD, write_file};
use crate::progress::{self, Bars};
use crate::replay::foot::{ReplayError, Replayed, Table, Wanted, replay};
use crate::replay::jobs;
use crate::replay::span::Span;
use crate::report::{SummaryStyle, print, warn};
use crate::summary::{InputReport, Summaries};
use crate::targets::{self, Target};

/// What `footfall replay` takes.
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// The recordings; `-` is standard input
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// How they are read, and with which parameters.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Length of the window: a duration such as 50ms or a count such as 50samples; with half-widths
    /// only, as with --preset paper
    #[arg(long, value_name = "LENGTH", value_parser = parse_window)]
    pub window: Option<WindowLength>,
    /// Leave out what comes before this time since the first sample; the estimator sees it all the
    /// same
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub from: Option<f64>,
    /// Stop at this time since the first sample
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub to: Option<f64>,
    /// Write the estimates, one row per sample; `-` is standard output
    #[arg(long, value_name = "OUT.csv")]
    pub output: Option<PathBuf>,
    /// Write the figure, which is an SVG; of several feet one each, with the foot in its name
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
    /// Estimate so many recordings at once; as many as there are cores where it is not given
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
}

/// A recording of which all feet have been estimated.
struct Done {
    file: String,
    /// What is to be said about how it was read.
    notices: Vec<String>,
    feet: Vec<Replayed>,
}

impl ReplayArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let span = Span::new(self.from, self.to);
        if span.is_empty() {
            return Err(Error::EmptySpan {
                from: self.from.unwrap_or(0.0),
                to: self.to.unwrap_or(0.0),
            });
        }
        let configuration = Configuration::read(self.recording.config.as_deref())?;
        targets::check_inputs(&self.inputs)?;
        self.check_targets()?;
        let jobs = self.jobs.unwrap_or_else(jobs::all_cores);
        let bars = Bars::default();
        let done = jobs::run(&self.inputs, jobs, |input| {
            self.replay(&configuration, input, span, jobs, &bars)
        });
        let mut feet = Vec::new();
        for one in done {
            let Done {
                file,
                notices,
                feet: replayed,
            } = one?;
            notices.iter().for_each(warn);
            for foot in &replayed {
                self.recording.report(&file, &foot.findings)?;
            }
            feet.extend(replayed);
        }
        self.write(feet)
    }

    /// Checks that all results can be written, before anything is computed.
    fn check_targets(&self) -> Result<(), OutputError> {
        let table = self.output.iter().map(|path| Target::Table(path));
        let picture = self.plot.iter().map(|path| Target::Picture(path));
        targets::check(&self.inputs, &table.chain(picture).collect::<Vec<_>>())?;
        if self.json && self.output.as_deref() == Some(Path::new(STANDARD)) {
            return Err(OutputError::StdoutTwice);
        }
        Ok(())
    }

    /// Reads a recording and estimates all feet in it.
    fn replay(
        &self,
        configuration: &Configuration,
        input: &Path,
        span: Span,
        jobs: NonZeroUsize,
        bars: &Bars,
    ) -> Result<Done, Error> {
        let opened = progress::open(input, self.recording.format, bars)?;
        let format = opened.format();
        let mut params = self.recording.params(configuration, format);
        if let Some(window) = self.window {
            params.window = window;
        }
        let file = input.display().to_string();
        let origins = configuration.origins(&file, self.recording.sample_rate, self.window);
        let hints = self.recording.hints(configuration)?;
        let stored = opened.store_all(&hints)?;
        origins.check_effects(&params)?;
        let preset = self.recording.preset;
        let mut notices = Vec::new();
        for about in stored.iter().map(|stored| &stored.about) {
            notices.extend(about.notices.iter().cloned());
            notices.extend(preset.window_notice(format, &params, &about.name, about.sample_rate));
        }
        let several = self.inputs.len() > 1 || stored.len() > 1;
        let wanted = Wanted {
            span,
            table: match &self.output {
                None => Table::None,
                Some(_) if several => Table::SeveralFeet,
                Some(_) => Table::OneFoot,
            },
            figure: self.plot.is_some(),
        };
        // Each foot is estimated once, but by any thread.
        let stored: Vec<_> = stored.into_iter().map(Mutex::new).collect();
        let jobs = if self.inputs.len() == 1 {
            jobs
        } else {
            NonZeroUsize::MIN
        };
        let feet = jobs::run(&stored, jobs, |stored| {
            let mut stored = stored.lock().unwrap_or_else(PoisonError::into_inner);
            let bar = bars.estimating(stored.about.samples as u64);
            let replayed = replay(&mut stored, &params, &wanted, || bar.inc(1));
            bar.finish_and_clear();
            let mut foot = replayed.map_err(|error| match error {
                ReplayError::Params(error) => origins.explain(&error, &params).into(),
                other => Error::Replay(other),
            })?;
            foot.findings = with_mounting(foot.findings, &hints);
            let about = &stored.about;
            let report = InputReport::new(&about.notices, about.repairs, &foot.findings);
            foot.summary.input = Some(report);
            Ok::<_, Error>(foot)
        });
        Ok(Done {
            feet: feet.into_iter().collect::<Result<_, _>>()?,
            file,
            notices,
        })
    }

    /// Writes what was asked for.
    fn write(&self, mut feet: Vec<Replayed>) -> Result<(), Error> {
        let mut written = Vec::new();
        if let Some(path) = &self.output {
            let several = self.inputs.len() > 1 || feet.len() > 1;
            write_file(path, |to| {
                write_header(if several { Feet::Several } else { Feet::One }, to)?;
                let parts = feet.iter_mut().filter_map(|foot| foot.table.as_mut());
                parts.into_iter().try_for_each(|part| part.write(to))
            })?;
            written.push(path.clone());
        }
        if let Some(path) = &self.plot {
            written.extend(write_figures(path, &mut feet)?);
        }
        let style = if self.json {
            SummaryStyle::Json
        } else if self.output.as_deref() == Some(Path::new(STANDARD)) {
            SummaryStyle::Silent
        } else {
            SummaryStyle::Text
        };
        let summaries = Summaries::new(feet.into_iter().map(|foot| foot.summary).collect());
        print(&summaries, style, &written).map_err(Error::Print)
    }
}

/// Writes the figure of each foot, and says where.
fn write_figures(path: &Path, replayed: &mut [Replayed]) -> Result<Vec<PathBuf>, Error> {
    let one = replayed.len() == 1;
    let mut written = Vec::new();
    for foot in replayed {
        if let Some(figure) = foot.figure.take() {
            let path = if one {
                path.to_owned()
            } else {
                targets::with_foot(path, &foot.summary.recording)
            };
            write_file(&path, |to| to.write_all(figure.svg()?.as_bytes()))?;
            written.push(path);
        }
    }
    Ok(written)
}
