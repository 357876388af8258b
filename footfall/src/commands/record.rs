//! `footfall record`: feet that stream, as MCAP for ROS 2.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use decode::Feet;
use decode::live::Listener;
use live::feed::Fed;
use live::link::pace::Speed;
use live::{Arrival, Feed, LinkError, Source};
use mcap::McapError;
use ros::{Bridge, McapFile};

use super::monitor::SOURCES;
use crate::error::Error;
use crate::files::{OutputError, finish_when_interrupted, is_interrupted};
use crate::messages::warn;
use crate::report::print_text;
use crate::targets::{self, Target};

/// How long to wait for an arrival before what is there is written.
const QUIET: Duration = Duration::from_millis(200);

/// What `footfall record` takes.
#[derive(Debug, Args)]
pub struct RecordArguments {
    /// Where the feet stream from.
    #[arg(help = SOURCES)]
    pub source: Source,
    /// Where they are recorded. Whatever ends the recording, what came a second before is in it
    #[arg(long, short, value_name = "OUT.mcap")]
    pub output: PathBuf,
    /// Stop after this time; Ctrl-C stops it, too
    #[arg(long, value_name = "SECONDS", value_parser = analysis::config::parse_seconds)]
    pub seconds: Option<f64>,
    /// Replace a file of this name
    #[arg(long)]
    pub overwrite: bool,
}

/// A recording that is being made.
struct Recording<'a> {
    path: &'a Path,
    file: McapFile<File>,
    listener: Listener,
    bridge: Bridge,
    unreadable: u64,
}

impl RecordArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let path = self.output.as_path();
        targets::check(&[], &[Target::Bag(path)])?;
        let mut options = File::options();
        options.write(true).create_new(!self.overwrite);
        let options = options.create(self.overwrite).truncate(self.overwrite);
        let file = options.open(path).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => OutputError::Exists {
                file: path.display().to_string(),
            },
            _ => unwritable(path, source),
        })?;
        let mut recording = Recording {
            path,
            file: McapFile::new(file).map_err(|error| unwritable(path, io_error(error)))?,
            listener: Listener::new(Feet::default()),
            bridge: Bridge::default(),
            unreadable: 0,
        };
        finish_when_interrupted();
        let end = self.seconds.map(Duration::from_secs_f64);
        let end = end.and_then(|time| Instant::now().checked_add(time));
        // What is played need not be waited for.
        let feed = Feed::open(self.source.at_speed(Speed::Max));
        let mut ended = None;
        while !is_interrupted() && end.is_none_or(|end| Instant::now() < end) {
            match feed.next(QUIET) {
                Some(Fed::Arrived((at, arrival))) => recording.take(at, arrival)?,
                Some(Fed::WaitsFor(error)) => warn(format!("{error}; waiting for it")),
                Some(Fed::NotSent(error)) => warn(error),
                Some(Fed::Opened) => {}
                Some(Fed::Ended(error)) => {
                    ended = Some(error);
                    break;
                }
                None => recording.idle()?,
            }
        }
        let lost = feed.lost();
        recording.finish(lost)?;
        match ended {
            None | Some(LinkError::Ended(_)) => Ok(()),
            Some(error) => Err(error.into()),
        }
    }
}

impl Recording<'_> {
    fn take(&mut self, at: estimator_core::Timestamp, arrival: Arrival) -> Result<(), Error> {
        match arrival {
            Arrival::Frame { interface, frame } => self.listener.frame(&interface, &frame, at),
            Arrival::Bytes { port, bytes } => self.listener.bytes(&port, &bytes, at),
            Arrival::Estimate(row) => self.listener.row(row, at),
            Arrival::Unreadable(_) => self.unreadable += 1,
        }
        self.write()
    }

    /// Nothing has come for a while.
    fn idle(&mut self) -> Result<(), Error> {
        self.listener.idle(live::link::now());
        self.write()?;
        let flushed = self.file.flush();
        Ok(flushed.map_err(|error| unwritable(self.path, io_error(error)))?)
    }

    fn write(&mut self) -> Result<(), Error> {
        while let Some(heard) = self.listener.next_heard() {
            let name = self.listener.name(&heard.foot);
            for published in self.bridge.messages(&heard, name.as_deref()) {
                let written = self.file.write(&published);
                written.map_err(|error| unwritable(self.path, io_error(error)))?;
            }
        }
        Ok(())
    }

    /// Writes what is left, and says what there is and what was lost.
    fn finish(mut self, lost: u64) -> Result<(), Error> {
        self.listener.finish();
        self.write()?;
        let counts = self.file.counts();
        let mut text = Vec::new();
        for (topic, count) in &counts {
            // Writing to memory does not fail.
            let _ = writeln!(text, "{count:>9} {topic}");
        }
        let _ = writeln!(text, "wrote {}", self.path.display());
        let reports = self.listener.reports();
        let missing: u64 = reports.iter().map(|(_, report)| report.missing).sum();
        let problems = reports.iter().flat_map(|(_, report)| &report.problems);
        let problems: Vec<_> = problems
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        if counts.is_empty() {
            warn("no foot was heard");
        }
        if missing > 0 {
            warn(format!("{missing} frames are missing, by their numbers"));
        }
        if !problems.is_empty() || self.unreadable > 0 {
            let lines = format!("{} lines unreadable", self.unreadable);
            warn(format!("{lines}; {}", problems.join(", ")));
        }
        if lost > 0 {
            warn(format!(
                "{lost} arrivals were lost: this machine did not keep up"
            ));
        }
        let path = self.path;
        let finished = self.file.finish();
        finished.map_err(|error| unwritable(path, io_error(error)))?;
        print_text(&String::from_utf8_lossy(&text)).map_err(Error::Print)
    }
}

fn unwritable(path: &Path, source: io::Error) -> OutputError {
    OutputError::Unwritable {
        file: path.display().to_string(),
        source,
    }
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}
