//! Tables of the estimates and events of feet, each of which waits in a temporary file until the tables of the previous
//! feet are written.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use estimator_core::ContactEstimate;
use stored::About;
use tables::output::{HEADER, RowNames, write_row};
use tempfile::SpooledTempFile;

use crate::events::{ContactEvent, write_event};

#[cfg(feature = "parquet")]
use std::fs::File;
#[cfg(feature = "parquet")]
use tables::parquet_output::{ParquetEstimates, join};

/// Layout of a table, given by the name of its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// CSV text.
    #[default]
    Csv,
    /// Parquet.
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

/// Estimates of one foot, buffered until the estimates of the preceding feet are written.
pub enum EstimateTable {
    /// CSV text.
    Csv(CsvRows),
    /// Parquet.
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

impl EstimateTable {
    /// Creates an empty table of a foot, with these names in its rows.
    ///
    /// # Errors
    /// The temporary file cannot be written, or Parquet is not built in.
    pub fn new(layout: Layout, names: RowNames, about: &About) -> io::Result<Self> {
        let (foot, start_us) = (names.of(about), about.start_us);
        Ok(match layout {
            Layout::Csv => Self::Csv(CsvRows::new(foot, start_us)),
            #[cfg(not(feature = "parquet"))]
            Layout::Parquet => {
                let what = "this program was built without the feature parquet";
                return Err(io::Error::new(io::ErrorKind::Unsupported, what));
            }
            #[cfg(feature = "parquet")]
            Layout::Parquet => Self::Parquet {
                foot,
                start_us,
                rows: Box::new(ParquetEstimates::new(tempfile::tempfile()?, names)?),
            },
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
pub fn write_tables(
    tables: Vec<EstimateTable>,
    names: RowNames,
    to: &mut dyn Write,
) -> io::Result<()> {
    #[cfg(feature = "parquet")]
    let mut files = Vec::new();
    let mut has_header = false;
    for table in tables {
        match table {
            EstimateTable::Csv(mut part) => {
                if !std::mem::replace(&mut has_header, true) {
                    names.write_header(HEADER, to)?;
                }
                part.write(to)?;
            }
            #[cfg(feature = "parquet")]
            EstimateTable::Parquet { rows, .. } => files.push(rows.finish()?),
        }
    }
    #[cfg(feature = "parquet")]
    if !files.is_empty() {
        join(files, to)?;
    }
    Ok(())
}

/// Bytes kept in memory.
const IN_MEMORY: usize = 8 << 20;

/// Rows of one foot in the table of estimates or of events.
pub struct CsvRows {
    foot: Option<String>,
    start_us: i64,
    rows: BufWriter<SpooledTempFile>,
}

impl CsvRows {
    /// Creates an empty part. `foot`, if given, is named in each row; `start_us` is the time of the recording's
    /// clock at timestamp 0, µs.
    #[must_use]
    pub fn new(foot: Option<String>, start_us: i64) -> Self {
        Self {
            foot,
            start_us,
            rows: BufWriter::with_capacity(1 << 16, SpooledTempFile::new(IN_MEMORY)),
        }
    }

    /// Appends an estimate.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn add(&mut self, estimate: &ContactEstimate) -> io::Result<()> {
        write_row(self.foot.as_deref(), estimate, self.start_us, &mut self.rows)
    }

    /// Appends an event.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn add_event(&mut self, event: &ContactEvent) -> io::Result<()> {
        write_event(self.foot.as_deref(), event, self.start_us, &mut self.rows)
    }

    /// Writes all rows.
    ///
    /// # Errors
    /// The errors of the writer and the temporary file.
    pub fn write(&mut self, to: &mut dyn Write) -> io::Result<()> {
        self.rows.seek(SeekFrom::Start(0))?;
        io::copy(self.rows.get_mut(), to)?;
        Ok(())
    }
}
