//! Files become recordings: SI units, one clock, nothing lost without a word.
//!
//! | format | module |
//! |---|---|
//! | `csv`: a header names the columns | [`csv`] |
//! | `pce-atlas`, `pce-go1`: the recordings of the method's authors | [`pce`] |
//!
//! All of them are tables of numbers separated by commas. Windows line ends,
//! blank lines, spaces around cells and a UTF-8 byte order mark are fine. `nan`, `inf` and
//! numbers beyond f32 in an axis are accepted: the estimator flags such a sample as invalid and
//! gives it mass 0.

pub mod csv;
pub mod error;
pub mod pce;
mod table;

use std::path::Path;

use clap::ValueEnum;
use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Validity, Vec3};

pub use error::{Cell, InputError};

use crate::recording::Recording;
use table::Table;

/// How a file is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Simulated ATLAS of the method's authors: 13 columns, no header, 1 kHz, gravity removed
    PceAtlas,
    /// Real GO1 of the method's authors: force and IMU in g and °/s, no header, 250 Hz
    PceGo1,
    /// A header naming any of t,ax,ay,az,wx,wy,wz,force,label (s, m/s², rad/s, N, 0/1)
    Csv,
}

/// What the reader is told about a file beyond its format.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Sample rate in Hz, above 0, where somebody gave it.
    pub sample_rate: Option<f32>,
    /// Whether the samples contain gravity, where it differs from what the format says.
    pub gravity: Option<Gravity>,
}

/// What came out of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The recording.
    pub recording: Recording,
    /// One sentence on each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<String>,
}

/// Reads a file.
///
/// # Errors
/// The first thing that is wrong with it, with file, line and column.
pub fn read(path: &Path, format: Format, hints: &Hints) -> Result<Loaded, InputError> {
    match format {
        Format::PceAtlas => pce::read_atlas(path, hints),
        Format::PceGo1 => pce::read_go1(path, hints),
        Format::Csv => csv::read(path, hints),
    }
}

/// The format of a file, where its first line leaves no doubt: a header that names all six axes.
///
/// # Errors
/// The file cannot be read, or its first line does not tell.
pub fn guess_format(path: &Path) -> Result<Format, InputError> {
    let mut table = Table::open(path)?;
    let columns = match table.next_row() {
        Ok(Some(header)) => csv::Columns::from_header(&header),
        // What is wrong with the line does not matter yet: it is no header.
        Ok(None) | Err(InputError::NotUtf8 { .. }) => None,
        Err(error) => return Err(error),
    };
    match columns {
        Some(columns) if columns.missing().is_empty() => Ok(Format::Csv),
        _ => Err(InputError::UnknownFormat {
            file: table.file().to_owned(),
        }),
    }
}

/// Where a recording comes from, as its title: the file's name without its extension.
fn recording_name(path: &Path) -> String {
    path.file_stem()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// The time of row `index` at a steady `sample_rate` in Hz.
fn steady_time(index: usize, sample_rate: f32) -> Timestamp {
    let micros = index as f64 * 1.0e6 / f64::from(sample_rate);
    Timestamp::from_micros(micros.round() as u64)
}

/// A sample from six numbers in SI units, in the order of [`Axis::ALL`](estimator_core::Axis::ALL).
fn imu_sample(timestamp: Timestamp, axes: [f64; 6], validity: Validity) -> ImuSample {
    let [ax, ay, az, wx, wy, wz] = axes.map(|value| value as f32);
    ImuSample {
        timestamp,
        specific_force: SpecificForce(Vec3::new(ax, ay, az)),
        angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
        validity,
    }
}
