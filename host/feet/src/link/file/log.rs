//! Playback of a log of CAN frames.

use std::io::{BufRead, BufReader, Read};
use std::sync::Arc;

use crate::decode::can_log::{LogContent, Reader};
use estimator_core::Timestamp;

use crate::link::{Arrival, Arrived};

/// Maximum number of bytes read as one line; lines of logs are shorter.
const LONGEST_LINE: u64 = 4096;

/// Log, read line by line.
pub(super) struct Log {
    lines: BufReader<Box<dyn Read>>,
    reader: Reader,
    /// Newest time in the log, if it has any.
    at: Timestamp,
    interface: Arc<str>,
}

impl Log {
    pub(super) fn new(source: Box<dyn Read>, reader: Reader) -> Self {
        Self {
            lines: BufReader::new(source),
            reader,
            at: Timestamp::default(),
            interface: "".into(),
        }
    }

    /// Reads the next frame or unreadable line.
    pub(super) fn next(&mut self) -> Result<Option<Arrived>, String> {
        loop {
            let mut line = Vec::new();
            let mut limited = (&mut self.lines).take(LONGEST_LINE);
            let count = limited.read_until(b'\n', &mut line);
            if count.map_err(|error| error.to_string())? == 0 {
                return Ok(None);
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim_matches(['\n', '\r', '\u{feff}']);
            if text.trim().is_empty() {
                continue;
            }
            let Some(read) = self.reader.read(text) else {
                return Ok(Some((self.at, Arrival::Unreadable(text.to_owned()))));
            };
            if let Some(time) = read.time {
                self.at = time;
            }
            if let LogContent::Frame(interface, frame) = read.content {
                if *self.interface != *interface {
                    self.interface = interface.into();
                }
                let interface = Arc::clone(&self.interface);
                return Ok(Some((self.at, Arrival::Frame { interface, frame })));
            }
        }
    }
}
