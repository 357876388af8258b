//! How a result gets to disk, and why it may not.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};

use analysis::whole_file::{WholeFile, remove_unfinished_and_exit};
use thiserror::Error;

use crate::feature::NotBuilt;

/// Why a result could not be written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The directory it should go to does not exist.
    #[error("{file} cannot be written: there is no directory {directory}")]
    NoDirectory {
        /// The result, as it was named.
        file: String,
        /// The missing directory.
        directory: String,
    },
    /// The result would take the place of the recording it is made from.
    #[error("{file} cannot be written: it is the recording itself")]
    OverInput {
        /// The result, as it was named.
        file: String,
    },
    /// Two results would go into one file.
    #[error("{file} cannot be written: it is named for two results")]
    SameFile {
        /// The second result, as it was named.
        file: String,
    },
    /// There is a file of that name, and what is in it would be lost.
    #[error("{file} is there already: name another file, or add --overwrite")]
    Exists {
        /// The file, as it was named.
        file: String,
    },
    /// There is a file of that name, in place of which a folder would come.
    #[error("{file} is there already, and a folder replaces nothing: name another")]
    NotReplaced {
        /// The file, as it was named.
        file: String,
    },
    /// There is a directory of that name.
    #[error("{file} cannot be written: it is a directory")]
    IsDirectory {
        /// The result, as it was named.
        file: String,
    },
    /// There is a file where the results' directory should be.
    #[error("{file} is a file, but results go into a directory")]
    NotADirectory {
        /// The directory, as it was named.
        file: String,
    },
    /// A result has the name of something else.
    #[error("{file} cannot be written: {kind}, so the name must end in .{expected}")]
    Extension {
        /// The result, as it was named.
        file: String,
        /// What results of its kind are.
        kind: &'static str,
        /// What its name must end in; several are joined by "or".
        expected: String,
    },
    /// A rosbag2 would go to standard output.
    #[error("a rosbag2 is a folder, which cannot go to standard output")]
    NoStdout,
    /// A bag has no times as late as those of the recording.
    #[error(
        "{file} cannot be written: messages of ROS 2 have no times after 2038; check the unit of the times"
    )]
    TooLate {
        /// The bag, as it was named.
        file: String,
    },
    /// This program cannot write it.
    #[error(transparent)]
    NotBuilt(#[from] NotBuilt),
    /// Two results would go to standard output.
    #[error("standard output takes one result: a table or picture (-), or --json")]
    StdoutTwice,
    /// Something else went wrong.
    #[error("{file} cannot be written: {source}")]
    Unwritable {
        /// The result, as it was named.
        file: String,
        /// What the operating system says.
        source: io::Error,
    },
}

/// The name that stands for standard input or standard output.
pub const STANDARD: &str = "-";

/// Writes a file so that it appears under its name when it is complete, and not at all where
/// something fails.
///
/// # Errors
/// The directory is missing, or the file cannot be written.
pub fn write_file(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    let file = path.display().to_string();
    if path == Path::new(STANDARD) {
        return unless_closed(to_stdout(content))
            .map_err(|source| OutputError::Unwritable { file, source });
    }
    if let Some(directory) = directory_of(path).filter(|directory| !directory.is_dir()) {
        return Err(OutputError::NoDirectory {
            file,
            directory: directory.display().to_string(),
        });
    }
    written(path, content).map_err(|source| OutputError::Unwritable { file, source })
}

/// That a reader has gone, such as `head`, is no failure: it has seen enough. What else there is to do
/// is done.
///
/// # Errors
/// Any other that `written` has.
pub fn unless_closed(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

fn to_stdout(content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffer = BufWriter::new(io::stdout().lock());
    content(&mut buffer)?;
    buffer.flush()
}

/// The directory that a path names, where it names one.
#[must_use]
pub fn directory_of(path: &Path) -> Option<&Path> {
    path.parent()
        .filter(|parent| !parent.as_os_str().is_empty())
}

fn written(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    if path.exists() && !path.is_file() {
        // A pipe or a terminal cannot be replaced by a file, and must not be.
        return unless_closed(filled(File::options().write(true).open(path)?, content));
    }
    let mut file = WholeFile::create(path)?;
    content(&mut file)?;
    file.finish()
}

fn filled(file: File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffer = BufWriter::new(file);
    content(&mut buffer)?;
    buffer.flush()
}

/// What an interruption does: ends the program at once; asks it to finish; it has been asked, so that the
/// next one ends it.
static INTERRUPTION: AtomicU8 = AtomicU8::new(ENDS);
const ENDS: u8 = 0;
const FINISHES: u8 = 1;
const FINISHING: u8 = 2;

/// What an interruption does now.
pub(crate) fn interrupt() {
    let is_asked =
        INTERRUPTION.compare_exchange(FINISHES, FINISHING, Ordering::Relaxed, Ordering::Relaxed);
    if is_asked.is_err() {
        remove_unfinished_and_exit(INTERRUPTED);
    }
}

/// From now on, the first interruption only asks this command to finish what it does:
/// [`is_interrupted`]. The next one ends it.
pub fn finish_when_interrupted() {
    INTERRUPTION.store(FINISHES, Ordering::Relaxed);
}

/// Whether this command has been asked to finish.
#[must_use]
pub fn is_interrupted() -> bool {
    INTERRUPTION.load(Ordering::Relaxed) == FINISHING
}

/// The exit code of a program that Ctrl-C has ended, as shells have it.
pub const INTERRUPTED: i32 = 130;

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_failure_halfway_leaves_what_was_there_before() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out.csv");
        fs::write(&path, "before").unwrap();
        let result = write_file(&path, |to| {
            to.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(result.is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "before");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_directory_is_named() {
        let error = write_file(Path::new("no/such/place/out.csv"), |_| Ok(())).unwrap_err();
        assert_eq!(
            error.to_string(),
            "no/such/place/out.csv cannot be written: there is no directory no/such/place"
        );
    }
}
