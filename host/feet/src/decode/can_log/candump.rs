//! Logs of can-utils: `candump -l`, `(1609459200.000114) can0 191#FFFF80800C0007D8`, and terminal output of
//! `candump`, `can0  191   [8]  FF FF 80 80 0C 00 07 D8`, with or without times (`-ta`, `-td`, `-tz`,
//! `-tA`), directions (`-x`) and text (`-a`). `log2long` also writes the latter.
//!
//! Source of the format: `candump.c` and `lib.c` of can-utils.

use estimator_core::Timestamp;
use recordings::input::iso8601::micros_since_1970;

use super::text::{Identifier, bytes as spaced_bytes, seconds};
use super::{LogContent, LogLine, Other, is_name};

/// Flag in identifiers of eight digits: error frame (`CAN_ERR_FLAG`).
const ERROR_FLAG: u32 = 0x2000_0000;

/// Reads a line of either format; `None` if it matches neither.
#[must_use]
pub fn parse(line: &str) -> Option<LogLine<'_>> {
    let read = log_line(line).or_else(|| terminal_line(line));
    // The textual explanation of an error frame, on an indented line of its own (-e).
    let explanation = LogLine { time: None, content: LogContent::Other(Other::Event) };
    read.or_else(|| line.starts_with('\t').then_some(explanation))
}

/// Reads a line of `candump -l`; `None` if it has another format.
#[must_use]
pub fn log_line(line: &str) -> Option<LogLine<'_>> {
    if let Some(count) = dropped(line) {
        return Some(LogLine { time: None, content: LogContent::Dropped(count) });
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
#[must_use]
pub fn terminal_line(line: &str) -> Option<LogLine<'_>> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::can_log::Logged;
    use wire::CanFrame;

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
            // A raw length of more than eight, and a time in nanoseconds.
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
            // With text, in which anything may stand; a length of more than eight; of log2long.
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
}
