//! Errors in a file: the file, the position, the problem, and the remedy.

use std::fmt::{self, Display, Formatter};
use std::io;

use files::file_kind::FileKind;
use options::display_in_plain_words;
use options::hint::{Hint, InWords, Setting, Vocabulary};
use options::{Format, LoadTopic, Mapping, TimeUnit, Units, is_ours};
use samples::number::{shown, shown_rate};

use crate::iso8601::{is_in_another_form, micros_since_1970};
use crate::list::listed;

pub use crate::list::first_of;

pub use crate::bag_problem::{
    DefinitionProblem, FieldsProblem, KnownLoad, LoadProblem, MessageProblem, Unsupported,
};

/// An error in a file.
#[derive(Debug)]
pub struct InputError {
    /// Path of the file, as given.
    pub file: String,
    /// Place in the file.
    pub place: Place,
    /// Error, with the values that are wrong.
    pub problem: Problem,
}

/// Place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A row.
    Row(RowPlace),
    /// A cell of a row.
    Cell {
        /// Row of the cell.
        row: RowPlace,
        /// Column, from 1.
        column: usize,
        /// Name of the column; empty if it is not known.
        name: String,
    },
    /// A topic, or a part of its messages.
    Topic(String),
    /// A message of a topic, by its number, from 1.
    Message {
        /// The topic.
        topic: String,
        /// Number of the message in its topic.
        number: u64,
    },
}

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

impl Display for RowPlace {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Row(row) => write!(f, ", row {row}"),
            Self::Names => Ok(()),
        }
    }
}

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Row(row) => row.fmt(f),
            Self::Cell { row, column, name } if name.is_empty() => {
                write!(f, "{row}, column {column}")
            }
            Self::Cell { row, column, name } => write!(f, "{row}, column {column} ({name})"),
            Self::Topic(topic) => write!(f, ", topic {topic}"),
            Self::Message { topic, number } => write!(f, ", topic {topic}, message {number}"),
        }
    }
}

/// Problem of a file. Lines and columns count from 1.
#[derive(Debug)]
pub enum Problem {
    /// The file cannot be opened or read.
    Unreadable(io::Error),
    /// The samples cannot be kept in a temporary file.
    Spool(io::Error),
    /// The file is named twice among files that are read together.
    Twice,
    /// The file has no samples.
    Empty,
    /// No format was given and the first line does not identify it.
    UnknownFormat {
        /// How to map its columns, if they have names.
        mapping: Option<Mapping>,
    },
    /// The content is not in the given format.
    OtherFormat {
        /// Given format.
        given: Format,
        /// Format found, if known.
        found: Option<Format>,
    },
    /// The file is of an unsupported kind.
    Foreign(FileKind),
    /// The file could be read, but not by this build.
    NotBuilt {
        /// Format of the file.
        format: Format,
        /// Feature of this crate that reads it.
        feature: &'static str,
    },
    /// The content does not match the first bytes.
    Damaged {
        /// Error of its reader.
        source: Box<dyn std::error::Error + Send + Sync>,
        /// Advice for recovery.
        advice: Option<&'static str>,
    },
    /// The file uses a part of its format that is not read.
    NotSupported(Unsupported),
    /// Options are given for a file to which they do not apply.
    Options {
        /// Format of the file.
        format: Format,
        /// The options.
        given: OptionsFor,
    },
    /// A folder contains no recordings.
    Folder,

