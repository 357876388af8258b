//! What can be wrong with a file, and where.

use std::{fmt, io};

use thiserror::Error;

use super::format::Format;
use super::iso8601::micros_since_1970;
use super::mapping::{Mapping, is_ours};
use super::options::{TimeUnit, Units};
pub use super::place::{Cell, Place};
use super::refusal::ContainerError;
use super::time::{MAX_TIME_S, MILLISECONDS_HINT};
use crate::number::{shown, shown_rate};

/// How the names in a header may be meant, although none is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeaderSlip {
    /// They are in upper case.
    UpperCase,
    /// They are separated by something else than commas.
    Separator(char),
}

impl fmt::Display for HeaderSlip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UpperCase => f.write_str("names are written in lower case"),
            Self::Separator(found) => {
                write!(
                    f,
                    "columns are separated by commas, semicolons or tabs, not by {found:?}"
                )
            }
        }
    }
}

/// What may help a header that is not understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Suggestion {
    /// The mapping that may be meant.
    Meant(Mapping),
    /// A mapping of the header's first names, to show how one is written.
    Example(Mapping),
}

impl fmt::Display for Suggestion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Meant(mapping) => write!(f, "did you mean --map {mapping}?"),
            Self::Example(mapping) => write!(
                f,
                "--map says which columns stand for them, such as --map {mapping}"
            ),
        }
    }
}

/// The end of an error about a header: what to do about it.
fn header_hint(slip: Option<HeaderSlip>, suggestion: Option<&Suggestion>) -> String {
    match (slip, suggestion) {
        (Some(slip), _) => format!("; {slip}"),
        (None, Some(suggestion)) => format!("; {suggestion}"),
        (None, None) => String::new(),
    }
}

/// A time as it stands in a file, with its unit unless it is a date.
fn time_text(text: &str, unit: TimeUnit) -> String {
    if micros_since_1970(text).is_some() {
        text.to_owned()
    } else {
        format!("{text} {}", unit.name())
    }
}

/// As much of a cell's text as fits a line.
fn excerpt(text: &str) -> String {
    const SHOWN: usize = 40;
    let mut first: String = text.chars().take(SHOWN).collect();
    if first.len() < text.len() {
        first.push('…');
    }
    first
}

/// The end of an error about a cell that should hold a number, where it tells what it is.
fn cell_hint(text: &str) -> &'static str {
    let has_comma = text.matches(',').count() == 1;
    if has_comma && text.replace(',', ".").parse::<f64>().is_ok() {
        ": a point comes before the fraction, not a comma (pandas.read_csv(…, sep=\";\", decimal=\",\") reads such tables)"
    } else if Units::are_named(text) || TimeUnit::written(text).is_some() {
        ": take out the line of units, and name them with --units and --time-unit"
    } else if is_ours(text) {
        ": the header stands here again, as where two tables were put into one file"
    } else {
        ""
    }
}

/// The end of an error about a time that would be one in a smaller unit.
fn unit_hint(text: &str, unit: TimeUnit) -> &'static str {
    let most = MAX_TIME_S * TimeUnit::Nanoseconds.per_second();
    let is_time = text.parse::<f64>().is_ok_and(|time| time.abs() <= most);
    if is_time && unit != TimeUnit::Nanoseconds {
        "; --time-unit says the unit: s, ms, us or ns"
    } else {
        ""
    }
}

