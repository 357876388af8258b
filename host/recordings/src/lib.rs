//! Reads files into recordings: SI units, one clock, and a notice for everything left out.
//!
//! [`Opened`] finds the format of a file by its first bytes, and gives the file to the crate that reads it:
//!
//! | files | crate |
//! |---|---|
//! | tables of named columns, and published recordings of robots | [`tables`] |
//! | bags of ROS 2 and ROS 1, with the feature `bags` | `bags` |
//! | the result of each: rows on one clock and in order, in a temporary file; errors with their position | [`stored`] |
//! | properties that a format does not carry: units, times, gravity, mounting, topics | [`options`] |
//!
//! Parquet and bags are read only with the features `parquet` and `bags`, and only from a disk: data from a pipe
//! or compressed data are copied first. All others are tables of numbers separated by commas, semicolons or tabs,
//! plain or compressed with gzip or zstd. Windows line ends, blank lines, lines that begin with `#`, spaces around
//! cells and a UTF-8 byte order mark are accepted, as are `nan`, `inf` and numbers beyond f32 in an axis: the
//! estimator flags such a sample as invalid and gives it mass 0.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use options::hint::Notice;
use options::{BagOptions, Content, Format, InputOptions, TableOptions, Times};
use stored::container::{Container, Readable};
use stored::error::{InputError, OptionsFor, Problem};
use stored::{Loaded, Stored, StreamedSample};
use tables::{Table, check_is_csv, published, read_csv, stream_csv};

/// An open file of known format. A table is read once and sequentially, so it may be a pipe.
pub struct Opened {
    source: Source,
    format: Format,
}

impl Opened {
    /// Opens a file, or the folder of a rosbag2. If no format is given, it is recognised by the first bytes;
    /// otherwise the file is a `csv` if its header has a known column or consists only of words, or if its first
    /// row is a message of ROS 2.
    ///
    /// # Errors
    /// The file cannot be opened, its kind is not supported, or it does not have the given format. Without a given
    /// format: the first line does not identify one.
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
        let text = match Readable::open(path, format, wrap, missing_feature)? {
            Readable::Text(text) => text,
            Readable::Container(container) => {
                let format = container.format;
                return Ok(Self { source: Source::Container(container), format });
            }
        };
        let mut table = Table::of(text)?;
        let format = match format {
            Some(format) => format,
            None => {
                check_is_csv(&mut table)?;
                Format::Csv
            }
        };
        Ok(Self { source: Source::Table(Box::new(table)), format })
    }

    /// Format of the file.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// Path of the file, as given.
    fn file(&self) -> &str {
        match &self.source {
            Source::Table(table) => &table.file,
            Source::Container(container) => &container.file,
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

    /// Reads the recording of each foot: one per selected topic of a bag, one per
    /// name in the column `foot` of a table, one in all other files.
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
            Source::Table(mut table) => {
                table.set_decimal(input_options.table.decimal);
                read_table(*table, self.format, input_options)?
            }
            #[cfg(feature = "bags")]
            Source::Container(container) if self.format.content() == Content::Messages => {
                bags::read(container, input_options)?
            }
            #[cfg(feature = "parquet")]
            Source::Container(container) if self.format == Format::Parquet => {
                tables::parquet::read(&container, input_options)?
            }
            Source::Container(Container { file, format, .. }) => {
                let feature = missing_feature(format).unwrap_or_default();
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

    /// Returns whether [`Self::stream`] can read the file: a table with a header, in which a time out of order is an error.
    #[must_use]
    pub fn can_stream(&self, input_options: &InputOptions) -> bool {
        matches!(self.source, Source::Table(_))
            && self.format == Format::Csv
            && matches!(input_options.table.times, Times::Auto | Times::Keep)
    }

    /// Reads a table while another program writes it. Passes each sample on as soon as its row is complete. At the end of
    /// the table, returns the notices about it.
    ///
    /// # Errors
    /// The errors of [`Self::store_all`], or the error of `each`.
    pub fn stream(
        self,
        input_options: &InputOptions,
        each: &mut dyn FnMut(StreamedSample) -> Result<(), InputError>,
    ) -> Result<Vec<Notice>, InputError> {
        self.check_options(input_options)?;
        match self.source {
            Source::Table(mut table) => {
                table.set_decimal(input_options.table.decimal);
                stream_csv(*table, input_options, each)
            }
            Source::Container(Container { file, format, .. }) => {
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
) -> Result<Vec<Stored>, InputError> {
    match format {
        Format::PceAtlas | Format::Lcd => {
            published::read_simulated(table, format, input_options).map(|only| vec![only])
        }
        Format::PceGo1 => published::read_go1(table, input_options).map(|only| vec![only]),
        // The content of a container is not a table.
        Format::Csv | Format::Parquet | Format::Mcap | Format::Rosbag2 | Format::Rosbag1 => {
            read_csv(table, input_options)
        }
    }
}

/// Content of an opened file.
enum Source {
    Table(Box<Table>),
    Container(Container),
}

/// Feature of this crate that reads files of a format, if missing in this build.
#[must_use]
pub const fn missing_feature(format: Format) -> Option<&'static str> {
    match format {
        Format::Parquet if !cfg!(feature = "parquet") => Some("parquet"),
        Format::Mcap | Format::Rosbag2 | Format::Rosbag1 if !cfg!(feature = "bags") => Some("bags"),
        _ => None,
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
