//! Logs of CAN frames, as can-utils write them; python-can converts others.
//!
//! [`recognise`] finds the form of a log in its first bytes, and returns a [`LogReader`] for its lines. Two forms are
//! read:
//!
//! | written by | such as |
//! |---|---|
//! | `candump -l` | `(1609459200.000114) can0 191#FFFF80800C0007D8` |
//! | `candump` on a terminal, and `log2long` | `can0  191   [8]  FF FF 80 80 0C 00 07 D8` |
//!
//! The second may have times (`-ta`, `-td`, `-tz`, `-tA`), directions (`-x`) and text (`-a`).
//!
//! Source of the formats: `candump.c` and `lib.c` of can-utils.

use std::borrow::Cow;
use std::fmt;
use std::io::{self, BufRead, Read};

use estimator_core::Timestamp;
use serde::Serialize;
use stored::iso8601::micros_since_1970;
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

impl<'a> LogLine<'a> {
    /// Creates a line without a time.
    const fn without_time(content: LogContent<'a>) -> Self {
        Self { time: None, content }
    }
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

samples::named! {
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

samples::named! {
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
pub struct LogReader {
    /// The format that it reads.
    pub(crate) form: Form,
    /// Reference of the times.
    pub(crate) times: LogTimes,
    /// Sum of the times so far if they are differences, µs.
    elapsed: u64,
}

impl LogReader {
    /// Reads the next line; `None` if it is not a line of the log's format.
    pub fn read<'a>(&mut self, line: &'a str) -> Option<LogLine<'a>> {
        // A file may contain both: terminal output appended to a log.
        let mut read = parse(line)?;
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

/// Returns a reader for the log that begins with these bytes; `None` if no line matches a format. The
/// first line that matches decides. Bytes that are not text are skipped.
#[must_use]
pub fn recognise(head: &[u8]) -> Option<LogReader> {
    let text = String::from_utf8_lossy(head);
    let form = text.lines().find_map(form_of)?;
    let times = match form {
        Form::CandumpTerminal => printed_times(&text),
        _ => LogTimes::Absolute,
    };
    Some(LogReader { form, times, elapsed: 0 })
}

fn form_of(line: &str) -> Option<Form> {
    let line = line.trim_start_matches('\u{feff}');
    if log_line(line).is_some() {
        Some(Form::CandumpLog)
    } else if terminal_line(line).is_some() {
        Some(Form::CandumpTerminal)
    } else {
        None
    }
}

/// Upper limit of the time between two frames of a log, µs: eleven days.
const LONGEST_DIFFERENCE_US: u64 = 1_000_000_000_000;

/// Distinguishes differences from absolute times: absolute times rarely decrease, differences do every few
/// lines.
fn printed_times(text: &str) -> LogTimes {
    let lines = text.lines().filter_map(terminal_line);
    let times = lines.filter_map(|line| line.time.map(Timestamp::as_micros));
    let times: Vec<u64> = times.collect();
    let falls = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
    let rises = times.windows(2).filter(|pair| pair[1] > pair[0]).count();
    // A steady bus repeats the same difference.
    let is_steady = rises <= 1 && times.len() > 2 && times.last() > Some(&0);
    // Times since 1970 are never differences, even if they decrease or repeat, because the clocks of two interfaces may
    // differ, and a clock may give several frames the same time.
    let are_short = times.iter().all(|time| *time <= LONGEST_DIFFERENCE_US);
    if are_short && (falls * 10 > falls + rises || is_steady) {
        LogTimes::Differences
    } else {
        LogTimes::Absolute
    }
}

/// Maximum number of bytes kept of a line, more than any line of a log has. Excess bytes are skipped.
const LONGEST: usize = 4096;

/// Reads the lines of a file one at a time, whatever their content and length.
pub(crate) struct Lines<R> {
    source: R,
    number: u64,
    line: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    pub(crate) const fn new(source: R) -> Self {
        Self { source, number: 0, line: Vec::new() }
    }

    /// Returns the next line without line feed, and its number from 1; `None` after the last. A byte order
    /// mark at the start is removed; bytes that are not UTF-8 become replacement characters.
    pub(crate) fn next(&mut self) -> io::Result<Option<(u64, Cow<'_, str>)>> {
        self.line.clear();
        let mut start = self.source.by_ref().take(LONGEST as u64);
        if start.read_until(b'\n', &mut self.line)? == 0 {
            return Ok(None);
        }
        if self.line.pop_if(|last| *last == b'\n').is_none() {
            self.source.skip_until(b'\n')?;
        }
        self.number += 1;
        let mark = "\u{feff}".as_bytes();
        let line = match self.line.strip_prefix(mark) {
            Some(rest) if self.number == 1 => rest,
            _ => &self.line,
        };
        Ok(Some((self.number, String::from_utf8_lossy(line))))
    }
}

/// Flag in identifiers of eight digits: error frame (`CAN_ERR_FLAG`).
const ERROR_FLAG: u32 = 0x2000_0000;

/// Reads a line of either format; `None` if it matches neither.
fn parse(line: &str) -> Option<LogLine<'_>> {
    let read = log_line(line).or_else(|| terminal_line(line));
    // The textual explanation of an error frame, on an indented line of its own (-e).
    let explanation = LogLine::without_time(LogContent::Other(Other::Event));
    read.or_else(|| line.starts_with('\t').then_some(explanation))
}

/// Reads a line of `candump -l`; `None` if it has another format.
fn log_line(line: &str) -> Option<LogLine<'_>> {
    if let Some(count) = dropped(line) {
        return Some(LogLine::without_time(LogContent::Dropped(count)));
    }
    let mut words = line.split_ascii_whitespace();
    let (time, interface, frame) = (words.next()?, words.next()?, words.next()?);
    // Newer versions append the direction.
    if !matches!(words.next(), None | Some("R" | "T")) || words.next().is_some() {
        return None;
    }
    let time = within(time, '(', ')').and_then(micros);
    let time = time.filter(|_| is_name(interface))?;
    let (time, content) = (Some(time), compact(interface, frame)?);
    Some(LogLine { time, content })
}

/// Parses an identifier, `#`, and flags, data or length of the frame.
fn compact<'a>(interface: &'a str, frame: &str) -> Option<LogContent<'a>> {
    let (id, content) = frame.split_once('#')?;
    let id = identifier(id)?;
    let whole = content;
    if let Some(fd) = content.strip_prefix('#') {
        let (flags, payload) = fd.split_at_checked(1)?;
        let is_flags = flags.bytes().all(|byte| byte.is_ascii_hexdigit());
        let length = bytes(payload)?.len();
        return (is_flags && is_fd_length(length)).then_some(LogContent::Other(Other::Fd));
    }
    let (content, raw_length) = content.split_once('_').unzip();
    let content = content.unwrap_or(whole);
    let length = match content.as_bytes() {
        [b'R'] => 0,
        [b'R', digit @ b'0'..=b'8'] => usize::from(digit - b'0'),
        _ => bytes(content)?.len(),
    };
    if length > 8 || raw_length.is_some_and(|raw| length != 8 || !is_raw_length(raw)) {
        return None;
    }
    if content.starts_with('R') {
        return Some(LogContent::Other(Other::Remote));
    }
    id.frame(interface, &bytes(content)?)
}

