//! A replayed recording: its reading, its notices, and the estimates of its feet.

use std::num::NonZeroUsize;
use std::path::Path;
use std::time::{Duration, Instant};

use ::options::hint::Notice;
use ::options::{ContactUse, Content, Format, without_effect};
use config::{GRAVITIES, word_of};
use estimator_core::ContactEstimate;
use estimator_core::any::AnyParams;
use indicatif::ProgressBar;
use recordings::Opened;
use replay::events::ContactEvent;
use replay::jobs;
use replay::summary::{Estimation, InputReport, ParametersReport, Summary};
use replay::{Layout, Observer, ReplayError, Replayed, RequestedResults, replay};
use samples::RecordedSample;
use stored::{About, Stored};

use super::bag_copy::CopiedFoot;
use super::pictures::Picture;
use super::{Output, Replay};
use crate::commands::options::{RecordingArguments, estimator_options, with_mounting};
use crate::commands::span;
use crate::error::Error;
use crate::files::{self, Drawing, OutputError};
use crate::words::CommandLine;

/// Recording with the estimates of all its feet.
pub(super) struct ReplayedRecording {
    pub(super) file: String,
    /// Notices about reading the recording.
    pub(super) notices: Vec<Notice>,
    /// Format and parameters of the recording, and the time that its estimates took.
    pub(super) details: Vec<String>,
    pub(super) feet: Vec<ReplayedFoot>,
}

/// Foot with its estimates.
pub(super) struct ReplayedFoot {
    /// Names of the foot in the recording.
    pub(super) names: Vec<String>,
    /// Properties of the foot that were recognised, in one line.
    pub(super) recognised: String,
    pub(super) results: Replayed,
    /// Picture of the foot, if drawn.
    pub(super) picture: Option<Picture>,
    /// The foot in a copy of its bag, if its contacts go there.
    #[cfg_attr(not(feature = "bags"), expect(dead_code, reason = "only a copy of a bag reads it"))]
    pub(super) copied: Option<CopiedFoot>,
}

/// File of a recording, apart from its feet.
struct RecordingFile {
    /// The file as given.
    name: String,
    format: Format,
    /// Parameters of a foot without settings of its own.
    params: AnyParams,
}

/// Foot of a recording before it is estimated.
struct StoredFoot {
    /// Names of the foot in the recording.
    names: Vec<String>,
    stored: Stored,
}

impl Replay {
    /// Reads a recording and estimates all its feet.
    pub(super) fn recording(&self, input: &Path) -> Result<ReplayedRecording, Error> {
        let format = self.arguments.recording.reading.format;
        self.opened(input, files::open_recording(input, format, &self.bars)?)
    }

    /// Reads a recording that was opened, and estimates all its feet.
    pub(super) fn opened(&self, input: &Path, opened: Opened) -> Result<ReplayedRecording, Error> {
        let started = Instant::now();
        let (file, feet) = self.read(input, opened)?;
        let read = Instant::now();
        self.resolved.origins(&file.name).check_effects(&file.params)?;
        let notices = self.notices(&file, &feet);
        let feet = self.estimate(&file, feet)?;
        let details = self.details(&file, &feet, read - started, read.elapsed());
        Ok(ReplayedRecording { file: file.name, notices, details, feet })
    }

    /// Reads the feet of a recording.
    fn read(
        &self,
        input: &Path,
        opened: Opened,
    ) -> Result<(RecordingFile, Vec<StoredFoot>), Error> {
        let arguments = &self.arguments;
        let reading = &arguments.recording.reading;
        let format = opened.format();
        if let Some(Output::Copy(copy)) = &self.output
            && format.content() != Content::Messages
        {
            return Err(OutputError::BagsOnly(copy.display().to_string()).into());
        }
        let file = RecordingFile {
            name: input.display().to_string(),
            format,
            params: self.resolved.params(format),
        };
        let contacts = ContactUse::unless_estimated(arguments.estimate_again);
        let feet = opened.store_all(&reading.input_options(&self.resolved, contacts))?;
        span::check_begin(&file.name, arguments.from, &feet)?;
        let shown_name = files::name_among(&arguments.inputs, input);
        let foot = |mut stored: Stored| {
            let names = stored.about.names().into_iter();
            let names = names.map(str::to_owned).collect();
            if let Some(name) = &shown_name {
                stored.about.name.clone_from(name);
            }
            StoredFoot { names, stored }
        };
        Ok((file, feet.into_iter().map(foot).collect()))
    }

