//! Reads files into recordings: SI units, one clock, and a notice for everything left out.
//!
//! | step | file |
//! |---|---|
//! | the public type [`Opened`]: a file of known format, found by its first bytes, and its reading; the formats by name | this one |
//! | properties that a format does not carry: units, times, gravity, mounting, topics | `options` |
//! | `csv`, `parquet`: named columns. When a table is opened, `header::check_is_csv` judges its header; when it is read, `header::Layout` gives each column its meaning | [`table`] |
//! | `mcap`, `rosbag2`, `rosbag1`: bags of ROS 2 and ROS 1 | `bag` |
//! | `pce-atlas`, `pce-go1`, `lcd`: published recordings of robots | [`published`] |
//! | rows on one clock and in order, and the stored recording: the result | `stored` |
//! | the rate of the rows; smooth times | `rate`; `smooth` |
//! | recorded contacts as the estimates | [`contacts`] |
//! | errors, with their position; those in messages of bags | [`error`]; `bag_problem` |
//! | dates with times | [`iso8601`] |
//!
//! Parquet and bags are read only with the features `parquet` and `bags`, and only from a disk: data from a pipe
//! or compressed data are copied first. All others are tables of numbers separated by commas, semicolons or tabs,
//! plain or compressed with gzip or zstd. Windows line ends, blank lines, lines that begin with `#`, spaces around
//! cells and a UTF-8 byte order mark are accepted, as are `nan`, `inf` and numbers beyond f32 in an axis: the
//! estimator flags such a sample as invalid and gives it mass 0.

#[cfg(feature = "bags")]
pub mod bag;
mod bag_problem;
pub mod contacts;
pub mod error;
pub mod iso8601;
mod options;
pub mod published;
pub(crate) mod rate;
mod smooth;
mod stored;
pub mod table;

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempPath};

use crate::compressed::{decompressed, without_ending};
use crate::file_kind::{self, FileKind};
use crate::hint::Notice;
use crate::utf16::in_utf8;
use error::OptionsFor;
#[cfg(feature = "parquet")]
use table::parquet;
use table::reader::{Table, beginning_with};
use table::{csv, header};

pub use error::{InputError, Place, Problem, RowPlace};
pub use options::{
    AccelerationUnit, BagOptions, ContactUse, Correction, Decimal, InputOptions, LoadTopic,
    Mapping, OptionProblem, RateUnit, Rename, Scale, TableOptions, TimeUnit, Times, Topics, Units,
    is_among, matches_pattern, without_effect,
};
pub use rate::{TimesSoFar, rate_of_times, unit_of_step};
pub use stored::{
    About, Loaded, OLDEST_LOAD_US, RecordedEstimate, Repairs, SampleClock, Stored, StreamedSample,
};

/// An open file of known format. A table is read once and sequentially, so it may be a pipe.
pub struct Opened {
    source: Readable,
    format: Format,
}

impl Opened {
    /// Opens a file, or the folder of a rosbag2. If no format is given, it is recognised by the first bytes;
    /// otherwise the file is a `csv` if its header has a known column or consists only of words, or if its first
    /// row is a message of ROS 2.
    ///
    /// # Errors
    /// The file cannot be opened, is of a kind that is not read or not of the given format, or no format is given
    /// and the first line does not identify it.
    pub fn new(path: &Path, format: Option<Format>) -> Result<Self, InputError> {
        Self::through(path, format, |file, _| Box::new(file))
    }

    /// As [`Self::new`], but reads the result of `wrap`, which takes the file and its length in bytes, e.g. to
    /// show progress.
    ///
    /// # Errors
    /// The errors of [`Self::new`].
    pub fn through(
        path: &Path,
        format: Option<Format>,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
    ) -> Result<Self, InputError> {
        let mut source = Readable::open(path, format, wrap)?;
        let format = match (&mut source, format) {
            (Readable::Container(container), _) => container.format,
            (Readable::Table(_), Some(format)) => format,
            (Readable::Table(table), None) => {
                header::check_is_csv(table)?;
                Format::Csv
            }
        };
        Ok(Self { source, format })
    }

    /// Format of the file.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// Path of the file, as given.
    fn file(&self) -> &str {
        match &self.source {
            Readable::Table(table) => &table.file,
            Readable::Container(container) => &container.file,
        }
    }

