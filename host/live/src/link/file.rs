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
use recordings::input::Hints;
use recordings::input::compressed::decompressed;
use wire::uart::Decoder;

use super::pace::{Pace, Speed};
use super::{Link, LinkError};

/// Number of bytes read to recognise the format.
const HEAD: u64 = 1 << 16;

/// Opens a file for playback at this speed; `hints` apply to the recording of an IMU.
///
/// # Errors
/// The file cannot be read, or its format is unknown.
pub fn open(path: &Path, speed: Speed, hints: &Hints) -> Result<Box<dyn Link>, LinkError> {
    let name = path.display().to_string();
    let unreadable = |error: std::io::Error| LinkError::File(format!("{name}: {error}"));
    let pace = Pace::new(speed);
    if path.is_file() {
        let file = File::open(path).map_err(unreadable)?;
        let mut source = decompressed(Box::new(file)).map_err(unreadable)?;
        let mut head = Vec::new();
        let read = source.by_ref().take(HEAD).read_to_end(&mut head);
        read.map_err(unreadable)?;
        if let Some(reader) = recognise(&head) {
            let whole = Cursor::new(head).chain(source);
            return Ok(Box::new(log::Log::new(name, Box::new(whole), reader, pace)));
        }
        if holds_a_frame(&head) {
            let whole = Cursor::new(head).chain(source);
            return Ok(Box::new(bytes::Recording::new(name, Box::new(whole), pace)));
        }
    }
    Ok(Box::new(imu::Imu::open(path, pace, hints)?))
}

fn holds_a_frame(bytes: &[u8]) -> bool {
    let mut decoder = Decoder::new();
    bytes
        .iter()
        .any(|byte| matches!(decoder.push(*byte), Some(Ok(_))))
}
