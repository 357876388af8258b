//! Feet in one table: a column that names the foot of each row.
//!
//! A column of a known name is taken for the column of the feet if the rows of its names alternate, or if the time goes back
//! where the name changes, as in tables of single feet that were joined. A column with another meaning, such as a contact,
//! has long runs of one name while the time advances.

use std::collections::BTreeSet;

use options::InputOptions;
use options::names::find_feet;

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
    /// One of these columns may name feet. It does if the time goes back where its name changes.
    Possible(Vec<Candidate>),
    /// The column with this index.
    Known(usize),
}

/// Column that may name feet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Candidate {
    /// Index of the column.
    pub index: usize,
    /// Name in the newest row; `None` before the first. In a table that is not a stream, all rows so far have this name.
    pub name: Option<String>,
    /// Names in the first rows of a stream, whose later rows cannot be looked at.
    names: Vec<String>,
}

/// Number of rows of a stream after which its names are looked at.
const LOOKED_AT_IN_STREAM: usize = 32;

impl Candidate {
    /// Adds the name in a row of a stream. Returns the feet, if the names so far alternate.
    pub fn feet_in_stream(&mut self, name: String) -> Option<Vec<String>> {
        self.name = Some(name.clone());
        if self.names.len() == LOOKED_AT_IN_STREAM {
            return None;
        }
        self.names.push(name);
        let feet: BTreeSet<&String> = self.names.iter().collect();
        // A counter names no feet.
        let are_feet = self.names.len() == LOOKED_AT_IN_STREAM
            && feet.len() <= LOOKED_AT_IN_STREAM / 4
            && alternate(&self.names);
        are_feet.then(|| feet.into_iter().cloned().collect())
    }
}

impl FootColumn {
    /// Finds the column in a header. It is known if an option names it.
    pub fn of(header: &Row, options: &InputOptions) -> Self {
        let names: Vec<String> = header.cells().map(str::to_owned).collect();
        let is_mapped = options.table.mapping.pairs().any(|(ours, _)| ours == "foot");
        match find_feet(&names)[..] {
            // An option gives its column the best name.
            [first, ..] if is_mapped => Self::Known(first),
            ref found => Self::possible(
                found
                    .iter()
                    .map(|index| Candidate { index: *index, ..Candidate::default() })
                    .collect(),
            ),
        }
    }

    /// The columns that are left.
    pub fn possible(candidates: Vec<Candidate>) -> Self {
        if candidates.is_empty() { Self::None } else { Self::Possible(candidates) }
    }

    /// Decides by the first rows.
    pub fn look_at<C: Cells>(&mut self, rows: impl Iterator<Item = C>) {
        let Self::Possible(candidates) = &*self else {
            return;
        };
        let mut names = vec![Vec::new(); candidates.len()];
        for row in rows.take(LOOKED_AT) {
            for (names, candidate) in names.iter_mut().zip(candidates) {
                names.push(name_in(&row, candidate.index));
            }
        }
        let mut columns = candidates.iter().zip(&names);
        if let Some((candidate, _)) = columns.find(|(_, names)| alternate(names)) {
            *self = Self::Known(candidate.index);
            return;
        }
        // A counter names no feet.
        let are_few = |names: &Vec<String>| names.iter().collect::<BTreeSet<_>>().len() <= MOST;
        let few = candidates.iter().zip(&names).filter(|(_, names)| are_few(names));
        *self = Self::possible(few.map(|(candidate, _)| candidate.clone()).collect());
    }

    /// Restricts the columns that may be one.
    #[cfg(feature = "parquet")]
    pub fn retain(&mut self, is_read: impl Fn(usize) -> bool) {
        if let Self::Possible(candidates) = self {
            candidates.retain(|candidate| is_read(candidate.index));
        }
    }

    /// Indices of the columns that are read.
    #[cfg(feature = "parquet")]
    pub fn indices(&self) -> Vec<usize> {
        match self {
            Self::None => Vec::new(),
            Self::Possible(candidates) => {
                candidates.iter().map(|candidate| candidate.index).collect()
            }
            Self::Known(index) => vec![*index],
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
