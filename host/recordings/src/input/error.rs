//! Errors in a file, and their position.

use std::io;

use thiserror::Error;

use super::format::Format;
use super::iso8601::micros_since_1970;
pub use super::place::{Cell, RowPlace};
use super::refusal::ContainerError;
use super::table::mapping::{Mapping, is_ours};
use super::table::options::{TimeUnit, Units};
use super::table::sensors::options;
use super::time::{MAX_TIME_S, MILLISECONDS_HINT};
use crate::number::{shown, shown_rate};

/// Suggestion for a header that is not understood.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Suggestion {
    /// Known names are in upper case.
    #[error("names are written in lower case")]
    UpperCase,
    /// Known names are separated by this character instead of commas.
    #[error("columns are separated by commas, semicolons or tabs, not by {0:?}")]
    Separator(char),
    /// Mapping that may be intended.
    #[error("did you mean --map {0}?")]
    Meant(Mapping),
    /// Mapping of the header's first names, as an example of the syntax.
    #[error("--map says which columns stand for them, such as --map {0}")]
    Example(Mapping),
}

/// End of an error about a header: how to resolve it.
fn header_hint(suggestion: Option<&Suggestion>) -> String {
    suggestion.map_or_else(String::new, |suggestion| format!("; {suggestion}"))
}

/// A time as written in a file, with its unit unless it is a date.
fn time_text(text: &str, unit: TimeUnit) -> String {
    if micros_since_1970(text).is_some() {
        text.to_owned()
    } else {
        format!("{text} {}", unit.name())
    }
}

/// Text of a cell, shortened to fit a line.
fn excerpt(text: &str) -> String {
    const SHOWN: usize = 40;
    let mut first: String = text.chars().take(SHOWN).collect();
    if first.len() < text.len() {
        first.push('…');
    }
    first
}

/// End of an error about a cell that should hold a number, if the text shows its kind.
fn cell_hint(text: &str) -> &'static str {
    let has_comma = text.matches(',').count() == 1;
    if has_comma && text.replace(',', ".").parse::<f64>().is_ok() {
        ": a comma before the fraction, not between thousands, is read with --decimal ,"
    } else if Units::are_named(text) || TimeUnit::written(text).is_some() {
        ": take out the line of units, and name them with --units and --time-unit"
    } else if is_ours(text) {
        ": the header stands here again, as where two tables were put into one file"
    } else {
        ""
    }
}

/// End of an error about a time that would be valid in a smaller unit.
fn unit_hint(text: &str, unit: TimeUnit) -> &'static str {
    let most = MAX_TIME_S * TimeUnit::Nanoseconds.per_second();
    let is_time = text.parse::<f64>().is_ok_and(|time| time.abs() <= most);
    if is_time && unit != TimeUnit::Nanoseconds {
        "; --time-unit says the unit: s, ms, us or ns"
    } else {
        ""
    }
}

