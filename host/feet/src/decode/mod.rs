//! Decodes frames of feet to contacts, which are the rows of a table, and counts losses.
//!
//! | item | module |
//! |---|---|
//! | frames and bytes as they arrive, on all lines of a robot | [`live`] |
//! | frames of a CAN bus, live or of a log: a contact with the other values of its sample | `can` |
//! | messages of a serial line, live or of a recording | `uart` |
//! | lines of a log of CAN frames | [`can_log`] |
//! | nodes that are feet, and their names | [`known_feet`] |
//! | a contact, as a row of a table | [`row`] |
//! | counts of frames, losses and problems | [`report`] |
//!
//! [`read`] decodes a file. Its kind and the format of a log are detected from the contents. It is read once, and never
//! held in memory as a whole: `can` keeps the newest few thousand rows to complete them.

mod can;
pub mod can_log;
pub mod known_feet;
pub mod live;
pub mod report;
pub mod row;
mod uart;

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read};
use std::path::Path;

use files::compressed::decompressed;
use files::file_kind::{FileKind, no_log};
use thiserror::Error;

use crate::remedy::FootHint;
pub use known_feet::KnownFeet;
pub use report::{Medium, Report};
pub use row::ContactRow;

use can_log::{Form, Lines, recognise};

/// Name of standard input in messages.
pub const STANDARD_INPUT: &str = "standard input";

/// Receives rows, in the order of the file.
pub type RowSink<'a> = &'a mut dyn FnMut(ContactRow) -> io::Result<()>;

/// Decodes a file, or standard input for `-`. Logs may be compressed with gzip or zstd.
///
/// # Errors
/// The file cannot be read, is empty, or is neither a CAN log nor a recording of the serial line; or `sink`
/// fails. Damage within a file is counted in the report and is not an error.
pub fn read(path: &Path, feet: &KnownFeet, sink: RowSink<'_>) -> Result<FileOutcome, DecodeError> {
    if path == Path::new("-") {
        return stream(Box::new(io::stdin()), STANDARD_INPUT, feet, sink);
    }
    let file = path.display().to_string();
    let opened = File::open(path).map_err(DecodeError::unreadable(&file))?;
    stream(Box::new(opened), &file, feet, sink)
}

/// Decodes the contents of a file like [`read`]; `file` is its name in messages.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], file: &str, feet: &KnownFeet) -> Result<Decoded, DecodeError> {
    let mut rows = Vec::new();
    let source = Box::new(Cursor::new(bytes.to_vec()));
    let FileOutcome { report, notices, .. } = stream(source, file, feet, &mut |row| {
        rows.push(row);
        Ok(())
    })?;
    Ok(Decoded { rows, report, notices })
}

/// Result of decoding a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileOutcome {
    /// Name of the file in messages.
    pub file: String,
    /// Counts of what was received and what is missing.
    pub report: Report,
    /// Everything that was skipped or assumed.
    pub notices: Vec<DecodeNotice>,
}

/// Result of decoding a file that fits into memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// One per contact frame or message, in the order of the file.
    pub rows: Vec<ContactRow>,
    /// Counts of what was received and what is missing.
    pub report: Report,
    /// Notices, as in [`FileOutcome`].
    pub notices: Vec<DecodeNotice>,
}

/// Number of bytes at the start of a file from which its format is detected.
const HEAD: u64 = 1 << 16;

fn stream(
    source: Box<dyn Read>,
    file: &str,
    feet: &KnownFeet,
    sink: RowSink<'_>,
) -> Result<FileOutcome, DecodeError> {
    let unreadable = DecodeError::unreadable(file);
    let mut source =
        TolerantReader { inner: decompressed(source).map_err(&unreadable)?, is_cut: false };
    let mut head = Vec::new();
    let read = source.by_ref().take(HEAD).read_to_end(&mut head);
    read.map_err(unreadable)?;
    if head.is_empty() {
        return Err(DecodeError::Empty(file.to_owned()));
    }
    if let Some(kind) = no_log(&head) {
        let file = file.to_owned();
        return Err(DecodeError::Foreign { file, kind });
    }
    // Log formats are tried first, because a log truncated by a loss of power may contain zeros, whereas a
    // recording of the serial line contains no line of a log.
    let reader = recognise(&head);
    let whole = Cursor::new(head).chain(&mut source);
    let mut outcome = match reader {
        Some(reader) => {
            let lines = Lines::new(BufReader::with_capacity(HEAD as usize, whole));
            can::decode(lines, reader, file, feet, sink)?
        }
        None => uart::decode(whole, file, feet, sink)?
            .ok_or_else(|| DecodeError::Unrecognised(file.to_owned()))?,
    };
    if source.is_cut {
        outcome.report.count_problem("compressed_data_cut_off");
        outcome.notices.push(DecodeNotice::CutOff);
    }
    Ok(outcome)
}

/// Reader that treats the early end of compressed data as the end of the file.
struct TolerantReader {
    inner: Box<dyn Read>,
    is_cut: bool,
}

