//! Recording to MCAP with the profile `ros2`, schemas included, chunks compressed with zstd.
//!
//! A chunk is written as a whole, once a second of message time or when it is full: a truncated file keeps
//! all complete chunks.

use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use crate::bridge::Published;
use crate::definition::Definition;

/// Maximum size of a chunk before compression, bytes.
const CHUNK: u64 = 1 << 20;

/// Maximum duration of a chunk, µs.
const CHUNK_US: u64 = 1_000_000;

/// Writer of an MCAP file.
pub struct McapFile<W: Write + Seek> {
    writer: Writer<W>,
    /// Channels of each topic: another bag may have several.
    channels: HashMap<Arc<str>, Vec<Channel>>,
    chunk_began_us: Option<u64>,
}

struct Channel {
    id: u16,
    /// Type and serialisation of its messages.
    message: String,
    encoding: String,
    messages: u32,
}

impl Channel {
    /// Header of its next message, written at this time, ns.
    const fn header(&mut self, log_ns: u64) -> MessageHeader {
        let header = MessageHeader {
            channel_id: self.id,
            sequence: self.messages,
            log_time: log_ns,
            publish_time: log_ns,
        };
        self.messages = self.messages.wrapping_add(1);
        header
    }
}

/// A topic of another bag.
#[derive(Clone, Copy, Debug)]
pub struct Declared<'a> {
    /// Name of the topic.
    pub topic: &'a str,
    /// Type of its messages.
    pub message: &'a str,
    /// Definition of the type with its encoding, if known.
    pub schema: Option<(&'a str, &'a [u8])>,
    /// Serialisation of its messages, such as `cdr`.
    pub encoding: &'a str,
    /// Further properties, such as the quality of service.
    pub metadata: &'a BTreeMap<String, String>,
}

impl<W: Write + Seek> McapFile<W> {
    /// Creates a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(to: W) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("footfall ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .chunk_size(Some(CHUNK))
            // Written data is never changed, so complete chunks survive truncation.
            .disable_seeking(true);
        Ok(Self {
            writer: options.create(to)?,
            channels: HashMap::new(),
            chunk_began_us: None,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&mut self, published: &Published) -> Result<(), McapError> {
        let definition = Definition::of(&published.message);
        let nanos = published.at.as_micros().saturating_mul(1000);
        let data = published.message.cdr();
        if let Some(channel) = self.channel(&published.topic, definition.name, "cdr") {
            let header = channel.header(nanos);
            return self.put(&header, &data);
        }
        let text = definition.text();
        let declared = Declared {
            topic: &published.topic,
            message: definition.name,
            schema: Some(("ros2msg", text.as_bytes())),
            encoding: "cdr",
            metadata: &BTreeMap::new(),
        };
        self.copy(&declared, nanos, &data)
    }

    /// Appends a message of another bag, with the time at which it was written, ns.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn copy(&mut self, of: &Declared<'_>, log_ns: u64, data: &[u8]) -> Result<(), McapError> {
        if self.channel(of.topic, of.message, of.encoding).is_none() {
            self.declare(of)?;
        }
        match self.channel(of.topic, of.message, of.encoding) {
            Some(channel) => {
                let header = channel.header(log_ns);
                self.put(&header, data)
            }
            None => Ok(()),
        }
    }

    fn channel(&mut self, topic: &str, message: &str, encoding: &str) -> Option<&mut Channel> {
        let channels = self.channels.get_mut(topic)?.iter_mut();
        channels
            .into_iter()
            .find(|channel| channel.message == message && channel.encoding == encoding)
    }

    fn put(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), McapError> {
        let micros = header.log_time / 1000;
        let began = *self.chunk_began_us.get_or_insert(micros);
        if micros.saturating_sub(began) >= CHUNK_US {
            self.writer.flush()?;
            self.chunk_began_us = Some(micros);
        }
        self.writer.write_to_known_channel(header, data)
    }

    /// Writes the current chunk, for use before a pause.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn flush(&mut self) -> Result<(), McapError> {
        if self.chunk_began_us.take().is_some() {
            self.writer.flush()?;
        }
        Ok(())
    }

    /// Adds the channel of a topic. A schema that is there already is used again.
    fn declare(&mut self, of: &Declared<'_>) -> Result<(), McapError> {
        let schema = match of.schema {
            Some((encoding, text)) => self.writer.add_schema(of.message, encoding, text)?,
            // The name of the type is kept without its definition.
            None if !of.message.is_empty() => self.writer.add_schema(of.message, "", &[])?,
            None => 0,
        };
        let id = self
            .writer
            .add_channel(schema, of.topic, of.encoding, of.metadata)?;
        let channel = Channel {
            id,
            message: of.message.to_owned(),
            encoding: of.encoding.to_owned(),
            messages: 0,
        };
        self.channels
            .entry(of.topic.into())
            .or_default()
            .push(channel);
        Ok(())
    }

    /// Number of messages on each topic so far.
    #[must_use]
    pub fn counts(&self) -> BTreeMap<&str, u32> {
        let channels = self.channels.iter();
        channels
            .map(|(topic, channels)| {
                let messages = channels.iter().map(|channel| channel.messages);
                (topic.as_ref(), messages.sum())
            })
            .collect()
    }

    /// Writes the remaining messages and the summary.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<(), McapError> {
        self.writer.finish().map(drop)
    }
}
