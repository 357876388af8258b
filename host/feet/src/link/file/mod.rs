//! Playback of a file, whose format is recognised by its first bytes.
//!
//! | file | is played by |
//! |---|---|
//! | a log of CAN frames in any format that `footfall decode` reads | `PlayedLog` |
//! | a recording of the serial line | `PlayedBytes` |
//! | a recording of an IMU in any format that `footfall replay` reads, estimated here | `imu` |

mod imu;

pub use imu::RecordingError;

use std::fs::File;
use std::io::{self, BufReader, Cursor, ErrorKind, Read};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use estimator_core::Timestamp;
use files::compressed::decompressed;
use wire::uart::{Decoder, Message};

use super::clock::PlaybackPace;
use super::{Arrival, Arrived, Link, LinkError, Sending};
use crate::decode::can_log::{Lines, LogContent, LogReader, recognise};
use crate::source::{Playback, Speed};

/// Number of bytes read to recognise the format.
const HEAD: u64 = 1 << 16;

/// Opens a file at this speed; `playback` applies to the recording of an IMU.
///
/// # Errors
/// The file cannot be read, its format is unknown, or it has contacts of feet and `playback` is not the default.
pub fn open(path: &Path, speed: Speed, playback: &Playback) -> Result<Box<dyn Link>, LinkError> {
    let name = path.display().to_string();
    Ok(Box::new(Played {
        read: parts(path, &name, playback)?,
        name,
        pace: PlaybackPace::new(speed),
        next: None,
    }))
}

/// Function that returns the next part of a file with its time, in order of time; `None` at the end.
type NextPart = Box<dyn FnMut() -> Result<Option<Arrived>, PlayError>>;

/// Reason why a file cannot be played further.
#[derive(Debug)]
enum PlayError {
    /// The file cannot be read.
    Read(io::Error),
    /// The file has frames without times.
    NoTimes,
}

impl PlayError {
    /// Creates the error of a line from the error of a file.
    fn of(self, file: &str) -> LinkError {
        let file = file.to_owned();
        match self {
            Self::Read(source) => LinkError::File { file, source },
            Self::NoTimes => LinkError::NoTimes(file),
        }
    }
}

impl From<io::Error> for PlayError {
    fn from(error: io::Error) -> Self {
        Self::Read(error)
    }
}

fn parts(path: &Path, name: &str, playback: &Playback) -> Result<NextPart, LinkError> {
    let unreadable = |error: io::Error| PlayError::Read(error).of(name);
    if path.is_file() {
        let file = File::open(path).map_err(unreadable)?;
        let mut source = decompressed(Box::new(file)).map_err(unreadable)?;
        let mut head = Vec::new();
        let read = source.by_ref().take(HEAD).read_to_end(&mut head);
        read.map_err(unreadable)?;
        let reader = recognise(&head);
        if reader.is_some() || holds_a_frame(&head) {
            if *playback != Playback::default() {
                return Err(LinkError::NotEstimated(name.to_owned()));
            }
            let whole = Box::new(Cursor::new(head).chain(source));
            if let Some(reader) = reader {
                let mut log = PlayedLog::new(whole, reader);
                return Ok(Box::new(move || log.next()));
            }
            let mut recording = PlayedBytes::new(name, whole);
            return Ok(Box::new(move || recording.next()));
        }
    }
    let mut imu = imu::PlayedImu::open(path, playback)?;
    Ok(Box::new(move || Ok(imu.next()?)))
}

/// File with the state of its playback.
struct Played {
    read: NextPart,
    name: String,
    pace: PlaybackPace,
    /// Part that is read but not due yet.
    next: Option<Arrived>,
}

impl Link for Played {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let name = &self.name;
        let read = match self.next.take() {
            None => (self.read)(),
            next => Ok(next),
        };
        let next = read.map_err(|error| error.of(name))?;
        let next = next.ok_or_else(|| LinkError::Ended(name.clone()))?;
        if self.pace.wait(next.0.as_micros(), longest) {
            return Ok(Some(next));
        }
        self.next = Some(next);
        Ok(None)
    }

    fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
        Err(LinkError::ReadOnly(self.name.clone()))
    }
}

fn holds_a_frame(bytes: &[u8]) -> bool {
    let mut decoder = Decoder::new();
    let mut results = bytes.iter().map(|byte| decoder.push(*byte));
    results.any(|result| matches!(result, Some(Ok(_))))
}

/// Step back of a log's times beyond which the clock was set back, µs. Smaller steps come from lines out of order.
const SET_BACK_US: u64 = 1_000_000;

/// Log, read line by line.
struct PlayedLog {
    lines: Lines<BufReader<Box<dyn Read>>>,
    reader: LogReader,
    /// Newest time, on the log's clock as it was before it was set back.
    at: Timestamp,
    /// Time by which the log's clock was set back so far, µs.
    set_back_us: u64,
    interface: Arc<str>,
}

impl PlayedLog {
    fn new(source: Box<dyn Read>, reader: LogReader) -> Self {
        Self {
            lines: Lines::new(BufReader::new(source)),
            reader,
            at: Timestamp::default(),
            set_back_us: 0,
            interface: "".into(),
        }
    }

    /// Reads the next frame or unreadable line.
    fn next(&mut self) -> Result<Option<Arrived>, PlayError> {
        while let Some((_, line)) = self.lines.next()? {
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
                // Smaller steps back occur because lines of several interfaces may be out of order.
                let back_us = if back_us > SET_BACK_US { back_us } else { 0 };
                self.set_back_us = self.set_back_us.saturating_add(back_us);
                self.at = Timestamp::from_micros(moved_us.saturating_add(back_us));
            }
            if let LogContent::Frame(interface, frame) = read.content {
                if read.time.is_none() {
                    return Err(PlayError::NoTimes);
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

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Recording of a serial line, read piece by piece and timed by the contact messages in it.
struct PlayedBytes {
    port: Arc<str>,
    source: Box<dyn Read>,
    decoder: Decoder,
    /// Bytes read from the file; the first `used` of them are consumed.
    read: Vec<u8>,
    used: usize,
    at: Timestamp,
}

impl PlayedBytes {
    fn new(name: &str, source: Box<dyn Read>) -> Self {
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
    fn next(&mut self) -> Result<Option<Arrived>, PlayError> {
        let bytes = self.piece()?;
        let port = Arc::clone(&self.port);
        Ok((!bytes.is_empty()).then_some((self.at, Arrival::Bytes { port, bytes })))
    }

    /// Returns the bytes up to the end of the next message with a time, at most `PIECE` bytes; empty at the end.
    fn piece(&mut self) -> io::Result<Vec<u8>> {
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
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times_us(text: &'static str) -> Result<Vec<u64>, PlayError> {
        let reader = recognise(text.as_bytes()).expect("candump");
        let mut log = PlayedLog::new(Box::new(text.as_bytes()), reader);
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
        let error = times_us(log).unwrap_err().of("can.log").to_string();
        assert_eq!(error, "can.log has frames without times: log with candump -l");
    }
}
