//! CAN frames as lines of text, in the format of slcan adapters on a serial port (Lawicel's CAN232).
//!
//! | bytes | field |
//! |---|---|
//! | `t` | a data frame with an 11-bit identifier |
//! | 3 digits | the identifier, hexadecimal |
//! | 1 digit | number of data bytes, 0 to 8 |
//! | 2 digits each | the data bytes |
//! | 4 digits | a time stamp, which an adapter may add |
//!
//! CR ends the line.

use heapless::Vec;

use crate::frame::CanFrame;

/// End of a line.
pub const CR: u8 = b'\r';

/// Response to a command or frame that was not accepted.
pub const BEL: u8 = 0x07;

/// Length of the longest line of [`encode`], including its CR, bytes.
pub const LONGEST: usize = 22;

/// Encodes a frame. Returns its line, including the CR.
#[must_use]
pub fn encode(frame: &CanFrame) -> Vec<u8, LONGEST> {
    let length = frame.data().len() as u16;
    let head = [frame.id() >> 8, frame.id() >> 4, frame.id(), length];
    let data = frame.data().iter().map(|byte| u16::from(*byte));
    let digits = data.flat_map(|byte| [byte >> 4, byte]);
    let text = [b't'].into_iter();
    let text = text.chain(head.into_iter().chain(digits).map(digit));
    // A frame of 8 bytes has the longest line.
    text.chain([CR]).take(LONGEST).collect()
}

/// Decodes a line without its CR; `None` if it is not a data frame with an 11-bit identifier.
#[must_use]
pub fn decode(line: &[u8]) -> Option<CanFrame> {
    let [b't', head @ ..] = line else {
        return None;
    };
    let ([a, b, c, length], rest) = head.split_first_chunk()?;
    let id = value(*a)? << 8 | value(*b)? << 4 | value(*c)?;
    let length = usize::from(value(*length)?);
    let (data, stamp) = rest.split_at_checked(2 * length)?;
    if !matches!(stamp.len(), 0 | 4) || !stamp.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    let mut bytes = [0; 8];
    for (to, [high, low]) in bytes.iter_mut().zip(data.as_chunks().0) {
        *to = (value(*high)? << 4 | value(*low)?) as u8;
    }
    CanFrame::new(id, bytes.get(..length)?)
}

/// Hexadecimal digit of the low four bits.
const fn digit(value: u16) -> u8 {
    match (value & 0xF) as u8 {
        low @ 0..=9 => b'0' + low,
        high => b'A' - 10 + high,
    }
}

fn value(digit: u8) -> Option<u16> {
    char::from(digit).to_digit(16).map(|value| value as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn frame(id: u16, data: &[u8]) -> CanFrame {
        CanFrame::new(id, data).expect("a frame")
    }

    #[test]
    fn golden_lines_of_frames() {
        for (text, frame) in [
            ("t191300ABFF\r", frame(0x191, &[0x00, 0xAB, 0xFF])),
            ("t0800\r", frame(0x080, &[])),
            ("t7FF80123456789ABCDEF\r", {
                frame(0x7FF, &[0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF])
            }),
        ] {
            assert_eq!(encode(&frame), text.as_bytes());
            assert_eq!(decode(text.trim_end().as_bytes()), Some(frame));
        }
        let stamped = decode(b"t191300abff1234");
        assert_eq!(stamped, Some(frame(0x191, &[0x00, 0xAB, 0xFF])));
    }

    #[test]
    fn lines_of_other_kinds_are_not_decoded() {
        for text in [
            "",
            "t",
            "t19",
            "t1919",
            "t8000",
            "t1912A",
            "t1911ABCDE",
            "t1911ABCDEFG",
            "t191900112233445566778800",
            "t19\u{e4}1AB",
            "T000001911AB",
            "r1910",
            "V1013",
        ] {
            assert_eq!(decode(text.as_bytes()), None, "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn each_frame_comes_back(id in 0_u16..0x800, data in prop::collection::vec(any::<u8>(), 0..=8)) {
            let frame = frame(id, &data);
            let line: Vec<u8> = encode(&frame).to_vec();
            let (end, text) = line.split_last().expect("a line");
            prop_assert_eq!(*end, CR);
            prop_assert_eq!(decode(text), Some(frame));
        }
    }
}
