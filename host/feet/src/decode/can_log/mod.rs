//! Logs of CAN frames, as can-utils and python-can write them; python-can converts others.
//!
//! | idea | file |
//! |---|---|
//! | a frame with its time of reception; a reader for each format | this one |
//! | detection of the format from the first lines | [`recognise`] |
//! | can-utils: `candump -l`, and terminal output of `candump` | [`candump`] |
//! | parsing of times and bytes | `text` |

pub mod candump;
pub mod recognise;
mod text;

use std::fmt;

use estimator_core::Timestamp;
use serde::Serialize;
use wire::CanFrame;

/// A frame with its time of reception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Logged {
    /// Time since 1970, µs.
    pub at: Timestamp,
    /// The frame.
    pub frame: CanFrame,
}

impl Logged {
    /// Formats the frame as a line of `candump -l`, without line feed.
    #[must_use]
    pub fn line(self, interface: &str) -> impl fmt::Display {
        let (id, data) = (self.frame.id(), self.frame.data().iter());
        let data: String = data.map(|byte| format!("{byte:02X}")).collect();
        let micros = self.at.as_micros();
        let (seconds, micros) = (micros / 1_000_000, micros % 1_000_000);
        format!("({seconds}.{micros:06}) {interface} {id:03X}#{data}")
    }
}

/// A line of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogLine<'a> {
    /// Time in the log, if given.
    pub time: Option<Timestamp>,
    /// Content of the line.
    pub content: LogContent<'a>,
}

/// Content of a line of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogContent<'a> {
    /// A classic data frame with a standard identifier, and the interface that received it; blank if the
    /// log does not name it.
    Frame(&'a str, CanFrame),
    /// An entry that no foot sends.
    Other(Other),
    /// Number of frames lost between the bus and the log.
    Dropped(u64),
}

recordings::named! {
    /// Kinds of entries that no foot sends, with their names in reports.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Other {
        /// A remote frame.
        Remote = "remote",
        /// A data frame with an identifier of 29 bits.
        Extended = "extended",
        /// An error frame of the interface.
        Error = "error_frame",
        /// A CAN FD frame.
        Fd = "fd",
        /// An event of the logging program or of another bus.
        Event = "events",
    }
}

/// Reference of the times in a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogTimes {
    /// Relative to one moment: 1970, or the first frame.
    Absolute,
    /// Relative to the previous frame (`candump -td`).
    Differences,
}

recordings::named! {
    /// A form of log.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Form {
        /// `candump -l`.
        CandumpLog = "candump -l",
        /// `candump` as it prints on a terminal.
        CandumpTerminal = "candump",
    }
}

impl Form {
    /// An example line.
    #[must_use]
    pub const fn example(self) -> &'static str {
        match self {
            Self::CandumpLog => "(1609459200.000111) can0 191#FFFF80800C0007D8",
            Self::CandumpTerminal => {
                "(1609459200.000111)  can0  191   [8]  FF FF 80 80 0C 00 07 D8"
            }
        }
    }
}

/// Reads the lines of a log, one after the other.
#[derive(Clone, Debug)]
pub struct Reader {
    /// The format that it reads.
    pub(crate) form: Form,
    /// Reference of the times.
    pub(crate) times: LogTimes,
    /// Sum of the times so far if they are differences, µs.
    elapsed: u64,
}

impl Reader {
    /// Reads the next line; `None` if it is not a line of the log's format.
    pub fn read<'a>(&mut self, line: &'a str) -> Option<LogLine<'a>> {
        // A file may contain both: terminal output appended to a log.
        let mut read = candump::parse(line)?;
        if let (LogTimes::Differences, Some(time)) = (self.times, &mut read.time) {
            self.elapsed = self.elapsed.saturating_add(time.as_micros());
            *time = Timestamp::from_micros(self.elapsed);
        }
        Some(read)
    }
}

/// Returns whether the name of an interface can be written to a table.
fn is_name(name: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_graphic() && !matches!(byte, b',' | b'"');
    !name.is_empty() && name.bytes().all(allowed)
}
