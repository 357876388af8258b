//! Errors in a file, and their position.

use std::{fmt, io};

use thiserror::Error;

use crate::file_kind::FileKind;
use crate::input::format::Format;
use crate::input::hints::LoadTopic;
use crate::input::iso8601::micros_since_1970;
use crate::input::table::names::options;
use crate::input::table::options::{Mapping, TimeUnit, Units, is_ours};
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

/// Limit of times around zero, s, so that microseconds are exact: up to here an f64 holds a decimal number to half
/// a microsecond. Seconds since 1970 reach it in 2096.
pub(super) const MAX_TIME_S: f64 = 4.0e9;

/// Hint for times that are plausible only as milliseconds.
pub const MILLISECONDS_HINT: &str =
    "; column t looks like milliseconds, but is read in s: --time-unit ms";

/// Hint for times that are plausible only as microseconds.
pub const MICROSECONDS_HINT: &str =
    "; column t looks like microseconds, but is read in s: --time-unit us";

/// Hint for times that are too close for samples.
pub const BATCHES_HINT: &str = "; rows that arrive in batches are spaced by --times rate";

/// End of the description of a topic whose messages are those of ROS 1.
const OF_ROS_1: &str = " in ros1)";

const ROS_1_ADVICE: &str =
    "; these are messages of ROS 1: give the .bag that they are from, or record with ROS 2";

/// A topic with samples of an IMU.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuTopic {
    /// Name of the topic.
    pub name: String,
    /// Frame of its messages, if the topic has several.
    pub frame: Option<String>,
    /// Number of messages.
    pub messages: u64,
    /// Message rate, Hz; `None` if there are fewer than two messages.
    pub rate: Option<f64>,
}

/// How a foot on a serial line is made to send its samples.
pub(super) const STREAM_ADVICE: &str = "; a foot sends its samples on a serial line after footfall foot SOURCE set uart_streams.raw_sample=1";

impl fmt::Display for ImuTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        if let Some(frame) = &self.frame {
            write!(f, " frame {frame:?}")?;
        }
        write!(f, " ({} messages", self.messages)?;
        match self.rate {
            Some(rate) => write!(f, ", {rate:.0} Hz)"),
            None => write!(f, ")"),
        }
    }
}

/// List of topics or other names.
fn listed<T: fmt::Display>(names: &[T]) -> String {
    match names {
        [] => "nothing".to_owned(),
        _ => first_of(names, 20),
    }
}

