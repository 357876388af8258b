//! CSV of python-can: `1609459200.000111,0x191,0,0,0,8,//+AgAwAB9g=`, with data in base64.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use estimator_core::Timestamp;

use super::text::{Identifier, seconds};
use super::{LogContent, LogLine, Other};

/// First line of each file.
pub const HEADER: &str = "timestamp,arbitration_id,extended,remote,error,dlc,data";

/// Reads a line; `None` if it is not a row of such a table.
#[must_use]
pub fn parse(line: &str) -> Option<LogLine<'_>> {
    let line = line.trim();
    if line == HEADER {
        return Some(LogLine::without_time(LogContent::Aside));
    }
    let mut cells = line.split(',');
    let mut cell = || cells.next();
    let time = Some(time(cell()?)?);
    let id = u32::from_str_radix(cell()?.strip_prefix("0x")?, 16).ok()?;
    let mut flag = || match cell()? {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    };
    let (extended, remote, error) = (flag()?, flag()?, flag()?);
    let length: usize = cell()?.parse().ok()?;
    let data = BASE64.decode(cell()?).ok()?;
    if cell().is_some() || length > 64 || (!remote && length != data.len()) {
        return None;
    }
    let id = Identifier::new(id, extended)?;
    let content = if error {
        LogContent::Other(Other::Error)
    } else if remote {
        LogContent::Other(Other::Remote)
    } else if length > 8 {
        // The table does not distinguish shorter FD frames.
        LogContent::Other(Other::Fd)
    } else {
        id.frame("", &data)?
    };
    Some(LogLine { time, content })
}

/// Parses seconds formatted as a Python float.
fn time(text: &str) -> Option<Timestamp> {
    if let Some(time) = seconds(text) {
        return Some(time);
    }
    let allowed = |byte: u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'-' | b'+');
    let is_float = text.bytes().all(allowed);
    let micros = text.parse::<f64>().ok().filter(|_| is_float)? * 1e6;
    // A float represents every microsecond up to this limit.
    let is_exact = (0.0..(1_u64 << 53) as f64).contains(&micros);
    is_exact.then(|| Timestamp::from_micros(micros.round() as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::CanFrame;

    const LINE: &str = "1609459200.000111,0x191,0,0,0,8,//+AgAwAB9g=";

    #[test]
    fn frame_written_by_python_can_is_read() {
        let data = [0xFF, 0xFF, 0x80, 0x80, 0x0C, 0x00, 0x07, 0xD8];
        let read = parse(LINE).unwrap();
        assert_eq!(
            read.time.map(Timestamp::as_micros),
            Some(1_609_459_200_000_111)
        );
        let frame = CanFrame::new(0x191, &data).unwrap();
        assert_eq!(read.content, LogContent::Frame("", frame));
        assert_eq!(parse(&format!("{LINE}\r")), Some(read));
        for (text, micros) in [
            ("1.6e-05", 16),
            ("0.0", 0),
            ("1234567.0123456789", 1_234_567_012_346),
        ] {
            let line = LINE.replace("1609459200.000111", text);
            let read = parse(&line).unwrap();
            assert_eq!(read.time.map(Timestamp::as_micros), Some(micros), "{text}");
        }
    }

    #[test]
    fn frames_not_sent_by_a_foot_are_recognised() {
        for (line, content) in [
            (HEADER, LogContent::Aside),
            (
                "1.0,0x18daf110,1,0,0,2,AQI=",
                LogContent::Other(Other::Extended),
            ),
            ("1.0,0x711,0,1,0,4,", LogContent::Other(Other::Remote)),
            (
                "1.0,0x4,1,0,1,8,AAQAAAAAAAA=",
                LogContent::Other(Other::Error),
            ),
            (
                "1.0,0x191,0,0,0,12,AAECAwQFBgcICQoL",
                LogContent::Other(Other::Fd),
            ),
        ] {
            assert_eq!(
                parse(line).map(|line| line.content),
                Some(content),
                "{line}"
            );
        }
    }

    #[test]
    fn invalid_lines_are_rejected() {
        for line in [
            "",
            "1609459200.000111,0x191,0,0,0,8,//+AgAwAB9g",
            "1609459200.000111,0x191,0,0,0,7,//+AgAwAB9g=",
            "1609459200.000111,0x191,0,0,0,8,//+AgAwAB9g=,",
            "1609459200.000111,191,0,0,0,8,//+AgAwAB9g=",
            "1609459200.000111,0x991,0,0,0,8,//+AgAwAB9g=",
            "1609459200.000111,0x191,2,0,0,8,//+AgAwAB9g=",
            "-1.0,0x191,0,0,0,8,//+AgAwAB9g=",
            "nan,0x191,0,0,0,8,//+AgAwAB9g=",
            "inf,0x191,0,0,0,8,//+AgAwAB9g=",
            "1e300,0x191,0,0,0,8,//+AgAwAB9g=",
            "1.0,0x191,0,0,0,8,",
            "1.0,0x191,0,0,0,1,====",
            "1.0,0x191,0,0,0,1,A*==",
        ] {
            assert_eq!(parse(line), None, "{line:?}");
        }
    }
}
