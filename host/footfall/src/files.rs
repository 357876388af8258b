//! Writing of results to disk, and its errors.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};

use recordings::analysis::whole_file::{WholeFile, remove_unfinished_and_exit};
use thiserror::Error;

use crate::feature::NotBuilt;

/// Reason a result cannot be written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The target directory does not exist.
    #[error("{file} cannot be written: there is no directory {directory}")]
    NoDirectory {
        /// Result as given.
        file: String,
        /// Missing directory.
        directory: String,
    },
    /// Contacts go into a copy of a bag, and the input is another file, or there are several.
    #[error("{0} becomes a copy of a bag with its contacts: give one mcap or rosbag2 to replay")]
    OneBagOnly(String),
    /// There are options for a copy of a bag, and none is written.
    #[error("{0} is for a copy of a bag: --output copy.mcap")]
    NoCopy(&'static str),
    /// Two options write one topic.
    #[error("--compat unitree and --lowstate both write /footfall/lowstate: give one of them")]
    LowStateTwice,
    /// Contacts go into a copy of a bag, and the input is not a file on disk.
    #[error(
        "{0} becomes a copy of the recording, which is read twice: a bag on disk, not standard input or a pipe. \
         For the estimates alone name a .csv or .parquet"
    )]
    ReadTwice(String),
    /// The result would overwrite its source recording.
    #[error("{0} cannot be written: it is the recording itself")]
    OverInput(String),
    /// Two results would be written to one file.
    #[error("{0} cannot be written: it is named for two results")]
    SameFile(String),
    /// A file of this name exists and would be overwritten.
    #[error("{0} is there already: name another file, or add --overwrite")]
    Exists(String),
    /// A directory of this name exists.
    #[error("{0} cannot be written: it is a directory")]
    IsDirectory(String),
    /// A file exists in place of the results directory.
    #[error("{0} is a file, but results go into a directory")]
    NotADirectory(String),
    /// The file extension does not match the result.
    #[error("{file} cannot be written: {kind}, so the name must end in .{expected}")]
    Extension {
        /// Result as given.
        file: String,
        /// Description of this kind of result.
        kind: &'static str,
        /// Expected extension; several are joined by "or".
        expected: String,
    },
    /// The times of the recording exceed the range of a bag.
    #[error(
        "{0} cannot be written: messages of ROS 2 have no times after 2038; check the unit of the times"
    )]
    TooLate(String),
    /// The feature for this format is not built.
    #[error(transparent)]
    NotBuilt(#[from] NotBuilt),
    /// Two results would be written to standard output.
    #[error("standard output takes one result: a table or picture (-), or --json")]
    StdoutTwice,
    /// Any other error.
    #[error("{file} cannot be written: {source}")]
    Unwritable {
        /// Result as given.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
}

impl OutputError {
    /// Returns the conversion of an error of the operating system about a result.
    pub fn unwritable(path: &Path) -> impl FnOnce(io::Error) -> Self {
        |source| Self::Unwritable { file: path.display().to_string(), source }
    }
}

/// Name for standard input or standard output.
pub const STANDARD: &str = "-";

/// Writes a file that appears under its name only when complete, and not at all on an error.
///
/// # Errors
/// The directory is missing, or the file cannot be written.
pub fn write_file(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    check_directory_of(path)?;
    written(path, content).map_err(OutputError::unwritable(path))
}

/// Checks that the directory of a file exists.
///
/// # Errors
/// It does not.
pub fn check_directory_of(path: &Path) -> Result<(), OutputError> {
    match directory_of(path).filter(|directory| !directory.is_dir()) {
        Some(directory) => Err(OutputError::NoDirectory {
            file: path.display().to_string(),
            directory: directory.display().to_string(),
        }),
        None => Ok(()),
    }
}

/// Checks that a directory exists or can be created, i.e. that no file has its name.
///
/// # Errors
/// A file has this name.
pub fn check_can_be_directory(path: &Path) -> Result<(), OutputError> {
    match path.exists() && !path.is_dir() {
        true => Err(OutputError::NotADirectory(path.display().to_string())),
        false => Ok(()),
    }
}

/// Ignores an error caused by a closed reader, such as `head`; remaining work continues.
///
/// # Errors
/// Any other error in `written`.
pub fn unless_closed(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// Writes to standard output, whose reader may close it.
///
/// # Errors
/// Any other error.
pub fn to_stdout(content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    in_place(io::stdout().lock(), content)
}

/// Returns the directory part of a path, if any.
#[must_use]
pub fn directory_of(path: &Path) -> Option<&Path> {
    path.parent().filter(|parent| !parent.as_os_str().is_empty())
}

fn written(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    if path == Path::new(STANDARD) {
        return to_stdout(content);
    }
    if path.exists() && !path.is_file() {
        // Pipes and terminals must be written in place, not replaced by a file.
        return in_place(File::options().write(true).open(path)?, content);
    }
    let mut file = WholeFile::create(path)?;
    content(&mut file)?;
    file.finish()
}

fn in_place(
    to: impl Write,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut buffer = BufWriter::new(to);
    unless_closed(content(&mut buffer).and_then(|()| buffer.flush()))
}

/// Effect of an interruption: exits at once; requests an orderly end; or, once requested, exits on the next
/// interruption.
static INTERRUPTION: AtomicU8 = AtomicU8::new(ENDS);
const ENDS: u8 = 0;
const FINISHES: u8 = 1;
const FINISHING: u8 = 2;

/// Handles an interruption.
pub(crate) fn interrupt() {
    let is_asked =
        INTERRUPTION.compare_exchange(FINISHES, FINISHING, Ordering::Relaxed, Ordering::Relaxed);
    if is_asked.is_err() {
        remove_unfinished_and_exit(INTERRUPTED);
    }
}

/// Makes the first interruption request an orderly end, reported by [`is_interrupted`]. The next interruption exits
/// at once.
pub fn finish_when_interrupted() {
    INTERRUPTION.store(FINISHES, Ordering::Relaxed);
}

/// Returns whether an orderly end was requested.
#[must_use]
pub fn is_interrupted() -> bool {
    INTERRUPTION.load(Ordering::Relaxed) == FINISHING
}

/// Exit code of a program ended by Ctrl-C, as used by shells.
pub const INTERRUPTED: i32 = 130;

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn failed_write_keeps_the_previous_file() {
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
    fn missing_directory_is_named() {
        let error = write_file(Path::new("no/such/place/out.csv"), |_| Ok(())).unwrap_err();
        assert_eq!(
            error.to_string(),
            "no/such/place/out.csv cannot be written: there is no directory no/such/place"
        );
    }
}