    /// A quoted cell holds rows.
    RowsInQuotes {
        /// Line of the closing quote, or the end of the file.
        until: u64,
    },
    /// A row is too long.
    LongRow {
        /// Longest row, bytes.
        most_bytes: usize,
    },
    /// A line is not text.
    NotUtf8,
    /// A line has too many or too few cells.
    ColumnCount {
        /// Number of cells found.
        found: usize,
        /// Number of cells expected.
        expected: usize,
    },
    /// The header lacks required columns.
    MissingColumns {
        /// Missing names, separated by commas.
        columns: String,
        /// Reason why the columns may be present after all, or columns that may be meant.
        hint: Option<Hint>,
    },
    /// A column of a mapping is not in the header.
    NoSuchColumn {
        /// Name in the mapping.
        name: String,
        /// Names in the header.
        columns: String,
    },
    /// A column of a mapping is ambiguous.
    AmbiguousColumn {
        /// Name in the mapping.
        name: String,
        /// Two columns that match it.
        candidates: [String; 2],
    },
    /// The header has a duplicate column.
    DuplicateColumn,
    /// A table has several sensors.
    SeveralSensors {
        /// First axis of each.
        candidates: Vec<String>,
        /// Mapping that selects each.
        mappings: Vec<Mapping>,
    },
    /// The unit in the name of a column differs from the unit in which it is read.
    NamedUnit {
        /// Name of the column.
        name: String,
        /// Unit in its name.
        unit: &'static str,
        /// Unit in which it would be read.
        read_in: &'static str,
        /// Units that match the names of all columns.
        units: Units,
    },
    /// A column does not hold numbers.
    ColumnType {
        /// Name of the column.
        column: String,
        /// Type found.
        found: String,
        /// Expected type.
        wanted: &'static str,
    },
    /// A required number is blank.
    Blank,
    /// A cell, with this content, does not hold a number.
    NotANumber(String),
    /// A label is neither 0 nor 1, but this.
    Label(String),
    /// A validity has an unknown name.
    Validity(String),
    /// IMU values follow a row that had none.
    ImuAfterForceOnly,

    /// A time is not finite, or too far from zero.
    Time {
        /// Content of the cell.
        text: String,
        /// Unit in which it is read.
        unit: TimeUnit,
        /// Unit in which it is plausible, if known.
        meant: Option<TimeUnit>,
    },
    /// A time is not at least 1 µs after the previous one.
    TimeOrder {
        /// Time as written in the file.
        text: String,
        /// Unit in which it is read.
        unit: TimeUnit,
        /// Time of the previous row, in that unit.
        previous: f64,
    },
    /// A time is not at least 1 µs after the previous one, in a file without lines.
    MessageOrder {
        /// Time of the previous message, µs.
        previous_us: i64,
        /// Whether it is the same time.
        repeats: bool,
    },
    /// Rows would be left out though only their stamps jitter.
    Jitter {
        /// Number of rows that would be left out.
        rows: usize,
        /// Number of all rows.
        of: usize,
    },
    /// The sample rate is unknown.
    UnknownSampleRate {
        /// Column that may hold the times.
        time_column: Option<String>,
    },
    /// Times taken for times since 1970 yield an implausible rate.
    GuessedUnit {
        /// Unit in which the times were read.
        read_in: TimeUnit,
        /// Unit in which they are plausible.
        meant: TimeUnit,
    },
    /// The rate is too low for a foot in the unit of the times, but not in another one.
    UnitOfTimes {
        /// Rate in the unit, Hz.
        rate: f64,
        /// Unit in which the times were read.
        unit: TimeUnit,
        /// Units that fit, with the rate in each, Hz.
        fitting: Vec<(TimeUnit, f64)>,
    },
    /// The times contradict the given sample rate.
    SampleRateConflict {
        /// Rate of the times, Hz.
        measured: f64,
        /// Given rate, Hz.
        given: f32,
        /// Unit of the times in which they would agree.
        meant: Option<TimeUnit>,
    },