    /// Reads the file into memory.
    ///
    /// # Errors
    /// The errors of [`Self::store`].
    pub fn read(self, input_options: &InputOptions) -> Result<Loaded, InputError> {
        let file = self.file().to_owned();
        self.store(input_options)?.into_loaded().map_err(|source| InputError::spool(&file, source))
    }

    /// Reads the recording of each foot: one per selected topic of a bag, one in all other files.
    ///
    /// # Errors
    /// The first error found, with file, line and column, or file, topic and message.
    pub fn store_all(self, input_options: &InputOptions) -> Result<Vec<Stored>, InputError> {
        self.store_as(input_options, None)
    }

    /// As [`Self::store_all`]. `foot` replaces the name in the file of an only foot, and selects the settings that
    /// apply.
    ///
    /// # Errors
    /// The errors of [`Self::store_all`].
    pub fn store_as(
        self,
        input_options: &InputOptions,
        foot: Option<&str>,
    ) -> Result<Vec<Stored>, InputError> {
        self.check_options(input_options)?;
        let mut feet = match self.source {
            Readable::Table(mut table) => {
                table.set_decimal(input_options.table.decimal);
                vec![read_table(*table, self.format, input_options)?]
            }
            #[cfg(feature = "bags")]
            Readable::Container(container) if self.format.content() == Content::Messages => {
                bag::read(container, input_options)?
            }
            #[cfg(feature = "parquet")]
            Readable::Container(container) if self.format == Format::Parquet => {
                vec![parquet::read(&container, input_options)?]
            }
            Readable::Container(Container { file, format, .. }) => {
                let feature = format.missing_feature().unwrap_or_default();
                let problem = Problem::NotBuilt { format, feature };
                return Err(InputError::of_file(file, problem));
            }
        };
        if let ([only], Some(_)) = (&mut feet[..], foot) {
            only.about.foot = None;
        }
        for stored in &mut feet {
            let names = stored.about.names_with(foot);
            stored.about.correction = *input_options.correction_of(&names);
        }
        Ok(feet)
    }

    /// Reads the file. For files with named columns or topics, memory does not grow with the length.
    ///
    /// # Errors
    /// The errors of [`Self::store_all`], or the file has several feet.
    pub fn store(self, input_options: &InputOptions) -> Result<Stored, InputError> {
        let file = self.file().to_owned();
        let mut feet = self.store_all(input_options)?;
        if feet.len() > 1 {
            let names = feet.into_iter().filter_map(|stored| stored.about.foot);
            let feet = names.collect();
            return Err(InputError::of_file(file, Problem::SeveralFeet(feet)));
        }
        feet.pop().ok_or_else(|| InputError::empty(&file))
    }

    /// Returns whether [`Self::stream`] reads the file: it is a table with a header, whose times are in order or refused.
    #[must_use]
    pub fn can_stream(&self, input_options: &InputOptions) -> bool {
        matches!(self.source, Readable::Table(_))
            && self.format == Format::Csv
            && input_options.table.times == Times::Keep
    }

    /// Reads a table while it is written: passes each sample on as soon as its row is complete, and returns the notices
    /// about the table at its end.
    ///
    /// # Errors
    /// The errors of [`Self::store_all`], or that of `each`.
    pub fn stream(
        self,
        input_options: &InputOptions,
        each: &mut dyn FnMut(StreamedSample) -> Result<(), InputError>,
    ) -> Result<Vec<Notice>, InputError> {
        self.check_options(input_options)?;
        match self.source {
            Readable::Table(mut table) => {
                table.set_decimal(input_options.table.decimal);
                csv::stream(*table, input_options, each)
            }
            Readable::Container(Container { file, format, .. }) => {
                let given = OptionsFor::Tables;
                Err(InputError::of_file(file, Problem::Options { format, given }))
            }
        }
    }

    /// Checks that the options apply to this kind of file.
    fn check_options(&self, input_options: &InputOptions) -> Result<(), InputError> {
        let format = self.format;
        let given = match format.content() {
            Content::Fixed if input_options.table != TableOptions::default() => OptionsFor::Tables,
            Content::Messages if input_options.table.time_unit.is_some() => {
                OptionsFor::TimesOfTables
            }
            Content::Fixed | Content::Columns if input_options.bag != BagOptions::default() => {
                OptionsFor::Bags
            }
            _ => return Ok(()),
        };
        Err(InputError::of_file(self.file(), Problem::Options { format, given }))
    }
}

