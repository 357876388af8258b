//! Start of a table: the column separator, and a header in a comment.

use std::io::{self, Read};

use csv::StringRecord;

use super::mapping::is_ours;
use super::names;

/// Number of columns of six axes.
const COLUMNS_OF_A_TABLE: usize = 6;

/// Marks a line as a comment.
pub(super) const COMMENT: u8 = b'#';

/// Most bytes read to find the first line of the table.
const LONGEST_HEAD: usize = 1 << 18;

/// Most bytes read to find a header below the first line.
const LONGEST_PREAMBLE: u64 = 1 << 14;

/// Most lines above a header.
const LONGEST_PREAMBLE_LINES: usize = 50;

/// Number of commas in the first line from which a table is separated by commas: six axes need them.
const SURELY_COMMAS: usize = 5;

/// Properties found in the first lines of a file.
pub(super) struct Head {
    /// Bytes read to find them.
    pub(super) bytes: Vec<u8>,
    /// Column separator: a comma, a semicolon or a tab.
    pub(super) separator: u8,
    /// Number of lines above the header that are neither blank nor comments; they are blank in `bytes`.
    pub(super) preamble: usize,
    /// Last comment before the first other line, with its line number.
    pub(super) comment: Option<(u64, StringRecord)>,
}

impl Head {
    /// Reads the required part of a file.
    pub(super) fn of(source: &mut dyn Read) -> io::Result<Self> {
        let mut bytes = Vec::new();
        let mut chunk = [0; 4096];
        while bytes.len() < LONGEST_HEAD && !lines(&bytes).any(|line| line.is_row()) {
            match source.read(&mut chunk) {
                Ok(0) => break,
                Ok(count) => bytes.extend_from_slice(&chunk[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        let preamble = pass_over_preamble(&mut bytes, source)?;
        // The last line of a file may lack a line end.
        bytes.push(b'\n');
        let first = lines(&bytes).find(Line::is_row);
        let separator = first.as_ref().map_or(b',', |line| separator(line.bytes));
        let comment = lines(&bytes)
            .take_while(|line| !line.is_row())
            .filter_map(|line| line.comment())
            .last();
        bytes.pop();
        Ok(Self { separator, preamble, comment, bytes })
    }
}

/// Blanks the lines above the header, so that line numbers are kept: lines that loggers write about themselves
/// without a comment mark. The first of them is neither a row of numbers nor a header, and a header follows soon.
/// Returns their number.
fn pass_over_preamble(bytes: &mut Vec<u8>, source: &mut dyn Read) -> io::Result<usize> {
    let first = lines(bytes).find(Line::is_row);
    if first.is_none_or(|line| line.may_begin_a_table()) {
        return Ok(0);
    }
    let mut more = source.take(LONGEST_PREAMBLE);
    more.read_to_end(bytes)?;
    let Some(Line { start: header, .. }) = lines(bytes).find(Line::is_header) else {
        return Ok(0);
    };
    let passed = lines(&bytes[..header]).filter(Line::is_row).count();
    if passed > LONGEST_PREAMBLE_LINES {
        return Ok(0);
    }
    for byte in &mut bytes[..header] {
        if *byte != b'\n' {
            *byte = b' ';
        }
    }
    Ok(passed)
}

struct Line<'a> {
    /// Start of the line.
    start: usize,
    /// The line without surrounding space.
    bytes: &'a [u8],
    number: u64,
}

/// Complete lines of a text.
fn lines(text: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let rest = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text);
    let mut end = text.len() - rest.len();
    let lines = rest.split_inclusive(|byte| *byte == b'\n');
    let complete = lines.take_while(|line| line.ends_with(b"\n"));
    complete.zip(1..).map(move |(line, number)| {
        let start = end;
        end += line.len();
        let bytes = line.trim_ascii();
        Line { start, bytes, number }
    })
}

impl Line<'_> {
    fn is_row(&self) -> bool {
        self.bytes.first().is_some_and(|byte| *byte != COMMENT)
    }

    /// Cells of a comment, with the line's number.
    fn comment(&self) -> Option<(u64, StringRecord)> {
        let text = self.bytes.strip_prefix(&[COMMENT])?;
        Some((self.number, cells(text)?))
    }

    /// Returns whether it is a header with six axes.
    fn is_header(&self) -> bool {
        self.is_row() && cells(self.bytes).is_some_and(|cells| names::is_header(&cells))
    }

    /// Returns whether the first line of a table may look like this: a header, even one that is not understood, or
    /// numbers. Lines above a table have fewer columns.
    fn may_begin_a_table(&self) -> bool {
        cells(self.bytes)
            .is_none_or(|cells| cells.len() >= COLUMNS_OF_A_TABLE || cells.iter().any(is_ours))
    }
}

/// Cells of a line of text.
fn cells(line: &[u8]) -> Option<StringRecord> {
    let text = str::from_utf8(line).ok()?;
    let separator = char::from(separator(line));
    let cells = text.split(separator).map(|cell| {
        let cell = cell.trim();
        let inner = cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"'));
        inner.unwrap_or(cell)
    });
    Some(cells.collect())
}

/// Column separator of a line.
fn separator(line: &[u8]) -> u8 {
    let count = |wanted: u8| line.iter().filter(|byte| **byte == wanted).count();
    let commas = count(b',');
    if commas >= SURELY_COMMAS {
        return b',';
    }
    [b';', b'\t'].into_iter().find(|other| count(*other) > commas).unwrap_or(b',')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Head {
        Head::of(&mut text.as_bytes()).unwrap()
    }

    #[test]
    fn separator_is_the_most_frequent_in_the_first_row() {
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
    fn lines_above_a_header_become_blank() {
        for header in ["t,ax,ay,az,wx,wy,wz", "a\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z"] {
            let above = "Logger 1.2\nDate: 2024-05-01, 12:00\n\n# by hand\n// filter, 3\n";
            let rows = "1\n".repeat(30_000);
            let text = format!("{above}{header}\n{rows}");
            let mut rest = text.as_bytes();
            let mut head = Head::of(&mut rest).unwrap();
            assert_eq!(head.preamble, 3);
            assert_eq!(head.separator, separator(header.as_bytes()));
            head.bytes.extend_from_slice(rest);
            let blank = format!(
                "{}\n{}\n\n{}\n{}\n",
                " ".repeat(10),
                " ".repeat(23),
                " ".repeat(9),
                " ".repeat(12)
            );
            assert_eq!(head.bytes, format!("{blank}{header}\n{rows}").as_bytes());
        }
    }

    #[test]
    fn table_without_lines_above_its_header_is_unchanged() {
        for text in [
            "t,ax\nt,ax,ay,az,wx,wy,wz\n",
            "0,1\n2,3\n",
            "0.1 0.2\nno header\n",
            "a,b,c,d,e,f\nt,ax,ay,az,wx,wy,wz\n",
            &("x\n".repeat(60) + "t,ax,ay,az,wx,wy,wz\n"),
        ] {
            let head = head(text);
            assert_eq!((head.preamble, head.bytes), (0, text.as_bytes().to_vec()));
        }
    }

    #[test]
    fn bytes_read_ahead_are_kept() {
        let text = "# note\nt;ax\n".to_owned() + &"0;1\n".repeat(9000);
        let mut rest = text.as_bytes();
        let mut bytes = Head::of(&mut rest).unwrap().bytes;
        assert!(bytes.len() < text.len());
        bytes.extend_from_slice(rest);
        assert!(bytes == text.as_bytes());
    }

    #[test]
    fn comment_above_the_table_may_be_its_header() {
        let (line, cells) = head("# made by x\n# t, ax\n0,1\n").comment.unwrap();
        assert_eq!((line, cells), (2, StringRecord::from(vec!["t", "ax"])));
        assert!(head("t,ax\n# 0,1\n").comment.is_none());
    }
}
