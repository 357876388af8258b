//! Files become recordings: SI units, one clock, nothing lost without a word.
//!
//! | step | file |
//! |---|---|
//! | the formats by name, files by their first bytes, and how a file is opened | `format`, `magic`, `foreign`, `open`, this one |
//! | recordings among other files | `candidate` |
//! | gzip and zstd, what separates columns, rows of cells with their line numbers | `compressed`, `lines`, `head`, `table` |
//! | `csv`: a header names the columns | [`csv`]; `header`, `cells`, `intake`, `clock`, `rate`, `time` |
//! | `parquet`: the same columns | `parquet` |
//! | `mcap`, `rosbag2`: bags of ROS 2 | `bag`; [`topics`] |
//! | tables of others: options, names, ROS 2 without a header, dates, times out of order | [`options`], [`mapping`]; `layout`, `names`, `ros2`, `iso8601`, `times` |
//! | columns of a `csv` that are no part of a recording: the true orientation | `extra`, `truth` |
//! | `pce-atlas`, `pce-go1`, `lcd`: published recordings of robots | [`pce`] |
//! | rows in order, whatever they are read from, and where they go | `rows`, `stored` |
//! | the sensor's static calibration, and its mounting | `correction` |
//! | what comes out, and what can be wrong | `loaded`, [`error`], `place`, [`refusal`] |
//!
//! Parquet and bags are read with the features `parquet` and `bags` only, and from a disk: what comes through a
//! pipe or is compressed is copied first. All others are tables of numbers separated by commas, semicolons or tabs, plain or compressed
//! with gzip or zstd. Windows line ends, blank lines, lines that begin with `#`, spaces around cells
//! and a UTF-8 byte order mark are fine. `nan`, `inf` and
//! numbers beyond f32 in an axis are accepted: the estimator flags such a sample as invalid and
//! gives it mass 0.

#[cfg(feature = "bags")]
mod bag;
mod candidate;
mod cells;
mod clock;
pub mod compressed;
mod correction;
pub mod csv;
pub mod error;
mod extra;
mod foreign;
mod format;
mod head;
mod header;
mod intake;
mod iso8601;
mod layout;
mod lines;
mod loaded;
mod magic;
pub mod mapping;
mod names;
mod open;
pub mod options;
#[cfg(feature = "parquet")]
pub(crate) mod parquet;
pub mod pce;
mod place;
mod rate;
pub mod refusal;
mod ros2;
mod rows;
mod stored;
mod table;
pub mod time;
mod times;
pub mod topics;
mod truth;

use std::fs::File;
use std::io::Read;
use std::path::Path;

pub use candidate::{is_recording, is_rosbag2};
pub use correction::Correction;
pub use error::{Cell, HeaderSlip, InputError, Place, Suggestion};
pub use foreign::Foreign;
pub use format::{Content, Format};
pub use loaded::{Hints, Loaded, Repairs};
pub use magic::no_log;
pub use mapping::Mapping;
pub use options::{AccelerationUnit, RateUnit, TableOptions, TimeUnit, Times, Units};
pub use rate::{TimesSoFar, rate_of_times};
pub use refusal::ContainerError;
pub use stored::{About, Stored};
pub use table::recording_name;
pub use topics::{BagOptions, LoadTopic, Topics};

use crate::mounting;
use crate::space::Rotation;
use open::{Container, Source};
use pce::LabelScheme;
use table::Table;
use truth::Orientations;

/// A file that is open, with its format known. A table is read once, as it comes, so a pipe will do.
pub struct Opened {
    source: Source,
    format: Format,
}

impl Opened {
    /// Opens a file, or the folder of a rosbag2. Where no format is given, it is known by the first
    /// bytes; else a header that names any known column makes it `csv`, and so does one of words
    /// only, or a message of ROS 2 for a first row.
    ///
    /// # Errors
    /// The file cannot be opened, it is of a kind that is not read, it is not of the format that is
    /// given, or no format is given and its first line does not show it.
    pub fn new(path: &Path, format: Option<Format>) -> Result<Self, InputError> {
        Self::through(path, format, |file, _| Box::new(file))
    }