/// Reads a line of terminal output of `candump`; `None` if it has another format.
fn terminal_line(line: &str) -> Option<LogLine<'_>> {
    let (time, rest) = leading_time(line.trim())?;
    let (interface, rest) = word(rest)?;
    if !is_name(interface) {
        return None;
    }
    let (mut id, mut rest) = word(rest)?;
    if matches!(id, "RX" | "TX") {
        // -x adds the bit rate switch and the error state of the sender.
        let (switched, after) = word(rest)?;
        let (state, after) = word(after)?;
        if !matches!(switched, "-" | "B") || !matches!(state, "-" | "E") {
            return None;
        }
        (id, rest) = word(after)?;
    }
    let (length, rest) = word(rest)?;
    let content = printed(interface, identifier(id)?, length, rest)?;
    Some(LogLine { time, content })
}

/// Parses a frame whose length and data are separate words.
fn printed<'a>(
    interface: &'a str,
    id: Identifier,
    length: &str,
    rest: &str,
) -> Option<LogContent<'a>> {
    // A raw length of more than eight is in braces (-8).
    let (length, most) = match within(length, '{', '}') {
        Some(raw) => (is_raw_length(raw).then_some(8)?, 8),
        None => (within(length, '[', ']')?.parse().ok()?, 64),
    };
    if length > most || !is_fd_length(length) {
        return None;
    }
    if rest == "remote request" {
        return Some(LogContent::Other(Other::Remote));
    }
    let data = spaced_bytes(rest.split_ascii_whitespace(), length)?;
    match id {
        Identifier::Other(other @ Other::Error) => Some(LogContent::Other(other)),
        _ if length > 8 => Some(LogContent::Other(Other::Fd)),
        _ => id.frame(interface, &data),
    }
}

