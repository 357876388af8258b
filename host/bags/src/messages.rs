//! Messages of a bag, as stored and decoded.
//!
//! A message of ROS 2 is CDR in either byte order, optionally compressed. The first four bytes give the encoding of the
//! rest (DDSI-RTPS 2.5, section 10.5): 0 and 1 are plain CDR, big and little endian. rosbag2 may compress each message
//! with zstd; plain ones begin with a zero.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::io::{Cursor, Read};
use std::ops::Deref;
use std::sync::Arc;

use byteorder::{BigEndian, LittleEndian};
use cdr_encoding::from_bytes;
use serde::Deserialize;

use files::compressed::{ZSTD, decompressed};
use stored::error::{InputError, MessageProblem};

/// A topic as declared in a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages, such as `sensor_msgs/msg/Imu`.
    pub message: String,
    /// Serialisation of its messages, such as `cdr`.
    pub encoding: String,
    /// Definition of the type, if the bag has one.
    pub schema: Option<Arc<Schema>>,
    /// Further properties, such as the quality of service.
    pub metadata: BTreeMap<String, String>,
}

/// Channels in the order of a bag, each once. The time for one does not grow with their number.
#[derive(Default)]
pub(super) struct Channels {
    all: Vec<Channel>,
    /// Indices by topic.
    by_topic: HashMap<String, Vec<usize>>,
}

impl Channels {
    /// Adds a channel that is not there yet.
    pub(super) fn add(&mut self, channel: &Channel) {
        let same_topic = self.by_topic.entry(channel.topic.clone()).or_default();
        if !same_topic.iter().any(|index| self.all[*index] == *channel) {
            same_topic.push(self.all.len());
            self.all.push(channel.clone());
        }
    }
}

impl Deref for Channels {
    type Target = [Channel];

    fn deref(&self) -> &[Channel] {
        &self.all
    }
}

/// Definition of a type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// Language of the definition, such as `ros2msg`.
    pub encoding: String,
    /// Text of the definition.
    pub text: Vec<u8>,
}

/// Times and number of a message, which its storage keeps beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageTimes {
    /// Time at which the message was written, ns.
    pub log_ns: i64,
    /// Time at which it was sent, ns; the time of writing if the storage has only one time.
    pub publish_ns: i64,
    /// Number given by its sender, where the storage keeps it.
    pub sequence: Option<u32>,
}

/// Receives the topics and messages of a bag.
pub(super) trait Visitor {
    /// Declares a topic before its messages; returns whether they are needed. A topic may be declared more than once.
    fn channel(&mut self, channel: &Channel) -> bool;

    /// Passes a message of a topic that is needed.
    fn message(
        &mut self,
        channel: &Channel,
        times: MessageTimes,
        payload: &[u8],
    ) -> Result<(), InputError>;
}

/// Converts a time from ns to µs, rounded.
pub(super) fn micros(nanoseconds: i64) -> i64 {
    let rest = nanoseconds.rem_euclid(1000);
    nanoseconds.div_euclid(1000) + i64::from(rest >= 500)
}

/// Longest message after decompression, bytes.
const LONGEST_MESSAGE: u64 = 1 << 20;

/// Length of the encoding header, bytes.
pub(super) const ENCODING: usize = 4;

/// Most bytes that may follow a message: padding to a multiple of four.
pub(super) const LONGEST_PADDING: usize = 3;

/// Byte order of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

/// Content of a message, after its encoding.
pub(super) struct Payload<'a> {
    pub(super) order: Order,
    pub(super) bytes: Cow<'a, [u8]>,
}

impl Payload<'_> {
    /// First fields of the message, and the number of their bytes.
    fn decode<T: for<'de> Deserialize<'de>>(&self) -> cdr_encoding::Result<(T, usize)> {
        match self.order {
            Order::Big => from_bytes::<T, BigEndian>(&self.bytes),
            Order::Little => from_bytes::<T, LittleEndian>(&self.bytes),
        }
    }
}

/// Decompresses a message that is compressed, up to `most_bytes`.
pub(super) fn decompressed_message(
    payload: &[u8],
    most_bytes: u64,
) -> Result<Cow<'_, [u8]>, MessageProblem> {
    if !payload.starts_with(&ZSTD) {
        return Ok(Cow::Borrowed(payload));
    }
    let mut message = Vec::new();
    decompressed(Box::new(Cursor::new(payload.to_vec())))
        .and_then(|text| text.take(most_bytes + 1).read_to_end(&mut message))
        .map_err(MessageProblem::Compression)?;
    if message.len() as u64 > most_bytes {
        return Err(MessageProblem::TooLong { most_bytes });
    }
    Ok(Cow::Owned(message))
}

/// Decompresses a message and reads its encoding.
pub(super) fn content(payload: &[u8]) -> Result<Payload<'_>, MessageProblem> {
    let message = decompressed_message(payload, LONGEST_MESSAGE)?;
    let Some((encoding, _)) = message.split_at_checked(ENCODING) else {
        return Err(MessageProblem::NoContent { bytes: message.len() });
    };
    let order = match encoding[..2] {
        [0, 0] => Order::Big,
        [0, 1] => Order::Little,
        _ => return Err(MessageProblem::Encoding([encoding[0], encoding[1]])),
    };
    let bytes = match message {
        Cow::Borrowed(message) => Cow::Borrowed(&message[ENCODING..]),
        Cow::Owned(message) => Cow::Owned(message[ENCODING..].to_vec()),
    };
    Ok(Payload { order, bytes })
}

/// Reads a message.
pub(super) fn decode<T: for<'de> Deserialize<'de>>(payload: &[u8]) -> Result<T, MessageProblem> {
    let content = content(payload)?;
    let decoded = content.decode();
    let length = content.bytes.len();
    let bytes = ENCODING + length;
    match decoded {
        Ok((message, used)) if length - used <= LONGEST_PADDING => Ok(message),
        Ok((_, used)) => Err(MessageProblem::MoreBytes { bytes, expected: ENCODING + used }),
        Err(cdr_encoding::Error::Eof) => Err(MessageProblem::FewerBytes { bytes }),
        Err(error) => Err(MessageProblem::Value(Box::new(error))),
    }
}

/// Reads the first fields of a message and ignores the rest.
pub(super) fn decode_start<T>(payload: &[u8]) -> Result<T, MessageProblem>
where
    T: for<'de> Deserialize<'de>,
{
    let decoded = content(payload)?.decode();
    decoded.map(|(start, _)| start).map_err(|error| MessageProblem::Value(Box::new(error)))
}