    /// [`Self::new`], reading what `wrap` makes of the file and its length in bytes, such as one
    /// that shows progress.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn through(
        path: &Path,
        format: Option<Format>,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
    ) -> Result<Self, InputError> {
        let mut source = Source::open(path, format, wrap)?;
        let format = match (&mut source, format) {
            (Source::Container(container), _) => container.format,
            (Source::Table(_), Some(format)) => format,
            (Source::Table(table), None) => guess_format(table)?,
        };
        Ok(Self { source, format })
    }

    /// How the file is laid out.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// The file, as it was named.
    fn file(&self) -> &str {
        match &self.source {
            Source::Table(table) => table.file(),
            Source::Container(container) => &container.file,
        }
    }

    /// Reads it into memory.
    ///
    /// # Errors
    /// Those of [`Self::store`].
    pub fn read(self, hints: &Hints) -> Result<Loaded, InputError> {
        let file = self.file().to_owned();
        self.store(hints)?
            .into_loaded()
            .map_err(|source| InputError::Spool { file, source })
    }

    /// Reads the recording of each foot in it: of each topic that is chosen in a bag, of the one foot
    /// in all other files.
    ///
    /// # Errors
    /// The first thing that is wrong with it, with file, line and column, or file, topic and message.
    pub fn store_all(self, hints: &Hints) -> Result<Vec<Stored>, InputError> {
        self.check_options(hints)?;
        let format = self.format;
        match self.source {
            Source::Table(table) => Ok(vec![read_table(*table, format, hints)?]),
            Source::Container(container) => read_container(container, hints),
        }
    }

    /// Reads it, in memory that does not grow with its length where it has names for its columns or
    /// topics.
    ///
    /// # Errors
    /// Those of [`Self::store_all`]; there are several feet.
    pub fn store(self, hints: &Hints) -> Result<Stored, InputError> {
        let file = self.file().to_owned();
        let mut feet = self.store_all(hints)?;
        match (feet.pop(), feet.is_empty()) {
            (Some(only), true) => Ok(only),
            (None, _) => Err(InputError::Empty { file }),
            (Some(last), false) => {
                let names = feet.iter().chain([&last]);
                let feet = names
                    .filter_map(|stored| stored.about.foot.clone())
                    .collect();
                Err(ContainerError::SeveralFeet { file, feet }.into())
            }
        }
    }

    /// Makes sure that options are not for another kind of file.
    fn check_options(&self, hints: &Hints) -> Result<(), InputError> {
        let file = || self.file().to_owned();
        let format = self.format;
        let TableOptions {
            mapping, time_unit, ..
        } = &hints.table;
        let options = match format.content() {
            Content::Fixed if hints.table != TableOptions::default() => {
                "--map and --time-unit are for csv and parquet, --units and --times for mcap and \
                 rosbag2, too"
            }
            Content::Messages if !mapping.is_empty() || time_unit.is_some() => {
                "--map and --time-unit are for csv and parquet"
            }
            _ if format.content() != Content::Messages && hints.bag != BagOptions::default() => {
                let file = file();
                return Err(ContainerError::BagOptions { file, format }.into());
            }
            _ => return Ok(()),
        };
        Err(InputError::TableOptions {
            file: file(),
            format,
            options,
        })
    }

    /// Reads a `csv` or Parquet that has the columns `qw`, `qx`, `qy` and `qz`, too: a unit quaternion per
    /// row, Hamilton, sensor → world, z up, blank where it is not known. Gives it for each sample, from
    /// the frame of the foot, as the samples are; `None`, too, where a column `movement` says that the
    /// row does not count. Whatever the format of a table is said to be, it is read as a `csv`.
    ///
    /// # Errors
    /// The first thing that is wrong with it, with file, line and column; no row counts; or it is a bag,
    /// whose orientations are those of an estimator.
    pub fn read_with_orientation(
        self,
        hints: &Hints,
    ) -> Result<(Loaded, Vec<Option<Rotation>>), InputError> {
        let file = self.file().to_owned();
        let mut orientations = Orientations::default();
        let stored = match self.source {
            Source::Table(table) => csv::read(*table, hints, &mut orientations)?,
            #[cfg(feature = "parquet")]
            Source::Container(container) if self.format == Format::Parquet => {
                parquet::read(&container, hints, &mut orientations)?
            }
            Source::Container(_) => {
                let format = self.format;
                return Err(ContainerError::NoTruth { file, format }.into());
            }
        };
        if orientations.rows.iter().all(Option::is_none) {
            return Err(InputError::NoOrientation { file });
        }
        let loaded = stored
            .into_loaded()
            .map_err(|source| InputError::Spool { file, source })?;
        // The truth is the sensor's, the samples are the foot's.
        let to_sensor = mounting::rotation(&hints.correction.mounting).inverse();
        let turn = |truth: Option<Rotation>| truth.map(|truth| truth.after(to_sensor));
        Ok((loaded, orientations.rows.into_iter().map(turn).collect()))
    }
}

