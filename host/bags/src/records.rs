//! Records of a file of MCAP or of ROS 1, read one after the other: their topics, and the reasons to stop.

use std::error::Error;
use std::io::{self, Read};

use crate::definition::{Converter, as_ros2};
use crate::messages::{Channel, MessageTimes, Visitor};
use stored::error::{InputError, Problem, Unsupported};

/// Longest record that is read, bytes. A raw picture of 64 million pixels of 4 bytes is shorter.
pub(super) const LONGEST_RECORD: usize = 256 << 20;

/// Most bytes of a compressed chunk after decompression. Writers make chunks of some MB.
pub(super) const LONGEST_CHUNK: u64 = 4 << 30;

/// Bytes read at once.
pub(super) const AT_ONCE: usize = 64 << 10;

/// Topic whose messages follow: a channel of MCAP, or a connection of ROS 1.
pub(super) struct Connection {
    channel: Channel,
    /// `None` for messages that are not of ROS 1, and for messages whose type has no valid definition.
    converter: Option<Converter>,
    /// Whether the visitor needs the messages.
    pub(super) is_needed: bool,
}

impl Connection {
    /// Declares a topic to a visitor, converted to one of ROS 2 if possible.
    pub(super) fn declare(channel: Channel, visitor: &mut dyn Visitor) -> Self {
        let (channel, converter) = as_ros2(channel);
        let is_needed = visitor.channel(&channel);
        Self { channel, converter, is_needed }
    }

    /// Passes a message to the visitor.
    pub(super) fn pass(
        &self,
        times: MessageTimes,
        payload: &[u8],
        visitor: &mut dyn Visitor,
    ) -> Result<(), Stop> {
        let converted = self.converter.as_ref().map(|converter| converter.cdr(payload));
        let payload = converted.as_deref().unwrap_or(payload);
        visitor.message(&self.channel, times, payload).map_err(Stop::Refused)
    }
}

/// Reason to stop reading a file.
pub(super) enum Stop {
    /// The file ends early, for this reason.
    Early(&'static str),
    Unreadable(io::Error),
    Damaged(Box<dyn Error + Send + Sync>),
    /// The file is not read, though it is not damaged.
    NotSupported(Unsupported),
    /// The visitor refused a message.
    Refused(InputError),
}

impl Stop {
    /// The file ends within a record.
    pub(super) const CUT: Self = Self::Early("it ends within a record");

    /// File systems leave zeros after a loss of power.
    pub(super) const ZEROS: Self = Self::Early("zeros follow");

    /// Returns the reason why the file ends early, or an error about the file. `advice` is for a damaged file.
    pub(super) fn ending(self, file: &str, advice: &'static str) -> Result<String, InputError> {
        let problem = match self {
            Self::Early(why) => return Ok(why.to_owned()),
            Self::Unreadable(source) => return Err(InputError::unreadable(file, source)),
            Self::Damaged(source) => Problem::Damaged { source, advice: Some(advice) },
            Self::NotSupported(part) => Problem::NotSupported(part),
            Self::Refused(error) => return Err(error),
        };
        Err(InputError::of_file(file, problem))
    }
}

/// A compressed chunk grows beyond this many bytes: the length in its header, or [`LONGEST_CHUNK`].
#[derive(Debug, thiserror::Error)]
#[error("a chunk has more than {0} bytes when it is decompressed")]
pub(super) struct ChunkGrows(u64);

/// Checks the length of the records of a compressed chunk so far, bytes.
pub(super) fn expect_at_most(most: u64, decompressed: u64) -> Result<(), Stop> {
    if decompressed > most { Err(Stop::Damaged(Box::new(ChunkGrows(most)))) } else { Ok(()) }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::CUT,
            _ => Self::Unreadable(error),
        }
    }
}

/// Reads `length` bytes of a record. Memory grows with the data read, because the declared length may exceed the data.
pub(super) fn load(
    record: &mut Vec<u8>,
    from: &mut (impl Read + ?Sized),
    length: u64,
) -> Result<(), Stop> {
    record.clear();
    from.take(length).read_to_end(record)?;
    if (record.len() as u64) < length { Err(Stop::CUT) } else { Ok(()) }
}

/// Reads bytes that are not needed.
pub(super) fn skip(from: &mut impl Read, length: u64) -> Result<(), Stop> {
    let skipped = io::copy(&mut from.take(length), &mut io::sink())?;
    if skipped < length { Err(Stop::CUT) } else { Ok(()) }
}

/// Reads the available bytes; 0 at the end.
pub(super) fn read_some(from: &mut impl Read, room: &mut [u8]) -> io::Result<usize> {
    loop {
        match from.read(room) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}

/// A little-endian number of at most 8 bytes.
pub(super) fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}