    /// No topic has samples of an IMU.
    NoImu {
        /// All topics.
        topics: Vec<TopicType>,
        /// A topic whose messages of another type have the axes of one IMU.
        with_axes: Option<String>,
        /// Whether feet have sent contacts.
        has_contacts: bool,
    },
    /// A topic that was named has no axes of an IMU.
    ImuFields {
        /// Type of its messages.
        message: String,
        /// Problem with its fields.
        problem: FieldsProblem,
    },
    /// A topic has no message.
    NoMessage {
        /// The topic; `None` if none has a message.
        topic: Option<String>,
        /// All topics with samples of an IMU.
        topics: Vec<ImuTopic>,
    },
    /// A topic is missing.
    NoSuchTopic {
        /// Name of the topic.
        topic: String,
        /// Expected content.
        wanted: &'static str,
        /// Topics with samples of an IMU, if these are expected.
        imus: Vec<ImuTopic>,
        /// All other topics.
        topics: Vec<TopicType>,
    },
    /// No IMU has the selected frame.
    NoSuchFrame {
        /// The frame.
        frame: String,
        /// All topics with samples of an IMU, and their frames.
        frames: Vec<ImuTopic>,
    },
    /// The topic of the foot is ambiguous, because several topics, these, have samples of an IMU.
    SeveralTopics(Vec<ImuTopic>),
    /// The file has these feet, but one is expected.
    SeveralFeet(Vec<String>),
    /// A message does not match its topic.
    Message(MessageProblem),
    /// All messages of a topic mark this sensor as missing.
    Absent(&'static str),
    /// The number of loads differs from the number of feet.
    LoadCount {
        /// Number of loads.
        loads: usize,
        /// Topics of the feet, in order.
        feet: Vec<String>,
    },
    /// The only IMU is probably on the trunk.
    OnlyTrunk {
        /// Topic of that IMU.
        topic: String,
    },
    /// Several loads do not have the names of the feet.
    LoadPairs {
        /// Topics of the loads.
        loads: Vec<String>,
        /// Names of the feet.
        feet: Vec<String>,
    },
    /// A load has no such field.
    LoadField {
        /// Load.
        load: LoadTopic,
        /// Type of its messages.
        message: String,
        /// Problem with its fields.
        problem: LoadProblem,
    },
    /// Two feet would have this name.
    TwoFeet(String),
    /// A foot that is to be renamed is not in the file.
    NoFootToRename {
        /// Name of the foot.
        name: String,
        /// Topics of the feet.
        feet: Vec<String>,
    },
}

/// Kinds of files to which given options apply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionsFor {
    /// Options of tables, for a format with columns, units and times of its own.
    Tables,
    /// The unit of times, for messages.
    TimesOfTables,
    /// A mapping, for messages whose fields are known.
    OtherMessages,
    /// Options of bags, for a table.
    Bags,
}

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

/// A topic with the type of its messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicType {
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages; empty if it is not known.
    pub message: String,
    /// Serialisation of its messages, such as `cdr`.
    pub encoding: String,
}

impl TopicType {
    /// Returns whether the messages are of ROS 1 and lack a valid definition. With a definition they would be read as
    /// CDR.
    fn is_of_ros_1(&self) -> bool {
        self.encoding == "ros1"
    }
}

impl InputError {
    /// Creates the error of a problem of the file as a whole.
    pub fn of_file(file: impl Into<String>, problem: Problem) -> Self {
        Self { file: file.into(), place: Place::File, problem }
    }

    /// Creates the error of a problem in a row.
    pub fn of_row(file: impl Into<String>, row: RowPlace, problem: Problem) -> Self {
        Self { file: file.into(), place: Place::Row(row), problem }
    }

    /// Creates the error of a message that does not match its topic.
    pub fn of_message(file: &str, topic: &str, number: u64, problem: MessageProblem) -> Self {
        let place = Place::Message { topic: topic.to_owned(), number };
        Self { file: file.to_owned(), place, problem: Problem::Message(problem) }
    }

    /// Creates the error of a file without samples.
    #[must_use]
    pub fn empty(file: &str) -> Self {
        Self::of_file(file, Problem::Empty)
    }

    /// Creates the error of a file that cannot be opened or read.
    #[must_use]
    pub fn unreadable(file: &str, source: io::Error) -> Self {
        Self::of_file(file, Problem::Unreadable(source))
    }

    /// Creates the error of a file whose samples cannot be kept in a temporary file.
    #[must_use]
    pub fn spool(file: &str, source: io::Error) -> Self {
        Self::of_file(file, Problem::Spool(source))
    }

    /// Returns whether compressed data end early.
    pub fn ended_early(&self) -> bool {
        matches!(&self.problem, Problem::Unreadable(source) if source.kind() == io::ErrorKind::UnexpectedEof)
    }

    /// Returns whether the error may come from a truncated row with this number of cells.
    pub fn may_be_a_cut(&self, cells: usize) -> bool {
        match &self.problem {
            Problem::ColumnCount { found, expected } => found < expected,
            Problem::NotANumber(_) | Problem::Blank | Problem::Validity(_) => {
                matches!(self.place, Place::Cell { column, .. } if column == cells)
            }
            _ => false,
        }
    }

    /// Adds a column that may hold the times, if no column is known to.
    pub fn with_time_column(mut self, column: Option<String>) -> Self {
        if let Problem::UnknownSampleRate { time_column } = &mut self.problem {
            *time_column = column.filter(|name| name != "t");
        }
        self
    }
}

impl std::error::Error for InputError {}

