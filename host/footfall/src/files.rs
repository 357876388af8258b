//! Files: recordings are opened, and results are checked before anything is computed, and written as a whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use files::whole_file::WholeFile;
use options::Format;
use recordings::Opened;
use replay::Layout;
use stored::container::recording_name;
use stored::error::{InputError, Place, Problem};
use thiserror::Error;

use crate::feature::{Feature, NotBuilt};
use crate::progress::Bars;
use crate::ros::compat::MixedBodies;

/// Name for standard input or standard output.
pub const STANDARD: &str = "-";

/// Path of standard input on Unix.
const STDIN: &str = "/dev/stdin";

/// An output file by kind of result.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// Table of replay estimates.
    Estimates(&'a Path),
    /// Table of events.
    Events(&'a Path),
    /// Table of decoded rows.
    Rows(&'a Path),
    /// Picture of a replay, in any format of [`Drawing`].
    Drawing(&'a Path),
    /// A configuration file.
    Configuration(&'a Path),
    /// A recording for ROS 2.
    Bag(&'a Path),
    /// Settings of a foot.
    Settings(&'a Path),
    /// Recording in the format given by its name or by an option.
    Samples(&'a Path),
}

impl<'a> Target<'a> {
    const fn path(self) -> &'a Path {
        self.parts().0
    }

    /// Path, description of the result for error messages, and accepted file extensions; none accepts any.
    const fn parts(self) -> (&'a Path, &'static str, &'static [&'static str]) {
        match self {
            Self::Estimates(path) => (path, "tables are CSV or Parquet", &Layout::EXTENSIONS),
            Self::Events(path) | Self::Rows(path) => (path, "tables are CSV", &["csv"]),
            Self::Drawing(path) => (path, "pictures are SVG or pages", &Drawing::EXTENSIONS),
            Self::Configuration(path) => (path, "configurations are TOML", &["toml"]),
            Self::Bag(path) => (path, "recordings for ROS 2 are MCAP", &["mcap"]),
            Self::Settings(path) => (path, "settings are text", &["txt"]),
            Self::Samples(path) => (path, "recordings are CSV, Parquet or bags", &[]),
        }
    }

    /// Returns the feature that writes the format; `None` if it needs none.
    fn feature(self) -> Option<Feature> {
        match self {
            Self::Estimates(path) if Layout::of(path) == Layout::Parquet => Some(Feature::Parquet),
            Self::Bag(_) => Some(Feature::Bags),
            _ => None,
        }
    }
}

/// Format of a replay picture, selected by the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// SVG, one per foot.
    Svg,
    /// HTML page of all feet.
    Page,
}

impl Drawing {
    /// Accepted file extensions.
    const EXTENSIONS: [&'static str; 2] = ["svg", "html"];

    /// Returns the format for a file of this name; standard output, pipes and other names get an SVG.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("html") { Self::Page } else { Self::Svg }
    }
}

/// Treatment of existing files that have the names of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// Existing files are kept. One that would be replaced is an error, before anything is computed.
    #[default]
    Kept,
    /// Existing files are replaced (`--overwrite`).
    Replaced,
}

impl Existing {
    /// Checks that a result replaces no file that is kept. Pipes, devices and standard output do not count as files.
    ///
    /// # Errors
    /// A file has this name, and is kept.
    pub fn check(self, path: &Path) -> Result<(), OutputError> {
        if self == Self::Kept && path != Path::new(STANDARD) && path.is_file() {
            return Err(OutputError::Exists(named(path)));
        }
        Ok(())
    }
}

/// Checks the output files: their directories exist, no recording, no other output and no file that is kept is
/// overwritten, and extensions match the results. Standard output takes one result, but not a streamed recording,
/// which needs a file.
///
/// # Errors
/// The first violation found.
pub fn check(
    inputs: &[PathBuf],
    targets: &[Target<'_>],
    existing: Existing,
) -> Result<(), OutputError> {
    for (k, target) in targets.iter().enumerate() {
        let path = target.path();
        if inputs.iter().any(|input| same_file(input, path)) {
            return Err(OutputError::OverInput(named(path)));
        }
        if let Some(feature) = target.feature() {
            feature.needed_for(path.display())?;
        }
        if path != Path::new(STANDARD) || matches!(target, Target::Bag(_)) {
            if path.is_dir() {
                return Err(OutputError::IsDirectory(named(path)));
            }
            check_directory_of(path)?;
            check_extension(*target)?;
            existing.check(path)?;
        }
        let is_stdout = |target: &Target<'_>| target.path() == Path::new(STANDARD);
        if is_stdout(target) && targets[..k].iter().any(is_stdout) {
            return Err(OutputError::StdoutTwice);
        }
        let is_same = |before: &Target<'_>| same_file(before.path(), path);
        if targets[..k].iter().any(is_same) {
            return Err(OutputError::SameFile(named(path)));
        }
    }
    Ok(())
}

/// Returns the file name for one of several feet, with the foot's name before the extension.
#[must_use]
pub fn path_of_foot(path: &Path, foot: &str) -> PathBuf {
    let is_safe = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let safe = foot.replace(|c| !is_safe(c), "_");
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{safe}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Returns the path, with a number before the extension if the path is already taken.
#[must_use]
pub fn unused_path(path: PathBuf, taken: &[PathBuf]) -> PathBuf {
    let numbered = (2..).map(|number: u32| path_of_foot(&path, &number.to_string()));
    let mut names = std::iter::once(path.clone()).chain(numbered);
    names.find(|name| !taken.contains(name)).unwrap_or(path)
}

/// Checks that no recording is named twice, as it would count twice.
///
/// # Errors
/// A recording is named twice.
pub fn check_inputs(inputs: &[PathBuf]) -> Result<(), InputError> {
    for (k, input) in inputs.iter().enumerate() {
        let is_standard = input == Path::new(STANDARD);
        let is_same =
            |before: &PathBuf| same_file(before, input) || (is_standard && before == input);
        if inputs[..k].iter().any(is_same) {
            let (file, problem) = (named(input), Problem::Twice);
            return Err(InputError { file, place: Place::File, problem });
        }
    }
    Ok(())
}

/// Opens a recording as [`Opened::new`] does, with a bar while it is read; `-` is standard input.
///
/// # Errors
/// The errors of [`Opened::new`].
pub fn open_recording(
    path: &Path,
    format: Option<Format>,
    bars: &Bars,
) -> Result<Opened, InputError> {
    let path = if path == Path::new(STANDARD) { Path::new(STDIN) } else { path };
    Opened::through(path, format, |file, bytes| bars.reading(file, bytes))
}

/// Returns the path of a recording as its name if another of `inputs` has the same file name.
#[must_use]
pub fn name_among(inputs: &[PathBuf], input: &Path) -> Option<String> {
    let name = recording_name(input);
    let mut others = inputs.iter().filter(|other| *other != input);
    others.any(|other| recording_name(other) == name).then(|| named(input))
}

/// Writes a file that appears under its name only when complete, and not at all on an error.
///
/// `content` can fail with an error of the program. It puts that [`Error`](crate::error::Error) into an [`io::Error`],
/// and the conversion of the returned [`OutputError`] into an `Error` takes it out again.
///
/// # Errors
/// The directory is missing, the file cannot be written, or a file of this name has appeared and is kept.
pub fn write_file(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    check_directory_of(path)?;
    // Another program may have written it since the results were checked.
    existing.check(path)?;
    write(path, existing, content).map_err(|error| match (existing, error.kind()) {
        (Existing::Kept, io::ErrorKind::AlreadyExists) => OutputError::Exists(named(path)),
        _ => OutputError::unwritable(path)(error),
    })
}

/// Checks that the directory of a file exists.
///
/// # Errors
/// It does not.
pub fn check_directory_of(path: &Path) -> Result<(), OutputError> {
    if let Some(directory) = directory_of(path)
        && !directory.is_dir()
    {
        return Err(OutputError::NoDirectory {
            file: path.display().to_string(),
            directory: directory.display().to_string(),
        });
    }
    Ok(())
}

/// Creates a directory of results if it does not exist.
///
/// # Errors
/// A file has its name, or it cannot be created.
pub fn create_directory(path: &Path) -> Result<(), OutputError> {
    check_can_be_directory(path)?;
    fs::create_dir_all(path).map_err(OutputError::unwritable(path))
}

/// Checks that a directory exists or can be created, i.e. that no file has its name.
///
/// # Errors
/// A file has this name.
pub fn check_can_be_directory(path: &Path) -> Result<(), OutputError> {
    if path.exists() && !path.is_dir() {
        Err(OutputError::NotADirectory(path.display().to_string()))
    } else {
        Ok(())
    }
}

/// Ignores the error of a closed reader, such as `head`, so that remaining work continues.
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
    /// Contacts are to be written to a copy of the bags, but an input is not a bag.
    #[error(
        "{0} would be a copy of the replayed bags with their contacts, so each recording must be mcap, rosbag2 or rosbag1"
    )]
    BagsOnly(String),
    /// Options for a copy of a bag are given, but no copy is written.
    #[error("{0} applies only to a copy of a bag: add --output copy.mcap")]
    NoCopy(&'static str),
    /// Two options would write one topic.
    #[error("--compat unitree and --lowstate both write /footfall/lowstate: give one of them")]
    LowStateTwice,
    /// The requested forms of messages are for robots with different numbers of feet.
    #[error(transparent)]
    MixedBodies(#[from] MixedBodies),
    /// Contacts are to be written to a copy of a bag, but the input is not a file on disk.
    #[error(
        "{0} becomes a copy of the recording, which is read twice: a bag on disk, not standard input or a pipe. \
         For the estimates alone name a .csv or .parquet"
    )]
    ReadTwice(String),
    /// The result would overwrite its source recording.
    #[error("{0} cannot be written: it is the recording itself")]
    OverInput(String),
    /// Two results would be written to one file.
    #[error("{0} cannot be written: two results have this name")]
    SameFile(String),
    /// A file of this name exists and would be overwritten.
    #[error("{0} is there already: name another file, or add --overwrite")]
    Exists(String),
    /// A file of the simulated walk exists and would be overwritten. The command may have been given no arguments.
    #[error(
        "{0} is there already: name another directory with `footfall demo --output DIR`, or replace it with \
         `footfall demo --overwrite`"
    )]
    DemoExists(String),
    /// A recording would be written to a terminal, or to a serial port.
    #[error(
        "{0} is a terminal or a serial port, and a recording is binary: name a file, or a pipe"
    )]
    Terminal(String),
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
        let is_standard = path == Path::new(STANDARD);
        let file = if is_standard { "standard output".to_owned() } else { named(path) };
        |source| Self::Unwritable { file, source }
    }
}