fn read_table(
    table: Table,
    format: Format,
    input_options: &InputOptions,
) -> Result<Stored, InputError> {
    match format {
        Format::PceAtlas | Format::Lcd => published::read_simulated(table, format, input_options),
        Format::PceGo1 => published::read_go1(table, input_options),
        // The content of a container is not a table.
        Format::Csv | Format::Parquet | Format::Mcap | Format::Rosbag2 | Format::Rosbag1 => {
            csv::read(table, input_options)
        }
    }
}

/// Reads a file.
///
/// # Errors
/// The first error found, with file, line and column.
pub fn read(
    path: &Path,
    format: Format,
    input_options: &InputOptions,
) -> Result<Loaded, InputError> {
    Opened::new(path, Some(format))?.read(input_options)
}

/// Title of a recording: the file's name without its extension and that of its compression.
#[must_use]
pub fn recording_name(path: &Path) -> String {
    let stem = without_ending(path).file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

crate::named! {
    /// Layout of a file.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Format {
        /// Simulated ATLAS of the method's authors: 13 columns, no header, 1 kHz, gravity removed.
        PceAtlas = "pce-atlas",
        /// Real GO1 of the method's authors: force and IMU in g and °/s, no header, 250 Hz.
        PceGo1 = "pce-go1",
        /// Simulated ATLAS and NAO of github.com/mrsp/lcd: 13 columns, no header, 100 Hz, gravity
        /// removed.
        Lcd = "lcd",
        /// A header naming any of t,ax,ay,az,wx,wy,wz,force,label,validity (s, m/s², rad/s, N, 0/1).
        Csv = "csv",
        /// The columns of a csv in Parquet.
        Parquet = "parquet",
        /// `sensor_msgs/msg/Imu` of ROS 2 in MCAP.
        Mcap = "mcap",
        /// The same in the `SQLite` database of a rosbag2, or the folder of a rosbag2.
        Rosbag2 = "rosbag2",
        /// `sensor_msgs/Imu` of ROS 1 in a `.bag`.
        Rosbag1 = "rosbag1",
    } or |name| {
        let known = Self::ALL.map(Self::name).join(", ");
        format!("there is no format `{name}`; known are {known}")
    }
}

/// Kind of content, which determines the applicable options.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Columns at fixed places with fixed units.
    Fixed,
    /// Columns identified by name.
    Columns,
    /// Messages by topic.
    Messages,
}

impl Format {
    /// Description in one line, for the help of an option.
    #[must_use]
    pub const fn help(self) -> &'static str {
        match self {
            Self::PceAtlas => {
                "Simulated ATLAS of the method's authors: 13 columns, no header, 1 kHz, gravity removed"
            }
            Self::PceGo1 => {
                "Real GO1 of the method's authors: force and IMU in g and °/s, no header, 250 Hz"
            }
            Self::Lcd => {
                "Simulated ATLAS and NAO of github.com/mrsp/lcd: 13 columns, no header, 100 Hz, gravity removed"
            }
            Self::Csv => {
                "A header naming any of t,ax,ay,az,wx,wy,wz,force,label,validity (s, m/s², rad/s, N, 0/1)"
            }
            Self::Parquet => "The columns of a csv in Parquet",
            Self::Mcap => "sensor_msgs/msg/Imu of ROS 2 in MCAP; known by its first bytes",
            Self::Rosbag2 => {
                "The same in a .db3 of rosbag2, or the folder of a rosbag2; known by its first bytes"
            }
            Self::Rosbag1 => "sensor_msgs/Imu of ROS 1 in a .bag; known by its first bytes",
        }
    }

    /// Kind of content.
    #[must_use]
    pub const fn content(self) -> Content {
        match self {
            Self::PceAtlas | Self::PceGo1 | Self::Lcd => Content::Fixed,
            Self::Csv | Self::Parquet => Content::Columns,
            Self::Mcap | Self::Rosbag2 | Self::Rosbag1 => Content::Messages,
        }
    }

    /// Returns whether its files are recognised by their first bytes and read from a disk only.
    #[must_use]
    pub const fn is_container(self) -> bool {
        matches!(self, Self::Parquet | Self::Mcap | Self::Rosbag2 | Self::Rosbag1)
    }

    /// Format of a kind of file that is recognised by its first bytes; `None` if it is not read.
    const fn of_kind(kind: FileKind) -> Option<Self> {
        match kind {
            FileKind::Mcap => Some(Self::Mcap),
            FileKind::Sqlite => Some(Self::Rosbag2),
            FileKind::Ros1Bag => Some(Self::Rosbag1),
            FileKind::Parquet => Some(Self::Parquet),
            _ => None,
        }
    }

    /// Feature of this crate that reads its files, if missing in this build.
    #[must_use]
    pub const fn missing_feature(self) -> Option<&'static str> {
        match self {
            Self::Parquet if !cfg!(feature = "parquet") => Some("parquet"),
            Self::Mcap | Self::Rosbag2 | Self::Rosbag1 if !cfg!(feature = "bags") => Some("bags"),
            _ => None,
        }
    }
}

