//! Logs of `candump -l` (can-utils): `(1609459200.000114) can0 191#FFFF80800C0007D8`.

use std::fmt;

use estimator_core::Timestamp;
use wire::CanFrame;

/// A frame and when it was received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Logged {
    /// Time since 1970, µs.
    pub at: Timestamp,
    /// The frame.
    pub frame: CanFrame,
}

impl Logged {
    /// The line of a log, without its end.
    #[must_use]
    pub fn line(self, interface: &str) -> impl fmt::Display {
        let micros = self.at.as_micros();
        let data: String = self
            .frame
            .data()
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        format!(
            "({}.{:06}) {interface} {:03X}#{data}",
            micros / 1_000_000,
            micros % 1_000_000,
            self.frame.id()
        )
    }
}

/// What a line of a log holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line<'a> {
    /// A classic data frame with a standard identifier, and the interface that received it.
    Frame(&'a str, Logged),
    /// A frame that no foot sends.
    Other(Other),
}

/// Kinds of frames that no foot sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Other {
    /// A request for a frame, without data.
    Remote,
    /// A data frame with an identifier of 29 bits.
    Extended,
    /// A report of the interface on an error of the bus.
    Error,
    /// A frame of CAN FD.
    Fd,
}

/// In identifiers of eight digits: this is not a frame but an error of the bus (`CAN_ERR_FLAG`).
const ERROR_FLAG: u32 = 0x2000_0000;

/// Reads a line; `None` where it is none of a log.
#[must_use]
pub fn parse(line: &str) -> Option<Line<'_>> {
    let mut words = line.split_ascii_whitespace();
    let (time, interface, frame) = (words.next()?, words.next()?, words.next()?);
    // Newer versions append the direction.
    if !matches!(words.next(), None | Some("R" | "T")) || words.next().is_some() {
        return None;
    }
    let at = time.strip_prefix('(')?.strip_suffix(')').and_then(micros)?;
    // It goes into tables.
    let is_name = |byte: u8| byte.is_ascii_graphic() && !matches!(byte, b',' | b'"');
    if !interface.bytes().all(is_name) {
        return None;
    }
    let (id, content) = frame.split_once('#')?;
    let (id, kind) = identifier(id)?;
    if let Some(fd) = content.strip_prefix('#') {
        let (flags, payload) = fd.split_at_checked(1)?;
        let is_flags = flags.bytes().all(|byte| byte.is_ascii_hexdigit());
        let has_length = matches!(
            bytes(payload)?.len(),
            0..=8 | 12 | 16 | 20 | 24 | 32 | 48 | 64
        );
        return (is_flags && has_length).then_some(Line::Other(Other::Fd));
    }
    let (content, raw_length) = match content.split_once('_') {
        Some((content, raw)) => (content, Some(raw)),
        None => (content, None),
    };
    let length = if let Some(length) = content.strip_prefix('R') {
        match length.as_bytes() {
            [] => 0,
            [digit @ b'0'..=b'8'] => usize::from(digit - b'0'),
            _ => return None,
        }
    } else {
        bytes(content)?.len()
    };
    if length > 8 || raw_length.is_some_and(|raw| length != 8 || !is_raw_length(raw)) {
        return None;
    }
    if content.starts_with('R') {
        return Some(Line::Other(Other::Remote));
    }
    if let Some(other) = kind {
        return Some(Line::Other(other));
    }
    let frame = CanFrame::new(u16::try_from(id).ok()?, &bytes(content)?)?;
    Some(Line::Frame(interface, Logged { at, frame }))
}

/// An identifier of three or eight digits, and what the latter make of a data frame.
fn identifier(text: &str) -> Option<(u32, Option<Other>)> {
    let id = u32::from_str_radix(text, 16).ok()?;
    match text.len() {
        3 if id <= 0x7FF => Some((id, None)),
        8 if id & ERROR_FLAG != 0 && id < ERROR_FLAG << 1 => Some((id, Some(Other::Error))),
        8 if id < ERROR_FLAG => Some((id, Some(Other::Extended))),
        _ => None,
    }
}

/// The length that was sent where it is more than the 8 bytes that there are: `_9` to `_F`.
fn is_raw_length(text: &str) -> bool {
    matches!(text.as_bytes(), [b'9' | b'A'..=b'F'])
}

/// Seconds with six decimals, or with nine (`candump -N`), of which six are used.
fn micros(text: &str) -> Option<Timestamp> {
    let (seconds, fraction) = text.split_once('.')?;
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !matches!(fraction.len(), 6 | 9) || !digits(seconds) || !digits(fraction) {
        return None;
    }
    let whole: u64 = seconds.parse().ok()?;
    let micros = whole
        .checked_mul(1_000_000)?
        .checked_add(fraction.get(..6)?.parse().ok()?)?;
    Some(Timestamp::from_micros(micros))
}

/// Pairs of hexadecimal digits, as `candump` writes them; dots between them are allowed.
fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<char> = text.chars().filter(|c| *c != '.').collect();
    digits
        .chunks(2)
        .map(|pair| match pair {
            [high, low] => Some((high.to_digit(16)? << 4 | low.to_digit(16)?) as u8),
            _ => None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "(1609459200.000114) can0 191#FFFF80800C0007D8";

    fn logged() -> Logged {
        let data = [0xFF, 0xFF, 0x80, 0x80, 0x0C, 0x00, 0x07, 0xD8];
        Logged {
            at: Timestamp::from_micros(1_609_459_200_000_114),
            frame: CanFrame::new(0x191, &data).expect("it fits"),
        }
    }

    #[test]
    fn a_frame_is_written_as_candump_writes_it_and_read_back() {
        assert_eq!(logged().line("can0").to_string(), LINE);
        let read = Some(Line::Frame("can0", logged()));
        for line in [
            LINE.to_owned(),
            format!("{LINE} R"),
            format!(" {LINE} T\r"),
            // A length sent that is more than eight, and time in nanoseconds.
            format!("{LINE}_E"),
            LINE.replace(".000114)", ".000114999)"),
        ] {
            assert_eq!(parse(&line), read, "{line:?}");
        }
        let empty = parse("(0.000000) vcan1 080#");
        assert!(
            matches!(empty, Some(Line::Frame("vcan1", logged)) if logged.frame.data().is_empty())
        );
    }

    #[test]
    fn frames_that_no_foot_sends_are_lines_of_a_log_too() {
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
            assert_eq!(parse(&line), Some(Line::Other(other)), "{line}");
        }
    }

    #[test]
    fn what_is_no_line_of_a_log_is_refused() {
        for line in [
            "",
            "can0  191   [8]  FF FF 80 80 0C 00 07 D8",
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
}
