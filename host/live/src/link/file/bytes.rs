//! Playback of a recording of the serial line, timed by the contact messages in it.

use std::io::{ErrorKind, Read};
use std::sync::Arc;
use std::time::Duration;

use estimator_core::Timestamp;
use wire::uart::{Decoder, Message};

use crate::link::pace::Pace;
use crate::link::{Arrival, Arrived, Link, LinkError, Sending};

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Recording with the state of its playback.
pub(super) struct Recording {
    name: String,
    port: Arc<str>,
    source: Box<dyn Read>,
    pace: Pace,
    decoder: Decoder,
    /// Bytes read from the file; the first `used` of them are consumed.
    read: Vec<u8>,
    used: usize,
    at: Timestamp,
    /// Piece that is complete but not due yet.
    next: Option<Vec<u8>>,
}

impl Recording {
    pub(super) fn new(name: String, source: Box<dyn Read>, pace: Pace) -> Self {
        Self {
            port: name.as_str().into(),
            name,
            source,
            pace,
            decoder: Decoder::new(),
            read: Vec::new(),
            used: 0,
            at: Timestamp::default(),
            next: None,
        }
    }

    /// Returns the bytes up to the end of the next message with a time, at most `PIECE` bytes.
    fn piece(&mut self) -> Result<Vec<u8>, LinkError> {
        let mut piece = Vec::new();
        loop {
            while let Some(byte) = self.read.get(self.used) {
                self.used += 1;
                piece.push(*byte);
                if let Some(Ok(frame)) = self.decoder.push(*byte)
                    && let Some(time) = time_of(&frame.message)
                {
                    self.at = time;
                    return Ok(piece);
                }
                if piece.len() >= PIECE {
                    return Ok(piece);
                }
            }
            self.read.resize(PIECE, 0);
            self.used = 0;
            match self.source.read(&mut self.read) {
                Ok(0) if piece.is_empty() => {
                    self.read.clear();
                    return Err(LinkError::Ended(self.name.clone()));
                }
                Ok(0) => {
                    self.read.clear();
                    return Ok(piece);
                }
                Ok(count) => self.read.truncate(count),
                Err(error) if error.kind() == ErrorKind::Interrupted => self.read.clear(),
                Err(error) => return Err(LinkError::File(format!("{}: {error}", self.name))),
            }
        }
    }
}

/// Time of a message, if it has one.
const fn time_of(message: &Message) -> Option<Timestamp> {
    match message {
        Message::Contact(contact) => Some(contact.timestamp),
        _ => None,
    }
}

impl Link for Recording {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let bytes = match self.next.take() {
            Some(bytes) => bytes,
            None => self.piece()?,
        };
        if self.pace.wait(self.at.as_micros(), longest) {
            let port = Arc::clone(&self.port);
            Ok(Some((self.at, Arrival::Bytes { port, bytes })))
        } else {
            self.next = Some(bytes);
            Ok(None)
        }
    }

    fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
        Err(LinkError::ReadOnly(self.name.clone()))
    }
}
