//! The beginning of a table: what separates its columns, and a header that is a comment.

use std::io::{self, Read};

use csv::StringRecord;

/// Begins a line that is no row.
pub(super) const COMMENT: u8 = b'#';

/// At most this many bytes are looked at for the first line of the table.
const LONGEST_HEAD: usize = 1 << 18;

/// From this many commas on in its first line, a table is separated by commas: six axes need them.
const SURELY_COMMAS: usize = 5;

/// What the first lines of a file show.
pub(super) struct Head {
    /// The bytes that were read to see it.
    pub(super) bytes: Vec<u8>,
    /// What separates columns: a comma, a semicolon or a tab.
    pub(super) separator: u8,
    /// The last comment before the first other line, with its number.
    pub(super) comment: Option<(u64, StringRecord)>,
}

impl Head {
    /// Reads as much of a file as it takes.
    pub(super) fn of(source: &mut dyn Read) -> io::Result<Self> {
        let mut bytes = Vec::new();
        let mut chunk = [0; 4096];
        while bytes.len() < LONGEST_HEAD && !Lines::of(&bytes).any(|line| line.is_row()) {
            match source.read(&mut chunk) {
                Ok(0) => break,
                Ok(count) => bytes.extend_from_slice(&chunk[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        // A file's last line may have no end.
        bytes.push(b'\n');
        let first = Lines::of(&bytes).find(Line::is_row);
        let separator = first.as_ref().map_or(b',', |line| separator(line.bytes));
        let comment = Lines::of(&bytes)
            .take_while(|line| !line.is_row())
            .filter_map(|line| line.comment())
            .last();
        bytes.pop();
        Ok(Self {
            separator,
            comment,
            bytes,
        })
    }
}

/// The lines of a text that have an end.
struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
}

struct Line<'a> {
    /// Without space around it.
    bytes: &'a [u8],
    number: u64,
}

impl<'a> Lines<'a> {
    fn of(text: &'a [u8]) -> Self {
        let rest = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text);
        Self { rest, number: 0 }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let end = self.rest.iter().position(|byte| *byte == b'\n')?;
        let line = self.rest[..end].trim_ascii();
        self.rest = &self.rest[end + 1..];
        self.number += 1;
        Some(Line {
            bytes: line,
            number: self.number,
        })
    }
}

impl Line<'_> {
    fn is_row(&self) -> bool {
        self.bytes.first().is_some_and(|byte| *byte != COMMENT)
    }

    /// The cells of a comment, with the line's number.
    fn comment(&self) -> Option<(u64, StringRecord)> {
        let text = self.bytes.strip_prefix(&[COMMENT])?;
        let text = str::from_utf8(text).ok()?;
        let separator = char::from(separator(text.as_bytes()));
        let cells: StringRecord = text.split(separator).map(str::trim).collect();
        Some((self.number, cells))
    }
}

/// What separates the columns of a line.
fn separator(line: &[u8]) -> u8 {
    let count = |wanted: u8| line.iter().filter(|byte| **byte == wanted).count();
    let commas = count(b',');
    if commas >= SURELY_COMMAS {
        return b',';
    }
    [b';', b'\t']
        .into_iter()
        .find(|other| count(*other) > commas)
        .unwrap_or(b',')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Head {
        Head::of(&mut text.as_bytes()).unwrap()
    }

    #[test]
    fn columns_are_separated_by_what_the_first_row_has_most_of() {
        for (text, separator) in [
            ("t,ax,ay,az,wx,wy,wz\n", b','),
            ("t;ax;ay;az;wx;wy;wz\n", b';'),
            ("t\tax\tay\taz\twx\twy\twz\n", b'\t'),
            ("\u{feff}\r\n# a, b, c, d, e, f\r\n\r\nt;ax\r\n", b';'),
            ("t (s, boot);ax;ay;az;wx;wy;wz", b';'),
            ("t,ax,ay,az,wx,wy,wz,a;b;c;d;e;f;g;h;i\n", b','),
            ("t", b','),
            ("", b','),
        ] {
            assert_eq!(head(text).separator, separator, "{text:?}");
        }
    }

    #[test]
    fn what_was_read_to_see_it_is_kept() {
        let text = "# note\nt;ax\n".to_owned() + &"0;1\n".repeat(9000);
        let mut rest = text.as_bytes();
        let mut bytes = Head::of(&mut rest).unwrap().bytes;
        assert!(bytes.len() < text.len());
        bytes.extend_from_slice(rest);
        assert!(bytes == text.as_bytes());
    }

    #[test]
    fn the_comment_above_the_table_may_be_its_header() {
        let (line, cells) = head("# made by x\n# t, ax\n0,1\n").comment.unwrap();
        assert_eq!((line, cells), (2, StringRecord::from(vec!["t", "ax"])));
        assert!(head("t,ax\n# 0,1\n").comment.is_none());
    }
}
