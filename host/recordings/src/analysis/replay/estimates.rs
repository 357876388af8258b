//! Table of estimates of one foot, in CSV or Parquet, and the tables of all feet in one file.

#[cfg(feature = "parquet")]
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use crate::output::{TableFeet, write_header};
#[cfg(feature = "parquet")]
use crate::parquet_output::{ParquetEstimates, join};
use estimator_core::ContactEstimate;

use super::part::Part;

/// Layout of a table, given by the name of its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// CSV text.
    #[default]
    Csv,
    /// As Parquet.
    Parquet,
}

impl Layout {
    /// File extensions of the layouts.
    pub const EXTENSIONS: [&'static str; 2] = ["csv", "parquet"];

    /// Returns Parquet for a file name with that extension, and text for any other, such as a pipe's.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("parquet") { Self::Parquet } else { Self::Csv }
    }
}

/// Estimates of one foot, buffered until those of the preceding feet are written.
pub enum Estimates {
    /// CSV text.
    Csv(Part),
    /// As Parquet.
    #[cfg(feature = "parquet")]
    Parquet {
        /// Name of the foot, if the table names it.
        foot: Option<String>,
        /// Time of the recording's clock at timestamp 0, µs.
        start_us: i64,
        /// Rows, in a temporary file.
        rows: Box<ParquetEstimates<File>>,
    },
}

impl Estimates {
    /// Creates an empty table; `foot`, if given, is named in each row.
    ///
    /// # Errors
    /// The temporary file cannot be written, or Parquet is not built in.
    pub fn new(layout: Layout, foot: Option<String>, start_us: i64) -> io::Result<Self> {
        Ok(match layout {
            Layout::Csv => Self::Csv(Part::new(foot, start_us)),
            #[cfg(not(feature = "parquet"))]
            Layout::Parquet => {
                let what = "this program was built without the feature parquet";
                return Err(io::Error::new(io::ErrorKind::Unsupported, what));
            }
            #[cfg(feature = "parquet")]
            Layout::Parquet => {
                let feet = foot.as_ref().map_or(TableFeet::One, |_| TableFeet::Several);
                Self::Parquet {
                    foot,
                    start_us,
                    rows: Box::new(ParquetEstimates::new(tempfile::tempfile()?, feet)?),
                }
            }
        })
    }

    /// Appends an estimate.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn add(&mut self, estimate: &ContactEstimate) -> io::Result<()> {
        match self {
            Self::Csv(part) => part.add(estimate),
            #[cfg(feature = "parquet")]
            Self::Parquet { foot, start_us, rows } => {
                rows.add(foot.as_deref(), estimate, *start_us)
            }
        }
    }
}

/// Writes the tables of all feet as one.
///
/// # Errors
/// The errors of the writer and the temporary files.
pub fn write(tables: Vec<Estimates>, feet: TableFeet, to: &mut dyn Write) -> io::Result<()> {
    #[cfg(feature = "parquet")]
    let mut files = Vec::new();
    let mut has_header = false;
    for table in tables {
        match table {
            Estimates::Csv(mut part) => {
                if !std::mem::replace(&mut has_header, true) {
                    write_header(feet, to)?;
                }
                part.write(to)?;
            }
            #[cfg(feature = "parquet")]
            Estimates::Parquet { rows, .. } => files.push(rows.finish()?),
        }
    }
    #[cfg(feature = "parquet")]
    if !files.is_empty() {
        join(files, to)?;
    }
    Ok(())
}