display_in_plain_words!(InputError);

impl InWords for InputError {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        let text = fmt::from_fn(|f| {
            write!(f, "{}{}", self.file, self.place)?;
            self.problem.write(words, f)?;
            if let Some(hint) = self.problem.hint() {
                f.write_str(self.problem.before_hint())?;
                hint.write_in(words, f)?;
            }
            self.problem.write_end(words, f)
        });
        // Names come from the file, and a damaged one may contain a line break. An error is one line.
        f.write_str(&text.to_string().replace(char::is_control, "\u{FFFD}"))
    }
}

impl Problem {
    /// Returns what to do about the problem, if the file or its settings show it.
    #[must_use]
    pub fn hint(&self) -> Option<Hint> {
        Some(match self {
            Self::UnknownFormat { .. } => Hint::Format,
            Self::MissingColumns { hint, .. } => hint.clone()?,
            Self::SeveralSensors { mappings, .. } => Hint::ChooseSensor(mappings.clone()),
            Self::NamedUnit { units, .. } => Hint::Units(*units),
            Self::NotANumber(text) => cell_hint(text)?,
            Self::Time { meant: Some(meant), .. } => Hint::TimesLookLike(*meant),
            Self::Time { text, unit, .. } => unit_hint(text, *unit)?,
            Self::TimeOrder { .. } => Hint::RowOrder,
            Self::MessageOrder { .. } => Hint::MessageOrder,
            Self::Jitter { .. } => Hint::SmoothTimes,
            Self::UnknownSampleRate { .. } => Hint::SampleRate,
            Self::GuessedUnit { meant, .. } => Hint::TimeUnit(*meant),
            Self::UnitOfTimes { fitting, .. } => Hint::TimesLookLikeOneOf(fitting.clone()),
            Self::SampleRateConflict { meant: Some(meant), .. } => Hint::TimesLookLike(*meant),
            Self::NoImu { with_axes, .. } => Hint::TopicWithAxes(with_axes.clone()?),
            Self::ImuFields { problem, .. } => problem.hint()?,
            Self::SeveralTopics(topics) => Hint::ChooseTopic {
                topics: topics.windows(2).any(|two| two[0].name != two[1].name),
                frames: topics.iter().any(|topic| topic.frame.is_some()),
            },
            Self::LoadCount { feet, .. } => Hint::LoadForEach(listed(feet)),
            Self::OnlyTrunk { topic } => Hint::ReadTrunk(topic.clone()),
            Self::LoadPairs { .. } => Hint::TopicsInOrder,
            Self::TwoFeet(_) => Hint::Rename,
            _ => return None,
        })
    }

