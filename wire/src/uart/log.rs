//! Type 0x20: a line of text.
//!
//! | bytes | field |
//! |---|---|
//! | 0 | level: 1 error, 2 warning, 3 information |
//! | 1 … | the text, UTF-8 |

use core::fmt;

use crate::bytes::{Reader, Writer};

/// Maximum length of a text, bytes.
pub const MAX_LOG: usize = 120;

/// A line of text.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct LogMessage {
    /// Level: 1 error, 2 warning, 3 information.
    pub level: u8,
    text: [u8; MAX_LOG],
    length: u8,
}

impl LogMessage {
    /// Creates a line. Excess text is cut off between two characters.
    #[must_use]
    pub fn new(level: u8, text: &str) -> Self {
        let mut line = Self { level, text: [0; MAX_LOG], length: 0 };
        line.push(text);
        line
    }

    fn push(&mut self, text: &str) {
        let room = MAX_LOG.saturating_sub(usize::from(self.length));
        let mut end = text.len().min(room);
        while !text.is_char_boundary(end) {
            end = end.saturating_sub(1);
        }
        let free = self.text.iter_mut().skip(usize::from(self.length));
        for (to, from) in free.zip(text.bytes().take(end)) {
            *to = from;
        }
        self.length = self.length.saturating_add(end as u8);
    }

    /// Replaces the digit at `at`, if there is one, with the last decimal digit of `number`.
    pub fn set_digit(&mut self, at: usize, number: u32) {
        if let Some(digit @ b'0'..=b'9') = self.text.get_mut(at) {
            *digit = b'0' + (number % 10) as u8;
        }
    }

    /// Text.
    #[must_use]
    pub fn text(&self) -> &str {
        core::str::from_utf8(self.bytes()).unwrap_or("")
    }

    fn bytes(&self) -> &[u8] {
        self.text.get(..usize::from(self.length)).unwrap_or(&[])
    }

    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(self.level);
        writer.bytes(self.bytes());
    }

    pub(super) fn read(mut reader: Reader<'_>) -> Option<Self> {
        let level = reader.u8()?;
        let text = core::str::from_utf8(reader.rest()).ok()?;
        (text.len() <= MAX_LOG).then(|| Self::new(level, text))
    }
}

/// Appends text. Excess text is cut off.
impl fmt::Write for LogMessage {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push(text);
        Ok(())
    }
}

impl fmt::Debug for LogMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "LogMessage {{ {}, {:?} }}", self.level, self.text())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uart::{Kind, MAX_FRAME, Message, encode};
    use core::fmt::Write;

    #[test]
    fn golden_bytes() {
        let line = LogMessage::new(2, "héllo");
        let mut payload = [0; 7];
        let mut writer = Writer::new(&mut payload);
        line.write(&mut writer);
        assert_eq!(writer.finish(), Some(7));
        assert_eq!(payload, *b"\x02h\xC3\xA9llo");
        let decoded = Message::decode(Kind::Log, &payload);
        assert_eq!(decoded, Some(Message::Log(line)));
        assert_eq!(Message::decode(Kind::Log, b"\x02\xFF"), None);
    }

    #[test]
    fn a_long_line_is_cut_between_characters_and_still_fits_a_frame() {
        let line = LogMessage::new(1, &"€".repeat(100));
        assert_eq!(line.text(), "€".repeat(40));
        let frame = encode(0, &Message::Log(line));
        assert!(frame.as_bytes().len() <= MAX_FRAME);
        assert!(frame.as_bytes().len() > MAX_LOG);
    }

    #[test]
    fn a_text_that_is_too_long_is_refused() {
        for (length, fits) in [(MAX_LOG, true), (MAX_LOG + 1, false)] {
            let payload = [&[1][..], &std::vec![b'x'; length]].concat();
            assert_eq!(Message::decode(Kind::Log, &payload).is_some(), fits);
        }
    }

    #[test]
    fn a_line_is_written_piece_by_piece() {
        let mut line = LogMessage::new(3, "P = ");
        write!(line, "{:.2}", 0.5).expect("writing never fails");
        assert_eq!(line.text(), "P = 0.50");
    }

    #[test]
    fn set_digit_replaces_digits_alone() {
        let mut line = LogMessage::new(3, "é 00");
        for (at, number) in [(3, 1_234), (4, 5), (0, 6), (1, 7), (5, 8), (MAX_LOG, 9)] {
            line.set_digit(at, number);
        }
        assert_eq!(line.text(), "é 45");
    }
}
