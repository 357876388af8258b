//! What can be wrong with a file that is no text.

use std::fmt;

use thiserror::Error;

use super::foreign::Foreign;
use super::format::Format;
use super::topics::LoadTopic;

/// A topic with samples of an IMU.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuTopic {
    /// Its name.
    pub name: String,
    /// How many messages it has.
    pub messages: u64,
    /// How many arrive in a second, Hz; `None` where there are fewer than two.
    pub rate: Option<f64>,
}

impl fmt::Display for ImuTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            messages,
            rate,
        } = self;
        write!(f, "{name} ({messages} messages")?;
        match rate {
            Some(rate) => write!(f, ", {rate:.0} Hz)"),
            None => write!(f, ")"),
        }
    }
}

/// Topics or other names, one after the other.
fn listed<T: fmt::Display>(names: &[T]) -> String {
    const SHOWN: usize = 20;
    let shown: Vec<_> = names.iter().take(SHOWN).map(T::to_string).collect();
    let shown = shown.join(", ");
    match names.len().checked_sub(SHOWN) {
        Some(more @ 1..) => format!("{shown} and {more} more"),
        _ if names.is_empty() => "nothing".to_owned(),
        _ => shown,
    }
}

/// Why a file is not read as what its first bytes say.
#[derive(Debug, Error)]
pub enum ContainerError {
    /// It is of a kind that is not read here.
    #[error("{file} is {kind}; {}", kind.advice().unwrap_or("it is not read here"))]
    Foreign {
        /// The file, as it was named.
        file: String,
        /// What it is.
        kind: Foreign,
    },
    /// It could be read, but not by this program.
    #[error("{file} is {format}, and this program was built without the feature {feature}")]
    NotBuilt {
        /// The file, as it was named.
        file: String,
        /// Its format.
        format: Format,
        /// The feature of this crate that reads it.
        feature: &'static str,
    },
    /// It is not in the format that was given.
    #[error(
        "{file} is {}, but was given as --format {given}",
        found.map_or("a table or of no kind that is known", Format::name)
    )]
    OtherFormat {
        /// The file, as it was named.
        file: String,
        /// What was given.
        given: Format,
        /// What it is, where that is known.
        found: Option<Format>,
    },
    /// True orientations are in tables only.
    #[error(
        "{file} is {format}, whose orientations are what an estimator made of the samples: the truth is in columns qw,qx,qy,qz of csv or parquet"
    )]
    NoTruth {
        /// The file, as it was named.
        file: String,
        /// What it is.
        format: Format,
    },
    /// There are no recordings in a folder.
    #[error("{file} is a folder without files of a rosbag2: .mcap or .db3")]
    Folder {
        /// The folder, as it was named.
        file: String,
    },
    /// It is not what its first bytes promise.
    #[error("{file} is damaged: {source}{}", advice.map(|advice| format!("; {advice}")).unwrap_or_default())]
    Damaged {
        /// The file, as it was named.
        file: String,
        /// What its reader says.
        source: Box<dyn std::error::Error + Send + Sync>,
        /// What may save it.
        advice: Option<&'static str>,
    },
    /// No topic has samples of an IMU.
    #[error(
        "{file} has no topic of sensor_msgs/msg/Imu in CDR; there is {}",
        listed(topics)
    )]
    NoImu {
        /// The file, as it was named.
        file: String,
        /// The topics with their types.
        topics: Vec<String>,
    },
    /// A topic has no message.
    #[error("{file}: topic {topic} has no message; there is {}", listed(topics))]
    NoMessage {
        /// The file, as it was named.
        file: String,
        /// The topic, or all of them.
        topic: String,
        /// All with samples of an IMU.
        topics: Vec<ImuTopic>,
    },
    /// A topic is not there.
    #[error("{file} has no topic {topic} of {wanted}; there is {}", listed(topics))]
    NoSuchTopic {
        /// The file, as it was named.
        file: String,
        /// The topic that was named.
        topic: String,
        /// What it should have.
        wanted: &'static str,
        /// What there is.
        topics: Vec<String>,
    },
    /// Several topics may be the foot.
    #[error(
        "{file} has several IMUs, choose with --topic, or --topic all: {}",
        listed(topics)
    )]
    SeveralTopics {
        /// The file, as it was named.
        file: String,
        /// All with samples of an IMU.
        topics: Vec<ImuTopic>,
    },
    /// Several feet are read where one is wanted.
    #[error("{file} has several feet, and one is wanted here: {}", listed(feet))]
    SeveralFeet {
        /// The file, as it was named.
        file: String,
        /// Their names.
        feet: Vec<String>,
    },
    /// A message is not what its topic promises.
    #[error("{file}, topic {topic}, message {number}: {what}")]
    Message {
        /// The file, as it was named.
        file: String,
        /// The topic.
        topic: String,
        /// The message among those of the topic, from 1.
        number: u64,
        /// What is wrong with it.
        what: String,
    },
    /// All messages of a topic say that a sensor is not there.
    #[error(
        "{file}, topic {topic}: its messages have no {sensor}, as {sensor}_covariance[0] = -1 says"
    )]
    Absent {
        /// The file, as it was named.
        file: String,
        /// The topic.
        topic: String,
        /// The field.
        sensor: &'static str,
    },
    /// There are not as many loads as feet.
    #[error(
        "{file}: there are loads for {} of {} feet: give --load-topic once for each of {}",
        loads.len(),
        feet.len(),
        listed(feet)
    )]
    LoadCount {
        /// The file, as it was named.
        file: String,
        /// The loads.
        loads: Vec<LoadTopic>,
        /// The topics of the feet, in their order.
        feet: Vec<String>,
    },
    /// A load has no such field.
    #[error("{file}: {load} is no load: {message} has {fields}")]
    LoadField {
        /// The file, as it was named.
        file: String,
        /// The load.
        load: LoadTopic,
        /// The type of its messages.
        message: String,
        /// Which fields that has.
        fields: &'static str,
    },
    /// Options for bags are given for a file that is none.
    #[error("{file} is read as {format}: --topic and --load-topic are for mcap and rosbag2")]
    BagOptions {
        /// The file, as it was named.
        file: String,
        /// Its format.
        format: Format,
    },
    /// A column has something else than numbers.
    #[error("{file}: column {column} has values of type {found}, which cannot be read as {wanted}")]
    ColumnType {
        /// The file, as it was named.
        file: String,
        /// The column.
        column: String,
        /// Its type.
        found: String,
        /// What it should be.
        wanted: &'static str,
    },
}

impl ContainerError {
    pub(super) const fn not_built(file: String, format: Format, feature: &'static str) -> Self {
        Self::NotBuilt {
            file,
            format,
            feature,
        }
    }
}
