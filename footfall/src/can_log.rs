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
    /// A frame that no foot sends: remote, extended, an error, or CAN FD.
    Other,
}

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
    let (id, data) = frame.split_once('#')?;
    let number = u32::from_str_radix(id, 16).ok()?;
    let standard = match id.len() {
        3 if number <= 0x7FF => true,
        8 => false,
        _ => return None,
    };
    if let Some(fd) = data.strip_prefix('#') {
        let payload = fd.get(1..)?;
        return (bytes(payload)?.len() <= 64).then_some(Line::Other);
    }
    if data.starts_with('R') {
        return Some(Line::Other);
    }
    let data = bytes(data)?;
    if data.len() > 8 {
        return None;
    }
    if !standard {
        return Some(Line::Other);
    }
    let frame = CanFrame::new(number as u16, &data)?;
    Some(Line::Frame(interface, Logged { at, frame }))
}

/// Seconds with six decimals.
fn micros(text: &str) -> Option<Timestamp> {
    let (seconds, fraction) = text.split_once('.')?;
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if fraction.len() != 6 || !digits(seconds) || !digits(fraction) {
        return None;
    }
    let whole: u64 = seconds.parse().ok()?;
    let micros = whole
        .checked_mul(1_000_000)?
        .checked_add(fraction.parse().ok()?)?;
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
        for line in [LINE.to_owned(), format!("{LINE} R"), format!(" {LINE} T\r")] {
            assert_eq!(parse(&line), read, "{line:?}");
        }
        let empty = parse("(0.000000) vcan1 080#");
        assert!(
            matches!(empty, Some(Line::Frame("vcan1", logged)) if logged.frame.data().is_empty())
        );
    }

    #[test]
    fn frames_that_no_foot_sends_are_lines_of_a_log_too() {
        for line in [
            "(1.000000) can0 123#R",
            "(1.000000) can0 123#R8",
            "(1.000000) can0 18DAF110#0102",
            "(1.000000) can0 20000004#0004000000000000",
            "(1.000000) can0 191##1000102030405060708090A0B",
        ] {
            assert_eq!(parse(line), Some(Line::Other), "{line}");
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
        ] {
            assert_eq!(parse(line), None, "{line:?}");
        }
    }
}
