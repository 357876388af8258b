//! Position in a file, for messages.

use thiserror::Error;

/// Position of a row in a file.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum RowPlace {
    /// Line number in a text, from 1.
    #[error(", line {0}")]
    Line(u64),
    /// Row number, from 1, in a file without lines.
    #[error(", row {0}")]
    Row(u64),
    /// The names of the columns, in a file without lines.
    #[error("")]
    Names,
}

/// Position of a cell in a file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{file}{place}, column {column} ({name})")]
pub struct Cell {
    /// Path of the file, as given.
    pub file: String,
    /// Row of the cell.
    pub place: RowPlace,
    /// Column, from 1.
    pub column: usize,
    /// Name of the column.
    pub name: String,
}
