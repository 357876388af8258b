//! Recording to MCAP with the profile `ros2`, schemas included, chunks compressed with zstd.
//!
//! A chunk is written as a whole, once a second of message time or when it is full: a truncated file keeps
//! all complete chunks.

use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use crate::definition::Definition;
use crate::published::Published;

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
    /// Its declaration.
    message: String,
    schema: Option<(String, Vec<u8>)>,
    encoding: String,
    metadata: BTreeMap<String, String>,
    messages: u32,
}

impl Channel {
    /// Header of its next message.
    fn header(&mut self, times: Times) -> MessageHeader {
        let header = MessageHeader {
            channel_id: self.id,
            sequence: times.sequence.unwrap_or(self.messages),
            log_time: times.log_ns,
            publish_time: times.publish_ns,
        };
        self.messages = self.messages.wrapping_add(1);
        header
    }

    /// Returns whether a topic was declared with the same type, definition, serialisation and properties.
    fn is(&self, of: &Declared<'_>) -> bool {
        let schema = self.schema.as_ref();
        self.message == of.message
            && self.encoding == of.encoding
            && schema.map(|(encoding, text)| (encoding.as_str(), &text[..])) == of.schema
            && self.metadata == *of.metadata
    }
}

/// Times of a message of another bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// Time at which it was written, ns.
    pub log_ns: u64,
    /// Time at which it was sent, ns.
    pub publish_ns: u64,
    /// Number given by its sender; without, its number on its channel.
    pub sequence: Option<u32>,
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
        let log_ns = published.at.as_micros().saturating_mul(1000);
        let times = Times {
            log_ns,
            publish_ns: log_ns,
            sequence: None,
        };
        let data = published.message.cdr();
        let own = |channel: &&mut Channel| channel.message == definition.name;
        let channels = self.channels.get_mut(&published.topic);
        if let Some(channel) = channels.and_then(|channels| channels.iter_mut().find(own)) {
            let header = channel.header(times);
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
        self.copy(&declared, times, &data)
    }

    /// Appends a message of another bag.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn copy(&mut self, of: &Declared<'_>, times: Times, data: &[u8]) -> Result<(), McapError> {
        if self.channel(of).is_none() {
            self.declare(of)?;
        }
        let Some(channel) = self.channel(of) else {
            return Ok(());
        };
        let header = channel.header(times);
        self.put(&header, data)
    }

    fn channel(&mut self, of: &Declared<'_>) -> Option<&mut Channel> {
        let channels = self.channels.get_mut(of.topic)?;
        channels.iter_mut().find(|channel| channel.is(of))
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
        let (topic, encoding, metadata) = (of.topic, of.encoding, of.metadata);
        let id = self.writer.add_channel(schema, topic, encoding, metadata)?;
        let schema = of.schema;
        let channel = Channel {
            id,
            message: of.message.to_owned(),
            schema: schema.map(|(encoding, text)| (encoding.to_owned(), text.to_owned())),
            encoding: encoding.to_owned(),
            metadata: metadata.clone(),
            messages: 0,
        };
        self.channels.entry(topic.into()).or_default().push(channel);
        Ok(())
    }

    /// Number of messages on each topic so far.
    #[must_use]
    pub fn counts(&self) -> BTreeMap<&str, u32> {
        let count = |channels: &[Channel]| channels.iter().map(|channel| channel.messages).sum();
        let channels = self.channels.iter();
        let counts = channels.map(|(topic, channels)| (topic.as_ref(), count(channels)));
        counts.collect()
    }

    /// Writes the remaining messages and the summary.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<(), McapError> {
        self.writer.finish().map(drop)
    }
}
