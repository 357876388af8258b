//! Playback of a log of CAN frames.

use std::io::{BufReader, Read};
use std::sync::Arc;

use crate::decode::can_log::{LogContent, Reader};
use crate::decode::lines::Lines;
use estimator_core::Timestamp;

use crate::link::{Arrival, Arrived};

/// Log, read line by line.
pub(super) struct Log {
    lines: Lines<BufReader<Box<dyn Read>>>,
    reader: Reader,
    /// Newest time in the log, if it has any.
    at: Timestamp,
    interface: Arc<str>,
}

impl Log {
    pub(super) fn new(source: Box<dyn Read>, reader: Reader) -> Self {
        Self {
            lines: Lines::new(BufReader::new(source)),
            reader,
            at: Timestamp::default(),
            interface: "".into(),
        }
    }

    /// Reads the next frame or unreadable line.
    pub(super) fn next(&mut self) -> Result<Option<Arrived>, String> {
        while let Some((_, line)) = self.lines.next().map_err(|error| error.to_string())? {
            if line.trim().is_empty() {
                continue;
            }
            let Some(read) = self.reader.read(&line) else {
                let text = line.trim_end_matches('\r').to_owned();
                return Ok(Some((self.at, Arrival::Unreadable(text))));
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
        Ok(None)
    }
}
