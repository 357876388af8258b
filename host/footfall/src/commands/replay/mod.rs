//! `footfall replay`: estimates recordings and writes a table, pictures, events and a summary, or a copy of a bag with
//! the contacts of its feet (`bag_copy`).

#[cfg(feature = "bags")]
mod bag_copy;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use clap::Args;
use estimator_core::params::WindowLength;
use estimator_core::{ContactEstimate, Params};
use indicatif::ProgressBar;
use recordings::config::{GRAVITIES, Resolved, parse_seconds, parse_window, word_of};
use recordings::events::{ContactEvent, HEADER};
use recordings::hint::Notice;
use recordings::input::{About, ContactUse, Content, Format, InputOptions, Stored, without_effect};
use recordings::jobs;
use recordings::output::RowNames;
use recordings::replay::{
    Layout, Observer, ReplayError, Replayed, RequestedResults, Span, replay, write_tables,
};
use recordings::samples::RecordedSample;
use recordings::summary::{Estimation, InputReport, ParametersReport, Summaries, Summary};

use super::options::{
    self, ESTIMATOR, INPUT, OUTPUT, OverwriteArguments, RecordingArguments, compat_parser,
    estimator_options, parse_force, with_mounting,
};
use crate::error::{CommandLine, Error, in_words};
use crate::files::{self, Drawing, Existing, OutputError, STANDARD, Target, write_file};
use crate::messages::{detail, warn};
use crate::plot::page::{self, PageFoot};
use crate::plot::{self, RecordingPlot};
use crate::progress::{self, Bars};
use crate::report::{SummaryStyle, print};
use crate::ros::Compat;
use crate::ros::compat::{Body, MixedBodies, WRENCH_FORCE};
#[cfg(feature = "bags")]
use bag_copy::{AllFeetOptions, LowStateSource};

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
    pub copied: CopiedArguments,
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

/// A recording with estimates of all its feet.
struct ReplayedRecording {
    file: String,
    /// Notices about reading the recording.
    notices: Vec<Notice>,
    /// Details of the recognised format.
    details: Vec<String>,
    /// Names of each foot in the recording.
    names: Vec<Vec<String>>,
    /// Feet whose contacts go into a copy of the bag.
    copied: Vec<CopiedFoot>,
    feet: Vec<ReplayedFoot>,
}

/// A recording while its feet are estimated.
struct RecordingRun<'a> {
    resolved: &'a Resolved,
    file: &'a str,
    format: Format,
    requested: RequestedResults,
    bars: &'a Bars,
}

/// Messages of all feet in a copy of a bag.
#[derive(Clone, Debug, Default, Args)]
pub struct CopiedArguments {
    /// In a copy of a bag, also write the decisions of all feet in messages of other programs, separated by
    /// commas
    #[arg(long, value_name = "WHOSE,...", value_delimiter = ',', value_parser = compat_parser(), help_heading = OUTPUT)]
    pub compat: Vec<Compat>,
    /// Force of a foot that stands, N, in messages of --compat wrench
    #[arg(long, value_name = "NEWTONS", default_value_t = WRENCH_FORCE, value_parser = parse_force, help_heading = OUTPUT)]
    pub wrench_force: f64,
    /// In a copy of a bag, repeat the messages of a Unitree robot on this topic as /footfall/lowstate, with a
    /// `foot_force` of 100 for each standing foot and 0 for the others
    #[arg(long, value_name = "TOPIC", help_heading = OUTPUT)]
    pub lowstate: Option<String>,
    /// Factor of the loads that are the forces instead of decisions.
    #[arg(
        long,
        value_name = "FACTOR",
        requires = "lowstate",
        allow_negative_numbers = true,
        value_parser = parse_scale,
        help = "With --lowstate, write the loads times this factor, rounded, as forces",
        help_heading = OUTPUT
    )]
    pub lowstate_scale: Option<f64>,
}

/// A foot with its estimates.
struct ReplayedFoot {
    results: Replayed,
    /// Picture of the foot, if drawn.
    picture: Option<Picture>,
}

