//! Playback of a log of CAN frames.

use std::io::{BufReader, Read};
use std::sync::Arc;

use crate::decode::can_log::{LogContent, Reader};
use crate::decode::lines::Lines;
use estimator_core::Timestamp;

use crate::link::{Arrival, Arrived};

/// Smallest step back of a log's clock that is not the order of its lines, µs.
const SET_BACK_US: u64 = 1_000_000;

/// Log, read line by line.
pub(super) struct Log {
    lines: Lines<BufReader<Box<dyn Read>>>,
    reader: Reader,
    /// Newest time, on the log's clock as it was before it was set back.
    at: Timestamp,
    /// Time by which the log's clock was set back so far, µs.
    set_back_us: u64,
    interface: Arc<str>,
}

impl Log {
    pub(super) fn new(source: Box<dyn Read>, reader: Reader) -> Self {
        Self {
            lines: Lines::new(BufReader::new(source)),
            reader,
            at: Timestamp::default(),
            set_back_us: 0,
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
                let moved_us = time.as_micros().saturating_add(self.set_back_us);
                let back_us = self.at.as_micros().saturating_sub(moved_us);
                // Lines of several interfaces may be out of order by less.
                let back_us = if back_us > SET_BACK_US { back_us } else { 0 };
                self.set_back_us = self.set_back_us.saturating_add(back_us);
                self.at = Timestamp::from_micros(moved_us.saturating_add(back_us));
            }
            if let LogContent::Frame(interface, frame) = read.content {
                if read.time.is_none() {
                    return Err("has frames without times: log with candump -l".to_owned());
                }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::can_log::recognise::recognise;

    fn times_us(text: &'static str) -> Result<Vec<u64>, String> {
        let reader = recognise(text.as_bytes()).expect("candump");
        let mut log = Log::new(Box::new(text.as_bytes()), reader);
        let mut times = Vec::new();
        while let Some((at, _)) = log.next()? {
            times.push(at.as_micros());
        }
        Ok(times)
    }

    #[test]
    fn times_go_on_where_the_clock_is_set_back() {
        let times =
            times_us("(9.000000) can0 191#00\n(9.100000) can0 191#00\n(2.500000) can0 191#00\n");
        assert_eq!(times.unwrap(), [9_000_000, 9_100_000, 9_100_000]);
    }

    #[test]
    fn frames_without_times_are_refused() {
        let log = "  can0  191   [1]  00\n";
        assert!(times_us(log).unwrap_err().contains("candump -l"));
    }
}