/// An opened file.
enum Readable {
    Table(Box<Table>),
    Container(Container),
}

/// A container read from the disk, in one or several files.
#[cfg_attr(
    not(any(feature = "bags", feature = "parquet")),
    allow(dead_code, reason = "only the readers use it")
)]
struct Container {
    format: Format,
    /// File or folder, as given.
    file: String,
    /// Title of the recording.
    name: String,
    /// Files in the order of their times.
    parts: Vec<ContainerFile>,
}

/// A file of a container.
#[cfg_attr(not(feature = "bags"), allow(dead_code, reason = "only the readers use it"))]
struct ContainerFile {
    format: Format,
    path: PathBuf,
    /// Reader of the first pass, which shows its progress.
    first_pass: Option<Box<dyn Read>>,
    /// Temporary copy, so that the file can be read repeatedly and at any position.
    _copy: Option<TempPath>,
}

#[cfg(feature = "bags")]
impl ContainerFile {
    /// Returns its bytes from the start.
    fn bytes(&mut self) -> io::Result<Box<dyn Read>> {
        match self.first_pass.take() {
            Some(bytes) => Ok(bytes),
            None => Ok(Box::new(File::open(&self.path)?)),
        }
    }
}

impl Readable {
    /// Opens a file, read through the result of `wrap` with its length in bytes; or a folder.
    fn open(
        path: &Path,
        given: Option<Format>,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
    ) -> Result<Self, InputError> {
        let file = path.display().to_string();
        let opened = if path.is_dir() {
            Recognised::Container(Format::Rosbag2, Self::folder(path)?)
        } else {
            Recognised::file(path, wrap).map_err(|source| InputError::unreadable(&file, source))?
        };
        match (opened, given) {
            (Recognised::Foreign(kind), _) => {
                Err(InputError::of_file(file, Problem::Foreign(kind)))
            }
            (Recognised::Table(_), Some(given)) if given.is_container() => {
                Err(other_format(file, given, None))
            }
            (Recognised::Table(table), _) => Ok(Self::Table(table)),
            (Recognised::Container(format, _), Some(given)) if format != given => {
                Err(other_format(file, given, Some(format)))
            }
            (Recognised::Container(format, parts), _) => match format.missing_feature() {
                Some(feature) => {
                    Err(InputError::of_file(file, Problem::NotBuilt { format, feature }))
                }
                None => Ok(Self::Container(Container {
                    format,
                    file,
                    name: recording_name(path),
                    parts,
                })),
            },
        }
    }

    /// Files of a rosbag2 in its folder.
    fn folder(path: &Path) -> Result<Vec<ContainerFile>, InputError> {
        let file = path.display().to_string();
        let entries = fs::read_dir(path).map(|entries| entries.map(|entry| Ok(entry?.path())));
        let paths = entries.and_then(parts_among);
        let mut parts = Vec::new();
        for path in paths.map_err(|source| InputError::unreadable(&file, source))? {
            let file = path.display().to_string();
            let opened = Recognised::file(&path, |file, _| Box::new(file));
            match opened.map_err(|source| InputError::unreadable(&file, source))? {
                Recognised::Container(Format::Mcap | Format::Rosbag2, mut part) => {
                    parts.append(&mut part);
                }
                _ => return Err(other_format(file, Format::Rosbag2, None)),
            }
        }
        if parts.is_empty() {
            return Err(InputError::of_file(file, Problem::Folder));
        }
        Ok(parts)
    }
}

fn other_format(file: String, given: Format, found: Option<Format>) -> InputError {
    InputError::of_file(file, Problem::OtherFormat { given, found })
}

