//! Text in UTF-16, as spreadsheets and Windows write it, read as UTF-8.

use std::io::{self, Cursor, Read};

/// Bytes of the file that are converted at once.
const CHUNK: usize = 1 << 14;

/// Number of plain characters by which UTF-16 without a byte order mark is recognised.
const PLAIN_CHARACTERS: usize = 8;

/// Returns a text in UTF-16 as UTF-8, without a byte order mark, and any other content unchanged.
///
/// # Errors
/// The first bytes cannot be read.
pub fn in_utf8(mut content: Box<dyn Read>) -> io::Result<Box<dyn Read>> {
    let mut first = Vec::new();
    content.by_ref().take(2 * PLAIN_CHARACTERS as u64).read_to_end(&mut first)?;
    let order = ByteOrder::of_text(&first);
    let content = Cursor::new(first).chain(content);
    Ok(match order {
        Some(order) => Box::new(Utf8::new(content, order)),
        None => Box::new(content),
    })
}

/// Order of the two bytes of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// Order of the bytes of a text in UTF-16, by its first bytes: a byte order mark, or ASCII characters with a zero beside
    /// each; `None` of any other file.
    fn of_text(first: &[u8]) -> Option<Self> {
        match first {
            // UTF-32.
            [0xff, 0xfe, 0, 0, ..] => None,
            [0xff, 0xfe, ..] => Some(Self::Little),
            [0xfe, 0xff, ..] => Some(Self::Big),
            _ => [Self::Little, Self::Big].into_iter().find(|order| order.is_plain(first)),
        }
    }

    fn is_plain(self, first: &[u8]) -> bool {
        let mut units = first.chunks_exact(2).map(|unit| self.unit([unit[0], unit[1]]));
        let is_text = |unit: u16| matches!(unit, 0x09 | 0x0a | 0x0d | 0x20..=0x7e);
        first.len() >= 2 * PLAIN_CHARACTERS && units.by_ref().take(PLAIN_CHARACTERS).all(is_text)
    }

    const fn unit(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Little => u16::from_le_bytes(bytes),
            Self::Big => u16::from_be_bytes(bytes),
        }
    }
}

/// UTF-8 of a text in UTF-16, without its byte order mark. An invalid unit becomes U+FFFD.
struct Utf8<R> {
    text: R,
    order: ByteOrder,
    /// First byte of a unit whose second has not been read.
    half: Option<u8>,
    /// First unit of a pair whose second has not been read.
    high: Option<u16>,
    /// Whether the byte order mark may still come.
    is_first: bool,
    converted: Vec<u8>,
    /// Bytes of `converted` that were taken.
    taken: usize,
}

impl<R: Read> Utf8<R> {
    const fn new(text: R, order: ByteOrder) -> Self {
        Self {
            text,
            order,
            half: None,
            high: None,
            is_first: true,
            converted: Vec::new(),
            taken: 0,
        }
    }

    /// Converts the next bytes; returns false at the end of the text.
    fn convert(&mut self) -> io::Result<bool> {
        let mut bytes = [0; CHUNK];
        let count = self.text.read(&mut bytes)?;
        let mut units: Vec<u16> = self.high.take().into_iter().collect();
        for byte in &bytes[..count] {
            match self.half.take() {
                Some(first) => units.push(self.order.unit([first, *byte])),
                None => self.half = Some(*byte),
            }
        }
        let is_high = |unit: &u16| matches!(unit, 0xd800..=0xdbff);
        if count > 0 && units.last().is_some_and(is_high) {
            self.high = units.pop();
        }
        let mut text: String = char::decode_utf16(units)
            .map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect();
        if self.is_first && !text.is_empty() {
            self.is_first = false;
            if text.starts_with('\u{feff}') {
                text.remove(0);
            }
        }
        self.converted = text.into_bytes();
        self.taken = 0;
        Ok(count > 0)
    }
}

impl<R: Read> Read for Utf8<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.converted.len() {
            if !self.convert()? && self.converted.is_empty() {
                return Ok(0);
            }
        }
        let count = (&self.converted[self.taken..]).read(to)?;
        self.taken += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns one byte per call, so that each unit and each pair is cut.
    struct Slowly(Cursor<Vec<u8>>);

    impl Read for Slowly {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            let most = to.len().min(1);
            self.0.read(&mut to[..most])
        }
    }

    fn encoded(text: &str, order: ByteOrder) -> Vec<u8> {
        let bytes = |unit: u16| match order {
            ByteOrder::Little => unit.to_le_bytes(),
            ByteOrder::Big => unit.to_be_bytes(),
        };
        text.encode_utf16().flat_map(bytes).collect()
    }

    #[test]
    fn text_in_both_orders_reads_as_utf8() {
        for order in [ByteOrder::Little, ByteOrder::Big] {
            for text in ["\u{feff}t,ax [m/s²]\r\n0,1\n", "t,ax,ay,az,\u{1f9b6}\n"] {
                let bytes = encoded(text, order);
                assert_eq!(ByteOrder::of_text(&bytes), Some(order), "{text}");
                let mut read = String::new();
                in_utf8(Box::new(Slowly(Cursor::new(bytes))))
                    .unwrap()
                    .read_to_string(&mut read)
                    .unwrap();
                assert_eq!(read, text.trim_start_matches('\u{feff}'));
            }
        }
    }

    #[test]
    fn other_files_are_not_taken_for_utf16() {
        for first in [
            &b"t,ax,ay,az,wx,wy,wz\n"[..],
            b"",
            b"t\0,\0",
            b"\xff\xfe\0\0t\0\0\0",
            b"\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
            b"\x80\x04\x95\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
        ] {
            assert_eq!(ByteOrder::of_text(first), None, "{first:?}");
            let mut read = Vec::new();
            in_utf8(Box::new(first)).unwrap().read_to_end(&mut read).unwrap();
            assert_eq!(read, first);
        }
    }

    #[test]
    fn cut_or_wrong_units_become_replacement_characters() {
        let mut bytes = encoded("a,", ByteOrder::Little);
        bytes.extend([0x3e, 0xd8, b'b', 0, 0x3e, 0xd8, 7]);
        let mut read = String::new();
        Utf8::new(&bytes[..], ByteOrder::Little).read_to_string(&mut read).unwrap();
        assert_eq!(read, "a,\u{fffd}b\u{fffd}");
    }
}
