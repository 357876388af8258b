//! Playback of a log of CAN frames.

use std::io::{BufRead, BufReader, Read};
use std::sync::Arc;
use std::time::Duration;

use decode::can_log::{LogContent, Reader};
use estimator_core::Timestamp;

use crate::link::pace::Pace;
use crate::link::{Arrival, Arrived, Link, LinkError, Sending};

/// Maximum number of bytes read as one line; lines of logs are shorter.
const LONGEST_LINE: u64 = 4096;

/// Log with the state of its playback.
pub(super) struct Log {
    name: String,
    lines: BufReader<Box<dyn Read>>,
    reader: Reader,
    pace: Pace,
    /// Newest time in the log, if it has any.
    at: Timestamp,
    interface: Arc<str>,
    /// Entry that is read but not due yet.
    next: Option<Arrived>,
}

impl Log {
    pub(super) fn new(name: String, source: Box<dyn Read>, reader: Reader, pace: Pace) -> Self {
        Self {
            name,
            lines: BufReader::new(source),
            reader,
            pace,
            at: Timestamp::default(),
            interface: "".into(),
            next: None,
        }
    }

    /// Reads the next frame or unreadable line.
    fn read(&mut self) -> Result<Arrived, LinkError> {
        loop {
            let mut line = Vec::new();
            let mut limited = (&mut self.lines).take(LONGEST_LINE);
            let count = limited.read_until(b'\n', &mut line);
            match count {
                Ok(0) => return Err(LinkError::Ended(self.name.clone())),
                Ok(_) => {}
                Err(error) => return Err(LinkError::File(format!("{}: {error}", self.name))),
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim_matches(['\n', '\r', '\u{feff}']);
            if text.trim().is_empty() {
                continue;
            }
            let Some(read) = self.reader.read(text) else {
                return Ok((self.at, Arrival::Unreadable(text.to_owned())));
            };
            if let Some(time) = read.time {
                self.at = time;
            }
            if let LogContent::Frame(interface, frame) = read.content {
                if *self.interface != *interface {
                    self.interface = interface.into();
                }
                let interface = Arc::clone(&self.interface);
                return Ok((self.at, Arrival::Frame { interface, frame }));
            }
        }
    }
}

impl Link for Log {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let next = match self.next.take() {
            Some(next) => next,
            None => self.read()?,
        };
        if self.pace.wait(next.0.as_micros(), longest) {
            Ok(Some(next))
        } else {
            self.next = Some(next);
            Ok(None)
        }
    }

    fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
        Err(LinkError::ReadOnly(self.name.clone()))
    }
}
