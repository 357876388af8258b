//! Replay of a stream: the row of a sample is printed as soon as the sample has arrived on standard input.
//!
//! The sample rate is given by `--sample-rate`, or found from the times in the first second. In the latter case the rows
//! of that second are printed together at its end. Samples are checked as they arrive, so that a finding is reported long
//! before the stream ends. A file that is redirected to standard input is read as a whole.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::Path;

use estimator_core::any::AnyParams;
use estimator_core::mounting::Mounting;
use estimator_core::{Gravity, Timestamp};
use options::{ContactUse, Correction, InputOptions};
use plausible::{Check, Finding};
use recordings::Opened;
use samples::estimate::Estimator;
use samples::{RecordedSample, steady_time};
use stored::StreamedSample;
use stored::error::{InputError, Place, Problem};
use stored::rate::TimesSoFar;
use tables::output::{HEADER, RowNames, write_row};

use super::{Output, Replay};
use crate::commands::options::with_mounting;
use crate::error::Error;
use crate::files::{OutputError, STANDARD, open_recording, unless_closed};
use crate::messages::warn;
use crate::words::in_words;

/// Span of times in which the rate is found, µs.
const FIRST_US: u64 = 1_000_000;

/// Smallest number of samples in which the rate is found.
const LEAST_SAMPLES: usize = 10;

/// Times at which the samples are checked, and the period after the last of them, µs.
const CHECKED_US: [u64; 3] = [5_000_000, 15_000_000, 45_000_000];
const CHECKED_EACH_US: u64 = 60_000_000;

impl Replay {
    /// Replays standard input as a stream, if it is one and nothing is wanted but a table of the estimates on standard
    /// output. Returns whether it has.
    ///
    /// # Errors
    /// The input cannot be read, a parameter is out of range, or standard output cannot be written.
    pub(super) fn stream(&self) -> Result<bool, Error> {
        let arguments = &self.arguments;
        let is_to_stdout =
            matches!(&self.output, Some(Output::Table(path)) if path == Path::new(STANDARD));
        let [input] = &arguments.inputs[..] else { return Ok(false) };
        if input != Path::new(STANDARD)
            || !is_to_stdout
            || arguments.events.is_some()
            || arguments.plot.is_some()
            || !is_pipe()
        {
            return Ok(false);
        }
        let reading = &arguments.recording.reading;
        let opened = open_recording(input, reading.format, &self.bars)?;
        let input_options = reading.input_options(&self.resolved, ContactUse::Ignored);
        // Settings of single feet need the names of all feet, which only a whole recording shows.
        let has_feet =
            !self.resolved.overrides.feet.is_empty() || !input_options.foot_corrections.is_empty();
        if has_feet || !opened.can_stream(&input_options) {
            let recordings = vec![self.opened(input, opened)?];
            self.check_names(&recordings)?;
            let feet = self.report(recordings)?;
            return self.write(feet).map(|()| true);
        }
        self.stream_rows(opened, &input_options)?;
        Ok(true)
    }

    fn stream_rows(&self, opened: Opened, input_options: &InputOptions) -> Result<(), Error> {
        let file = STANDARD;
        let params = self.resolved.params(opened.format());
        let origins = self.resolved.origins(file);
        origins.check_effects(&params)?;
        let gravity = input_options.gravity.unwrap_or(Gravity::Included);
        let mut rows = RowStream {
            replay: self,
            params,
            gravity,
            correction: input_options.correction,
            given_rate: input_options.sample_rate,
            times: TimesSoFar::default(),
            held: Vec::new(),
            running: None,
            count: 0,
            start_us: 0,
            failed: None,
        };
        let written = rows.write_header();
        written.map_err(OutputError::unwritable(Path::new(STANDARD)))?;
        let notices = opened.stream(input_options, &mut |streamed| rows.take(streamed));
        let notices = match (notices, rows.failed.take()) {
            // The reader of the output, such as `head`, has closed it, the span has ended, or a parameter is wrong.
            (_, Some(StreamEnd::Closed)) => return Ok(()),
            (_, Some(StreamEnd::Failed(error))) => return Err(*error),
            (notices, None) => notices?,
        };
        rows.finish()?;
        notices.iter().map(in_words).for_each(warn);
        let Some(running) = rows.running else { return Ok(()) };
        let findings = with_mounting(running.check.findings(), &input_options.correction.mounting);
        let reading = &self.arguments.recording.reading;
        let is_new = |finding: &Finding| !running.reported.contains(finding.name());
        // With --strict, findings that were printed as warnings during the stream are still errors.
        let left = findings.into_iter().filter(|finding| reading.strict || is_new(finding));
        reading.report(file, &left.collect::<Vec<_>>())
    }
}

/// Returns whether standard input is a pipe or a terminal, which may be written to while it is read.
fn is_pipe() -> bool {
    let about = std::fs::metadata("/dev/stdin");
    about.is_ok_and(|about| !about.is_file())
}

/// Writer of the rows of a stream.
struct RowStream<'a> {
    replay: &'a Replay,
    params: AnyParams,
    gravity: Gravity,
    correction: Correction,
    given_rate: Option<f32>,
    times: TimesSoFar,
    /// Samples until the rate is known.
    held: Vec<RecordedSample>,
    running: Option<Running>,
    /// Number of samples so far.
    count: usize,
    start_us: i64,
    failed: Option<StreamEnd>,
}

struct Running {
    estimator: Estimator,
    check: Check,
    rate: f32,
    /// Number of checks so far, and the findings that were reported.
    checks: usize,
    reported: BTreeSet<&'static str>,
}