/// Reason why a file is not a recording. Lines and columns count from 1.
#[derive(Debug, Error)]
pub enum InputError {
    /// The content does not match its first bytes or options.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// The file cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// Path of the file, as given.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is named twice among files that are read together.
    #[error("{file} is named twice: what it shows would count twice")]
    Twice {
        /// The file, as given the second time.
        file: String,
    },
    /// The file has no samples.
    #[error("{file} is empty: it holds no sample")]
    Empty {
        /// Path of the file, as given.
        file: String,
    },
    /// No format was given and the first line does not identify it.
    #[error(
        "{file} has no header that names the six axes, so its format must be given: --format pce-atlas, pce-go1, lcd or csv{}",
        header_hint(suggestion.as_ref())
    )]
    UnknownFormat {
        /// Path of the file, as given.
        file: String,
        /// How to map its columns, if they have names.
        suggestion: Option<Suggestion>,
    },
    /// A quoted cell holds rows.
    #[error(
        "{file}, line {line}: a quote opens here and is open until line {until}, so that the rows between would be lost: remove it"
    )]
    RowsInQuotes {
        /// Path of the file, as given.
        file: String,
        /// Line of the opening quote.
        line: u64,
        /// Line of the closing quote, or the end of the file.
        until: u64,
    },
    /// A row is too long.
    #[error(
        "{file}, line {line}: a row of more than {most_bytes} bytes: the file is not a table, or a quote that opens here is never closed"
    )]
    LongRow {
        /// Path of the file, as given.
        file: String,
        /// Line at which it begins.
        line: u64,
        /// Longest row, bytes.
        most_bytes: usize,
    },
    /// The unit in the name of a column differs from the unit in which it is read.
    #[error(
        "{file}{place}: column {name:?} is in {unit} by its name, but would be read in {read_in}: --units {units}"
    )]
    NamedUnit {
        /// Path of the file, as given.
        file: String,
        /// Position of the header.
        place: RowPlace,
        /// Name of the column.
        name: String,
        /// Unit in its name.
        unit: &'static str,
        /// Unit in which it would be read.
        read_in: &'static str,
        /// Units that match the names of all columns.
        units: Units,
    },
    /// A line is not text.
    #[error("{file}, line {line}, column {column}: not UTF-8 text")]
    NotUtf8 {
        /// Path of the file, as given.
        file: String,
        /// Number of the line.
        line: u64,
        /// Number of the column.
        column: usize,
    },
    /// A line has too many or too few cells.
    #[error("{file}{place}: {found} columns where {expected} are expected")]
    ColumnCount {
        /// Path of the file, as given.
        file: String,
        /// Position of the row.
        place: RowPlace,
        /// Number of cells found.
        found: usize,
        /// Number of cells expected.
        expected: usize,
    },
    /// The header lacks required columns.
    #[error(
        "{file}{place}: missing in the header: {columns}{}",
        header_hint(suggestion.as_ref())
    )]
    MissingColumns {
        /// Path of the file, as given.
        file: String,
        /// Position of the header.
        place: RowPlace,
        /// Missing names, separated by commas.
        columns: String,
        /// Reason why they may be present after all, or columns that may be intended.
        suggestion: Option<Suggestion>,
    },
    /// A column of a mapping is not in the header.
    #[error("{file}{place}: there is no column {name:?} to map; there are {columns}")]
    NoSuchColumn {
        /// Path of the file, as given.
        file: String,
        /// Position of the header.
        place: RowPlace,
        /// Name in the mapping.
        name: String,
        /// Names in the header.
        columns: String,
    },
    /// A column of a mapping is ambiguous.
    #[error(
        "{file}{place}: {name:?} may be {} or {}: give more of its name",
        candidates[0],
        candidates[1]
    )]
    AmbiguousColumn {
        /// Path of the file, as given.
        file: String,
        /// Position of the header.
        place: RowPlace,
        /// Name in the mapping.
        name: String,
        /// Two columns that match it.
        candidates: [String; 2],
    },
    /// A table has several sensors.
    #[error(
        "{file}{place}: {} are of different sensors: choose one, {}",
        candidates.join(", "),
        options(mappings)
    )]
    SeveralSensors {
        /// Path of the file, as given.
        file: String,
        /// Position of the header.
        place: RowPlace,
        /// First axis of each.
        candidates: Vec<String>,
        /// Mapping that selects each.
        mappings: Vec<Mapping>,
    },
    /// Options for tables with a header are given for a format with fixed columns and units.
    #[error("{file} is read as {format}, which has columns, units and times of its own: {options}")]
    TableOptions {
        /// Path of the file, as given.
        file: String,
        /// Format of the file.
        format: Format,
        /// Options that apply to other formats.
        options: &'static str,
    },
    /// The header has a duplicate column.
    #[error("{cell}: this name stands in the header twice")]
    DuplicateColumn {
        /// The second of the two.
        cell: Cell,
    },
    /// A required number is blank.
    #[error("{cell}: blank where a number is needed")]
    Blank {
        /// The cell.
        cell: Cell,
    },
    /// A cell does not hold a number.
    #[error("{cell}: {:?} is not a number{}", excerpt(text), cell_hint(text))]
    NotANumber {
        /// The cell.
        cell: Cell,
        /// Content of the cell.
        text: String,
    },
    /// A label is neither 0 nor 1.
    #[error("{cell}: label {text} where 0 (not stable) or 1 (stable) is expected")]
    Label {
        /// The cell.
        cell: Cell,
        /// Content of the cell.
        text: String,
    },
    /// A validity has an unknown name.
    #[error(
        "{cell}: {text:?} where valid, accelerometer_saturated, gyroscope_saturated, both_saturated, stale or invalid is expected"
    )]
    Validity {
        /// The cell.
        cell: Cell,
        /// Content of the cell.
        text: String,
    },
    /// A time is not finite, or too far from zero.
    #[error(
        "{cell}: {0} is no time in {1}: -{2:e} to {2:e} is expected{3}",
        excerpt(text),
        unit.name(),
        MAX_TIME_S * unit.per_second(),
        unit_hint(text, *unit)
    )]
    Time {
        /// The cell.
        cell: Cell,
        /// Content of the cell.
        text: String,
        /// Unit in which it is read.
        unit: TimeUnit,
    },
    /// A time is not at least 1 µs after the previous one.
    #[error(
        "{cell}: time {} does not come after {previous} {} in the row before: sort the rows, \
         leave such rows out with --times drop-bad, or space all by the sample rate with --times rate",
        time_text(text, *unit),
        unit.name()
    )]
    TimeOrder {
        /// The cell.
        cell: Cell,
        /// Time as written in the file.
        text: String,
        /// Unit in which it is read.
        unit: TimeUnit,
        /// Time of the previous row, in that unit.
        previous: f64,
    },
    /// A time is not at least 1 µs after the previous one, in a file without lines.
    #[error(
        "{file}: the time of a message does not come after {} s, the one before; --times drop-bad \
         leaves such messages out, --times rate spaces them by the sample rate",
        *previous_us as f64 / 1.0e6
    )]
    MessageOrder {
        /// Path of the file, as given.
        file: String,
        /// Time of the previous message, µs.
        previous_us: i64,
    },
    /// The samples cannot be buffered.
    #[error(
        "{file}: its samples cannot be kept in {}: {source}; the variable TMPDIR names another folder",
        std::env::temp_dir().display()
    )]
    Spool {
        /// Path of the file, as given.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Cells that belong together are only partly filled.
    #[error(
        "{cell}: IMU values after a row that had none; rows of force alone may only stand at the end"
    )]
    ImuAfterForceOnly {
        /// The cell.
        cell: Cell,
    },
    /// The sample rate is unknown.
    #[error(
        "{file} has no times that tell the sample rate, so it must be given: --sample-rate HZ{}",
        time_column
            .as_ref()
            .map(|name| format!("; did you mean `t` for `{name}`? --map t={name}"))
            .unwrap_or_default()
    )]
    UnknownSampleRate {
        /// Path of the file, as given.
        file: String,
        /// Column that may hold the times.
        time_column: Option<String>,
    },
    /// Times taken for times since 1970 yield an implausible rate.
    #[error(
        "{file}: column t was taken for {} since 1970, but looks like {}: --time-unit {}",
        read_in.name(),
        meant.name(),
        meant.name()
    )]
    GuessedUnit {
        /// Path of the file, as given.
        file: String,
        /// Unit in which the times were read.
        read_in: TimeUnit,
        /// Unit in which they are plausible.
        meant: TimeUnit,
    },
    /// The times contradict the given sample rate.
    #[error(
        "{file}: column t says {} Hz, but the sample rate was given as {} Hz{}",
        shown_rate(*measured),
        shown(*given),
        if *in_milliseconds { MILLISECONDS_HINT } else { "" }
    )]
    SampleRateConflict {
        /// Path of the file, as given.
        file: String,
        /// Rate of the times, Hz.
        measured: f64,
        /// Given rate, Hz.
        given: f32,
        /// Whether they would agree with times in milliseconds.
        in_milliseconds: bool,
    },
}

