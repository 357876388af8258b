//! Recording of foot messages as MCAP, for `footfall record`.

use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use crate::ros::{McapFile, Published};
use mcap::McapError;

use crate::error::Error;
use crate::files::OutputError;
use crate::messages::warn;
use crate::stream::Sink;

/// A recording in progress.
pub struct McapRecording {
    path: PathBuf,
    file: McapFile<File>,
}

impl McapRecording {
    /// Creates a recording without messages, which `replaces` a file of its name or fails.
    ///
    /// # Errors
    /// The file cannot be written, or already exists and is kept.
    pub fn create(path: &Path, replaces: bool) -> Result<Self, OutputError> {
        let mut options = File::options();
        options.write(true).create_new(!replaces);
        let options = options.create(replaces).truncate(replaces);
        let file = options.open(path).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => OutputError::Exists(path.display().to_string()),
            _ => OutputError::unwritable(path)(source),
        })?;
        let file = McapFile::new(file).map_err(unwritable(path))?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Writes pending messages and returns the message counts by topic and the name of the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<String, OutputError> {
        let mut text = String::new();
        let counts = self.file.counts();
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
        self.file.finish().map_err(unwritable(&self.path))?;
        Ok(text)
    }
}

impl Sink for McapRecording {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        let written = self.file.write(&published);
        Ok(written.map_err(unwritable(&self.path))?)
    }

    fn idle(&mut self) -> Result<(), Error> {
        Ok(self.file.flush().map_err(unwritable(&self.path))?)
    }
}

fn unwritable(path: &Path) -> impl FnOnce(McapError) -> OutputError {
    |error| OutputError::unwritable(path)(io_error(error))
}

/// Converts an error of the MCAP writer to an I/O error, keeping one of the operating system.
pub fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}
