//! Frames as lines of text, in the format of Lawicel's CAN232 and CANUSB.
//!
//! | line | frame |
//! |---|---|
//! | `t1912AABB` | 11 bits of identifier in three digits, the number of bytes, the bytes |
//! | `T000001912AABB` | 29 bits of identifier in eight digits |
//! | `r1912`, `R000001912` | the same without data: a remote frame |

use std::fmt::Write as _;

use crate::emulator::part::can::BusFrame;

/// Formats a frame as a line, without its end.
#[must_use]
pub fn line(frame: &BusFrame) -> String {
    let letter = match (frame.extended, frame.remote) {
        (false, false) => 't',
        (true, false) => 'T',
        (false, true) => 'r',
        (true, true) => 'R',
    };
    let digits = if frame.extended { 8 } else { 3 };
    let mut line = format!("{letter}{:0digits$X}{}", frame.id, frame.data.len());
    for byte in frame.data.iter().filter(|_| !frame.remote) {
        // Writing to a String cannot fail.
        let _ = write!(line, "{byte:02X}");
    }
    line
}

/// Parses a line; `None` if it is not a valid frame.
#[must_use]
pub fn frame(line: &str) -> Option<BusFrame> {
    if !line.is_ascii() {
        return None;
    }
    let (extended, remote) = match line.as_bytes().first()? {
        b't' => (false, false),
        b'T' => (true, false),
        b'r' => (false, true),
        b'R' => (true, true),
        _ => return None,
    };
    let (digits, highest) = match extended {
        true => (8, 0x1FFF_FFFF),
        false => (3, 0x7FF),
    };
    let (id, rest) = line.get(1..)?.split_at_checked(digits)?;
    let (length, data) = rest.split_at_checked(1)?;
    let id = number(id).filter(|id| *id <= highest)?;
    let length = length.parse::<usize>().ok().filter(|length| *length <= 8)?;
    let expected = if remote { 0 } else { 2 * length };
    if data.len() != expected {
        return None;
    }
    let bytes = data.as_bytes().chunks(2).map(|pair| {
        let pair = std::str::from_utf8(pair).ok()?;
        u8::try_from(number(pair)?).ok()
    });
    Some(BusFrame {
        id,
        extended,
        remote,
        // A remote frame carries the number of bytes that it requests.
        data: if remote {
            vec![0; length]
        } else {
            bytes.collect::<Option<_>>()?
        },
    })
}

/// Parses hexadecimal digits only: the library would accept a sign.
fn number(digits: &str) -> Option<u32> {
    let are_digits = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| are_digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_frame_has_its_line() {
        for text in ["t1912AAFF", "t0800", "T1FFFFFFF10F", "r7110", "R000001918"] {
            let frame = frame(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(line(&frame), text);
        }
        assert_eq!(frame("t191100"), Some(BusFrame::new(0x191, &[0])));
    }

    #[test]
    fn invalid_lines_are_rejected() {
        for text in [
            "",
            "t",
            "t19",
            "t1919",
            "t8000",
            "t1911",
            "t1911A",
            "t1911AG",
            "t19110000",
            "t+911AA",
            "T200000000",
            "r19100",
            "x1910",
            "t191\u{e4}",
            "V",
        ] {
            assert_eq!(frame(text), None, "{text}");
        }
    }
}