/// Kind of an opened file.
enum Recognised {
    Table(Box<Table>),
    Container(Format, Vec<ContainerFile>),
    Foreign(FileKind),
}

impl Recognised {
    fn file(path: &Path, wrap: impl FnOnce(File, u64) -> Box<dyn Read>) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if about.is_file() {
            let first = beginning(&mut file)?;
            file.seek(SeekFrom::Start(0))?;
            if let Some(format) = FileKind::of_first_bytes(&first).and_then(Format::of_kind) {
                return Ok(Self::of(ContainerFile {
                    format,
                    path: path.to_owned(),
                    first_pass: Some(wrap(file, about.len())),
                    _copy: None,
                }));
            }
        }
        let mut text = in_utf8(decompressed(wrap(file, about.len()))?)?;
        let first = beginning(&mut text)?;
        let known = FileKind::of_first_bytes(&first);
        let mut text = beginning_with(first, text);
        let Some(kind) = known else {
            let table = Table::of(path.display().to_string(), recording_name(path), text)?;
            return Ok(Self::Table(Box::new(table)));
        };
        let Some(format) = Format::of_kind(kind) else {
            return Ok(Self::Foreign(kind));
        };
        // An unsupported file is not copied.
        if format.missing_feature().is_some() {
            return Ok(Self::Container(format, Vec::new()));
        }
        let mut copy = NamedTempFile::new()?;
        io::copy(&mut text, &mut copy)?;
        let copy = copy.into_temp_path();
        Ok(Self::of(ContainerFile {
            format,
            path: copy.to_path_buf(),
            first_pass: None,
            _copy: Some(copy),
        }))
    }

    fn of(part: ContainerFile) -> Self {
        Self::Container(part.format, vec![part])
    }
}

/// Reads the first bytes.
fn beginning(file: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut first = Vec::new();
    file.take(file_kind::LENGTH as u64).read_to_end(&mut first)?;
    Ok(first)
}

/// Files of a rosbag2 among the entries of its folder, in the order of their times.
///
/// # Errors
/// The folder cannot be read to its end: a file could be missing from the result.
fn parts_among(entries: impl Iterator<Item = io::Result<PathBuf>>) -> io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = entries.collect::<io::Result<_>>()?;
    paths.retain(|path| is_part(path));
    paths.sort_by_key(|path| (number_at_the_end(path), path.clone()));
    Ok(paths)
}

/// Returns whether this is the name of a file of a rosbag2.
fn is_part(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".zstd").unwrap_or(&name);
    name.ends_with(".mcap") || name.ends_with(".db3")
}

/// Number that rosbag2 appends to names of files: 10 of `walk_10.db3`.
fn number_at_the_end(path: &Path) -> u64 {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    let number = stem.rsplit('_').next().unwrap_or_default();
    number.parse().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn format_is_found_by_its_name() {
        for format in Format::ALL {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
    }

    #[test]
    fn kinds_that_are_read_have_a_format() {
        for kind in FileKind::ALL {
            // Other databases than those of a rosbag2 are refused by their tables.
            let is_read = kind.advice().is_none() || kind == FileKind::Sqlite;
            assert_eq!(Format::of_kind(kind).is_some(), is_read, "{kind}");
        }
    }

    #[test]
    fn unknown_format_error_lists_the_known_ones() {
        assert_eq!(
            "xls".parse::<Format>(),
            Err("there is no format `xls`; known are pce-atlas, pce-go1, lcd, csv, \
             parquet, mcap, rosbag2, rosbag1"
                .to_owned())
        );
    }

    #[test]
    fn folder_that_fails_midway_is_an_error() {
        let entry = |name: &str| Ok(PathBuf::from(name));
        let entries =
            || [entry("walk/walk_10.db3"), entry("walk/metadata.yaml"), entry("walk/walk_2.db3")];
        let paths = parts_among(entries().into_iter()).expect("all entries are readable");
        assert_eq!(paths, ["walk/walk_2.db3", "walk/walk_10.db3"].map(PathBuf::from));
        let broken = Err(io::Error::from(io::ErrorKind::StaleNetworkFileHandle));
        let error =
            parts_among(entries().into_iter().chain([broken])).expect_err("an entry is missing");
        assert_eq!(error.kind(), io::ErrorKind::StaleNetworkFileHandle);
    }
}