impl InputError {
    pub(crate) fn empty(file: &str) -> Self {
        let file = file.to_owned();
        Self::Empty { file }
    }

    pub(crate) fn unreadable(file: &str, source: io::Error) -> Self {
        let file = file.to_owned();
        Self::Unreadable { file, source }
    }

    pub(crate) fn spool(file: &str, source: io::Error) -> Self {
        let file = file.to_owned();
        Self::Spool { file, source }
    }

    /// Returns whether compressed data end early.
    pub(super) fn ended_early(&self) -> bool {
        matches!(self, Self::Unreadable { source, .. } if source.kind() == io::ErrorKind::UnexpectedEof)
    }

    /// Returns whether the error may come from a truncated row with this number of cells.
    pub(super) fn may_be_a_cut(&self, cells: usize) -> bool {
        match self {
            Self::ColumnCount { found, expected, .. } => found < expected,
            Self::NotANumber { cell, .. } | Self::Blank { cell } | Self::Validity { cell, .. } => {
                cell.column == cells
            }
            _ => false,
        }
    }

    /// Adds a column that may hold the times, if no column is known to.
    pub(super) fn with_time_column(self, column: Option<String>) -> Self {
        match self {
            Self::UnknownSampleRate { file, .. } => {
                Self::UnknownSampleRate { file, time_column: column.filter(|name| name != "t") }
            }
            other => other,
        }
    }
}
