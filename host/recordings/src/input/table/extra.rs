//! Columns of a `csv` that are not part of a recording.

use super::cells::Cells;
use super::reader::Row;
use crate::input::error::InputError;

/// Reader of the columns of a table that are not part of a recording.
pub(in crate::input) trait ExtraColumns {
    /// Returns whether it reads the column of this name.
    fn reads(&self, name: &str) -> bool;

    /// Processes the header.
    fn header(&mut self, header: &Row, file: &str) -> Result<(), InputError>;

    /// Indices of the columns that it reads.
    #[cfg(feature = "parquet")]
    fn used(&self) -> Vec<usize>;

    /// Processes a row.
    fn row(&mut self, row: &impl Cells) -> Result<(), InputError>;

    /// Removes the rows whose flag in `kept` is false.
    fn retain(&mut self, kept: &[bool]);
}

/// No extra columns.
impl ExtraColumns for () {
    fn reads(&self, _: &str) -> bool {
        false
    }

    fn header(&mut self, _: &Row, _: &str) -> Result<(), InputError> {
        Ok(())
    }

    #[cfg(feature = "parquet")]
    fn used(&self) -> Vec<usize> {
        Vec::new()
    }

    fn row(&mut self, _: &impl Cells) -> Result<(), InputError> {
        Ok(())
    }

    fn retain(&mut self, _: &[bool]) {}
}