/// Splits a line into the time in brackets at its start, if any, and the rest.
fn leading_time(line: &str) -> Option<(Option<Timestamp>, &str)> {
    let Some(rest) = line.strip_prefix('(') else {
        return Some((None, line));
    };
    let (time, rest) = rest.split_once(')')?;
    let time = match time.split_once(' ') {
        Some((date, clock)) => dated(date, clock)?,
        None => micros(time)?,
    };
    Some((Some(time), rest))
}

/// Parses a date and a time of day (`-tA`), assumed to be UTC.
fn dated(date: &str, clock: &str) -> Option<Timestamp> {
    let (clock, fraction) = clock.split_once('.')?;
    let whole = micros_since_1970(&format!("{date} {clock}"))? / 1_000_000;
    micros(&format!("{whole}.{fraction}"))
}

/// Splits off the first word.
fn word(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_start();
    let end = text.find(|c: char| c.is_ascii_whitespace());
    let (word, rest) = text.split_at_checked(end.unwrap_or(text.len()))?;
    (!word.is_empty()).then_some((word, rest.trim_start()))
}

fn within(text: &str, open: char, close: char) -> Option<&str> {
    text.strip_prefix(open)?.strip_suffix(close)
}

/// Number of frames that `candump` reports as lost:
/// `DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)`.
fn dropped(line: &str) -> Option<u64> {
    let rest = line.strip_prefix("DROPCOUNT: dropped ")?;
    word(rest)?.0.parse().ok()
}

const fn is_fd_length(length: usize) -> bool {
    matches!(length, 0..=8 | 12 | 16 | 20 | 24 | 32 | 48 | 64)
}

/// Parses an identifier of three or eight digits; eight digits mean an extended or error frame.
fn identifier(text: &str) -> Option<Identifier> {
    let id = u32::from_str_radix(text, 16).ok()?;
    match text.len() {
        3 => Identifier::new(id, false),
        8 if id & ERROR_FLAG != 0 && id < ERROR_FLAG << 1 => Some(Identifier::Other(Other::Error)),
        8 => Identifier::new(id, true),
        _ => None,
    }
}

/// Returns whether the text is a raw length above the 8 data bytes: `9` to `F`, one digit.
fn is_raw_length(text: &str) -> bool {
    matches!(text.as_bytes(), [b'9' | b'A'..=b'F'])
}

/// Fraction written by `asc2log` if its sum of two fractions is a whole second.
const CARRIED: &str = "1000000";

/// Parses seconds with six decimals, or with nine (`candump -N`), of which six are used.
fn micros(text: &str) -> Option<Timestamp> {
    let (whole, fraction) = text.split_once('.')?;
    if fraction == CARRIED {
        let whole: u64 = whole.parse().ok()?;
        let micros = whole.checked_add(1)?.checked_mul(1_000_000)?;
        return Some(Timestamp::from_micros(micros));
    }
    let is_number = fraction.bytes().all(|byte| byte.is_ascii_digit());
    if !matches!(fraction.len(), 6 | 9) || !is_number {
        return None;
    }
    seconds(text.get(..whole.len() + 7)?)
}

/// Parses pairs of hexadecimal digits, as written by `candump`; dots between them are allowed.
fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<char> = text.chars().filter(|c| *c != '.').collect();
    let byte = |pair: &[char]| match pair {
        [high, low] => Some((high.to_digit(16)? << 4 | low.to_digit(16)?) as u8),
        _ => None,
    };
    digits.chunks(2).map(byte).collect()
}

/// Parses seconds with one to nine decimals, rounded to microseconds.
fn seconds(text: &str) -> Option<Timestamp> {
    let (whole, fraction) = text.split_once('.')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if fraction.len() > 9 || !digits(whole) || !digits(fraction) {
        return None;
    }
    let nanos: u64 = format!("{fraction:0<9}").parse().ok()?;
    let whole: u64 = whole.parse().ok()?;
    let micros = whole.checked_mul(1_000_000)?;
    let micros = micros.checked_add((nanos + 500) / 1000)?;
    Some(Timestamp::from_micros(micros))
}

