//! A recording, where this program writes MCAP.

use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use mcap::McapError;
use ros::{McapFile, Published};

use super::Existing;
use crate::error::Error;
use crate::files::OutputError;
use crate::stream::Sink;

/// A recording that is being made.
pub struct McapRecording {
    path: PathBuf,
    file: McapFile<File>,
}

impl McapRecording {
    /// A recording without messages.
    ///
    /// # Errors
    /// The file cannot be written, or is there already.
    pub fn create(path: &Path, existing: Existing) -> Result<Self, OutputError> {
        let replaces = existing == Existing::Replaced;
        let mut options = File::options();
        options.write(true).create_new(!replaces);
        let options = options.create(replaces).truncate(replaces);
        let file = options.open(path).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => OutputError::Exists {
                file: path.display().to_string(),
            },
            _ => unwritable(path, source),
        })?;
        let file = McapFile::new(file).map_err(|error| unwritable(path, io_error(error)))?;
        Ok(Self {
            path: path.to_owned(),
            file,
        })
    }

    /// Its name.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes what is left; what there is, a line for each topic, and the name of the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<String, OutputError> {
        let mut text = String::new();
        for (topic, count) in &self.file.counts() {
            // Writing to memory does not fail.
            let _ = writeln!(text, "{count:>9} {topic}");
        }
        let _ = writeln!(text, "wrote {}", self.path.display());
        let finished = self.file.finish();
        finished.map_err(|error| unwritable(&self.path, io_error(error)))?;
        Ok(text)
    }
}

impl Sink for McapRecording {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        let written = self.file.write(&published);
        Ok(written.map_err(|error| unwritable(&self.path, io_error(error)))?)
    }

    fn idle(&mut self) -> Result<(), Error> {
        let flushed = self.file.flush();
        Ok(flushed.map_err(|error| unwritable(&self.path, io_error(error)))?)
    }
}

fn unwritable(path: &Path, source: io::Error) -> OutputError {
    OutputError::Unwritable {
        file: path.display().to_string(),
        source,
    }
}

/// What the operating system says, where it is that which an MCAP could not be written for.
pub fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}