/// Joins the first names with commas, and counts the rest.
pub(super) fn first_of<T: fmt::Display>(
    names: impl IntoIterator<Item = T>,
    shown: usize,
) -> String {
    let mut names = names.into_iter();
    let first: Vec<_> = names.by_ref().take(shown).map(|name| name.to_string()).collect();
    match names.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// Reason why a file is not read as its first bytes suggest.
#[derive(Debug, Error)]
pub enum ContainerError {
    /// The file is of an unsupported kind.
    #[error("{file} is {kind}; {}", kind.advice().unwrap_or("it is not read here"))]
    Foreign {
        /// Path of the file, as given.
        file: String,
        /// Kind of the file.
        kind: FileKind,
    },
    /// The file could be read, but not by this build.
    #[error("{file} is {format}, and this program was built without the feature {feature}")]
    NotBuilt {
        /// Path of the file, as given.
        file: String,
        /// Format of the file.
        format: Format,
        /// Feature of this crate that reads it.
        feature: &'static str,
    },
    /// The file is not in the given format.
    #[error(
        "{file} is {}, but was given as --format {given}",
        found.map_or("a table or of no kind that is known", Format::name)
    )]
    OtherFormat {
        /// Path of the file, as given.
        file: String,
        /// Given format.
        given: Format,
        /// Format found, if known.
        found: Option<Format>,
    },
    /// A folder contains no recordings.
    #[error("{file} is a folder without files of a rosbag2: .mcap or .db3")]
    Folder {
        /// Path of the folder, as given.
        file: String,
    },
    /// The content does not match the first bytes.
    #[error("{file} is damaged: {source}{}", advice.map(|advice| format!("; {advice}")).unwrap_or_default())]
    Damaged {
        /// Path of the file, as given.
        file: String,
        /// Error of its reader.
        source: Box<dyn std::error::Error + Send + Sync>,
        /// Advice for recovery.
        advice: Option<&'static str>,
    },
    /// No topic has samples of an IMU.
    #[error(
        "{file} has no topic of sensor_msgs/msg/Imu in CDR; there is {}{}{}{}",
        listed(topics),
        if topics.iter().any(|topic| topic.ends_with(OF_ROS_1)) { ROS_1_ADVICE } else { "" },
        with_axes.as_ref().map(|topic| format!("; {topic} has six axes, of a foot or of the trunk: --topic {topic}")).unwrap_or_default(),
        if *has_contacts { STREAM_ADVICE } else { "" }
    )]
    NoImu {
        /// Path of the file, as given.
        file: String,
        /// Topics with their types.
        topics: Vec<String>,
        /// A topic whose messages of another type have the axes of one IMU.
        with_axes: Option<String>,
        /// Whether feet have sent contacts.
        has_contacts: bool,
    },
    /// A topic that was named has no axes of an IMU.
    #[error("{file}, topic {topic}: {message} is read by its fields: {what}")]
    ImuFields {
        /// Path of the file, as given.
        file: String,
        /// The topic, or the part of its messages.
        topic: String,
        /// Type of its messages.
        message: String,
        /// Half a sentence on what is missing.
        what: String,
    },
    /// A topic has no message.
    #[error("{file}: topic {topic} has no message; there is {}", listed(topics))]
    NoMessage {
        /// Path of the file, as given.
        file: String,
        /// The topic, or all of them.
        topic: String,
        /// All topics with samples of an IMU.
        topics: Vec<ImuTopic>,
    },
    /// A topic is missing.
    #[error("{file} has no topic {topic} of {wanted}; there is {}", listed(topics))]
    NoSuchTopic {
        /// Path of the file, as given.
        file: String,
        /// Name of the topic.
        topic: String,
        /// Expected content.
        wanted: &'static str,
        /// Topics in the file.
        topics: Vec<String>,
    },
    /// No IMU has the selected frame.
    #[error("{file} has no IMU with the frame {frame:?}; it has {}", listed(frames))]
    NoSuchFrame {
        /// Path of the file, as given.
        file: String,
        /// The frame.
        frame: String,
        /// All topics with samples of an IMU, and their frames.
        frames: Vec<ImuTopic>,
    },
    /// The topic of the foot is ambiguous.
    #[error(
        "{file} has several IMUs, choose with {}, or --topic all: {}",
        choosers(topics),
        listed(topics)
    )]
    SeveralTopics {
        /// Path of the file, as given.
        file: String,
        /// All topics with samples of an IMU.
        topics: Vec<ImuTopic>,
    },
    /// The file has several feet, but one is expected.
    #[error("{file} has several feet, and one is wanted here: {}", listed(feet))]
    SeveralFeet {
        /// Path of the file, as given.
        file: String,
        /// Names of the feet.
        feet: Vec<String>,
    },
    /// A message does not match its topic.
    #[error("{file}, topic {topic}, message {number}: {what}")]
    Message {
        /// Path of the file, as given.
        file: String,
        /// The topic.
        topic: String,
        /// Number of the message in its topic, from 1.
        number: u64,
        /// Description of the error.
        what: String,
    },
    /// All messages of a topic mark a sensor as missing.
    #[error(
        "{file}, topic {topic}: its messages have no {sensor}, as {sensor}_covariance[0] = -1 says"
    )]
    Absent {
        /// Path of the file, as given.
        file: String,
        /// The topic.
        topic: String,
        /// Field of the sensor.
        sensor: &'static str,
    },
    /// The number of loads differs from the number of feet.
    #[error(
        "{file}: there are loads for {} of {} feet: give --load-topic once for each of {}",
        loads.len(),
        feet.len(),
        listed(feet)
    )]
    LoadCount {
        /// Path of the file, as given.
        file: String,
        /// Loads.
        loads: Vec<LoadTopic>,
        /// Topics of the feet, in order.
        feet: Vec<String>,
    },
    /// Two feet would have one name.
    #[error("{file}: two feet would be {name}: --rename gives each foot a name of its own")]
    TwoFeet {
        /// File.
        file: String,
        /// The name.
        name: String,
    },
    /// A foot that is to be renamed is not in the file.
    #[error("{file} has no foot {name} to rename; there is {}", listed(feet))]
    NoFootToRename {
        /// Path of the file, as given.
        file: String,
        /// Name of the foot.
        name: String,
        /// Topics of the feet.
        feet: Vec<String>,
    },
    /// A load has no such field.
    #[error("{file}: {load} is no load: {message} {what}")]
    LoadField {
        /// Path of the file, as given.
        file: String,
        /// Load.
        load: LoadTopic,
        /// Type of its messages.
        message: String,
        /// Half a sentence on its fields.
        what: String,
    },
    /// Options for bags are given for a file of another format.
    #[error(
        "{file} is read as {format}: --topic, --not-topic, --frame and --load-topic are for mcap and rosbag2"
    )]
    BagOptions {
        /// Path of the file, as given.
        file: String,
        /// Format of the file.
        format: Format,
    },
    /// A column does not hold numbers.
    #[error("{file}: column {column} has values of type {found}, which cannot be read as {wanted}")]
    ColumnType {
        /// Path of the file, as given.
        file: String,
        /// Name of the column.
        column: String,
        /// Type found.
        found: String,
        /// Expected type.
        wanted: &'static str,
    },
}

/// Options that select one of these.
fn choosers(topics: &[ImuTopic]) -> &'static str {
    let has_frames = topics.iter().any(|topic| topic.frame.is_some());
    let has_topics = topics.windows(2).any(|two| two[0].name != two[1].name);
    match (has_topics, has_frames) {
        (true, true) => "--topic and --frame",
        (false, true) => "--frame",
        (_, false) => "--topic",
    }
}

impl ContainerError {
    /// Returns whether the same file may be read elsewhere: a program or a feature is missing here.
    #[must_use]
    pub const fn is_of_this_machine(&self) -> bool {
        matches!(self, Self::Foreign { kind: FileKind::Ros1Bag, .. } | Self::NotBuilt { .. })
    }
}
