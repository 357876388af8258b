//! Errors in a file that is not a text.

use std::fmt;

use thiserror::Error;

use super::format::Format;
use super::topics::LoadTopic;
use crate::samples::foreign::Foreign;

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
        kind: Foreign,
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
        matches!(self, Self::Foreign { kind: Foreign::Ros1Bag, .. } | Self::NotBuilt { .. })
    }
}