/// Parses `length` hexadecimal bytes, one per word; `None` for fewer. A byte must have two digits, so that a truncated
/// one is rejected.
fn spaced_bytes<'a>(words: impl Iterator<Item = &'a str>, length: usize) -> Option<Vec<u8>> {
    let byte = |word: &str| {
        let is_byte = word.len() == 2 && word.bytes().all(|b| b.is_ascii_hexdigit());
        u8::from_str_radix(word, 16).ok().filter(|_| is_byte)
    };
    let bytes: Vec<u8> = words.take(length).map(byte).collect::<Option<_>>()?;
    (bytes.len() == length).then_some(bytes)
}

/// Identifier of a frame, as far as feet use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Identifier {
    /// 11 bits.
    Standard(u16),
    /// Extended or error frame, which no foot sends.
    Other(Other),
}

impl Identifier {
    /// Returns `None` if `id` has too many bits.
    fn new(id: u32, is_extended: bool) -> Option<Self> {
        if is_extended {
            (id <= 0x1FFF_FFFF).then_some(Self::Other(Other::Extended))
        } else {
            (id <= 0x7FF).then_some(Self::Standard(id as u16))
        }
    }

    /// A classic data frame with this identifier; `None` for more than eight bytes.
    fn frame<'a>(self, interface: &'a str, data: &[u8]) -> Option<LogContent<'a>> {
        match self {
            Self::Standard(id) => Some(LogContent::Frame(interface, CanFrame::new(id, data)?)),
            Self::Other(other) => (data.len() <= 8).then_some(LogContent::Other(other)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufReader;

    fn recognised(text: &str) -> Option<(Form, LogTimes)> {
        recognise(text.as_bytes()).map(|reader| (reader.form, reader.times))
    }

    #[test]
    fn first_valid_line_determines_the_format() {
        for form in Form::ALL {
            for text in [
                form.example().to_owned(),
                format!("\u{feff}{}\r\n", form.example()),
                format!("cut off\n\n{}\n", form.example()),
            ] {
                let found = recognise(text.as_bytes()).map(|reader| reader.form);
                assert_eq!(found, Some(form), "{text:?}");
            }
        }
        for text in ["", "t,ax,ay\n0,1,2\n", "date of birth\n", "1.5 a b c\n"] {
            assert_eq!(recognised(text), None, "{text:?}");
        }
    }

    #[test]
    fn differences_are_distinguished_from_absolute_times() {
        let log = |times: &[&str]| {
            let line = |time: &&str| format!(" ({time})  can0  191   [1]  00\n");
            recognised(&times.iter().map(line).collect::<String>()).map(|(_, times)| times)
        };
        for (times, expected) in [
            (&["000.000000", "000.001000", "000.002000"][..], LogTimes::Absolute),
            (&["1609459200.000000", "1609459200.001000"], LogTimes::Absolute),
            (&["000.000000"], LogTimes::Absolute),
            (&["1609459200.000000"; 4], LogTimes::Absolute),
            (
                &[
                    "1609459200.000000",
                    "1609459199.000000",
                    "1609459200.001000",
                    "1609459199.001000",
                ],
                LogTimes::Absolute,
            ),
            (
                &["000.000000", "000.000889", "000.000111", "000.000889", "000.000111"],
                LogTimes::Differences,
            ),
            (&["000.000000", "000.001000", "000.001000", "000.001000"], LogTimes::Differences),
        ] {
            assert_eq!(log(times), Some(expected), "{times:?}");
        }
        assert_eq!(
            recognised("can0  191   [1]  00\n".repeat(3).as_str()),
            Some((Form::CandumpTerminal, LogTimes::Absolute))
        );
    }

    fn lines(bytes: &[u8]) -> Vec<String> {
        // A small buffer, so that lines span several reads.
        let mut lines = Lines::new(BufReader::with_capacity(3, bytes));
        let mut read = Vec::new();
        while let Some((number, line)) = lines.next().unwrap() {
            assert_eq!(number, read.len() as u64 + 1);
            read.push(line.into_owned());
        }
        read
    }

    #[test]
    fn lines_end_with_a_line_feed_or_the_file() {
        assert_eq!(lines(b""), Vec::<String>::new());
        assert_eq!(lines(b"ab\r\n\ncdefgh"), ["ab\r", "", "cdefgh"]);
        assert_eq!(lines(b"\xef\xbb\xbfab\ncd\n"), ["ab", "cd"]);
        assert_eq!(lines(b"a\xff\n"), ["a\u{fffd}"]);
    }

    #[test]
    fn length_of_a_line_is_limited() {
        let long = [&[b'x'; 3 * LONGEST][..], b"\ny"].concat();
        let read = lines(&long);
        assert_eq!((read[0].len(), read[1].as_str()), (LONGEST, "y"));
    }

    const LINE: &str = "(1609459200.000114) can0 191#FFFF80800C0007D8";

    fn logged() -> Logged {
        let data = [0xFF, 0xFF, 0x80, 0x80, 0x0C, 0x00, 0x07, 0xD8];
        Logged {
            at: Timestamp::from_micros(1_609_459_200_000_114),
            frame: CanFrame::new(0x191, &data).expect("it fits"),
        }
    }

    fn line_of(time: Option<Timestamp>, frame: CanFrame) -> LogLine<'static> {
        LogLine { time, content: LogContent::Frame("can0", frame) }
    }

    fn content(line: &str) -> Option<LogContent<'_>> {
        parse(line).map(|line| line.content)
    }

    #[test]
    fn frame_in_candump_format_round_trips() {
        assert_eq!(logged().line("can0").to_string(), LINE);
        let read = Some(line_of(Some(logged().at), logged().frame));
        for line in [
            LINE.to_owned(),
            format!("{LINE} R"),
            format!(" {LINE} T\r"),
            // A line with a raw length of more than eight, and a line with a time in nanoseconds.
            format!("{LINE}_E"),
            LINE.replace(".000114)", ".000114999)"),
        ] {
            assert_eq!(log_line(&line), read, "{line:?}");
        }
        let empty = log_line("(0.000000) vcan1 080#").map(|line| line.content);
        assert!(
            matches!(empty, Some(LogContent::Frame("vcan1", frame)) if frame.data().is_empty())
        );
    }

    #[test]
    fn frames_not_sent_by_a_foot_are_recognised() {
        for (frame, other) in [
            ("123#R", Other::Remote),
            ("123#R0", Other::Remote),
            ("123#R8", Other::Remote),
            ("123#R8_F", Other::Remote),
            ("18DAF110#R", Other::Remote),
            ("18DAF110#0102", Other::Extended),
            ("00000191#FFFF80800C0007D8", Other::Extended),
            ("20000004#0004000000000000", Other::Error),
            ("191##1", Other::Fd),
            ("191##1000102030405060708090A0B", Other::Fd),
            ("18DAF110##F00", Other::Fd),
        ] {
            let line = format!("(1.000000) can0 {frame}");
            assert_eq!(content(&line), Some(LogContent::Other(other)), "{line}");
        }
    }

    #[test]
    fn invalid_log_lines_are_rejected() {
        for line in [
            "",
            "(1609459200.000114) can0 191",
            "(1609459200.0001) can0 191#00",
            "(-1.000000) can0 191#00",
            "(99999999999999999999.000000) can0 191#00",
            "(1.000000) can0 191#0",
            "(1.000000) can0 191#GG",
            "(1.000000) can0 191#000102030405060708",
            "(1.000000) can0 891#00",
            "(1.000000) can0 91#00",
            "(1.000000) can0 191#00 R x",
            "(1.000000) can0 191#00 Q",
            "(1.0000000) can0 191#00",
            "(1.000000) can,0 191#00",
            "(1.000000) can0 191#00_9",
            "(1.000000) can0 191#FFFF80800C0007D8_8",
            "(1.000000) can0 191#FFFF80800C0007D8_",
            "(1.000000) can0 191#FFFF80800C0007D8_99",
            "(1.000000) can0 191#R9",
            "(1.000000) can0 191#RX",
            "(1.000000) can0 191##",
            "(1.000000) can0 191##X",
            "(1.000000) can0 191##1000102030405060708",
            "(1.000000) can0 40000004#00",
        ] {
            assert_eq!(parse(line), None, "{line:?}");
        }
    }

    #[test]
    fn frame_in_terminal_format_is_read() {
        let frame = logged().frame;
        let at = |micros| Some(Timestamp::from_micros(micros));
        let since_1970 = logged().at.as_micros();
        for (line, time) in [
            ("  can0  191   [8]  FF FF 80 80 0C 00 07 D8", None),
            (" (1609459200.000114)  can0  191   [8]  FF FF 80 80 0C 00 07 D8", at(since_1970)),
            (" (000.000000)  can0  191   [8]  FF FF 80 80 0C 00 07 D8\r", at(0)),
            (" (012.345678)  can0  191   [8]  FF FF 80 80 0C 00 07 D8", at(12_345_678)),
            (
                " (2021-01-01 00:00:00.000114)  can0  191   [8]  FF FF 80 80 0C 00 07 D8",
                at(since_1970),
            ),
            ("  can0  RX - -  191   [8]  FF FF 80 80 0C 00 07 D8", None),
            (" (000.001000)  can0  TX B E  191   [8]  FF FF 80 80 0C 00 07 D8", at(1000)),
            // A line with text, in which anything may stand; a raw length of more than eight; a line of log2long.
            ("  can0  191   [8]  FF FF 80 80 0C 00 07 D8   '.. [1] #'", None),
            ("  can0  191   {E}  FF FF 80 80 0C 00 07 D8", None),
            ("(000.000001)  can0       191   [8]  FF FF 80 80 0C 00 07 D8   '........'", at(1)),
        ] {
            assert_eq!(parse(line), Some(line_of(time, frame)), "{line:?}");
        }
        for (line, other) in [
            ("can0  711   [0]  remote request", Other::Remote),
            ("can0  18DAF110   [2]  01 02   '..'", Other::Extended),
            ("can0  191  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B", Other::Fd),
            ("can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME", Other::Error),
        ] {
            assert_eq!(content(line), Some(LogContent::Other(other)), "{line}");
        }
        let empty = content("can0  080   [0]  ");
        assert!(matches!(empty, Some(LogContent::Frame("can0", frame)) if frame.data().is_empty()));
    }

    #[test]
    fn invalid_terminal_lines_are_rejected() {
        for line in [
            "can0",
            "can0  191",
            "can0  191   [8]",
            "can0  191   [8]  FF FF 80 80 0C 00 07",
            "can0  191   [8]  FF FF 80 80 0C 00 07 D",
            "can0  191   [9]  FF FF 80 80 0C 00 07 D8 00",
            "can0  191   [8  FF FF 80 80 0C 00 07 D8",
            "can0  991   [1]  FF",
            "can0  RX - 191   [1]  FF",
            "(1.0) can0  191   [1]  FF",
            "(1.000000 can0  191   [1]  FF",
            "(2021-02-01) can0  191   [1]  FF",
            "(2021-13-01 00:00:00.000114) can0  191   [1]  FF",
            "(2021-01-01 24:00:00.000114) can0  191   [1]  FF",
            "(2021-01-01 00:00.000114) can0  191   [1]  FF",
            "can,0  191   [1]  FF",
        ] {
            assert_eq!(parse(line), None, "{line:?}");
        }
    }

    #[test]
    fn dates_are_days_since_1970() {
        let seconds = |date| dated(date, "00:00:00.000000").map(|at| at.as_micros() / 1_000_000);
        for (date, days) in [
            ("1970-01-01", 0),
            ("2000-02-29", 11_016),
            ("2000-03-01", 11_017),
            ("2021-01-01", 18_628),
            ("2024-12-31", 20_088),
        ] {
            assert_eq!(seconds(date), Some(days * 86_400), "{date}");
        }
    }

    #[test]
    fn uncarried_second_of_asc2log_is_carried() {
        let time = |text| parse(text).and_then(|line| line.time);
        assert_eq!(
            time("(1795234497.1000000) can0 191#FF R").map(Timestamp::as_micros),
            Some(1_795_234_498_000_000)
        );
        assert_eq!(time("(1795234497.1000001) can0 191#FF"), None);
        assert_eq!(time("(x.1000000) can0 191#FF"), None);
    }

    #[test]
    fn explanation_of_an_error_frame_is_an_event() {
        let line = "\tcontroller-problem{tx-error-warning}";
        assert_eq!(content(line), Some(LogContent::Other(Other::Event)));
    }

    #[test]
    fn dropcount_line_counts_lost_frames() {
        let line = "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)";
        assert_eq!(content(line), Some(LogContent::Dropped(3)));
    }

    #[test]
    fn seconds_are_rounded_to_microseconds() {
        for (text, micros) in [
            ("0.0", Some(0)),
            ("1.5", Some(1_500_000)),
            ("0.0014", Some(1_400)),
            ("0.0000015", Some(2)),
            ("0.9999995", Some(1_000_000)),
            ("0.9999994", Some(999_999)),
            ("1609459200.000111222", Some(1_609_459_200_000_111)),
            ("1", None),
            ("1.", None),
            (".1", None),
            ("-1.0", None),
            ("+1.0", None),
            ("1.0000000001", None),
            ("99999999999999999999.0", None),
            ("18446744073709.999999", None),
        ] {
            assert_eq!(seconds(text).map(Timestamp::as_micros), micros, "{text}");
        }
    }
}
