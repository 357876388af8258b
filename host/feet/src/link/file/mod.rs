//! Playback of a file, whose format is recognised by its first bytes.
//!
//! | file | is played by |
//! |---|---|
//! | a log of CAN frames in any format that `footfall decode` reads | `log` |
//! | a recording of the serial line | `bytes` |
//! | a recording of an IMU in any format that `footfall replay` reads, estimated here | `imu` |

mod bytes;
mod imu;
mod log;

use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::Path;
use std::time::Duration;

use crate::decode::can_log::recognise::recognise;
use recordings::input::compressed::decompressed;
use wire::uart::Decoder;

use super::pace::{Pace, Speed};
use super::{Arrived, Link, LinkError, Sending};
use crate::playback::Playback;

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
        pace: Pace::new(speed),
        next: None,
    }))
}

/// Function that returns the next part of a file with its time, in order of time: `None` at the end, or the reason why the
/// file cannot be read further.
type NextPart = Box<dyn FnMut() -> Result<Option<Arrived>, String>>;

fn parts(path: &Path, name: &str, playback: &Playback) -> Result<NextPart, LinkError> {
    let unreadable = |error: io::Error| LinkError::File(format!("{name}: {error}"));
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
                let mut log = log::Log::new(whole, reader);
                return Ok(Box::new(move || log.next()));
            }
            let mut recording = bytes::Recording::new(name, whole);
            return Ok(Box::new(move || recording.next()));
        }
    }
    let mut imu = imu::Imu::open(path, playback)?;
    Ok(Box::new(move || imu.next()))
}

/// File with the state of its playback.
struct Played {
    read: NextPart,
    name: String,
    pace: Pace,
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
        let next = read.map_err(|error| LinkError::File(format!("{name}: {error}")))?;
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
