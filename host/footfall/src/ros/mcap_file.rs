//! Recording to MCAP with the profile `ros2`, schemas included, chunks compressed with zstd.
//!
//! A chunk is written as a whole, once a second of message time or when it is full: a truncated file keeps
//! all complete chunks.

use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use crate::ros::definition::Definition;
use crate::ros::published::Published;

/// Maximum size of a chunk before compression, bytes.
const CHUNK: u64 = 1 << 20;

/// Maximum duration of a chunk, µs.
const CHUNK_US: u64 = 1_000_000;

/// Writer of an MCAP file.
pub struct McapFile<W: Write + Seek> {
    writer: Writer<W>,
    /// Channel and number of messages of each topic.
    channels: BTreeMap<Arc<str>, (u16, u32)>,
    chunk_began_us: Option<u64>,
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
            channels: BTreeMap::new(),
            chunk_began_us: None,
        })
    }

    /// Appends a message.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&mut self, published: &Published) -> Result<(), McapError> {
        let topic = &published.topic;
        if !self.channels.contains_key(topic) {
            let definition = Definition::of(&published.message);
            let text = definition.text();
            let schema = (self.writer).add_schema(definition.name, "ros2msg", text.as_bytes())?;
            let none = BTreeMap::new();
            let channel = self.writer.add_channel(schema, topic, "cdr", &none)?;
            self.channels.insert(topic.clone(), (channel, 0));
        }
        let Some((channel, messages)) = self.channels.get_mut(topic) else {
            return Ok(());
        };
        let micros = published.at.as_micros();
        let log_time = micros.saturating_mul(1000);
        let header = MessageHeader {
            channel_id: *channel,
            sequence: *messages,
            log_time,
            publish_time: log_time,
        };
        *messages = messages.wrapping_add(1);
        let began = *self.chunk_began_us.get_or_insert(micros);
        if micros.saturating_sub(began) >= CHUNK_US {
            self.writer.flush()?;
            self.chunk_began_us = Some(micros);
        }
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

    /// Number of messages on each topic so far.
    pub fn counts(&self) -> impl Iterator<Item = (&str, u32)> {
        let channels = self.channels.iter();
        channels.map(|(topic, (_, messages))| (topic.as_ref(), *messages))
    }

    /// Writes the remaining messages and the summary.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<(), McapError> {
        self.writer.finish().map(drop)
    }
}