/// A foot whose contacts go into a copy of its bag.
#[cfg_attr(not(feature = "bags"), expect(dead_code, reason = "only a copy of a bag reads it"))]
struct CopiedFoot {
    /// Bag of the foot.
    file: String,
    /// Name of the foot, in the topics of its contacts.
    name: String,
    /// Its place in messages of all feet, if its names have one.
    place: Option<usize>,
    /// Its samples.
    stored: Stored,
    /// Parameters of its estimate.
    params: Params,
    /// Part of the recording whose contacts are written.
    span: Span,
    /// Events in that part.
    events: Vec<ContactEvent>,
}

impl ReplayArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let span = options::span(self.from, self.to)?;
        let resolved = self.recording.resolved(self.window)?;
        files::check_inputs(&self.inputs)?;
        self.check_targets()?;
        let jobs = self.jobs.unwrap_or_else(jobs::all_cores);
        let bars = Bars::default();
        let replayed = jobs::run(&self.inputs, jobs, |input| {
            self.estimate_recording(&resolved, input, span, jobs, &bars)
        });
        let replayed: Vec<ReplayedRecording> = replayed.into_iter().collect::<Result<_, _>>()?;
        let names = replayed.iter().flat_map(|recording| recording.names.iter().flatten());
        let names: Vec<&str> = names.map(String::as_str).collect();
        resolved.check_axes(&names)?;
        resolved.unused_feet(&names).into_iter().for_each(warn);
        let mut feet = Vec::new();
        let mut copied = Vec::new();
        for recording in replayed {
            copied.extend(recording.copied);
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
        let pictures = self.plot.as_deref().map(|path| picture_paths(path, &feet));
        let pictures = pictures.unwrap_or_default();
        pictures.iter().try_for_each(|path| self.overwrite.existing().check(path))?;
        #[cfg(feature = "bags")]
        if let Some(bag) = self.bag() {
            let to = (bag, self.overwrite.existing());
            self.copied.copy(&self.inputs, to, &mut copied, self.estimate_again)?;
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
        self.copied.check(self.bag())?;
        if let Some(bag) = self.bag() {
            let file = bag.display().to_string();
            let folder = bag.parent().filter(|folder| *folder != Path::new(""));
            let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok();
            for input in &self.inputs {
                let is_pipe = input.exists() && !input.is_file() && !input.is_dir();
                if is_pipe || input == Path::new(STANDARD) {
                    return Err(OutputError::ReadTwice(file));
                }
                if let (Some(folder), Ok(input)) = (&folder, input.canonicalize())
                    && input.is_dir()
                    && folder.starts_with(&input)
                {
                    return Err(OutputError::OverInput(file));
                }
            }
        }
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
        let opened = progress::open(input, self.recording.reading.format, bars)?;
        let format = opened.format();
        if let Some(bag) = self.bag()
            && format.content() != Content::Messages
        {
            let file = bag.display().to_string();
            return Err(OutputError::BagsOnly(file).into());
        }
        let file = input.display().to_string();
        let input_options = InputOptions {
            contacts: ContactUse::unless_estimated(self.estimate_again),
            ..self.recording.reading.input_options(resolved)
        };
        let mut stored = opened.store_all(&input_options)?;
        let names_of = |stored: &Stored| {
            let names = stored.about.names().into_iter();
            names.map(str::to_owned).collect()
        };
        let names: Vec<Vec<String>> = stored.iter().map(names_of).collect();
        options::check_begin(&file, self.from, &stored)?;
        if let Some(name) = files::name_among(&self.inputs, input) {
            for foot in &mut stored {
                foot.about.name.clone_from(&name);
            }
        }
        let read = Instant::now();
        let params = resolved.params(format);
        resolved.origins(&file).check_effects(&params)?;
        let notices = self.notices(&file, format, &params, &stored);
        let has_recorded_contacts_only = stored.iter().all(Stored::has_estimates);
        let run = RecordingRun {
            resolved,
            file: &file,
            format,
            requested: self.requested(span, stored.len()),
            bars,
        };
        // Each foot is estimated once, on any thread.
        let stored = stored.into_iter().map(Mutex::new);
        let stored: Vec<_> = names.iter().zip(stored).collect();
        // Several recordings already keep all cores busy.
        let jobs = if self.inputs.len() == 1 { jobs } else { NonZeroUsize::MIN };
        let replayed = jobs::run(&stored, jobs, |(names, stored)| {
            let mut stored = stored.lock().unwrap_or_else(PoisonError::into_inner);
            self.estimate_foot(&run, names, &mut stored)
        });
        let body = Body::of(&self.copied.compat)?;
        let (mut feet, mut copied, mut details) = (Vec::new(), Vec::new(), Vec::new());
        for ((names, stored), replayed) in stored.into_iter().zip(replayed) {
            let (foot, events) = replayed?;
            let stored = stored.into_inner().unwrap_or_else(PoisonError::into_inner);
            details.push(recognised(&stored.about, &foot.results.summary));
            copied.extend(events.map(|events| CopiedFoot {
                file: file.clone(),
                name: names.first().cloned().unwrap_or_default(),
                place: names.iter().find_map(|name| body.place(name)),
                stored,
                params: params_of(resolved, names, format),
                span,
                events,
            }));
            feet.push(foot);
        }
        let parameters = if has_recorded_contacts_only {
            "the estimates are recorded contacts".to_owned()
        } else {
            self.recording.parameters_text(&params, format)
        };
        details.push(format!("{file}: format {}; {parameters}", format.name()));
        details.push(format!(
            "{file}: {:.2} s to read, {:.2} s to estimate",
            (read - started).as_secs_f64(),
            read.elapsed().as_secs_f64()
        ));
        Ok(ReplayedRecording { feet, names, copied, file, notices, details })
    }

    /// Returns the notices about a recording, before it is estimated.
    fn notices(
        &self,
        file: &str,
        format: Format,
        params: &Params,
        stored: &[Stored],
    ) -> Vec<Notice> {
        let preset = self.recording.preset;
        let mut notices = Vec::new();
        if stored.iter().any(Stored::has_estimates) {
            let RecordingArguments { config, reading, .. } = &self.recording;
            let config = config.as_deref();
            let ineffective = estimator_options(preset, config, self.window, &reading.mounting);
            notices.extend(without_effect(file, &ineffective));
        }
        for Stored { about, .. } in stored {
            notices.extend(about.notices.iter().cloned());
        }
        for stored in stored.iter().filter(|stored| !stored.has_estimates()) {
            let about = &stored.about;
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

    /// Estimates a foot of a recording; returns its events as well if they go into a copy of the bag.
    fn estimate_foot(
        &self,
        run: &RecordingRun<'_>,
        names: &[String],
        stored: &mut Stored,
    ) -> Result<(ReplayedFoot, Option<Vec<ContactEvent>>), Error> {
        let RecordingRun { resolved, file, format, requested, bars } = run;
        let drawing = self.plot.as_deref().map(Drawing::of);
        let mut observer = FootObserver {
            bar: bars.estimating(stored.about.samples as u64),
            picture: drawing.map(|drawing| Picture::new(drawing, stored, requested.span)),
            events: self.bag().map(|_| Vec::new()),
        };
        let params = params_of(resolved, names, *format);
        let replayed = replay(stored, &params, requested, &mut observer);
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
        Ok((ReplayedFoot { results, picture: observer.picture }, observer.events))
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
            write_events((path, existing), &mut feet, names)?;
            written.push(path.clone());
        }
        write_pictures(pictures, existing, &mut feet)?;
        written.extend_from_slice(pictures);
        let style =
            if self.fills_stdout() { SummaryStyle::Silent } else { SummaryStyle::of(self.json) };
        let summaries =
            Summaries { recordings: feet.into_iter().map(|foot| foot.results.summary).collect() };
        print(&summaries, style, &written).map_err(Error::Print)
    }
}

/// Returns the parameters of the foot with these names.
fn params_of(resolved: &Resolved, names: &[String], format: Format) -> Params {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    resolved.params_of(&names, format)
}

/// Returns whether the file is a bag by its name.
fn is_bag(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
}

/// Returns the recognised properties of a recording.
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

impl CopiedArguments {
    /// Checks that the options apply: there is a copy, or none of them is given.
    fn check(&self, bag: Option<&Path>) -> Result<(), OutputError> {
        let option = match (&self.compat[..], &self.lowstate) {
            ([], None) => return Ok(()),
            (_, Some(_)) => "--lowstate",
            (_, None) => "--compat",
        };
        if bag.is_none() {
            return Err(OutputError::NoCopy(option));
        }
        let body = Body::of(&self.compat)?;
        match &self.lowstate {
            Some(_) if body == Body::Biped => Err(MixedBodies("--lowstate"))?,
            Some(_) if self.compat.contains(&Compat::Unitree) => {
                return Err(OutputError::LowStateTwice);
            }
            _ => {}
        }
        Ok(())
    }

    /// Copies the bags `inputs` with the contacts and events of their feet.
    ///
    /// # Errors
    /// Two bags have the same foot, or the copy cannot be written.
    #[cfg(feature = "bags")]
    fn copy(
        &self,
        inputs: &[PathBuf],
        to: (&Path, Existing),
        feet: &mut [CopiedFoot],
        again: bool,
    ) -> Result<(), Error> {
        let options = AllFeetOptions {
            compats: self.compat.clone(),
            wrench_force: self.wrench_force,
            low_states: self
                .lowstate
                .clone()
                .map(|topic| LowStateSource { topic, scale: self.lowstate_scale }),
        };
        // Parts that end early were reported when the samples were read.
        bag_copy::write(inputs, feet, &options, again, to)?;
        Ok(())
    }
}

/// Parses a factor of loads.
fn parse_scale(text: &str) -> Result<f64, &'static str> {
    let scale = text.parse().ok();
    scale
        .filter(|scale: &f64| scale.is_finite() && *scale != 0.0)
        .ok_or("write a number other than 0")
}

