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
use std::io::{Cursor, Read};
use std::path::Path;

use decode::can_log::recognise::recognise;
use recordings::input::compressed::decompressed;
use wire::uart::Decoder;

use super::pace::{Pace, Speed};
use super::{Link, LinkError};
use crate::playback::Playback;

/// Number of bytes read to recognise the format.
const HEAD: u64 = 1 << 16;

/// Opens a file at this speed; `playback` applies to the recording of an IMU.
///
/// # Errors
/// The file cannot be read, its format is unknown, or it has contacts of feet and `playback` is not the default.
pub fn open(path: &Path, speed: Speed, playback: &Playback) -> Result<Box<dyn Link>, LinkError> {
    let name = path.display().to_string();
    let unreadable = |error: std::io::Error| LinkError::File(format!("{name}: {error}"));
    let pace = Pace::new(speed);
    if path.is_file() {
        let file = File::open(path).map_err(unreadable)?;
        let mut source = decompressed(Box::new(file)).map_err(unreadable)?;
        let mut head = Vec::new();
        let read = source.by_ref().take(HEAD).read_to_end(&mut head);
        read.map_err(unreadable)?;
        let reader = recognise(&head);
        let is_line = reader.is_none() && holds_a_frame(&head);
        if (reader.is_some() || is_line) && *playback != Playback::default() {
            return Err(LinkError::NotEstimated(name));
        }
        if let Some(reader) = reader {
            let whole = Cursor::new(head).chain(source);
            return Ok(Box::new(log::Log::new(name, Box::new(whole), reader, pace)));
        }
        if is_line {
            let whole = Cursor::new(head).chain(source);
            return Ok(Box::new(bytes::Recording::new(name, Box::new(whole), pace)));
        }
    }
    Ok(Box::new(imu::Imu::open(path, pace, playback)?))
}

fn holds_a_frame(bytes: &[u8]) -> bool {
    let mut decoder = Decoder::new();
    bytes
        .iter()
        .any(|byte| matches!(decoder.push(*byte), Some(Ok(_))))
}
