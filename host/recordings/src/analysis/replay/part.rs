//! Rows of one foot in a table, buffered until those of the preceding feet are written.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use crate::events::{ContactEvent, write_event};
use crate::output::write_row;
use estimator_core::ContactEstimate;
use tempfile::SpooledTempFile;

/// Bytes kept in memory.
const IN_MEMORY: usize = 8 << 20;

/// Rows of one foot in the table of estimates or of events.
pub struct Part {
    foot: Option<String>,
    start_us: i64,
    rows: BufWriter<SpooledTempFile>,
}

impl Part {
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
