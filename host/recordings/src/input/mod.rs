//! Reads files into recordings: SI units, one clock, and a notice for everything left out.
//!
//! | step | file |
//! |---|---|
//! | the public type [`Opened`]: a file of known format, and its reading | this one |
//! | formats by name; opening of files by their first bytes | `format`, `open` |
//! | properties that a format does not carry: units, times, gravity, mounting, topics | `options` |
//! | `csv`, `parquet`: named columns | [`table`] |
//! | `mcap`, `rosbag2`, `rosbag1`: bags of ROS 2 and ROS 1 | `bag` |
//! | `pce-atlas`, `pce-go1`, `lcd`: published recordings of robots | [`published`] |
//! | rows on one clock and in order, and the stored recording: the result | `stored` |
//! | the rate of the rows; smooth times | `rate`; `smooth` |
//! | recorded contacts as the estimates | [`contacts`] |
//! | errors, with their position | [`error`] |
//! | dates with times | [`iso8601`] |
//!
//! Parquet and bags are read only with the features `parquet` and `bags`, and only from a disk: data from a pipe
//! or compressed data are copied first. All others are tables of numbers separated by commas, semicolons or tabs,
//! plain or compressed with gzip or zstd. Windows line ends, blank lines, lines that begin with `#`, spaces around
//! cells and a UTF-8 byte order mark are accepted, as are `nan`, `inf` and numbers beyond f32 in an axis: the
//! estimator flags such a sample as invalid and gives it mass 0.

#[cfg(feature = "bags")]
pub mod bag;
pub mod contacts;
pub mod error;
mod format;
pub mod iso8601;
mod open;
mod options;
pub mod published;
pub(crate) mod rate;
mod smooth;
mod stored;
pub mod table;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use error::OptionsFor;
use open::{Container, Readable};
#[cfg(feature = "parquet")]
use table::parquet;
use table::reader::Table;
use table::{csv, header};

pub use error::{InputError, Place, Problem, RowPlace};
pub use format::{Content, Format};
pub use options::{
    BagOptions, ContactUse, Correction, InputOptions, LoadTopic, Rename, Topics, is_among,
    matches_pattern, without_effect,
};
pub use rate::{TimesSoFar, rate_of_times, unit_of_step};
pub use stored::{About, Loaded, RecordedEstimate, Repairs, Stored};
pub use table::options::{
    AccelerationUnit, Decimal, Mapping, RateUnit, Scale, TableOptions, TimeUnit, Times, Units,
};
pub use table::reader::recording_name;

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
