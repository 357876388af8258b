//! Reasons why messages of a bag cannot be used. Builds that read no bags have them, too: they are parts of
//! [`Problem`](crate::error::Problem).

use std::error::Error;
use std::fmt::{self, Display, Formatter};
use std::io;

use thiserror::Error;

use options::hint::{Hint, Setting, Vocabulary};

use crate::list::first_of;

/// Reason why a message cannot be read by its type: a sentence about the message, after the place of the message.
#[derive(Debug, Error)]
pub enum MessageProblem {
    /// The message is compressed, and its decoder reports an error.
    #[error("it cannot be decompressed: {0}")]
    Compression(#[source] io::Error),
    /// The message is too long after decompression.
    #[error("it is longer than {most_bytes} bytes when it is decompressed")]
    TooLong {
        /// Most bytes that are read.
        most_bytes: u64,
    },
    /// The message ends before its content.
    #[error("{bytes} bytes are too short for a message")]
    NoContent {
        /// Length of the message.
        bytes: usize,
    },
    /// The message begins with these bytes.
    #[error(
        "it is encoded as 0x{:02x}{:02x}, not in plain CDR (0x0000 or 0x0001)",
        .0[0], .0[1]
    )]
    Encoding([u8; 2]),
    /// The message is longer than its type.
    #[error("{bytes} bytes are more than its type has, {expected}")]
    MoreBytes {
        /// Length of the message.
        bytes: usize,
        /// Number of bytes of its type.
        expected: usize,
    },
    /// The message is shorter than its type, which has a fixed layout.
    #[error("{bytes} bytes are fewer than its type has")]
    FewerBytes {
        /// Length of the message.
        bytes: usize,
    },
    /// The message ends before a field of its definition.
    #[error("it has fewer bytes than its type")]
    Cut,
    /// A field has an invalid value. The error comes from the decoder, a library of builds that read bags.
    #[error(transparent)]
    Value(Box<dyn Error + Send + Sync>),
    /// The length of the message fits no size of the characters in a `wstring`.
    #[error("its wstrings have neither 1, 2 nor 4 bytes for each unit of length")]
    WideText,
    /// The message is too large to be searched for a field.
    #[error("it has more than {most} fields")]
    TooManyFields {
        /// Most fields that are visited.
        most: usize,
    },
    /// An array of it ends before the wanted element.
    #[error("it has fewer elements than the index says")]
    NoElement,
    /// The message ends before a number that is to be replaced.
    #[error("its bytes end before a number")]
    NoRoom,
    /// The topic of the message has too many frames.
    #[error("its frame {frame:?} is beyond the {most} that a topic may have")]
    TooManyFrames {
        /// The first frame beyond them.
        frame: String,
        /// Most frames of a topic.
        most: usize,
    },
}

/// Reason why the definition of a type gives no path to the wanted fields: a sentence about the definition or a field.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DefinitionProblem {
    /// There is no definition.
    #[error("its definition is not in the bag")]
    Absent,
    /// The definition is in this language.
    #[error("its definition is in {0}, and only ros2msg is read")]
    Language(String),
    /// The definition is nested too deeply.
    #[error("its definition has more than {most} types within each other")]
    TooDeep {
        /// Most types within each other.
        most: usize,
    },
    /// This type is part of itself.
    #[error("its definition has {0} within itself")]
    Recursion(String),
    /// The definition of this type is missing.
    #[error("its definition lacks {0}")]
    NoType(String),
    /// This line is invalid.
    #[error("its definition has a line that is not a field: {0:?}")]
    Line(String),
    /// This part of a name has an invalid index.
    #[error("{0:?} is not of the form field[INDEX]")]
    Index(String),
    /// A type has no such field.
    #[error("there is no {name}, but {}", .fields.join(", "))]
    NoField {
        /// The wanted field.
        name: String,
        /// Names of all fields.
        fields: Vec<String>,
    },
    /// A part of a name names a field without fields.
    #[error("there is no {name}: what is before .{field} has no fields")]
    NoFieldsBefore {
        /// The whole name.
        name: String,
        /// The part after the field.
        field: String,
    },
    /// This field has no fields.
    #[error("{0} has no fields")]
    NoFields(String),
    /// This field has no elements.
    #[error("{0} is not an array")]
    NoArray(String),
    /// An array ends before the wanted element.
    #[error("{name} has the elements [0] to [{last}]")]
    NoElement {
        /// Name of the array.
        name: String,
        /// Index of its last element.
        last: u32,
    },
    /// A field has several numbers.
    #[error("{name} has the numbers {}", first_numbers(.numbers))]
    SeveralNumbers {
        /// Name of the field.
        name: String,
        /// Names of the numbers in it.
        numbers: Vec<String>,
    },
    /// This field is not a single number.
    #[error("{0} is not one number")]
    NoNumber(String),
}