impl Read for TolerantReader {
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

/// Notice about a part of a file that was skipped, or about an assumption that was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DecodeNotice {
    /// A line is not one of the log.
    MalformedLine {
        /// Number of the line, from 1.
        number: u64,
        /// Start of the line.
        start: String,
        /// Form of the log.
        form: Form,
    },
    /// This number of further lines is malformed.
    MoreMalformedLines(u64, Form),
    /// No foot has sent a contact, but a node that is not known as a foot may have.
    UnknownFoot {
        /// Ids of the known feet.
        known: String,
        /// Id of the node.
        node: u8,
    },
    /// The times of the log are differences from line to line.
    TimesAreDifferences,
    /// Several feet have no common clock, because the log has no times.
    NoCommonClock,
    /// The common clock of several feet is by reception, because no foot has reported a numbered SYNC.
    CommonByReception,
    /// Numbered SYNCs give the common clock of several feet, except in this number of rows.
    CommonBySync {
        /// Rows with the time of reception.
        received: u64,
    },
    /// The compressed data ends early.
    CutOff,
}

impl DecodeNotice {
    /// Returns a sentence for the user about the file of this name.
    #[must_use]
    pub fn sentence(&self, file: &str) -> String {
        let said = match self {
            Self::MalformedLine { number, start, form } => {
                return format!(
                    "{file}, line {number}: {start:?} is not a line of {}, which look like {}",
                    form.name(),
                    form.example()
                );
            }
            Self::MoreMalformedLines(count, form) => {
                format!("{count} more lines are not lines of {}", form.name())
            }
            Self::UnknownFoot { known, node } => format!(
                "no foot of the ids {known} has sent a contact, but node {node} may be one"
            ),
            Self::TimesAreDifferences => {
                "its times are differences from line to line; t_received is their sum".to_owned()
            }
            Self::NoCommonClock => {
                "this log has no times: t_received and t_common are blank, and each foot's t is on its own clock".to_owned()
            }
            Self::CommonByReception => {
                "t_common is the time of reception, as no foot has reported a numbered SYNC of this log (object 0x1019 of the master numbers them)".to_owned()
            }
            Self::CommonBySync { received: 0 } => "t_common is by numbered SYNCs".to_owned(),
            Self::CommonBySync { received } => format!(
                "t_common is by numbered SYNCs, but for {received} rows of feet that had reported none: there it is the time of reception"
            ),
            Self::CutOff => {
                "the compressed data ends early; what came before is decoded".to_owned()
            }
        };
        format!("{file}: {said}")
    }

    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::UnknownFoot { node, .. } => Some(FootHint::NameNodeAsFoot(*node)),
            _ => None,
        }
    }
}

/// Reason why a file cannot be decoded.
#[derive(Debug, Error)]
pub enum DecodeError {
    /// The file cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// Name of the file, as given.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is empty.
    #[error("{0} is empty")]
    Empty(String),
    /// The file has another format, detected by its first bytes.
    #[error("{file} is {kind}, which is not read here; {}", .kind.log_advice(.file).unwrap_or_default())]
    Foreign {
        /// Name of the file, as given.
        file: String,
        /// Detected format, with advice.
        kind: FileKind,
    },
    /// The file is neither a CAN log nor a recording of the serial line.
    #[error(
        "{0} is neither a log of candump, with lines such as \"(1609459200.000111) can0 191#FFFF80800C0007D8\", nor a recording of the serial line, whose frames end with a zero byte; another log of CAN frames is converted with python-can: pip install python-can, then can_logconvert {0} can.log"
    )]
    Unrecognised(String),
    /// The sink rejected a row.
    #[error("the rows cannot be written: {0}")]
    Rows(#[source] io::Error),
}

impl DecodeError {
    /// Returns the conversion of an error of the operating system about a file.
    fn unreadable(file: &str) -> impl Fn(io::Error) -> Self {
        |source| Self::Unreadable { file: file.to_owned(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unrecognised_file_error_names_accepted_formats() {
        let error =
            |bytes: &[u8]| decode(bytes, "x.bin", &KnownFeet::default()).unwrap_err().to_string();
        assert_eq!(error(b""), "x.bin is empty");
        for neither in [
            &b"t,ax,ay\n0,1,2\n"[..],
            &[0xFF; 50],
            // Start of an ELF file, whose zeros look like ends of frames.
            b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0\x3e\0\x01\0\0\0",
            &[0; 50],
        ] {
            let error = error(neither);
            assert!(error.starts_with("x.bin is neither a log of candump"), "{error}");
        }
    }

    #[test]
    fn log_with_broken_first_and_last_line_is_recognised() {
        let log = b"00114) can0 191#FF\n(1.000000) can0 711#00\n\0\0\0";
        let decoded = decode(log, "can.log", &KnownFeet::default()).unwrap();
        assert_eq!(decoded.report.format, Medium::Can);
        assert_eq!(decoded.report.problems["malformed_lines"], 2);
    }
}
