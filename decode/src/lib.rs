//! What feet have sent becomes rows again, and what was lost is counted.
//!
//! | step | module |
//! |---|---|
//! | a log of CAN frames, line by line | `can`, with [`can_log`] and `lines` |
//! | a recording of the serial line | `uart` |
//! | the same while it happens: what feet say | [`live`] |
//! | what to do about a fault, a flag or a refusal | [`remedy`] |
//! | which nodes are feet, and how they are called | [`feet`] |
//! | a row per contact | [`row`] |
//! | what came, what is missing, what is wrong | [`report`] |
//!
//! Which of the two a file is, and which form a log has, its contents show. Files are read once and
//! never held whole: of the rows, `can` keeps the newest few thousand, to complete them.

mod can;
pub mod can_log;
pub mod feet;
mod lines;
pub mod live;
pub mod remedy;
pub mod report;
pub mod row;
mod uart;

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read};
use std::path::Path;

use recordings::input::compressed::decompressed;
use recordings::input::{Foreign, no_log};
use thiserror::Error;

pub use feet::Feet;
pub use report::{Medium, Report};
pub use row::Row;

use crate::can_log::recognise::recognise;
use lines::Lines;

/// The number of first bytes by which the form of a log is recognised.
const HEAD: u64 = 1 << 16;

/// What standard input is called in messages.
pub const STANDARD_INPUT: &str = "standard input";

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
    /// It is something else, known by its first bytes.
    #[error("{file} is {kind}, which is not read here; {}", .kind.log_advice(.file).unwrap_or_default())]
    Foreign {
        /// The file, as it was named.
        file: String,
        /// What it is, and what to do.
        kind: Foreign,
    },
    /// It is neither of the two: nothing in it can be understood.
    #[error(
        "{file} is neither a log of CAN frames (of candump, Vector ASC, python-can's CSV), with lines such as \"(1609459200.000111) can0 191#FFFF80800C0007D8\", nor a recording of the serial line, whose frames end with a zero byte"
    )]
    Unrecognised {
        /// The file, as it was named.
        file: String,
    },
    /// What takes the rows does not.
    #[error("the rows cannot be written: {0}")]
    Rows(#[source] io::Error),
}

/// Takes rows, in the order of the file.
pub type Sink<'a> = &'a mut dyn FnMut(Row) -> io::Result<()>;

/// What there is to say about a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What came and what did not.
    pub report: Report,
    /// One sentence on each thing that was passed over or assumed, for people to read.
    pub notices: Vec<String>,
}

/// What came out of a file that fits into memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// One per contact frame or message, in the order of the file.
    pub rows: Vec<Row>,
    /// What came and what did not.
    pub report: Report,
    /// As in [`Outcome`].
    pub notices: Vec<String>,
}

/// Decodes a file, or standard input where it is called `-`. Logs may be compressed with gzip or
/// zstd.
///
/// # Errors
/// It cannot be read, is empty, or is neither a CAN log nor a recording of the serial line; or
/// `sink` fails. Damage within either is counted in the report and is no error.
pub fn read(path: &Path, feet: &Feet, sink: Sink<'_>) -> Result<Outcome, DecodeError> {
    if path == Path::new("-") {
        return stream(Box::new(io::stdin()), STANDARD_INPUT, feet, sink);
    }
    let file = path.display().to_string();
    match File::open(path) {
        Ok(opened) => stream(Box::new(opened), &file, feet, sink),
        Err(source) => Err(DecodeError::Unreadable { file, source }),
    }
}

/// Decodes the contents of a file, as [`read`] does; `file` is its name, for messages.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], file: &str, feet: &Feet) -> Result<Decoded, DecodeError> {
    let mut rows = Vec::new();
    let source = Box::new(Cursor::new(bytes.to_vec()));
    let Outcome { report, notices } = stream(source, file, feet, &mut |row| {
        rows.push(row);
        Ok(())
    })?;
    Ok(Decoded {
        rows,
        report,
        notices,
    })
}

fn stream(
    source: Box<dyn Read>,
    file: &str,
    feet: &Feet,
    sink: Sink<'_>,
) -> Result<Outcome, DecodeError> {
    let unreadable = |source| DecodeError::Unreadable {
        file: file.to_owned(),
        source,
    };
    let mut source = Source {
        inner: decompressed(source).map_err(unreadable)?,
        is_cut: false,
    };
    let mut head = Vec::new();
    source
        .by_ref()
        .take(HEAD)
        .read_to_end(&mut head)
        .map_err(unreadable)?;
    if head.is_empty() {
        return Err(DecodeError::Empty {
            file: file.to_owned(),
        });
    }
    if let Some(kind) = no_log(&head) {
        return Err(DecodeError::Foreign {
            file: file.to_owned(),
            kind,
        });
    }
    // A log that was cut off by a loss of power may hold zeros, but no recording of the serial
    // line holds a line of a log.
    let reader = recognise(&head);
    let whole = Cursor::new(head).chain(&mut source);
    let mut outcome = match reader {
        Some(reader) => {
            let lines = Lines::new(BufReader::with_capacity(HEAD as usize, whole));
            can::decode(lines, reader, file, feet, sink)?
        }
        None => uart::decode(whole, file, feet, sink)?.ok_or(DecodeError::Unrecognised {
            file: file.to_owned(),
        })?,
    };
    if source.is_cut {
        outcome.report.count_problem("compressed_data_cut_off");
        outcome.notices.push(format!(
            "{file}: the compressed data ends early; what came before is decoded"
        ));
    }
    Ok(outcome)
}

/// A file that may have been cut off while it was compressed: what there is of it.
struct Source {
    inner: Box<dyn Read>,
    is_cut: bool,
}

impl Read for Source {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        match self.inner.read(to) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                self.is_cut = true;
                Ok(0)
            }
            result => result,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_neither_says_what_would_be() {
        let error = |bytes: &[u8]| {
            decode(bytes, "x.bin", &Feet::default())
                .unwrap_err()
                .to_string()
        };
        assert_eq!(error(b""), "x.bin is empty");
        for neither in [
            &b"t,ax,ay\n0,1,2\n"[..],
            &[0xFF; 50],
            // As a program begins, whose zeros look like the ends of frames.
            b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0\x3e\0\x01\0\0\0",
            &[0; 50],
        ] {
            let error = error(neither);
            assert!(
                error.starts_with("x.bin is neither a log of CAN frames"),
                "{error}"
            );
        }
    }

    #[test]
    fn a_log_whose_first_and_last_lines_are_broken_is_still_a_log() {
        let log = b"00114) can0 191#FF\n(1.000000) can0 711#00\n\0\0\0";
        let decoded = decode(log, "can.log", &Feet::default()).unwrap();
        assert_eq!(decoded.report.format, Medium::Can);
        assert_eq!(decoded.report.problems["malformed_lines"], 2);
    }
}