    /// Returns what separates the hint from the sentence.
    const fn before_hint(&self) -> &'static str {
        match self {
            Self::MissingColumns { .. }
            | Self::Time { .. }
            | Self::MessageOrder { .. }
            | Self::UnitOfTimes { .. }
            | Self::SampleRateConflict { .. }
            | Self::NoImu { .. }
            | Self::ImuFields { .. }
            | Self::OnlyTrunk { .. } => "; ",
            Self::SeveralTopics(_) => ", ",
            _ => ": ",
        }
    }

    /// Writes the problem, after the file and the position: a predicate of the file, or a sentence after a colon.
    fn write(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(source) => write!(f, " cannot be read: {source}"),
            Self::Spool(source) => write!(
                f,
                ": its samples cannot be kept in {}: {source}; the variable TMPDIR names another folder",
                std::env::temp_dir().display()
            ),
            Self::Twice => f.write_str(" is named twice, and its samples would count twice"),
            Self::Empty => f.write_str(" is empty: it holds no sample"),
            Self::UnknownFormat { .. } => f.write_str(
                " has no header that names the six axes; write one, such as t,ax,ay,az,wx,wy,wz, or give its format",
            ),
            Self::OtherFormat { given, found } => write!(
                f,
                " is {}, but was given as {}",
                found.map_or("a table or of no kind that is known", Format::name),
                words.set(Setting::Format, given)
            ),
            Self::Foreign(kind) => {
                write!(f, " is {kind}; {}", kind.advice().unwrap_or("it is not read here"))
            }
            Self::NotBuilt { format, feature } => {
                write!(f, " is {format}, and this program was built without the feature {feature}")
            }
            Self::Damaged { source, advice } => {
                write!(f, " is damaged: {source}")?;
                advice.map_or(Ok(()), |advice| write!(f, "; {advice}"))
            }
            Self::NotSupported(part) => write!(f, " {part}"),
            Self::Options { format, given } => given.write(*format, words, f),
            Self::Folder => f.write_str(" is a folder without files of a rosbag2: .mcap or .db3"),
            Self::RowsInQuotes { until } => write!(
                f,
                ": a quote opens here and is open until line {until}, so that the rows between would be lost: remove it"
            ),
            Self::LongRow { most_bytes } => write!(
                f,
                ": a row of more than {most_bytes} bytes: the file is not a table, or a quote that opens here is never closed"
            ),
            Self::NotUtf8 => f.write_str(": not UTF-8 text"),
            Self::ColumnCount { found, expected } => {
                write!(f, ": {found} columns where {expected} are expected")
            }
            Self::MissingColumns { columns, .. } => {
                write!(f, ": missing in the header: {columns}")
            }
            Self::NoSuchColumn { name, columns } => {
                write!(f, ": there is no column {name:?} to map; there are {columns}")
            }
            Self::AmbiguousColumn { name, candidates: [one, other] } => {
                write!(f, ": {name:?} may be {one} or {other}: give more of its name")
            }
            Self::DuplicateColumn => f.write_str(": the header has this name twice"),
            Self::SeveralSensors { candidates, .. } => {
                write!(f, ": {} are of different sensors", candidates.join(", "))
            }
            Self::NamedUnit { name, unit, read_in, .. } => write!(
                f,
                ": column {name:?} is in {unit} by its name, but would be read in {read_in}"
            ),
            Self::ColumnType { column, found, wanted } => write!(
                f,
                ": column {column} has values of type {found}, which cannot be read as {wanted}"
            ),
            Self::Blank => f.write_str(": blank where a number is needed; nan marks a missing reading"),
            Self::NotANumber(text) => write!(f, ": {:?} is not a number", excerpt(text)),
            Self::Label(text) => {
                write!(f, ": label {text} where 0 (not stable) or 1 (stable) is expected")
            }
            Self::Validity(text) => write!(
                f,
                ": {text:?} where valid, accelerometer_saturated, gyroscope_saturated, both_saturated, stale or invalid is expected"
            ),
            Self::ImuAfterForceOnly => f.write_str(
                ": IMU values after a row that had none; rows with only a force are allowed only at the end",
            ),
            Self::Time { text, unit, .. } => write!(
                f,
                ": {} is not a time in {unit}: -{most:e} to {most:e} is expected",
                excerpt(text),
                most = MAX_TIME_S * unit.per_second()
            ),
            Self::TimeOrder { text, unit, previous } => write!(
                f,
                ": time {} does not come after {previous} {unit} in the row before",
                time_text(text, *unit)
            ),
            Self::MessageOrder { previous_us, .. } => write!(
                f,
                ": the time of a message does not come after {} s, the one before",
                *previous_us as f64 / 1.0e6
            ),
            Self::Jitter { rows, of } => {
                write!(f, ": {rows} of {of} rows would be left out though only their times jitter")
            }
            Self::UnknownSampleRate { .. } => {
                f.write_str(" has no times that determine the sample rate, so it must be given")
            }
            Self::GuessedUnit { read_in, meant } => write!(
                f,
                ": column t was taken for {read_in} since 1970, but looks like {meant}"
            ),
            Self::UnitOfTimes { rate, unit, .. } => write!(
                f,
                ": column t gives {} Hz in {}",
                shown_rate(*rate),
                unit.words()
            ),
            Self::SampleRateConflict { measured, given, .. } => write!(
                f,
                ": column t gives {} Hz, but the given sample rate is {} Hz",
                shown_rate(*measured),
                shown(*given)
            ),
            Self::NoImu { topics, .. } => {
                write!(f, " has no topic of sensor_msgs/msg/Imu in CDR; there is {}", listed(topics))?;
                let is_ros_1 = topics.iter().any(TopicType::is_of_ros_1);
                f.write_str(if is_ros_1 { ROS_1_ADVICE } else { "" })
            }
            Self::ImuFields { message, problem } => {
                write!(f, ": {message} is read by its fields: ")?;
                problem.write(words, f)
            }
            Self::NoMessage { topic: Some(topic), topics } => {
                write!(f, ": topic {topic} has no message; there is {}", listed(topics))
            }
            Self::NoMessage { topic: None, topics } => write!(
                f,
                ": no topic of sensor_msgs/msg/Imu has a message; there is {}",
                listed(topics)
            ),
            Self::NoSuchTopic { topic, wanted, imus, topics } => {
                let imus = imus.iter().map(|imu| imu as &dyn Display);
                let all: Vec<_> = imus.chain(topics.iter().map(|topic| topic as _)).collect();
                write!(f, " has no topic {topic} of {wanted}; there is {}", listed(&all))
            }
            Self::NoSuchFrame { frame, frames } => {
                write!(f, " has no IMU with the frame {frame:?}; it has {}", listed(frames))
            }
            Self::SeveralTopics(_) => f.write_str(" has several IMUs"),
            Self::SeveralFeet(feet) => {
                write!(f, " has several feet, and one is wanted here: {}", listed(feet))
            }
            Self::Message(problem) => write!(f, ": {problem}"),
            Self::Absent(sensor) => write!(
                f,
                ": its messages have no {sensor}, as {sensor}_covariance[0] = -1 says"
            ),
            Self::LoadCount { loads, feet } => {
                write!(f, ": there are loads for {loads} of {} feet", feet.len())
            }
            Self::OnlyTrunk { topic } => write!(
                f,
                ": its only IMU, {topic}, is probably that of the trunk: a stock Go1 or Go2 has no IMU on a foot"
            ),
            Self::LoadPairs { loads, feet } => write!(
                f,
                ": the loads {} cannot be paired by name with the feet {}",
                listed(loads),
                listed(feet)
            ),
            Self::LoadField { load, message, problem } => {
                write!(f, ": {load} is not a load: ")?;
                problem.write(message, f)
            }
            Self::TwoFeet(name) => write!(f, ": two feet would be {name}"),
            Self::NoFootToRename { name, feet } => {
                write!(f, " has no foot {name} to rename; there is {}", listed(feet))
            }
        }
    }

    /// Writes the part after the hint.
    fn write_end(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownFormat { mapping: Some(mapping) } => {
                f.write_str("; ")?;
                Hint::MapExample(mapping.clone()).write_in(words, f)
            }
            Self::UnknownSampleRate { time_column: Some(column) } => {
                f.write_str("; ")?;
                Hint::MapTime(column.clone()).write_in(words, f)
            }
            Self::NoImu { has_contacts: true, .. } => f.write_str(STREAM_ADVICE),
            Self::SeveralTopics(topics) => write!(f, ": {}", listed(topics)),
            Self::MessageOrder { repeats: true, .. } => f.write_str(
                "; if several feet send on one topic with one frame, give each a topic or a frame of its own",
            ),
            Self::TimeOrder { text, previous, .. } if text.parse() == Ok(*previous) => {
                f.write_str("; if rows of several feet have the same times, ")?;
                write!(f, "name the column of the foot: {}", words.set(Setting::Map, &"foot=COLUMN"))
            }
            _ => Ok(()),
        }
    }
}

