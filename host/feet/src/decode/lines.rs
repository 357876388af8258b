//! Reads the lines of a file one at a time, with arbitrary content and length.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// Maximum number of bytes kept of a line, more than any line of a log has. Excess bytes are skipped.
const LONGEST: usize = 4096;

/// Iterates over the lines of a file.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufReader;

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
}