fn check_extension(target: Target<'_>) -> Result<(), OutputError> {
    let (path, kind, extensions) = target.parts();
    // Pipes and terminals are accepted under any name.
    let special = path.exists() && !path.is_file();
    let extension = path.extension().unwrap_or_default();
    let is_known = |known: &&str| extension.eq_ignore_ascii_case(known);
    if special || extensions.is_empty() || extensions.iter().any(is_known) {
        return Ok(());
    }
    Err(OutputError::Extension { file: named(path), kind, expected: extensions.join(" or .") })
}

/// Returns whether two paths refer to the same file, which may not exist yet.
fn same_file(a: &Path, b: &Path) -> bool {
    if a == Path::new(STANDARD) || b == Path::new(STANDARD) {
        return false;
    }
    resolved(a).is_some_and(|a| Some(a) == resolved(b))
}

/// Returns the absolute path without symbolic links; of a file that does not exist, by its directory.
fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(resolved) = fs::canonicalize(path) {
        return Some(resolved);
    }
    let directory = fs::canonicalize(directory_of(path).unwrap_or(Path::new("."))).ok()?;
    Some(directory.join(path.file_name()?))
}

fn named(path: &Path) -> String {
    path.display().to_string()
}

fn write(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if path == Path::new(STANDARD) {
        return to_stdout(content);
    }
    if path.exists() && !path.is_file() {
        // Pipes and terminals must be written in place, not replaced by a file.
        return in_place(File::options().write(true).open(path)?, content);
    }
    let mut file = WholeFile::create(path)?;
    content(&mut file)?;
    match existing {
        Existing::Kept => file.finish_new(),
        Existing::Replaced => file.finish(),
    }
}

fn in_place(
    to: impl Write,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut buffer = BufWriter::new(to);
    unless_closed(content(&mut buffer).and_then(|()| buffer.flush()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn failed_write_keeps_the_previous_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out.csv");
        fs::write(&path, "before").unwrap();
        let result = write_file(&path, Existing::Replaced, |to| {
            to.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(result.is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "before");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn file_that_appears_during_the_write_is_kept() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out.csv");
        let write = |existing| {
            write_file(&path, existing, |to| {
                fs::write(&path, "of another program")?;
                to.write_all(b"own")
            })
        };
        let refused = write(Existing::Kept);
        assert!(matches!(refused, Err(OutputError::Exists(_))), "{refused:?}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "of another program");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
        write(Existing::Replaced).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "own");
    }
}