impl OptionsFor {
    fn write(self, format: Format, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        let name = |setting| words.name(setting);
        let time_unit = name(Setting::TimeUnit);
        write!(f, " is read as {format}")?;
        if self != Self::Bags {
            f.write_str(", which has columns, units and times of its own")?;
        }
        match self {
            Self::Tables => write!(
                f,
                ": {time_unit} is for csv and parquet, {}, {} and {} for mcap, rosbag2 and rosbag1, too",
                name(Setting::Map),
                name(Setting::Units),
                name(Setting::Times)
            ),
            Self::TimesOfTables => write!(f, ": {time_unit} is for csv and parquet"),
            Self::OtherMessages => write!(
                f,
                ": {} is for messages of other types than sensor_msgs/msg/Imu",
                name(Setting::Map)
            ),
            Self::Bags => write!(
                f,
                ": {}, {}, {} and {} are for mcap, rosbag2 and rosbag1",
                name(Setting::Topic),
                name(Setting::NotTopic),
                name(Setting::Frame),
                name(Setting::LoadTopic)
            ),
        }
    }
}

impl Display for ImuTopic {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        if let Some(frame) = &self.frame {
            write!(f, " frame {frame:?}")?;
        }
        let noun = if self.messages == 1 { "message" } else { "messages" };
        write!(f, " ({} {noun}", self.messages)?;
        match self.rate {
            Some(rate) => write!(f, ", {rate:.0} Hz)"),
            None => write!(f, ")"),
        }
    }
}

