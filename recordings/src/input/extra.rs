//! Columns of a `csv` that are no part of a recording.

use super::cells::Cells;
use super::error::InputError;
use super::table::Row;

/// A reader of the columns of a table that are no part of a recording.
pub(super) trait ExtraColumns {
    /// Whether it reads the column of this name.
    fn reads(&self, name: &str) -> bool;

    /// Takes in the header.
    fn header(&mut self, header: &Row, file: &str) -> Result<(), InputError>;

    /// The columns that it reads, by their index.
    #[cfg(feature = "parquet")]
    fn used(&self) -> Vec<usize>;

    /// Takes in a row.
    fn row(&mut self, row: &impl Cells) -> Result<(), InputError>;

    /// Leaves out the rows for which `kept` has a false.
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
