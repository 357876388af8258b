//! Writer of MCAP with the profile `ros2`, schemas included, chunks compressed with zstd.
//!
//! A chunk is written as a whole, once a second of message time or when it is full: a truncated file keeps
//! all complete chunks.

use std::collections::{BTreeMap, HashMap};
use std::io::{self, Seek, Write};
use std::sync::Arc;

use bags::{Channel, MessageTimes, Schema};
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use crate::ros::message::Definition;
use crate::ros::topics::Published;

/// Maximum size of a chunk before compression, bytes.
const CHUNK: u64 = 1 << 20;

/// Maximum duration of a chunk, µs.
const CHUNK_US: u64 = 1_000_000;

/// Writer of an MCAP file.
pub struct McapFile<W: Write + Seek> {
    writer: Writer<W>,
    /// Channels of each topic. A topic copied from another bag may have several.
    channels: HashMap<Arc<str>, Vec<Declared>>,
    chunk_began_us: Option<u64>,
}

/// A channel of the file.
struct Declared {
    id: u16,
    channel: Channel,
    messages: u32,
}

impl<W: Write + Seek> McapFile<W> {
    /// Creates a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(to: W) -> io::Result<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("footfall ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .chunk_size(Some(CHUNK))
            // Written data is never changed, so complete chunks survive truncation.
            .disable_seeking(true);
        Ok(Self {
            writer: options.create(to).map_err(io_error)?,
            channels: HashMap::new(),
            chunk_began_us: None,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&mut self, published: &Published) -> io::Result<()> {
        let definition = Definition::of(&published.message);
        let is_own = |channel: &Channel| channel.message == definition.name;
        let schema =
            || Schema { encoding: "ros2msg".to_owned(), text: definition.text().into_bytes() };
        let (channel_id, sequence) = match self.next(&published.topic, is_own) {
            Some(next) => next,
            None => self.declare(Channel {
                topic: published.topic.to_string(),
                message: definition.name.to_owned(),
                encoding: "cdr".to_owned(),
                schema: Some(schema().into()),
                metadata: BTreeMap::new(),
            })?,
        };
        let log_time = published.at.as_micros().saturating_mul(1000);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.put(&header, &published.message.cdr())
    }

    /// Appends a message of another bag. If its sender did not number it, it gets the next number of its channel.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn copy(&mut self, of: &Channel, times: MessageTimes, data: &[u8]) -> io::Result<()> {
        let (channel_id, number) = match self.next(&of.topic, |channel| channel == of) {
            Some(next) => next,
            None => self.declare(of.clone())?,
        };
        let nanos = |time| u64::try_from(time).unwrap_or_default();
        let header = MessageHeader {
            channel_id,
            sequence: times.sequence.unwrap_or(number),
            log_time: nanos(times.log_ns),
            publish_time: nanos(times.publish_ns),
        };
        self.put(&header, data)
    }

    /// Returns the id of a declared channel of a topic and the number of its next message, which it increments; `None` if
    /// the channel was not declared.
    fn next(&mut self, topic: &str, is: impl Fn(&Channel) -> bool) -> Option<(u16, u32)> {
        let mut channels = self.channels.get_mut(topic)?.iter_mut();
        let Declared { id, messages, .. } = channels.find(|declared| is(&declared.channel))?;
        let number = *messages;
        *messages = number.wrapping_add(1);
        Some((*id, number))
    }

    fn put(&mut self, header: &MessageHeader, data: &[u8]) -> io::Result<()> {
        let micros = header.log_time / 1000;
        let began = *self.chunk_began_us.get_or_insert(micros);
        if micros.saturating_sub(began) >= CHUNK_US {
            self.writer.flush().map_err(io_error)?;
            self.chunk_began_us = Some(micros);
        }
        self.writer.write_to_known_channel(header, data).map_err(io_error)
    }

    /// Writes the current chunk, for use before a pause.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        if self.chunk_began_us.take().is_some() {
            self.writer.flush().map_err(io_error)?;
        }
        Ok(())
    }

    /// Adds a channel; returns its id and the number of its first message. Reuses an existing schema.
    fn declare(&mut self, channel: Channel) -> io::Result<(u16, u32)> {
        let message = &channel.message;
        let schema = match &channel.schema {
            Some(schema) => self.writer.add_schema(message, &schema.encoding, &schema.text),
            // Without a definition, keep at least the name of the type.
            None if !message.is_empty() => self.writer.add_schema(message, "", &[]),
            None => Ok(0),
        };
        let schema = schema.map_err(io_error)?;
        let Channel { topic, encoding, metadata, .. } = &channel;
        let id = self.writer.add_channel(schema, topic, encoding, metadata).map_err(io_error)?;
        let of_topic = self.channels.entry(topic.as_str().into()).or_default();
        of_topic.push(Declared { id, channel, messages: 1 });
        Ok((id, 0))
    }

    /// Number of messages on each topic so far.
    #[must_use]
    pub fn counts(&self) -> BTreeMap<&str, u32> {
        let count = |channels: &[Declared]| channels.iter().map(|channel| channel.messages).sum();
        let channels = self.channels.iter();
        let counts = channels.map(|(topic, channels)| (topic.as_ref(), count(channels)));
        counts.collect()
    }

    /// Writes the remaining messages and the summary.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.finish().map(drop).map_err(io_error)
    }
}

/// Returns the earliest of the streams' next items, and the index of its stream. If several items have the same time,
/// the first stream wins.
///
/// # Errors
/// The first error of `next`, which returns a time and its item.
pub(crate) fn earliest<S, K: Ord, T>(
    streams: &mut [S],
    mut next: impl FnMut(&mut S) -> io::Result<Option<(K, T)>>,
) -> io::Result<Option<(T, usize)>> {
    let mut first: Option<(K, T, usize)> = None;
    for (index, stream) in streams.iter_mut().enumerate() {
        if let Some((time, item)) = next(stream)?
            && first.as_ref().is_none_or(|(before, ..)| time < *before)
        {
            first = Some((time, item, index));
        }
    }
    Ok(first.map(|(_, item, index)| (item, index)))
}

/// Converts an error of the MCAP writer to an I/O error, keeping one of the operating system.
fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}
