//! Files become recordings: SI units, one clock, nothing lost without a word.
//!
//! | step | file |
//! |---|---|
//! | the formats by name, and how a file is opened | `format`, this one |
//! | gzip and zstd, what separates columns, rows of cells with their line numbers | `compressed`, `head`, `table` |
//! | `csv`: a header names the columns | [`csv`]; `header`, `cells`, `clock`, `rate`, `time` |
//! | tables of others: options, names, ROS 2 without a header, dates, times out of order | [`options`], [`mapping`]; `layout`, `names`, `ros2`, `iso8601`, `times` |
//! | columns of a `csv` that are no part of a recording: the true orientation | `extra`, `truth` |
//! | `pce-atlas`, `pce-go1`, `lcd`: published recordings of robots | [`pce`] |
//! | rows in order, whatever they are read from, and where they go | `rows`, `stored` |
//! | the sensor's static calibration, and its mounting | `correction` |
//! | what comes out, and what can be wrong | `loaded`, [`error`] |
//!
//! All of them are tables of numbers separated by commas, semicolons or tabs, plain or compressed
//! with gzip or zstd. Windows line ends, blank lines, lines that begin with `#`, spaces around cells
//! and a UTF-8 byte order mark are fine. `nan`, `inf` and
//! numbers beyond f32 in an axis are accepted: the estimator flags such a sample as invalid and
//! gives it mass 0.

mod cells;
mod clock;
pub mod compressed;
mod correction;
pub mod csv;
pub mod error;
mod extra;
mod format;
mod head;
mod header;
mod iso8601;
mod layout;
mod loaded;
pub mod mapping;
mod names;
pub mod options;
pub mod pce;
mod rate;
mod ros2;
mod rows;
mod stored;
mod table;
pub mod time;
mod times;
mod truth;

use std::fs::File;
use std::io::Read;
use std::path::Path;

pub use correction::Correction;
pub use error::{Cell, HeaderSlip, InputError};
pub use format::Format;
pub use loaded::{Hints, Loaded, Repairs};
pub use mapping::Mapping;
pub use options::{AccelerationUnit, RateUnit, TableOptions, TimeUnit, Times, Units};
pub use stored::{About, Stored};

use crate::mounting;
use crate::space::Rotation;
use pce::LabelScheme;
use table::{Table, unwrapped};
use truth::Orientations;

/// A file that is open, with its format known. It is opened once and read once, so a pipe will do.
pub struct Opened {
    table: Table,
    format: Format,
}

impl Opened {
    /// Opens a file. Where no format is given, a header that names any known column makes it
    /// `csv`, and so does one of words only, or a message of ROS 2 for a first row.
    ///
    /// # Errors
    /// The file cannot be opened, or no format is given and its first line does not show it.
    pub fn new(path: &Path, format: Option<Format>) -> Result<Self, InputError> {
        Self::through(path, format, unwrapped)
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
        let mut table = Table::open(path, wrap)?;
        let format = match format {
            Some(format) => format,
            None => guess_format(&mut table)?,
        };
        Ok(Self { table, format })
    }

    /// How the file is laid out.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// Reads it into memory.
    ///
    /// # Errors
    /// The first thing that is wrong with it, with file, line and column.
    pub fn read(self, hints: &Hints) -> Result<Loaded, InputError> {
        let file = self.table.file().to_owned();
        self.store(hints)?
            .into_loaded()
            .map_err(|source| InputError::Spool { file, source })
    }

    /// Reads the recording of each foot in it.
    ///
    /// # Errors
    /// Those of [`Self::read`].
    pub fn store_all(self, hints: &Hints) -> Result<Vec<Stored>, InputError> {
        Ok(vec![self.store(hints)?])
    }

    /// Reads it, in memory that does not grow with its length where it is a `csv`.
    ///
    /// # Errors
    /// Those of [`Self::read`].
    pub fn store(self, hints: &Hints) -> Result<Stored, InputError> {
        if self.format != Format::Csv && hints.table != TableOptions::default() {
            return Err(InputError::TableOptions {
                file: self.table.file().to_owned(),
                format: self.format,
            });
        }
        let file = self.table.file().to_owned();
        let loaded = match self.format {
            Format::Csv => return csv::read(self.table, hints, &mut ()),
            Format::PceAtlas => pce::read_robot(self.table, LabelScheme::StableOrNot, hints),
            Format::Lcd => pce::read_robot(self.table, LabelScheme::ContactClass, hints),
            Format::PceGo1 => pce::read_go1(self.table, hints),
        }?;
        Stored::from_loaded(loaded).map_err(|source| InputError::Spool { file, source })
    }

    /// Reads a `csv` that has the columns `qw`, `qx`, `qy` and `qz`, too: a unit quaternion per
    /// row, Hamilton, sensor → world, z up, blank where it is not known. Gives it for each sample, from
    /// the frame of the foot, as the samples are; `None`, too, where a column `movement` says that the
    /// row does not count. Whatever the format is said to be, the file is read as a `csv`.
    ///
    /// # Errors
    /// The first thing that is wrong with it, with file, line and column; or no row counts.
    pub fn read_with_orientation(
        self,
        hints: &Hints,
    ) -> Result<(Loaded, Vec<Option<Rotation>>), InputError> {
        let file = self.table.file().to_owned();
        let mut orientations = Orientations::default();
        let stored = csv::read(self.table, hints, &mut orientations)?;
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

/// The format of a table, where its first row leaves no doubt: a header that names a known column,
/// if not quite as it should. What else is wrong with the header, the reader will say.
fn guess_format(table: &mut Table) -> Result<Format, InputError> {
    let Some(first) = table.peek_row()? else {
        return Err(table.empty());
    };
    if header::is_header(first) || layout::is_table(table)? {
        Ok(Format::Csv)
    } else {
        Err(InputError::UnknownFormat {
            file: table.file().to_owned(),
        })
    }
}