    /// Returns the notices about a recording, before it is estimated.
    fn notices(&self, file: &RecordingFile, feet: &[StoredFoot]) -> Vec<Notice> {
        let RecordingArguments { reading, preset, config } = &self.arguments.recording;
        let mut notices = Vec::new();
        if feet.iter().any(|foot| foot.stored.has_estimates()) {
            let (config, window) = (config.as_deref(), self.arguments.window);
            let ineffective = estimator_options(*preset, config, window, &reading.mounting);
            notices.extend(without_effect(&file.name, &ineffective));
        }
        for foot in feet {
            notices.extend(foot.stored.about.notices.iter().cloned());
        }
        for foot in feet.iter().filter(|foot| !foot.stored.has_estimates()) {
            let About { name, sample_rate, .. } = &foot.stored.about;
            notices.extend(preset.window_notice(file.format, &file.params, name, *sample_rate));
        }
        notices
    }

    /// Estimates all feet of a recording.
    fn estimate(
        &self,
        file: &RecordingFile,
        feet: Vec<StoredFoot>,
    ) -> Result<Vec<ReplayedFoot>, Error> {
        let requested = self.requested(feet.len());
        // Several recordings already keep all cores busy.
        let is_only = self.arguments.inputs.len() == 1;
        let jobs = if is_only { self.jobs } else { NonZeroUsize::MIN };
        let estimate = |foot| self.estimate_foot(file, &requested, foot);
        jobs::run(feet.into_iter(), jobs, estimate).into_iter().collect()
    }

    /// Returns the requested results of each foot of a recording with this number of feet.
    fn requested(&self, feet: usize) -> RequestedResults {
        let row_names = self.row_names(feet);
        let table = match &self.output {
            Some(Output::Table(path)) => Some(path),
            Some(Output::Copy(_)) | None => None,
        };
        RequestedResults {
            span: self.span,
            table: table.map(|_| row_names),
            layout: table.map(|path| Layout::of(path)).unwrap_or_default(),
            events: self.arguments.events.as_ref().map(|_| row_names),
        }
    }

    /// Estimates a foot of a recording.
    fn estimate_foot(
        &self,
        file: &RecordingFile,
        requested: &RequestedResults,
        StoredFoot { names, mut stored }: StoredFoot,
    ) -> Result<ReplayedFoot, Error> {
        let mut observer = self.observer(&stored.about);
        let params = {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            self.resolved.params_of(&names, file.format)
        };
        let replayed = replay(&mut stored, &params, requested, &mut observer);
        observer.bar.finish_and_clear();
        let mut results = replayed.map_err(|error| match error {
            ReplayError::Params(error) => self.resolved.origins(&file.name).explain(&error).into(),
            other => Error::from(other),
        })?;
        let about = &stored.about;
        results.findings = with_mounting(results.findings, &about.correction.mounting);
        results.summary.input = Some(InputReport::new(
            &file.name,
            file.format,
            &about.notices,
            about.repairs,
            &results.findings,
            &CommandLine,
        ));
        results.summary.estimation = (!stored.has_estimates()).then(|| Estimation {
            preset: self.arguments.recording.preset.name(),
            parameters: ParametersReport::of(&params, about.sample_rate, about.gravity),
            correction: (&about.correction).into(),
            learnt: results.learnt.into(),
        });
        let recognised = recognised(about, &results.summary);
        let copied = observer.events.map(|events| CopiedFoot {
            file: file.name.clone(),
            name: names.first().cloned().unwrap_or_default(),
            place: names.iter().find_map(|name| self.body.place(name)),
            stored,
            params,
            span: self.span,
            events,
        });
        Ok(ReplayedFoot { names, recognised, results, picture: observer.picture, copied })
    }

    /// Returns the observer of a foot, before its first sample.
    fn observer(&self, about: &About) -> FootObserver {
        let drawing = self.arguments.plot.as_deref().map(Drawing::of);
        FootObserver {
            bar: self.bars.estimating(about.samples as u64),
            picture: drawing.map(|drawing| Picture::new(drawing, about, self.span)),
            events: matches!(self.output, Some(Output::Copy(_))).then(Vec::new),
        }
    }

    /// Returns the format and the parameters of a recording, and the times to read and to estimate it.
    fn details(
        &self,
        file: &RecordingFile,
        feet: &[ReplayedFoot],
        to_read: Duration,
        to_estimate: Duration,
    ) -> Vec<String> {
        let RecordingFile { name, format, params } = file;
        let parameters = if feet.iter().all(|foot| foot.results.summary.estimation.is_none()) {
            "the estimates are recorded contacts".to_owned()
        } else {
            self.arguments.recording.parameters_text(params, *format)
        };
        let [to_read, to_estimate] = [to_read, to_estimate].map(|time| time.as_secs_f64());
        vec![
            format!("{name}: format {}; {parameters}", format.name()),
            format!("{name}: {to_read:.2} s to read, {to_estimate:.2} s to estimate"),
        ]
    }
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