/// Picture of a foot.
enum Picture {
    /// A figure of its own.
    Figure(RecordingPlot),
    /// Its part of a page.
    Page(PageFoot),
}

impl Picture {
    /// Creates the picture for the part `span` of a foot, without samples.
    fn new(drawing: Drawing, stored: &Stored, span: Span) -> Self {
        let name = stored.about.title();
        let about = &stored.about;
        let (from_s, to_s) = span.within(about.duration_us);
        let span = plot::span(from_s, to_s - from_s, about.sample_rate);
        match drawing {
            Drawing::Page => Self::Page(PageFoot::new(&name, about, span)),
            Drawing::Svg => {
                let (start_us, load) = (about.start_us, &about.load_title);
                Self::Figure(RecordingPlot::new(&name, start_us, load, span))
            }
        }
    }
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
        match &mut self.picture {
            Some(Picture::Figure(figure)) => figure.add(sample, estimate),
            Some(Picture::Page(page)) => page.add(sample, estimate),
            None => {}
        }
    }

    fn add_event(&mut self, event: &ContactEvent) {
        if let Some(events) = &mut self.events {
            events.push(*event);
        }
        match &mut self.picture {
            Some(Picture::Figure(figure)) => figure.add_event(event),
            Some(Picture::Page(page)) => page.add_event(event),
            None => {}
        }
    }
}

