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
    schemas: HashMap<&'static str, u16>,
    channels: HashMap<Arc<str>, Channel>,
    chunk_began_us: Option<u64>,
}

struct Channel {
    id: u16,
    messages: u32,
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
            schemas: HashMap::new(),
            channels: HashMap::new(),
            chunk_began_us: None,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&mut self, published: &Published) -> Result<(), McapError> {
        let micros = published.at.as_micros();
        let began = *self.chunk_began_us.get_or_insert(micros);
        if micros.saturating_sub(began) >= CHUNK_US {
            self.writer.flush()?;
            self.chunk_began_us = Some(micros);
        }
        let id = self.channel(published)?;
        let Some(channel) = self.channels.get_mut(&published.topic) else {
            return Ok(());
        };
        let nanos = micros.saturating_mul(1000);
        let header = MessageHeader {
            channel_id: id,
            sequence: channel.messages,
            log_time: nanos,
            publish_time: nanos,
        };
        channel.messages = channel.messages.wrapping_add(1);
        self.writer
            .write_to_known_channel(&header, &published.message.cdr())
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

    /// Returns the channel of a topic; creates it if it is new.
    fn channel(&mut self, published: &Published) -> Result<u16, McapError> {
        if let Some(channel) = self.channels.get(&published.topic) {
            return Ok(channel.id);
        }
        let definition = Definition::of(&published.message);
        let schema = match self.schemas.get(definition.name) {
            Some(schema) => *schema,
            None => {
                let text = definition.text();
                let schema = self
                    .writer
                    .add_schema(definition.name, "ros2msg", text.as_bytes())?;
                self.schemas.insert(definition.name, schema);
                schema
            }
        };
        let id = self
            .writer
            .add_channel(schema, &published.topic, "cdr", &BTreeMap::new())?;
        let channel = Channel { id, messages: 0 };
        self.channels.insert(Arc::clone(&published.topic), channel);
        Ok(id)
    }

    /// Number of messages on each topic so far.
    #[must_use]
    pub fn counts(&self) -> BTreeMap<&str, u32> {
        let channels = self.channels.iter();
        channels
            .map(|(topic, channel)| (topic.as_ref(), channel.messages))
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
