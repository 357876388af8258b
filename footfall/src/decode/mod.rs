//! `footfall decode`: what a foot has sent becomes rows again, and what was lost is counted.
//!
//! | step | module |
//! |---|---|
//! | a log of `candump -l` | `can`, with [`can_log`] |
//! | a recording of the serial line | `uart` |
//! | a row per contact | [`row`] |
//! | what came, what is missing, what is wrong | [`report`] |
//!
//! Which of the two a file is, its contents show.

mod can;
pub mod report;
pub mod row;
mod uart;

use std::fs;
use std::io;
use std::path::Path;

use thiserror::Error;

pub use report::{Medium, Report};
pub use row::Row;

use wire::NodeId;

use crate::can_log;

/// Why a file cannot be decoded.
#[derive(Debug, Error)]
pub enum DecodeError {
    /// The file cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// The file, as it was named.
        file: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// There is nothing in it.
    #[error("{file} is empty")]
    Empty {
        /// The file, as it was named.
        file: String,
    },
    /// It is neither of the two: nothing in it can be understood.
    #[error(
        "{file} is neither a log of candump -l, with lines such as \"(1609459200.000111) can0 191#FFFF80800C0007D8\", nor a recording of the serial line, whose frames end with a zero byte"
    )]
    Unrecognised {
        /// The file, as it was named.
        file: String,
    },
}

/// What came out of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// One per contact frame or message, in the order of the file.
    pub rows: Vec<Row>,
    /// What came and what did not.
    pub report: Report,
    /// One sentence on each thing that was passed over, for people to read.
    pub notices: Vec<String>,
}

/// Reads a file and decodes it. On CAN the feet are the nodes with an id that [`wire::Foot`] has
/// from the start, and `others`.
///
/// # Errors
/// It cannot be read, is empty, or is neither a CAN log nor a recording of the serial line.
/// Damage within either is counted in the report and is no error.
pub fn read(path: &Path, others: &[NodeId]) -> Result<Decoded, DecodeError> {
    let file = path.display().to_string();
    match fs::read(path) {
        Ok(bytes) => decode(&bytes, &file, others),
        Err(source) => Err(DecodeError::Unreadable { file, source }),
    }
}

/// Decodes the contents of a file, as [`read`] does; `file` is its name, for messages.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], file: &str, others: &[NodeId]) -> Result<Decoded, DecodeError> {
    let file = file.to_owned();
    if bytes.is_empty() {
        return Err(DecodeError::Empty { file });
    }
    // A log that was cut off by a loss of power may hold zeros, but no recording of the serial
    // line holds a line of a log.
    let text = String::from_utf8_lossy(bytes);
    if text.lines().any(|line| can_log::parse(line).is_some()) {
        Ok(can::decode(&text, &file, others))
    } else {
        uart::decode(bytes).ok_or(DecodeError::Unrecognised { file })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_neither_says_what_would_be() {
        let error = |bytes: &[u8]| decode(bytes, "x.bin", &[]).unwrap_err().to_string();
        assert_eq!(error(b""), "x.bin is empty");
        for neither in [
            &b"t,ax,ay\n0,1,2\n"[..],
            b"can0 191 [2] 00 01\n",
            &[0xFF; 50],
            // As a program begins, whose zeros look like the ends of frames.
            b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0\x3e\0\x01\0\0\0",
            &[0; 50],
        ] {
            let error = error(neither);
            assert!(
                error.starts_with("x.bin is neither a log of candump -l"),
                "{error}"
            );
        }
    }

    #[test]
    fn a_log_whose_first_and_last_lines_are_broken_is_still_a_log() {
        let log = b"00114) can0 191#FF\n(1.000000) can0 711#00\n\0\0\0";
        let decoded = decode(log, "can.log", &[]).unwrap();
        assert_eq!(decoded.report.format, Medium::Can);
        assert_eq!(decoded.report.problems["malformed_lines"], 2);
    }
}