/// Writes the table of the events of all feet, with these names in its rows.
fn write_events(
    (path, existing): (&Path, Existing),
    feet: &mut [ReplayedFoot],
    names: RowNames,
) -> Result<(), OutputError> {
    write_file(path, existing, |to| {
        names.write_header(HEADER, to)?;
        let mut parts = feet.iter_mut().filter_map(|foot| foot.results.events.as_mut());
        parts.try_for_each(|part| part.write(to))
    })
}

/// Returns the paths of the pictures: one page of all feet, or a figure for each.
fn picture_paths(path: &Path, feet: &[ReplayedFoot]) -> Vec<PathBuf> {
    if feet.len() == 1 || Drawing::of(path) == Drawing::Page {
        return vec![path.to_owned()];
    }
    let mut paths = Vec::new();
    for foot in feet {
        let path = files::path_of_foot(path, &foot.results.summary.recording);
        // Foot names may differ only in characters that file names cannot hold.
        paths.push(files::unused_path(path, &paths));
    }
    paths
}

/// Writes the page of all feet, or the figure of each, to these paths.
fn write_pictures(
    paths: &[PathBuf],
    existing: Existing,
    feet: &mut [ReplayedFoot],
) -> Result<(), OutputError> {
    let mut page = Vec::new();
    let mut figures = Vec::new();
    for picture in feet.iter_mut().filter_map(|foot| foot.picture.take()) {
        match picture {
            Picture::Page(foot) => page.push(foot),
            Picture::Figure(figure) => figures.push(figure),
        }
    }
    for (path, figure) in paths.iter().zip(figures) {
        write_file(path, existing, |to| to.write_all(figure.svg()?.as_bytes()))?;
    }
    match paths {
        [path] if !page.is_empty() => write_file(path, existing, |to| page::write(page, to)),
        _ => Ok(()),
    }
}
