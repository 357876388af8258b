//! `footfall replay`: estimates recordings and writes a table, events, a summary and pictures (`pictures`), or a copy
//! of a bag with the contacts of its feet (`bag_copy`).

mod bag_copy;
mod pictures;

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use estimator_core::params::WindowLength;
use estimator_core::{ContactEstimate, Params};
use indicatif::ProgressBar;
use recordings::config::{GRAVITIES, Resolved, parse_seconds, parse_window, word_of};
use recordings::events::{ContactEvent, HEADER};
use recordings::hint::Notice;
use recordings::input::{About, ContactUse, Content, Format, Stored, without_effect};
use recordings::jobs;
use recordings::output::RowNames;
use recordings::replay::{
    Layout, Observer, ReplayError, Replayed, RequestedResults, Span, replay, write_tables,
};
use recordings::samples::RecordedSample;
use recordings::summary::{Estimation, InputReport, ParametersReport, Summaries, Summary};

#[cfg(feature = "bags")]
use self::bag_copy::BagCopy;
use self::bag_copy::{CopiedFoot, CopyArguments, is_bag};
use self::pictures::Picture;
use super::options::{
    self, ESTIMATOR, INPUT, OUTPUT, OverwriteArguments, RecordingArguments, estimator_options,
    with_mounting,
};
use crate::error::{CommandLine, Error, in_words};
use crate::files::{self, Drawing, OutputError, STANDARD, Target, write_file};
use crate::messages::{detail, warn};
use crate::progress::{self, Bars};
use crate::report::{SummaryStyle, print};
use crate::ros::compat::Body;

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
    /// How they are read, and with which parameters.
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
    /// Whether the results replace files.
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
        let span = options::span(self.from, self.to)?;
        let resolved = self.recording.resolved(self.window)?;
        files::check_inputs(&self.inputs)?;
        self.check_targets()?;
        let jobs = self.jobs.unwrap_or_else(jobs::all_cores);
        let bars = Bars::default();
        let replayed = jobs::run(self.inputs.iter(), jobs, |input| {
            self.estimate_recording(&resolved, input, span, jobs, &bars)
        });
        let replayed: Vec<ReplayedRecording> = replayed.into_iter().collect::<Result<_, _>>()?;
        let names = replayed.iter().flat_map(|recording| &recording.feet);
        let names = names.flat_map(|foot| foot.names.iter().map(String::as_str));
        let names: Vec<&str> = names.collect();
        resolved.check_axes(&names)?;
        resolved.unused_feet(&names).into_iter().for_each(warn);
        let mut feet = Vec::new();
        for recording in replayed {
            recording.feet.iter().map(|foot| &foot.recognised).for_each(detail);
            recording.details.iter().for_each(detail);
            recording.notices.iter().map(in_words).for_each(warn);
            for ReplayedFoot { results, .. } in &recording.feet {
                let place = options::place(&recording.file, results.summary.foot.as_deref());
                self.recording.reading.report(&place, &results.findings)?;
            }
            feet.extend(recording.feet);
        }
        if feet.iter().all(|foot| foot.results.summary.samples == 0) {
            let files = self.inputs.iter().map(|input| input.display().to_string());
            return Err(Error::NothingInSpan(files.collect::<Vec<_>>().join(", ")));
        }
        // The names of pictures of several feet are known only now.
        let names = feet.iter().map(|foot| foot.results.summary.recording.as_str());
        let names: Vec<&str> = names.collect();
        let pictures = self.plot.as_deref().map(|path| pictures::paths(path, &names));
        let pictures = pictures.unwrap_or_default();
        pictures.iter().try_for_each(|path| self.overwrite.existing().check(path))?;
        #[cfg(feature = "bags")]
        if let Some(bag) = self.bag() {
            let copied = feet.iter_mut().filter_map(|foot| foot.copied.take());
            let mut copied: Vec<CopiedFoot> = copied.collect();
            let body = Body::of(&self.copied.compat)?;
            let copy = BagCopy::new(&self.inputs, &self.copied, body, self.estimate_again);
            copy.check(&copied)?;
            write_file(bag, self.overwrite.existing(), |to| copy.write(&mut copied, to))?;
        }
        self.write(feet, &pictures)
    }

    /// Checks that all results can be written before computing them.
    fn check_targets(&self) -> Result<(), OutputError> {
        let table_or_bag =
            |path| if is_bag(path) { Target::Bag(path) } else { Target::Estimates(path) };
        let table = self.output.as_deref().map(table_or_bag);
        let events = self.events.as_deref().map(Target::Events);
        let picture = self.plot.as_deref().map(Target::Drawing);
        let all: Vec<_> = [table, events, picture].into_iter().flatten().collect();
        files::check(&self.inputs, &all, self.overwrite.existing())?;
        let _ = self.copied.check(&self.inputs, self.bag())?;
        if self.json && self.fills_stdout() {
            return Err(OutputError::StdoutTwice);
        }
        Ok(())
    }

    /// Returns the output if it is a copy of the bag with its contacts.
    fn bag(&self) -> Option<&Path> {
        self.output.as_deref().filter(|path| is_bag(path))
    }

    /// Returns whether a result other than the summary goes to standard output.
    fn fills_stdout(&self) -> bool {
        let results = [&self.output, &self.events, &self.plot];
        let mut paths = results.into_iter().flatten();
        paths.any(|path| path == Path::new(STANDARD))
    }

    /// Reads a recording and estimates all its feet.
    fn estimate_recording(
        &self,
        resolved: &Resolved,
        input: &Path,
        span: Span,
        jobs: NonZeroUsize,
        bars: &Bars,
    ) -> Result<ReplayedRecording, Error> {
        let started = Instant::now();
        let (format, feet) = self.read(resolved, input, bars)?;
        let read = Instant::now();
        let file = input.display().to_string();
        let params = resolved.params(format);
        resolved.origins(&file).check_effects(&params)?;
        let notices = self.notices(&file, format, &params, &feet);
        let requested = self.requested(span, feet.len());
        let body = Body::of(&self.copied.compat)?;
        let run = RecordingRun { resolved, file: &file, format, requested, bars, body };
        // Several recordings already keep all cores busy.
        let jobs = if self.inputs.len() == 1 { jobs } else { NonZeroUsize::MIN };
        let replayed = jobs::run(feet.into_iter(), jobs, |foot| self.estimate_foot(&run, foot));
        let feet: Vec<ReplayedFoot> = replayed.into_iter().collect::<Result<_, _>>()?;
        let parameters = if feet.iter().all(|foot| foot.results.summary.estimation.is_none()) {
            "the estimates are recorded contacts".to_owned()
        } else {
            self.recording.parameters_text(&params, format)
        };
        let details = vec![
            format!("{file}: format {}; {parameters}", format.name()),
            format!(
                "{file}: {:.2} s to read, {:.2} s to estimate",
                (read - started).as_secs_f64(),
                read.elapsed().as_secs_f64()
            ),
        ];
        Ok(ReplayedRecording { file, notices, details, feet })
    }

    /// Reads the feet of a recording.
    fn read(
        &self,
        resolved: &Resolved,
        input: &Path,
        bars: &Bars,
    ) -> Result<(Format, Vec<StoredFoot>), Error> {
        let opened = progress::open(input, self.recording.reading.format, bars)?;
        let format = opened.format();
        if let Some(bag) = self.bag()
            && format.content() != Content::Messages
        {
            return Err(OutputError::BagsOnly(bag.display().to_string()).into());
        }
        let contacts = ContactUse::unless_estimated(self.estimate_again);
        let input_options = self.recording.reading.input_options(resolved, contacts);
        let stored = opened.store_all(&input_options)?;
        options::check_begin(&input.display().to_string(), self.from, &stored)?;
        let name = files::name_among(&self.inputs, input);
        let foot = |mut stored: Stored| {
            let names = stored.about.names().into_iter();
            let names = names.map(str::to_owned).collect();
            if let Some(name) = &name {
                stored.about.name.clone_from(name);
            }
            StoredFoot { names, stored }
        };
        Ok((format, stored.into_iter().map(foot).collect()))
    }

    /// Returns the notices about a recording, before it is estimated.
    fn notices(
        &self,
        file: &str,
        format: Format,
        params: &Params,
        feet: &[StoredFoot],
    ) -> Vec<Notice> {
        let preset = self.recording.preset;
        let mut notices = Vec::new();
        if feet.iter().any(|foot| foot.stored.has_estimates()) {
            let RecordingArguments { config, reading, .. } = &self.recording;
            let config = config.as_deref();
            let ineffective = estimator_options(preset, config, self.window, &reading.mounting);
            notices.extend(without_effect(file, &ineffective));
        }
        for foot in feet {
            notices.extend(foot.stored.about.notices.iter().cloned());
        }
        for foot in feet.iter().filter(|foot| !foot.stored.has_estimates()) {
            let about = &foot.stored.about;
            notices.extend(preset.window_notice(format, params, &about.name, about.sample_rate));
        }
        notices
    }

    /// Returns the requested results of each foot of a recording with this number of feet.
    fn requested(&self, span: Span, feet: usize) -> RequestedResults {
        let names = self.row_names(feet);
        let output = self.output.as_deref();
        RequestedResults {
            span,
            table: output.filter(|path| !is_bag(path)).map(|_| names),
            layout: output.map(Layout::of).unwrap_or_default(),
            events: self.events.as_ref().map(|_| names),
        }
    }

    /// Returns the names in the rows of tables of this number of feet.
    const fn row_names(&self, feet: usize) -> RowNames {
        if self.inputs.len() > 1 {
            RowNames::Recording
        } else if feet > 1 {
            RowNames::Foot
        } else {
            RowNames::Absent
        }
    }

    /// Estimates a foot of a recording.
    fn estimate_foot(
        &self,
        run: &RecordingRun<'_>,
        StoredFoot { names, mut stored }: StoredFoot,
    ) -> Result<ReplayedFoot, Error> {
        let RecordingRun { resolved, file, format, requested, bars, body } = run;
        let drawing = self.plot.as_deref().map(Drawing::of);
        let mut observer = FootObserver {
            bar: bars.estimating(stored.about.samples as u64),
            picture: drawing.map(|drawing| Picture::new(drawing, &stored.about, requested.span)),
            events: self.bag().map(|_| Vec::new()),
        };
        let params = {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            resolved.params_of(&names, *format)
        };
        let replayed = replay(&mut stored, &params, requested, &mut observer);
        observer.bar.finish_and_clear();
        let mut results = replayed.map_err(|error| match error {
            ReplayError::Params(error) => resolved.origins(file).explain(&error).into(),
            other => Error::Replay(other),
        })?;
        let about = &stored.about;
        results.findings = with_mounting(results.findings, &about.correction.mounting);
        let (notices, findings) = (&about.notices, &results.findings);
        let report =
            InputReport::new(file, *format, notices, about.repairs, findings, &CommandLine);
        results.summary.input = Some(report);
        results.summary.estimation = (!stored.has_estimates()).then(|| Estimation {
            preset: self.recording.preset.name(),
            parameters: ParametersReport::of(&Params {
                sample_rate: about.sample_rate,
                gravity: about.gravity,
                ..params
            }),
            correction: (&about.correction).into(),
            learnt: results.learnt.into(),
        });
        let recognised = recognised(about, &results.summary);
        let copied = observer.events.map(|events| CopiedFoot {
            file: (*file).to_owned(),
            name: names.first().cloned().unwrap_or_default(),
            place: names.iter().find_map(|name| body.place(name)),
            stored,
            params,
            span: requested.span,
            events,
        });
        Ok(ReplayedFoot { names, recognised, results, picture: observer.picture, copied })
    }

    /// Writes the results, with the pictures to these paths, and prints the summary.
    fn write(&self, mut feet: Vec<ReplayedFoot>, pictures: &[PathBuf]) -> Result<(), Error> {
        let mut written = Vec::new();
        let existing = self.overwrite.existing();
        let names = self.row_names(feet.len());
        if let Some(path) = &self.output {
            let tables = feet.iter_mut().filter_map(|foot| foot.results.table.take());
            let tables = tables.collect();
            if !is_bag(path) {
                write_file(path, existing, |to| write_tables(tables, names, to))?;
            }
            written.push(path.clone());
        }
        if let Some(path) = &self.events {
            write_file(path, existing, |to| write_events(&mut feet, names, to))?;
            written.push(path.clone());
        }
        let drawn = feet.iter_mut().filter_map(|foot| foot.picture.take());
        pictures::write(pictures, existing, drawn)?;
        written.extend_from_slice(pictures);
        let style =
            if self.fills_stdout() { SummaryStyle::Silent } else { SummaryStyle::of(self.json) };
        let summaries =
            Summaries { recordings: feet.into_iter().map(|foot| foot.results.summary).collect() };
        print(&summaries, style, &written).map_err(Error::Print)
    }
}

