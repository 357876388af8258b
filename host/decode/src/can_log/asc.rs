//! Vector's ASC: `0.000111 1  191  Rx   d 8 FF FF 80 80 0C 00 07 D8`, below a header that states the base of
//! identifiers and data, and the reference of the times.
//!
//! Source of the format: "CAN, Log & Trigger ASC Logging Format Specification", Vector, version
//! 1.4.6; and the files of python-can 4.6 and of can-utils' `log2asc`.

use super::text::{Identifier, bytes, seconds};
use super::{LogContent, LogLine, LogTimes, Other, is_name};

/// Flag of a CAN FD line: the frame has the format of CAN FD.
const EDL: u32 = 1 << 12;

/// Settings read from the header so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AscHeader {
    /// Base of identifiers and data: 10 or 16.
    base: u32,
    /// Reference of the times.
    pub(super) times: LogTimes,
}

impl Default for AscHeader {
    fn default() -> Self {
        Self {
            base: 16,
            times: LogTimes::Absolute,
        }
    }
}

/// Returns whether a line is a header line unique to ASC.
#[must_use]
pub fn is_header(line: &str) -> bool {
    AscHeader::default().header_line(line).is_some_and(|is| is)
}

impl AscHeader {
    /// Reads a line; `None` if it is not a line of an ASC log.
    pub fn read<'a>(&mut self, line: &'a str) -> Option<LogLine<'a>> {
        if self.header_line(line).is_some() {
            return Some(LogLine::without_time(LogContent::Aside));
        }
        let line = line.trim_start();
        let (time, event) = line.split_once(|c: char| c.is_ascii_whitespace())?;
        let time = Some(seconds(time)?);
        let content = self.event(event.trim())?;
        Some(LogLine { time, content })
    }

    /// Reads a line above or between events. Returns whether it states the base; `None` if it is an event or
    /// unknown.
    fn header_line(&mut self, line: &str) -> Option<bool> {
        let line = line.trim();
        let mut words = line.split_ascii_whitespace();
        match words.next()? {
            "base" => {
                self.base = match words.next()? {
                    "hex" => 16,
                    "dec" => 10,
                    _ => return None,
                };
                self.times = match (words.next()?, words.next()?) {
                    ("timestamps", "absolute") => LogTimes::Absolute,
                    ("timestamps", "relative") => LogTimes::Differences,
                    _ => return None,
                };
                // A further word belongs to the next line, whose beginning is lost.
                words.next().is_none().then_some(true)
            }
            "date" | "internal" | "no" | "Begin" | "End" | "previous" => Some(false),
            word if word.starts_with("//") => Some(false),
            _ => None,
        }
    }

    /// Reads the part of a line after the time.
    fn event<'a>(&self, event: &'a str) -> Option<LogContent<'a>> {
        let mut words = event.split_ascii_whitespace();
        let first = words.next()?;
        if first == "CANFD" {
            return self.fd(words);
        }
        if !first.bytes().all(|byte| byte.is_ascii_digit()) {
            // An event of the program, or of a bus other than CAN.
            return Some(LogContent::Other(Other::Event));
        }
        match words.next()? {
            "ErrorFrame" => Some(LogContent::Other(Other::Error)),
            "OverloadFrame" | "Statistic:" => Some(LogContent::Other(Other::Event)),
            id => {
                let id = self.identifier(id)?;
                match words.next()? {
                    "Rx" | "Tx" => {}
                    // A transmit request, not on the bus yet.
                    "TxRq" => return Some(LogContent::Other(Other::Event)),
                    _ => return None,
                }
                match words.next()? {
                    "r" => Some(LogContent::Other(Other::Remote)),
                    "d" => {
                        // A length code of more than eight means eight bytes.
                        let length = usize::from_str_radix(words.next()?, 16).ok()?;
                        let length = (length <= 15).then_some(length.min(8))?;
                        id.frame(first, &bytes(words, length, self.base)?)
                    }
                    _ => None,
                }
            }
        }
    }

    /// Reads a line of a CAN FD channel, which may also carry classic frames.
    fn fd<'a>(&self, mut words: impl Iterator<Item = &'a str>) -> Option<LogContent<'a>> {
        let channel = words.next()?;
        match words.next()? {
            "Rx" | "Tx" => {}
            "TxRq" => return Some(LogContent::Other(Other::Event)),
            _ => return None,
        }
        let id = match words.next()? {
            "ErrorFrame" => return Some(LogContent::Other(Other::Error)),
            id => self.identifier(id)?,
        };
        // An optional message name, then the flags for bit rate switch and error passive sender.
        let is_flag = |word: &str| matches!(word, "0" | "1");
        let mut switches = words.next()?;
        if !is_flag(switches) {
            switches = words.next()?;
        }
        let code = words.by_ref().nth(1).filter(|_| is_flag(switches))?;
        let code = u32::from_str_radix(code, 16).ok()?;
        let length: usize = words.next()?.parse().ok()?;
        if code > 15 || length > 64 {
            return None;
        }
        let data = bytes(words.by_ref(), length, self.base)?;
        // Skips duration and length in bits.
        let flags = words.nth(2)?;
        let flags = u32::from_str_radix(flags, 16).ok()?;
        let is_remote = flags & 0x10 != 0;
        if flags & EDL != 0 {
            Some(LogContent::Other(Other::Fd))
        } else if is_remote {
            Some(LogContent::Other(Other::Remote))
        } else {
            id.frame(channel, &data).filter(|_| is_name(channel))
        }
    }

    fn identifier(&self, text: &str) -> Option<Identifier> {
        let extended = text.strip_suffix(['x', 'X']);
        let (digits, is_extended) = (extended.unwrap_or(text), extended.is_some());
        let is_number = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
        let id = u32::from_str_radix(digits, self.base).ok();
        Identifier::new(id.filter(|_| is_number)?, is_extended)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;
    use wire::CanFrame;

    const DATA: [u8; 8] = [0xFF, 0xFF, 0x80, 0x80, 0x0C, 0x00, 0x07, 0xD8];

    fn frame() -> LogContent<'static> {
        LogContent::Frame("1", CanFrame::new(0x191, &DATA).unwrap())
    }

    fn read(line: &str) -> Option<(Option<u64>, LogContent<'_>)> {
        let read = AscHeader::default().read(line)?;
        Some((read.time.map(Timestamp::as_micros), read.content))
    }

    #[test]
    fn frames_of_vector_python_can_and_log2asc_are_read() {
        for line in [
            "   0.000111 1  191             Rx   d 8 FF FF 80 80 0C 00 07 D8",
            "   0.000111 1  191             Tx   d 8 FF FF 80 80 0C 00 07 D8  Length = 222000 BitCount = 115 ID = 401\r",
            // A length code of more than eight.
            "0.000111 1 191 Rx d F ff ff 80 80 0c 00 07 d8",
            "   0.000111 CANFD   1 Rx        191                                   0 0 8  8 FF FF 80 80 0C 00 07 D8   130000  130        0 0 0 0 0 0",
            "   0.000111 CANFD   1 Rx        191  FL_Contact                       0 0 8  8 FF FF 80 80 0C 00 07 D8   130000  130   200000 0 0 0 0 0",
        ] {
            assert_eq!(read(line), Some((Some(111), frame())), "{line}");
        }
        let mut header = AscHeader::default();
        for line in [
            "date Fri Jan 1 12:00:00.000 am 2021",
            "base dec  timestamps relative",
            "internal events logged",
            "// version 11.0.0",
            "Begin Triggerblock Fri Jan 01 00:00:00.0 2021",
        ] {
            let read = header.read(line).map(|line| line.content);
            assert_eq!(read, Some(LogContent::Aside), "{line}");
        }
        assert_eq!(header.times, LogTimes::Differences);
        let line = "0.5 1 401 Rx d 8 255 255 128 128 12 0 7 216";
        assert_eq!(header.read(line).map(|line| line.content), Some(frame()));
        assert_eq!(header.read("0.5 1 401 Rx d 1 256"), None);
        assert_eq!(header.read("0.5 1 4A Rx d 0"), None);
    }

    #[test]
    fn entries_not_sent_by_a_foot_are_recognised() {
        for (line, other) in [
            ("0.1 1  18DAF110x       Rx   d 2 01 02", Other::Extended),
            ("0.1 1  711             Rx   r", Other::Remote),
            ("0.1 1  711             Rx   r 4", Other::Remote),
            ("0.1 2  ErrorFrame", Other::Error),
            ("0.1 2  ErrorFrame ECC: 10100010", Other::Error),
            (
                "0.1 CANFD   1 Rx ErrorFrame Not Acknowledge error",
                Other::Error,
            ),
            (
                "0.1 CANFD   2 Rx        191                                   1 0 9 12 00 01 02 03 04 05 06 07 08 09 0A 0B        0    0     3000        0        0        0        0        0",
                Other::Fd,
            ),
            (
                "0.1 CANFD   2 Rx        711                                   0 0 0  0   130000  130       10 0 0 0 0 0",
                Other::Remote,
            ),
            ("0.1 1  191             TxRq d 1 00", Other::Event),
            (
                "0.1 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%",
                Other::Event,
            ),
            ("0.1 Start of measurement", Other::Event),
            ("0.1 CAN 1 Status:chip status error active", Other::Event),
            ("0.1 LIN 1 LIN_Msg", Other::Event),
        ] {
            let read = read(line).map(|(_, content)| content);
            assert_eq!(read, Some(LogContent::Other(other)), "{line}");
        }
    }

    #[test]
    fn invalid_lines_are_rejected() {
        for line in [
            "",
            "x",
            "0.1",
            "0.1 1",
            "0.1 1 191",
            "0.1 1 191 Rx",
            "0.1 1 191 Rx d",
            "0.1 1 191 Rx d 8 FF FF 80 80 0C 00 07",
            "0.1 1 191 Rx d 8 FF FF 80 80 0C 00 07 D",
            "0.1 1 191 Rx d 8 FF FF 80 80 0C 00 07 GG",
            "0.1 1 191 Rx d 10 FF",
            "0.1 1 891 Rx d 0",
            "0.1 1 FFFFFFFFx Rx d 0",
            "0.1 1 FL_Contact Rx d 0",
            "0.1 1 +191 Rx d 0",
            "-0.1 1 191 Rx d 0",
            "0.1 CANFD",
            "0.1 CANFD 1 Rx 191 0 0 8 8 FF FF 80 80 0C 00 07 D8 130000 130",
            "0.1 CANFD 1 Rx 191 0 0 9 9 FF FF 80 80 0C 00 07 D8 00 1 1 0 0",
            "0.1 CANFD 1 Rx 191 name name 8 8 FF FF 80 80 0C 00 07 D8 1 1 0 0",
            "base oct timestamps absolute",
            "base hex",
            "base hex timestamps absolute 0.1 1 191 Rx d 1 00",
        ] {
            assert_eq!(read(line), None, "{line:?}");
        }
    }
}