fn read_table(table: Table, format: Format, hints: &Hints) -> Result<Stored, InputError> {
    let file = table.file().to_owned();
    let loaded = match format {
        Format::PceAtlas => pce::read_robot(table, LabelScheme::StableOrNot, hints),
        Format::Lcd => pce::read_robot(table, LabelScheme::ContactClass, hints),
        Format::PceGo1 => pce::read_go1(table, hints),
        // What is in a container is no table.
        Format::Csv | Format::Parquet | Format::Mcap | Format::Rosbag2 => {
            return csv::read(table, hints, &mut ());
        }
    }?;
    Stored::from_loaded(loaded).map_err(|source| InputError::Spool { file, source })
}

#[cfg_attr(
    not(feature = "bags"),
    allow(clippy::needless_pass_by_value, reason = "a bag is read to its end")
)]
#[cfg_attr(
    not(any(feature = "bags", feature = "parquet")),
    allow(unused_variables, reason = "without readers nothing is asked")
)]
fn read_container(container: Container, hints: &Hints) -> Result<Vec<Stored>, InputError> {
    match container.format {
        #[cfg(feature = "bags")]
        Format::Mcap | Format::Rosbag2 => bag::read(container, hints),
        #[cfg(feature = "parquet")]
        Format::Parquet => Ok(vec![parquet::read(&container, hints, &mut ())?]),
        format => {
            let feature = format.missing_feature().unwrap_or_default();
            Err(ContainerError::not_built(container.file, format, feature).into())
        }
    }
}

/// Reads a file.
///
/// # Errors
/// The first thing that is wrong with it, with file, line and column.
pub fn read(path: &Path, format: Format, hints: &Hints) -> Result<Loaded, InputError> {
    Opened::new(path, Some(format))?.read(hints)
}

/// [`Opened::read_with_orientation`] of a file that is a `csv`.
///
/// # Errors
/// Those of opening the file and of reading it.
pub fn read_with_orientation(
    path: &Path,
    hints: &Hints,
) -> Result<(Loaded, Vec<Option<Rotation>>), InputError> {
    Opened::new(path, Some(Format::Csv))?.read_with_orientation(hints)
}

/// The columns that a mapping names.
const OURS: [&str; 7] = ["t", "ax", "ay", "az", "wx", "wy", "wz"];

/// The format of a table, where its first row leaves no doubt: a header that names a known column,
/// if not quite as it should. What else is wrong with the header, the reader will say.
fn guess_format(table: &mut Table) -> Result<Format, InputError> {
    let Some(first) = table.peek_row()? else {
        return Err(table.empty());
    };
    let first = first.clone();
    if header::is_header(&first) || layout::is_table(table)? {
        Ok(Format::Csv)
    } else {
        let names: Vec<String> = first.cells().map(str::to_owned).collect();
        Err(InputError::UnknownFormat {
            file: table.file().to_owned(),
            suggestion: layout::example(&OURS, &names),
        })
    }
}