/// Recording while its feet are estimated.
struct RecordingRun<'a> {
    resolved: &'a Resolved,
    file: &'a str,
    format: Format,
    requested: RequestedResults,
    bars: &'a Bars,
    body: Body,
}

/// Foot of a recording before it is estimated.
struct StoredFoot {
    /// Names of the foot in the recording.
    names: Vec<String>,
    stored: Stored,
}

/// Foot with its estimates.
struct ReplayedFoot {
    /// Names of the foot in the recording.
    names: Vec<String>,
    /// Its recognised properties, in one line.
    recognised: String,
    results: Replayed,
    /// Picture of the foot, if drawn.
    picture: Option<Picture>,
    /// The foot in a copy of its bag, if its contacts go there.
    #[cfg_attr(not(feature = "bags"), expect(dead_code, reason = "only a copy of a bag reads it"))]
    copied: Option<CopiedFoot>,
}

/// Recording with the estimates of all its feet.
struct ReplayedRecording {
    file: String,
    /// Notices about reading the recording.
    notices: Vec<Notice>,
    /// Its format and parameters, and the time that it took.
    details: Vec<String>,
    feet: Vec<ReplayedFoot>,
}

/// Returns the recognised properties of a foot, in one line.
fn recognised(about: &About, summary: &Summary) -> String {
    let gravity = word_of(&GRAVITIES, about.gravity);
    let metrics = summary.metrics.as_ref();
    let labelled = metrics.map_or(0, |metrics| metrics.labelled_samples);
    format!(
        "{}: {} samples, {:.3} s at {} Hz, gravity {gravity}, {labelled} with a label",
        summary.recording,
        about.samples,
        about.duration_s(),
        about.sample_rate,
    )
}

/// Observer of the estimation of a foot: progress bar, picture and events.
struct FootObserver {
    bar: ProgressBar,
    /// Picture of the foot, if drawn.
    picture: Option<Picture>,
    /// Events of the foot, if they go into a copy of the bag.
    events: Option<Vec<ContactEvent>>,
}

impl Observer for FootObserver {
    fn estimated(&mut self) {
        self.bar.inc(1);
    }

    fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        if let Some(picture) = &mut self.picture {
            picture.add(sample, estimate);
        }
    }

    fn add_event(&mut self, event: &ContactEvent) {
        if let Some(events) = &mut self.events {
            events.push(*event);
        }
        if let Some(picture) = &mut self.picture {
            picture.add_event(event);
        }
    }
}

/// Writes the table of the events of all feet, with these names in its rows.
fn write_events(feet: &mut [ReplayedFoot], names: RowNames, to: &mut dyn Write) -> io::Result<()> {
    names.write_header(HEADER, to)?;
    let mut parts = feet.iter_mut().filter_map(|foot| foot.results.events.as_mut());
    parts.try_for_each(|part| part.write(to))
}
