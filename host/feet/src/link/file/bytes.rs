//! Playback of a recording of the serial line, timed by the contact messages in it.

use std::io::{ErrorKind, Read};
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::uart::{Decoder, Message};

use crate::link::{Arrival, Arrived};

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Recording, read piece by piece.
pub(super) struct Recording {
    port: Arc<str>,
    source: Box<dyn Read>,
    decoder: Decoder,
    /// Bytes read from the file; the first `used` of them are consumed.
    read: Vec<u8>,
    used: usize,
    at: Timestamp,
}

impl Recording {
    pub(super) fn new(name: &str, source: Box<dyn Read>) -> Self {
        Self {
            port: name.into(),
            source,
            decoder: Decoder::new(),
            read: Vec::new(),
            used: 0,
            at: Timestamp::default(),
        }
    }

    /// Returns the next bytes, up to the end of a message with a time.
    pub(super) fn next(&mut self) -> Result<Option<Arrived>, String> {
        let bytes = self.piece()?;
        let port = Arc::clone(&self.port);
        Ok((!bytes.is_empty()).then_some((self.at, Arrival::Bytes { port, bytes })))
    }

    /// Returns the bytes up to the end of the next message with a time, at most `PIECE` bytes; none at the end.
    fn piece(&mut self) -> Result<Vec<u8>, String> {
        let mut piece = Vec::new();
        loop {
            while let Some(byte) = self.read.get(self.used) {
                self.used += 1;
                piece.push(*byte);
                if let Some(Ok(frame)) = self.decoder.push(*byte)
                    && let Message::Contact(contact) = &frame.message
                {
                    self.at = contact.timestamp;
                    return Ok(piece);
                }
                if piece.len() >= PIECE {
                    return Ok(piece);
                }
            }
            self.read.resize(PIECE, 0);
            self.used = 0;
            match self.source.read(&mut self.read) {
                Ok(0) => {
                    self.read.clear();
                    return Ok(piece);
                }
                Ok(count) => self.read.truncate(count),
                Err(error) if error.kind() == ErrorKind::Interrupted => self.read.clear(),
                Err(error) => return Err(error.to_string()),
            }
        }
    }
}