/// Reason why the axes of an IMU are not found in the fields of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldsProblem {
    /// The definition has no such fields.
    Definition(DefinitionProblem),
    /// There is no accelerometer with a gyroscope among these numbers.
    NoAxes(Vec<String>),
    /// The IMU in this part is on the robot's trunk.
    OfTrunk {
        /// Part of the message.
        part: &'static str,
        /// Address that selects it explicitly.
        address: String,
    },
    /// The mapping does not name this axis.
    NotNamed(&'static str),
    /// The mapping names this, which is not an axis.
    NoAxis(&'static str),
}

impl From<DefinitionProblem> for FieldsProblem {
    fn from(problem: DefinitionProblem) -> Self {
        Self::Definition(problem)
    }
}

impl FieldsProblem {
    pub(super) fn hint(&self) -> Option<Hint> {
        match self {
            Self::NoAxes(_) => Some(Hint::MapFields),
            Self::OfTrunk { address, .. } => Some(Hint::ReadTrunk(address.clone())),
            _ => None,
        }
    }

    pub(super) fn write(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        let map = words.name(Setting::Map);
        match self {
            Self::Definition(problem) => write!(f, "{problem}"),
            Self::NoAxes(numbers) => {
                write!(f, "no accelerometer and gyroscope among {}", first_numbers(numbers))
            }
            Self::OfTrunk { part, .. } => {
                write!(f, "{part} is the IMU of the robot's trunk, not of a foot")
            }
            Self::NotNamed(axis) => write!(f, "{map} does not name {axis}"),
            Self::NoAxis(name) => write!(
                f,
                "{map} of a message names its axes alone, not {name}: a load is given as {}",
                words.name(Setting::LoadTopic)
            ),
        }
    }
}

/// Names of the first numbers in a message.
fn first_numbers(names: &[String]) -> String {
    first_of(names, 12)
}

/// Types of messages whose numbers are known as loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnownLoad {
    /// `std_msgs/msg/Float32` and `Float64`.
    Number,
    /// `std_msgs/msg/Float32MultiArray` and `Float64MultiArray`.
    Numbers,
    /// `geometry_msgs/msg/Wrench` and `WrenchStamped`.
    Wrench,
}

impl KnownLoad {
    /// Number that is the load if none is named.
    pub const fn default_field(self) -> Option<&'static str> {
        match self {
            Self::Number => Some("data"),
            Self::Numbers => None,
            Self::Wrench => Some("force.z"),
        }
    }
}

impl Display for KnownLoad {
    /// Writes the numbers that may be named.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Number => "data",
            Self::Numbers => "data[0], data[1] and so on",
            Self::Wrench => {
                "force.x, force.y, force.z (which is taken where none is named), and force, its magnitude"
            }
        })
    }
}

/// Reason why a bag is not read, though it is not damaged: a predicate of the file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Unsupported {
    /// The bag is encrypted by this plugin of rosbag.
    #[error("is encrypted ({0}); write it again without encryption: rosbag decrypt walk.bag")]
    Encryption(String),
    /// The chunks of the bag have this compression.
    #[error(
        "has chunks with the compression {0:?}, and bz2, lz4 and none are read; \
         write it again: rosbag decompress walk.bag"
    )]
    Compression(String),
}

/// Reason why messages have no load.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LoadProblem {
    /// The messages are in this encoding, not in CDR.
    Encoding(String),
    /// The definition of their type is invalid.
    Definition(DefinitionProblem),
    /// The numbers of the type are known. No number is named, or the messages lack the named one.
    Known(KnownLoad),
    /// No number is named. The definition has these numbers.
    Numbers(Vec<String>),
    /// The messages lack the number that is named.
    NoNumber(DefinitionProblem),
}

impl LoadProblem {
    /// Writes a sentence about the type of the messages.
    pub(super) fn write(&self, message: &str, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Encoding(encoding) => write!(f, "{message} is in {encoding}, not in CDR"),
            Self::Definition(problem) => write!(f, "{message} cannot be read: {problem}"),
            Self::Known(load) => write!(f, "{message} has {load}"),
            Self::Numbers(numbers) => {
                write!(f, "{message} has the numbers {}", first_numbers(numbers))
            }
            Self::NoNumber(problem) => write!(f, "{message} has no such number: {problem}"),
        }
    }
}
