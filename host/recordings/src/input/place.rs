//! Position in a file, for messages.

use std::fmt;

/// Position of a row in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowPlace {
    /// Line number in a text, from 1.
    Line(u64),
    /// Row number, from 1, in a file without lines.
    Row(u64),
    /// The names of the columns, in a file without lines.
    Names,
}

impl fmt::Display for RowPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Row(row) => write!(f, ", row {row}"),
            Self::Names => Ok(()),
        }
    }
}

/// Position of a cell in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
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

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            file,
            place,
            column,
            name,
        } = self;
        write!(f, "{file}{place}, column {column} ({name})")
    }
}
