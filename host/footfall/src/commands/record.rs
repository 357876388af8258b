//! `footfall record`: records streaming feet as MCAP for ROS 2.

use std::path::{Path, PathBuf};

use clap::Args;

use super::options::{ListenArguments, OUTPUT, OverwriteArguments, PublishedArguments};
use crate::error::Error;
use crate::files::{self, Target};
use crate::stream::parse_duration;
#[cfg(feature = "bags")]
use {
    crate::Source,
    crate::files::{Existing, OutputError},
    crate::interruption::finish_when_interrupted,
    crate::messages::{aside, warn},
    crate::report::print_text,
    crate::ros::{McapFile, Published},
    crate::stream::{NothingHeard, SameName, Sink, Stream, deadline, unless_ended},
    feet::source::Speed,
    mcap::write::NoSeek,
    std::fmt::Write as _,
    std::fs::{self, File},
    std::io::{self, IsTerminal as _},
};

/// Arguments of `footfall record`.
#[derive(Debug, Args)]
pub struct RecordArguments {
    /// Feet that stream, and their source.
    #[command(flatten)]
    pub listen: ListenArguments,
    /// Frames, and messages of other programs.
    #[command(flatten)]
    pub published: PublishedArguments,
    /// File to write. Even if the recording is killed, the file lacks only the last second
    #[arg(long, short, value_name = "OUT.mcap", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Whether existing files are replaced.
    #[command(flatten)]
    pub overwrite: OverwriteArguments,
    /// Stop after this time, or on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = parse_duration)]
    pub seconds: Option<f64>,
}

impl RecordArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let path = self.output.as_path();
        let files = self.listen.sources.iter().filter_map(|source| source.file());
        let files: Vec<PathBuf> = files.map(Path::to_owned).collect();
        files::check(&files, &[Target::Bag(path)], self.overwrite.existing())?;
        #[cfg(feature = "bags")]
        self.record()?;
        Ok(())
    }

    /// Records until the feet, the time or the user ends it.
    #[cfg(feature = "bags")]
    fn record(self) -> Result<(), Error> {
        let path = self.output.as_path();
        finish_when_interrupted();
        let (sources, feet) = self.listen.sources_and_feet()?;
        // A file is read at full speed. If a time is given, as many seconds of data are recorded instead. Simulated feet
        // walk without end, so they are recorded in real time like others.
        let is_file = |source: &Source| source.file().is_some() && self.seconds.is_none();
        let sources = sources
            .into_iter()
            .map(|source| if is_file(&source) { source.at_speed(Speed::Max) } else { source });
        let sources = sources.collect();
        // An unreadable source must not replace an existing file.
        let mut stream = Stream::open(sources, feet, self.published.bridge()?)?;
        let mut recording = McapRecording::create(path, self.overwrite.existing())?;
        let end = deadline(stream.clock(), self.seconds);
        let ended = match stream.run(end, &mut recording) {
            // The messages before the error are kept.
            Err(error) if error.is::<SameName>() => Err(error),
            ended => unless_ended(ended?),
        };
        stream.report();
        if recording.is_empty() {
            recording.remove()?;
            ended?;
            return Err(NothingHeard.into());
        }
        let is_in_place = recording.is_in_place;
        let report = recording.finish()?;
        if is_in_place {
            // The pipe may be standard output.
            aside(report.trim_end());
        } else {
            print_text(&report).map_err(Error::Print)?;
        }
        ended
    }
}

/// A recording in progress.
#[cfg(feature = "bags")]
struct McapRecording {
    path: PathBuf,
    file: RecordingFile,
    /// Whether there was no file of this name before.
    is_new: bool,
    /// Whether the output is a pipe or a device, which is written in place.
    is_in_place: bool,
}

/// File of a recording.
#[cfg(feature = "bags")]
enum RecordingFile {
    /// The file has no message yet. A file that is to be replaced still has its old content.
    Opened(File),
    Begun(Box<McapFile<NoSeek<File>>>),
    /// The file could not be begun.
    Failed,
}

#[cfg(feature = "bags")]
impl McapRecording {
    /// Creates a recording without messages.
    ///
    /// # Errors
    /// The file cannot be written, exists by now and is kept, or is a terminal.
    fn create(path: &Path, existing: Existing) -> Result<Self, OutputError> {
        let is_new = !path.exists();
        let is_in_place = !is_new && !path.is_file();
        let replaces = is_in_place || existing == Existing::Replaced;
        let mut options = File::options();
        options.write(true).create_new(!replaces);
        // The old content is kept until something is received.
        let options = options.create(replaces).truncate(false);
        let file = options.open(path).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => OutputError::Exists(path.display().to_string()),
            _ => OutputError::unwritable(path)(source),
        })?;
        if file.is_terminal() {
            return Err(OutputError::Terminal(path.display().to_string()));
        }
        Ok(Self { path: path.to_owned(), file: RecordingFile::Opened(file), is_new, is_in_place })
    }

    /// Returns whether no message was recorded.
    const fn is_empty(&self) -> bool {
        !matches!(self.file, RecordingFile::Begun(_))
    }

    /// Removes the file if it was created by this command. A file that existed before is kept unchanged.
    ///
    /// # Errors
    /// It cannot be removed.
    fn remove(self) -> Result<(), OutputError> {
        drop(self.file);
        if self.is_new {
            fs::remove_file(&self.path).map_err(OutputError::unwritable(&self.path))?;
        }
        Ok(())
    }

    /// Appends a message. The first one replaces the old content of the file.
    fn write(&mut self, published: &Published) -> io::Result<()> {
        let file = std::mem::replace(&mut self.file, RecordingFile::Failed);
        self.file = match file {
            RecordingFile::Opened(file) => {
                // A device has no length.
                if file.metadata()?.is_file() {
                    file.set_len(0)?;
                }
                RecordingFile::Begun(Box::new(McapFile::new(NoSeek::new(file))?))
            }
            file => file,
        };
        match &mut self.file {
            RecordingFile::Begun(file) => file.write(published),
            _ => Ok(()),
        }
    }

    /// Writes pending messages and returns the message counts by topic and the name of the file.
    ///
    /// # Errors
    /// The file cannot be written.
    fn finish(self) -> Result<String, OutputError> {
        let mut text = String::new();
        let RecordingFile::Begun(file) = self.file else {
            return Ok(text);
        };
        let counts = file.counts();
        let has = |topic: &str| counts.iter().any(|(other, _)| **other == *topic);
        for topic in counts.keys() {
            if let Some(foot) = topic.strip_suffix("/contact")
                && !has(&format!("{foot}/imu"))
            {
                warn(format!(
                    "{foot}/imu is not in the recording: the foot sent no samples. On a serial line they come with footfall foot SOURCE set uart_streams.raw_sample=1"
                ));
            }
        }
        for (topic, count) in &counts {
            // Writing to memory does not fail.
            let _ = writeln!(text, "{count:>9} {topic}");
        }
        let _ = writeln!(text, "wrote {}", self.path.display());
        file.finish().map_err(OutputError::unwritable(&self.path))?;
        Ok(text)
    }
}

#[cfg(feature = "bags")]
impl Sink for McapRecording {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        let written = self.write(&published);
        Ok(written.map_err(OutputError::unwritable(&self.path))?)
    }

    fn idle(&mut self) -> Result<(), Error> {
        if let RecordingFile::Begun(file) = &mut self.file {
            file.flush().map_err(OutputError::unwritable(&self.path))?;
        }
        Ok(())
    }
}