impl Running {
    /// Reports new findings if the samples up to `now` are due to be checked.
    fn check_if_due(&mut self, now: Timestamp, mounting: &Mounting) {
        let last = CHECKED_US.len() - 1;
        let after_last = self.checks.saturating_sub(last) as u64;
        let due_us = CHECKED_US[self.checks.min(last)] + CHECKED_EACH_US * after_last;
        if now.as_micros() < due_us {
            return;
        }
        self.checks += 1;
        for finding in with_mounting(self.check.findings(), mounting) {
            if self.reported.insert(finding.name()) {
                warn(format!("{STANDARD}: {}", in_words(&finding)));
            }
        }
    }
}

/// Reason why a stream ends before its input.
enum StreamEnd {
    /// The reader of the output has closed it.
    Closed,
    Failed(Box<Error>),
}

impl RowStream<'_> {
    fn write_header(&self) -> io::Result<()> {
        let mut to = io::stdout().lock();
        let written = RowNames::Absent.write_header(HEADER, &mut to).and_then(|()| to.flush());
        unless_closed(written)
    }

    /// Processes a sample. An error of the output is kept in `failed`, and ends the stream.
    fn take(&mut self, streamed: StreamedSample) -> Result<(), InputError> {
        self.start_us = streamed.start_us.unwrap_or(0);
        let mut sample = streamed.sample;
        let has_times = streamed.start_us.is_some();
        if has_times {
            let us = i64::try_from(sample.imu.timestamp.as_micros()).unwrap_or(i64::MAX);
            self.times.add(us);
        } else if let Some(rate) = self.given_rate {
            sample.imu.timestamp = steady_time(self.count, rate);
        }
        self.count += 1;
        sample.imu = self.correction.corrected(sample.imu);
        if self.running.is_some() {
            return self.end_if_failed(|rows| rows.write(&[sample]));
        }
        self.held.push(sample);
        // Without times, waiting would not give the rate: `start` reports that it is missing.
        let is_known = self.given_rate.is_some()
            || !has_times
            || self.held.len() >= LEAST_SAMPLES
                && sample.imu.timestamp >= Timestamp::from_micros(FIRST_US);
        if is_known { self.end_if_failed(Self::start) } else { Ok(()) }
    }

    fn end_if_failed(
        &mut self,
        step: impl FnOnce(&mut Self) -> Result<(), StreamEnd>,
    ) -> Result<(), InputError> {
        match step(self) {
            Ok(()) => Ok(()),
            Err(end) => {
                self.failed = Some(end);
                // This error is not shown, because `failed` has the reason.
                let problem = Problem::Unreadable(io::ErrorKind::BrokenPipe.into());
                Err(InputError { file: STANDARD.to_owned(), place: Place::File, problem })
            }
        }
    }

    /// Starts the estimator, and writes the rows of the samples so far.
    fn start(&mut self) -> Result<(), StreamEnd> {
        let failed = |error: Error| StreamEnd::Failed(Box::new(error));
        let rate = self.times.rate(self.given_rate).map_err(|error| failed(error.into()))?;
        let estimator = Estimator::new(rate, self.gravity, &self.params).map_err(|error| {
            failed(self.replay.resolved.origins(STANDARD).explain(&error).into())
        })?;
        let check = Check::new(rate, self.gravity).with_thresholds(self.params.params.load);
        let (checks, reported) = (0, BTreeSet::new());
        self.running = Some(Running { estimator, check, rate, checks, reported });
        let held = std::mem::take(&mut self.held);
        self.write(&held)
    }

    /// Writes the rows of samples, and flushes them so that the reader gets them at once.
    fn write(&mut self, samples: &[RecordedSample]) -> Result<(), StreamEnd> {
        let Some(running) = &mut self.running else { return Ok(()) };
        let span = self.replay.span;
        let mut to = io::stdout().lock();
        let mut text = Vec::new();
        for sample in samples {
            if span.is_before(sample.imu.timestamp) {
                to.write_all(&text).and_then(|()| to.flush()).map_err(output_end)?;
                return Err(StreamEnd::Closed);
            }
            let estimate = running.estimator.update(sample);
            running.check.add(sample);
            running.check_if_due(sample.imu.timestamp, &self.correction.mounting);
            if span.contains(estimate.timestamp) {
                write_row(None, &estimate, self.start_us, &mut text).map_err(output_end)?;
            }
        }
        to.write_all(&text).and_then(|()| to.flush()).map_err(output_end)
    }

    /// Writes the rows of a stream that was shorter than the time in which the rate is found.
    fn finish(&mut self) -> Result<(), Error> {
        if self.running.is_none() {
            match self.start() {
                Ok(()) | Err(StreamEnd::Closed) => {}
                Err(StreamEnd::Failed(error)) => return Err(*error),
            }
        }
        let rate = self.running.as_ref().map(|running| running.rate);
        let preset = self.replay.resolved.preset;
        let notice = rate.and_then(|rate| {
            preset.window_notice(options::Format::Csv, &self.params, STANDARD, rate)
        });
        notice.iter().map(in_words).for_each(warn);
        Ok(())
    }
}

/// Returns the end of a stream whose row cannot be written.
fn output_end(error: io::Error) -> StreamEnd {
    if error.kind() == io::ErrorKind::BrokenPipe {
        return StreamEnd::Closed;
    }
    StreamEnd::Failed(Box::new(OutputError::unwritable(Path::new(STANDARD))(error).into()))
}