impl Display for TopicType {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { topic, message, encoding } = self;
        match (message.as_str(), encoding.as_str()) {
            ("", encoding) => write!(f, "{topic} ({encoding})"),
            (message, "cdr") => write!(f, "{topic} ({message})"),
            (message, encoding) => write!(f, "{topic} ({message} in {encoding})"),
        }
    }
}

/// Limit of times around zero, s, so that microseconds are exact: up to here an f64 holds a decimal number to half
/// a microsecond. Seconds since 1970 reach it in 2096.
pub const MAX_TIME_S: f64 = 4.0e9;

/// How a foot on a serial line is made to send its samples.
pub const STREAM_ADVICE: &str =
    "; a foot sends its samples on a serial line while its setting uart_streams.raw_sample is 1";

const ROS_1_ADVICE: &str =
    "; messages of ROS 1 are read by their definitions, and here these are missing or not complete";

/// Hint on a cell that should hold a number, if the text shows its kind.
fn cell_hint(text: &str) -> Option<Hint> {
    let has_comma = text.matches(',').count() == 1;
    if has_comma && text.replace(',', ".").parse::<f64>().is_ok() {
        Some(Hint::DecimalComma)
    } else if is_in_another_form(text) {
        Some(Hint::DateForm)
    } else if Units::are_named(text) || TimeUnit::written(text).is_some() {
        Some(Hint::UnitsLine)
    } else if is_ours(text) {
        Some(Hint::SecondHeader)
    } else {
        None
    }
}

/// Hint on a time that would be valid in a smaller unit.
fn unit_hint(text: &str, unit: TimeUnit) -> Option<Hint> {
    let most = MAX_TIME_S * TimeUnit::Nanoseconds.per_second();
    let is_time = text.parse::<f64>().is_ok_and(|time| time.abs() <= most);
    (is_time && unit != TimeUnit::Nanoseconds).then_some(Hint::OtherTimeUnit)
}

/// A time as written in a file, with its unit unless it is a date.
fn time_text(text: &str, unit: TimeUnit) -> String {
    if micros_since_1970(text).is_some() { text.to_owned() } else { format!("{text} {unit}") }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_stays_one_line_with_a_line_break_in_a_topic() {
        let [topic, message, encoding] = ["/imu", "sensor_msgs/\nsg/Imu", "cdr"].map(str::to_owned);
        let topics = vec![TopicType { topic, message, encoding }];
        let (topic, wanted, imus) = ("/odom".to_owned(), "Odometry", Vec::new());
        let problem = Problem::NoSuchTopic { topic, wanted, imus, topics };
        let text = InputError::of_file("walk.mcap", problem).to_string();
        let expected =
            "walk.mcap has no topic /odom of Odometry; there is /imu (sensor_msgs/\u{FFFD}sg/Imu)";
        assert_eq!(text, expected);
    }

    #[test]
    fn error_stays_one_line_with_a_line_break_in_its_place() {
        for place in [
            Place::Topic("/imu\nfl".into()),
            Place::Message { topic: "/imu\nfl".into(), number: 2 },
        ] {
            let problem = Problem::Message(MessageProblem::NoContent { bytes: 3 });
            let error = InputError { file: "walk.mcap".into(), place, problem };
            let text = error.to_string();
            assert!(text.starts_with("walk.mcap, topic /imu\u{FFFD}fl"), "{text:?}");
            assert!(text.ends_with(": 3 bytes are too short for a message"), "{text:?}");
        }
    }

    #[test]
    fn date_with_the_day_first_has_a_hint_on_its_form() {
        let date = "30.11.2026 12:00:00,123";
        let place = Place::Cell { row: RowPlace::Line(2), column: 1, name: "t".to_owned() };
        let problem = Problem::NotANumber(date.to_owned());
        assert_eq!(
            InputError { file: "walk.csv".to_owned(), place, problem }.to_string(),
            "walk.csv, line 2, column 1 (t): \"30.11.2026 12:00:00,123\" is not a number: \
             a date is read in the form 2026-11-30 12:00:00.123"
        );
    }
}
