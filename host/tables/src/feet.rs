//! Feet in one table: a column that names the foot of each row.
//!
//! A column is taken for the column of the feet if the rows of its names alternate, or if the time goes back where the
//! name changes, as in tables of single feet that were joined. A column with another meaning, such as a contact, has
//! long runs of one name while the time advances.

use std::collections::BTreeSet;

use options::InputOptions;
use options::names::find_foot;

use crate::reader::{Cells, Row};

/// Number of first rows whose names are looked at.
pub const LOOKED_AT: usize = 512;

/// Most names of feet: enough for the feet of any robot and other sensors.
const MOST: usize = 32;

/// Share of the rows with another name than the row before from which a column names feet, if its names are words, and if
/// they are numbers. A contact changes in three rows of a hundred.
const LEAST_CHANGES_OF_WORDS: f64 = 0.1;
const LEAST_CHANGES_OF_NUMBERS: f64 = 0.25;

/// Column with the names of feet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FootColumn {
    /// There is none.
    None,
    /// The column with this index may name feet. It does if the time goes back where the name changes.
    Possible {
        /// Index of the column.
        index: usize,
        /// Name in all rows so far; `None` before the first.
        name: Option<String>,
    },
    /// The column with this index.
    Known(usize),
}

impl FootColumn {
    /// Finds the column in a header. It is known if an option names it.
    pub fn of(header: &Row, options: &InputOptions) -> Self {
        let names: Vec<String> = header.cells().map(str::to_owned).collect();
        let is_mapped = options.table.mapping.pairs().any(|(ours, _)| ours == "foot");
        match find_foot(&names) {
            Some(index) if is_mapped => Self::Known(index),
            Some(index) => Self::Possible { index, name: None },
            None => Self::None,
        }
    }

    /// Decides by the first rows.
    pub fn look_at<C: Cells>(&mut self, rows: impl Iterator<Item = C>) {
        if let Self::Possible { index, name: None } = *self {
            let names = rows.take(LOOKED_AT).map(|row| name_in(&row, index));
            if alternate(&names.collect::<Vec<_>>()) {
                *self = Self::Known(index);
            }
        }
    }

    /// Index of the column, if there may be one.
    #[cfg(feature = "parquet")]
    pub const fn index(&self) -> Option<usize> {
        match self {
            Self::None => None,
            Self::Possible { index, .. } | Self::Known(index) => Some(*index),
        }
    }
}

/// Name of the foot in a row.
pub fn name_in(row: &impl Cells, index: usize) -> String {
    row.shown(index).trim().to_owned()
}

/// Returns whether the rows of several names alternate.
fn alternate(names: &[String]) -> bool {
    let different: BTreeSet<&String> = names.iter().collect();
    let changes = names.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let are_numbers = different.iter().all(|name| name.parse::<f64>().is_ok());
    let least = if are_numbers { LEAST_CHANGES_OF_NUMBERS } else { LEAST_CHANGES_OF_WORDS };
    (2..=MOST).contains(&different.len()) && changes as f64 >= least * names.len() as f64
}
