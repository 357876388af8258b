//! Files become recordings: SI units, one clock, nothing lost without a word.
//!
//! | format | module |
//! |---|---|
//! | `csv`: a header names the columns | [`csv`] |
//! | `pce-atlas`, `pce-go1`, `lcd`: published recordings of robots | [`pce`] |
//! | `csv` with the true orientation, for scores | [`read_with_orientation`] |
//!
//! All of them are tables of numbers separated by commas. Windows line ends,
//! blank lines, spaces around cells and a UTF-8 byte order mark are fine. `nan`, `inf` and
//! numbers beyond f32 in an axis are accepted: the estimator flags such a sample as invalid and
//! gives it mass 0.

mod correction;
pub mod csv;
pub mod error;
pub mod pce;
mod table;
mod truth;

use std::path::Path;

use clap::ValueEnum;
use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Validity, Vec3};

pub use correction::Correction;
pub use error::{Cell, HeaderSlip, InputError};

use crate::gait::space::Rotation;
use crate::recording::Recording;
use pce::LabelScheme;
use table::Table;
use truth::Orientations;

/// How a file is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Simulated ATLAS of the method's authors: 13 columns, no header, 1 kHz, gravity removed
    PceAtlas,
    /// Real GO1 of the method's authors: force and IMU in g and °/s, no header, 250 Hz
    PceGo1,
    /// Simulated ATLAS and NAO of github.com/mrsp/lcd: 13 columns, no header, 100 Hz, gravity removed
    Lcd,
    /// A header naming any of t,ax,ay,az,wx,wy,wz,force,label,validity (s, m/s², rad/s, N, 0/1)
    Csv,
}

/// What the reader is told about a file beyond its format.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Sample rate in Hz, above 0, where somebody gave it.
    pub sample_rate: Option<f32>,
    /// Whether the samples contain gravity, where it differs from what the format says.
    pub gravity: Option<Gravity>,
    /// The sensor's static calibration.
    pub correction: Correction,
}

/// What came out of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The recording. Its first sample is at time 0.
    pub recording: Recording,
    /// What the file's clock says at the first sample, µs; 0 where the file has no clock. It may
    /// be negative, as before a trigger, or count from 1970.
    pub start_us: i64,
    /// One sentence on each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<String>,
}

/// A file that is open, with its format known. It is opened once and read once, so a pipe will do.
pub struct Opened {
    table: Table,
    format: Format,
}

impl Opened {
    /// Opens a file. Where no format is given, a header that names any known column makes it
    /// `csv`.
    ///
    /// # Errors
    /// The file cannot be opened, or no format is given and its first line does not tell.
    pub fn new(path: &Path, format: Option<Format>) -> Result<Self, InputError> {
        let mut table = Table::open(path)?;
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

    /// Reads it.
    ///
    /// # Errors
    /// The first thing that is wrong with it, with file, line and column.
    pub fn read(self, hints: &Hints) -> Result<Loaded, InputError> {
        match self.format {
            Format::PceAtlas => pce::read_robot(self.table, LabelScheme::StableOrNot, hints),
            Format::Lcd => pce::read_robot(self.table, LabelScheme::ContactClass, hints),
            Format::PceGo1 => pce::read_go1(self.table, hints),
            Format::Csv => csv::read(self.table, hints, &mut ()),
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

/// Reads a `csv` that has the columns `qw`, `qx`, `qy` and `qz`, too: a unit quaternion per row,
/// Hamilton, sensor → world, z up, blank where it is not known. Gives it for each sample; `None`,
/// too, where a column `movement` says that the row does not count.
///
/// # Errors
/// The first thing that is wrong with it, with file, line and column; or no row counts.
pub fn read_with_orientation(
    path: &Path,
    hints: &Hints,
) -> Result<(Loaded, Vec<Option<Rotation>>), InputError> {
    let mut orientations = Orientations::default();
    let loaded = csv::read(Table::open(path)?, hints, &mut orientations)?;
    if orientations.rows.iter().all(Option::is_none) {
        return Err(InputError::NoOrientation {
            file: path.display().to_string(),
        });
    }
    Ok((loaded, orientations.rows))
}

/// The format of a table, where its first row leaves no doubt: a header that names a known column,
/// if not quite as it should. What else is wrong with the header, the reader will say.
fn guess_format(table: &mut Table) -> Result<Format, InputError> {
    let Some(first) = table.peek_row()? else {
        return Err(table.empty());
    };
    if csv::is_header(first) {
        Ok(Format::Csv)
    } else {
        Err(InputError::UnknownFormat {
            file: table.file().to_owned(),
        })
    }
}

/// The time of row `index` at a steady `sample_rate` in Hz.
fn steady_time(index: usize, sample_rate: f32) -> Timestamp {
    let micros = index as f64 * 1.0e6 / f64::from(sample_rate);
    Timestamp::from_micros(micros.round() as u64)
}

/// A sample from six readings in SI units, in the order of
/// [`Axis::ALL`](estimator_core::Axis::ALL), with what is known to be wrong with them put right.
fn imu_sample(
    timestamp: Timestamp,
    readings: [f64; 6],
    validity: Validity,
    correction: &Correction,
) -> ImuSample {
    let [ax, ay, az, wx, wy, wz] = readings.map(|value| value as f32);
    let (specific_force, angular_rate) = correction.apply(
        SpecificForce(Vec3::new(ax, ay, az)),
        AngularRate(Vec3::new(wx, wy, wz)),
    );
    ImuSample {
        timestamp,
        specific_force,
        angular_rate,
        validity,
    }
}