/// Why a file is no recording. Lines and columns count from 1.
#[derive(Debug, Error)]
pub enum InputError {
    /// It is not read as what its first bytes say.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// The file cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// The file, as it was named.
        file: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// It is named twice among those that are taken together.
    #[error("{file} is named twice: what it shows would count twice")]
    Twice {
        /// The file, as it was named the second time.
        file: String,
    },
    /// There is no sample in it.
    #[error("{file} is empty: it holds no sample")]
    Empty {
        /// The file, as it was named.
        file: String,
    },
    /// No format was given and the first line does not show it.
    #[error(
        "{file} has no header that names the six axes, so its format must be given: --format pce-atlas, pce-go1, lcd or csv{}",
        header_hint(None, suggestion.as_ref())
    )]
    UnknownFormat {
        /// The file, as it was named.
        file: String,
        /// How its columns are named, where they have names.
        suggestion: Option<Suggestion>,
    },
    /// A cell in quotes holds rows.
    #[error(
        "{file}, line {line}: a quote opens here and is open until line {until}, so that the rows between would be lost: remove it"
    )]
    RowsInQuotes {
        /// The file, as it was named.
        file: String,
        /// Where the quote opens.
        line: u64,
        /// Where it closes, or the end of the file.
        until: u64,
    },
    /// A row does not end.
    #[error(
        "{file}, line {line}: a row of more than {most_bytes} bytes: the file is no table, or a quote that opens here is never closed"
    )]
    LongRow {
        /// The file, as it was named.
        file: String,
        /// Where it begins.
        line: u64,
        /// As many bytes a row may have.
        most_bytes: usize,
    },
    /// The name of a column tells another unit than that in which it is read.
    #[error(
        "{file}{place}: column {name:?} is in {unit} by its name, but would be read in {read_in}: --units {units}"
    )]
    NamedUnit {
        /// The file, as it was named.
        file: String,
        /// Where the header is.
        place: Place,
        /// The column's name.
        name: String,
        /// The unit in its name.
        unit: &'static str,
        /// The unit in which it would be read.
        read_in: &'static str,
        /// The units in which all columns would be read as their names tell.
        units: Units,
    },
    /// A line is not text.
    #[error("{file}, line {line}, column {column}: not UTF-8 text")]
    NotUtf8 {
        /// The file, as it was named.
        file: String,
        /// The line.
        line: u64,
        /// The column.
        column: usize,
    },
    /// A line has too many or too few cells.
    #[error("{file}{place}: {found} columns where {expected} are expected")]
    ColumnCount {
        /// The file, as it was named.
        file: String,
        /// The row.
        place: Place,
        /// How many it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
    /// The header lacks columns that every recording needs.
    #[error(
        "{file}{place}: missing in the header: {columns}{}",
        header_hint(*slip, suggestion.as_ref())
    )]
    MissingColumns {
        /// The file, as it was named.
        file: String,
        /// Where the header is.
        place: Place,
        /// The missing names, separated by commas.
        columns: String,
        /// Where they may be all the same.
        slip: Option<HeaderSlip>,
        /// The columns that may be meant.
        suggestion: Option<Suggestion>,
    },
    /// A column of a mapping is not in the header.
    #[error("{file}{place}: there is no column {name:?} to map; there are {columns}")]
    NoSuchColumn {
        /// The file, as it was named.
        file: String,
        /// Where the header is.
        place: Place,
        /// The name in the mapping.
        name: String,
        /// The names in the header.
        columns: String,
    },
    /// A column of a mapping may be several.
    #[error(
        "{file}{place}: {name:?} may be {} or {}: give more of its name",
        candidates[0],
        candidates[1]
    )]
    AmbiguousColumn {
        /// The file, as it was named.
        file: String,
        /// Where the header is.
        place: Place,
        /// The name in the mapping.
        name: String,
        /// Two columns that it fits.
        candidates: [String; 2],
    },
    /// There are several sensors in one table.
    #[error(
        "{file}{place}: {} and {} are of two sensors: choose one, such as --map {mapping}",
        candidates[0],
        candidates[1]
    )]
    SeveralSensors {
        /// The file, as it was named.
        file: String,
        /// Where the header is.
        place: Place,
        /// The first axis of two of them.
        candidates: [String; 2],
        /// A mapping that chooses the first.
        mapping: Mapping,
    },
    /// Options for tables with a header are given for a format that has its own columns and units.
    #[error("{file} is read as {format}, which has columns, units and times of its own: {options}")]
    TableOptions {
        /// The file, as it was named.
        file: String,
        /// Its format.
        format: Format,
        /// Which options are for other formats.
        options: &'static str,
    },
    /// The header names a column twice.
    #[error("{cell}: this name stands in the header twice")]
    DuplicateColumn {
        /// The second of the two.
        cell: Cell,
    },
    /// A cell that needs a number has none.
    #[error("{cell}: blank where a number is needed")]
    Blank {
        /// The cell.
        cell: Cell,
    },
    /// A cell holds something else than a number.
    #[error("{cell}: {:?} is not a number{}", excerpt(text), cell_hint(text))]
    NotANumber {
        /// The cell.
        cell: Cell,
        /// What it holds.
        text: String,
    },
    /// A label is neither 0 nor 1.
    #[error("{cell}: label {text} where 0 (not stable) or 1 (stable) is expected")]
    Label {
        /// The cell.
        cell: Cell,
        /// What it holds.
        text: String,
    },
    /// The true orientation, or whether it counts, is not what it may be.
    #[error("{cell}: {text} where {expected} is expected")]
    Truth {
        /// The cell.
        cell: Cell,
        /// What it holds.
        text: String,
        /// What it may be.
        expected: &'static str,
    },
    /// The orientation is what an estimator made of the very samples.
    #[error(
        "{file}: qw, qx, qy and qz are estimates here, as the column p_stable beside them tells, and no truth"
    )]
    EstimatedOrientation {
        /// The file, as it was named.
        file: String,
    },
    /// There is nothing to score.
    #[error(
        "{file}: no row has an orientation that counts: qw, qx, qy and qz filled in and, where there is a column movement, a 1 in it"
    )]
    NoOrientation {
        /// The file, as it was named.
        file: String,
    },
    /// A validity has a name that means nothing here.
    #[error(
        "{cell}: {text:?} where valid, accelerometer_saturated, gyroscope_saturated, both_saturated, stale or invalid is expected"
    )]
    Validity {
        /// The cell.
        cell: Cell,
        /// What it holds.
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
        /// What it holds.
        text: String,
        /// The unit in which it is read.
        unit: TimeUnit,
    },
    /// Time does not advance by at least a microsecond.
    #[error(
        "{cell}: time {} does not come after {previous} {} in the row before; --times drop-bad \
         leaves such rows out, --times rate spaces rows by the sample rate",
        time_text(text, *unit),
        unit.name()
    )]
    TimeOrder {
        /// The cell.
        cell: Cell,
        /// The time as it stands there.
        text: String,
        /// The unit in which it is read.
        unit: TimeUnit,
        /// The time of the row before, in that unit.
        previous: f64,
    },
    /// Time does not advance by at least a microsecond, in a file that has no lines.
    #[error(
        "{file}: the time of a message does not come after {} s, the one before; --times drop-bad \
         leaves such messages out, --times rate spaces them by the sample rate",
        *previous_us as f64 / 1.0e6
    )]
    MessageOrder {
        /// The file, as it was named.
        file: String,
        /// The time of the message before, µs.
        previous_us: i64,
    },
    /// The samples cannot be kept while they are looked at.
    #[error(
        "{file}: its samples cannot be kept in {}: {source}; the variable TMPDIR names another folder",
        std::env::temp_dir().display()
    )]
    Spool {
        /// The file, as it was named.
        file: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// Cells that belong together are filled in part.
    #[error(
        "{cell}: IMU values after a row that had none; rows of force alone may only stand at the end"
    )]
    ImuAfterForceOnly {
        /// The cell.
        cell: Cell,
    },
    /// The sample rate is not known.
    #[error(
        "{file} has no times that tell the sample rate, so it must be given: --sample-rate HZ{}",
        time_column
            .as_ref()
            .map(|name| format!("; did you mean `t` for `{name}`? --map t={name}"))
            .unwrap_or_default()
    )]
    UnknownSampleRate {
        /// The file, as it was named.
        file: String,
        /// A column that may hold the times.
        time_column: Option<String>,
    },
    /// Times that were taken for those since 1970 make no rate that a sensor has.
    #[error(
        "{file}: column t was taken for {} since 1970, but looks like {}: --time-unit {}",
        read_in.name(),
        meant.name(),
        meant.name()
    )]
    GuessedUnit {
        /// The file, as it was named.
        file: String,
        /// The unit in which the times were read.
        read_in: TimeUnit,
        /// The one in which they make sense.
        meant: TimeUnit,
    },
    /// The times contradict the sample rate that was given.
    #[error(
        "{file}: column t says {} Hz, but the sample rate was given as {} Hz{}",
        shown_rate(*measured),
        shown(*given),
        if *in_milliseconds { MILLISECONDS_HINT } else { "" }
    )]
    SampleRateConflict {
        /// The file, as it was named.
        file: String,
        /// The rate that the times make, Hz.
        measured: f64,
        /// The rate that was given, Hz.
        given: f32,
        /// Whether they would agree if the times were in milliseconds.
        in_milliseconds: bool,
    },
}

impl InputError {
    /// Whether what is compressed ends before its end.
    pub(super) fn ended_early(&self) -> bool {
        matches!(self, Self::Unreadable { source, .. } if source.kind() == io::ErrorKind::UnexpectedEof)
    }

    /// Whether it may come from a row whose end is missing, which has as many cells.
    pub(super) fn may_be_a_cut(&self, cells: usize) -> bool {
        match self {
            Self::ColumnCount {
                found, expected, ..
            } => found < expected,
            Self::NotANumber { cell, .. } | Self::Blank { cell } | Self::Validity { cell, .. } => {
                cell.column == cells
            }
            _ => false,
        }
    }

    /// With a column that may hold the times, where none was known to.
    pub(super) fn with_time_column(self, column: Option<String>) -> Self {
        match self {
            Self::UnknownSampleRate { file, .. } => Self::UnknownSampleRate {
                file,
                time_column: column.filter(|name| name != "t"),
            },
            other => other,
        }
    }
}
