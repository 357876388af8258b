//! Where in a file something is, for messages.

use std::fmt;

/// Where in a file a row is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On this line of a text, from 1.
    Line(u64),
    /// This is its number among the rows, from 1, where there are no lines.
    Row(u64),
    /// It is not a row but what names the columns, where there are no lines.
    Names,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Row(row) => write!(f, ", row {row}"),
            Self::Names => Ok(()),
        }
    }
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// The file, as it was named.
    pub file: String,
    /// Its row.
    pub place: Place,
    /// Column, from 1.
    pub column: usize,
    /// The column's name.
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
