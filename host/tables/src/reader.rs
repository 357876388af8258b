//! Rows of cells from a text, with line numbers as in an editor: the column separator, a header in a comment or below lines
//! of a logger, rows of limited length.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::VecDeque;
use std::io::{self, Chain, Cursor, Read};
use std::rc::Rc;

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use options::names::is_header;
use options::{Decimal, is_ours};
use stored::container::Text;
use stored::error::{InputError, Place, Problem, RowPlace};
use stored::iso8601::micros_since_1970;

/// Number of separators from which a line is a row, because six axes need five separators.
const SEPARATORS_OF_A_ROW: usize = 5;

/// A text that ends with a line feed.
type EndedText = Chain<Watched<Box<dyn Read>>, &'static [u8]>;

/// A file that is read row by row.
pub struct Table {
    /// Path of the file, as given.
    pub file: String,
    /// Name of the recording in the file.
    pub recording_name: String,
    reader: csv::Reader<EndedText>,
    progress: Rc<Progress>,
    separator: u8,
    /// Number of lines above the header that are neither blank nor comments.
    preamble: usize,
    /// Mark before the fractions of its numbers.
    decimal: Decimal,
    /// Rows that were read ahead and not taken yet; an error is the last.
    ahead: VecDeque<Result<Row, InputError>>,
    /// Comment above the first row.
    comment: Option<Row>,
}

impl Table {
    /// Opens a file that is known to be a table.
    #[cfg(test)]
    pub fn open(path: &std::path::Path) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let opened = std::fs::File::open(path)
            .and_then(|file| files::compressed::decompressed(Box::new(file)));
        let text = opened.map_err(|source| InputError::unreadable(&name, source))?;
        Self::of(Text { file: name, name: stored::container::recording_name(path), text })
    }

    /// Creates the table of a text.
    ///
    /// # Errors
    /// The text cannot be read.
    pub fn of(text: Text) -> Result<Self, InputError> {
        let Text { file, name: recording_name, mut text } = text;
        let head = Head::of(&mut text).map_err(|source| InputError::unreadable(&file, source))?;
        let text: Box<dyn Read> = Box::new(Cursor::new(head.bytes).chain(text));
        let (text, progress) = Watched::new(text);
        Ok(Self {
            recording_name,
            progress,
            separator: head.separator,
            preamble: head.preamble,
            decimal: Decimal::Point,
            ahead: VecDeque::new(),
            comment: head.comment.map(|(line, cells)| Row {
                file: file.clone(),
                place: RowPlace::Line(line),
                cells,
            }),
            file,
            reader: ReaderBuilder::new()
                .has_headers(false)
                .delimiter(head.separator)
                .comment(Some(COMMENT))
                // The number of cells is checked against the format, not against line 1.
                .flexible(true)
                // A carriage return counts as space around a cell, so that every row ends right after its line
                // feed: see `line`.
                .terminator(Terminator::Any(b'\n'))
                .trim(Trim::All)
                .from_reader(text.chain(&b"\n"[..])),
        })
    }

    /// Returns the comment above the first row, if it names the columns of the numbers below it.
    pub fn comment_header(&mut self) -> Option<Row> {
        let comment = self.comment.clone()?;
        let first = self.peek_row().ok().flatten()?;
        let text = first.text(0);
        let is_value = text.parse::<f64>().is_ok() || micros_since_1970(text).is_some();
        (is_value && is_header(&comment.cells)).then_some(comment)
    }

    /// Sets the mark before the fractions of all numbers that are not read yet.
    pub fn set_decimal(&mut self, decimal: Decimal) {
        self.decimal = decimal;
        let ahead = std::mem::take(&mut self.ahead);
        let ahead: VecDeque<_> =
            ahead.into_iter().map(|row| row.map(|row| self.with_points(row))).collect();
        self.ahead = ahead;
    }

    /// Returns the row with a decimal point in each number.
    fn with_points(&self, row: Row) -> Row {
        if self.decimal == Decimal::Point || !row.cells.as_slice().contains(',') {
            return row;
        }
        let cells = row.cells.iter().map(|cell| {
            let point = cell.replacen(',', ".", 1);
            match point.parse::<f64>() {
                Ok(_) => Cow::Owned(point),
                Err(_) => Cow::Borrowed(cell),
            }
        });
        row.with_cells(cells.collect())
    }

    /// The row that [`next_row`](Self::next_row) returns next.
    pub fn peek_row(&mut self) -> Result<Option<&Row>, InputError> {
        if self.ahead.is_empty() {
            let next = self.read_row().transpose();
            self.ahead.extend(next);
        }
        match self.ahead.pop_front() {
            Some(Err(error)) => Err(error),
            Some(Ok(row)) => {
                self.ahead.push_front(Ok(row));
                Ok(self.ahead.front().and_then(|row| row.as_ref().ok()))
            }
            None => Ok(None),
        }
    }

    /// Returns the rows that [`next_row`](Self::next_row) returns next, up to this number. An error among them is
    /// returned when its row is taken.
    pub fn peek_rows(&mut self, most: usize) -> impl Iterator<Item = &Row> {
        while self.ahead.len() < most && !matches!(self.ahead.back(), Some(Err(_))) {
            match self.read_row().transpose() {
                Some(row) => self.ahead.push_back(row),
                None => break,
            }
        }
        self.ahead.iter().filter_map(|row| row.as_ref().ok())
    }

    /// Returns the next line that is not blank; `None` at the end of the file.
    pub fn next_row(&mut self) -> Result<Option<Row>, InputError> {
        match self.ahead.pop_front() {
            Some(row) => row.map(Some),
            None => self.read_row(),
        }
    }

    /// Reads the next line that is not blank.
    fn read_row(&mut self) -> Result<Option<Row>, InputError> {
        loop {
            let mut cells = StringRecord::new();
            self.progress.begin_row();
            // May also be the start of blank lines before the row.
            let begins = self.reader.position().line();
            match self.reader.read_record(&mut cells) {
                Ok(false) => return Ok(None),
                Ok(true) if cells.len() == 1 && cells[0].is_empty() => {}
                Ok(true) => {
                    self.check_quotes(&cells, begins)?;
                    let row =
                        Row { file: self.file.clone(), place: RowPlace::Line(self.line()), cells };
                    return Ok(Some(self.with_points(row)));
                }
                Err(error) => return Err(self.failure(error)),
            }
        }
    }

    /// Returns the line of the row just read. The position in a record is not usable, because it is the start of the blank
    /// lines before the record. The reader, however, is right after the row's line feed. The last row also has a line feed,
    /// because one is appended to the file.
    fn line(&self) -> u64 {
        self.reader.position().line() - 1
    }

    /// Checks that no rows are lost within the quotes of a cell.
    fn check_quotes(&self, cells: &StringRecord, line: u64) -> Result<(), InputError> {
        // All cells of the row are checked at once, because line feeds are rare.
        if !cells.as_slice().contains('\n') {
            return Ok(());
        }
        let is_row = |line: &str| {
            let separators = line.bytes().filter(|byte| *byte == self.separator);
            separators.count() >= SEPARATORS_OF_A_ROW
        };
        // The rest of the row after the closing quote does not count as a row.
        let swallowed = |cell: &str| cell.lines().skip(1).any(is_row);
        if !cells.iter().any(swallowed) {
            return Ok(());
        }
        let problem = Problem::RowsInQuotes { until: self.line() };
        Err(InputError::of_row(&self.file, RowPlace::Line(line), problem))
    }

    /// Returns whether the row just taken is the last and lacks a line end, so that the rest of it may be missing.
    pub fn is_cut_off(&mut self) -> bool {
        matches!(self.peek_row(), Ok(None)) && self.progress.ended_within_a_line()
    }

    /// Sentence about the lines above the header.
    pub fn preamble_notice(&self) -> Option<String> {
        let file = &self.file;
        match self.preamble {
            0 => None,
            1 => Some(format!("{file}: the line above the header is passed over")),
            lines => Some(format!("{file}: {lines} lines above the header are passed over")),
        }
    }

    fn failure(&self, error: csv::Error) -> InputError {
        if self.progress.is_too_long() {
            let line = RowPlace::Line(self.reader.position().line());
            let problem = Problem::LongRow { most_bytes: LONGEST_ROW };
            return InputError::of_row(&self.file, line, problem);
        }
        let message = error.to_string();
        match error.into_kind() {
            csv::ErrorKind::Utf8 { err, .. } => {
                let row = RowPlace::Line(self.line());
                let place = Place::Cell { row, column: err.field() + 1, name: String::new() };
                InputError { file: self.file.clone(), place, problem: Problem::NotUtf8 }
            }
            csv::ErrorKind::Io(source) => InputError::unreadable(&self.file, source),
            _ => InputError::unreadable(&self.file, io::Error::other(message)),
        }
    }
}

/// A row of the table.
#[derive(Clone)]
pub struct Row {
    /// Path of the file, as given.
    pub file: String,
    pub place: RowPlace,
    cells: StringRecord,
}

impl Row {
    /// Names of the columns of a file without lines.
    #[cfg(feature = "parquet")]
    pub fn of_names(file: &str, names: &[String]) -> Self {
        Self { file: file.to_owned(), place: RowPlace::Names, cells: names.iter().collect() }
    }

    /// Cells, without surrounding space.
    pub fn cells(&self) -> impl Iterator<Item = &str> {
        self.cells.iter()
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns a row at the same position with other cells.
    pub fn with_cells(&self, cells: StringRecord) -> Self {
        Self { file: self.file.clone(), place: self.place, cells }
    }

    /// Checks that the row has `expected` cells.
    pub fn expect_columns(&self, expected: usize) -> Result<(), InputError> {
        if self.cells.len() == expected {
            Ok(())
        } else {
            let problem = Problem::ColumnCount { found: self.cells.len(), expected };
            Err(InputError::of_row(&self.file, self.place, problem))
        }
    }

    /// Content of column `index` (from 0).
    pub fn text(&self, index: usize) -> &str {
        self.cells.get(index).unwrap_or_default()
    }
}

/// A row of a table; columns are indexed from 0.
pub trait Cells {
    /// Returns whether a cell is blank.
    fn is_blank(&self, index: usize) -> bool;

    /// Content of a cell, as text.
    fn shown(&self, index: usize) -> Cow<'_, str>;

    /// Number in a cell; `None` if it is blank.
    fn optional(&self, index: usize, name: &str) -> Result<Option<f64>, InputError>;

    /// Returns the number in a cell if it is an integer. This keeps nanoseconds, which have more digits than an f64.
    fn whole(&self, index: usize) -> Option<i64>;

    /// Time in a cell, µs, if the cell defines its unit.
    fn moment_us(&self, index: usize) -> Option<i64>;

    /// An error in a cell of the column with this name.
    fn error(&self, index: usize, name: &str, problem: Problem) -> InputError;

    /// Number in a cell that must not be blank.
    fn number(&self, index: usize, name: &str) -> Result<f64, InputError> {
        self.optional(index, name)?.ok_or_else(|| self.error(index, name, Problem::Blank))
    }
}

impl<C: Cells> Cells for &C {
    fn is_blank(&self, index: usize) -> bool {
        (*self).is_blank(index)
    }

    fn shown(&self, index: usize) -> Cow<'_, str> {
        (*self).shown(index)
    }

    fn optional(&self, index: usize, name: &str) -> Result<Option<f64>, InputError> {
        (*self).optional(index, name)
    }

    fn whole(&self, index: usize) -> Option<i64> {
        (*self).whole(index)
    }

    fn moment_us(&self, index: usize) -> Option<i64> {
        (*self).moment_us(index)
    }

    fn error(&self, index: usize, name: &str, problem: Problem) -> InputError {
        (*self).error(index, name, problem)
    }
}

impl Cells for Row {
    fn is_blank(&self, index: usize) -> bool {
        self.text(index).is_empty()
    }

    fn shown(&self, index: usize) -> Cow<'_, str> {
        Cow::Borrowed(self.text(index))
    }

    fn optional(&self, index: usize, name: &str) -> Result<Option<f64>, InputError> {
        match self.text(index) {
            "" => Ok(None),
            text => number(text)
                .map(Some)
                .ok_or_else(|| self.error(index, name, Problem::NotANumber(text.to_owned()))),
        }
    }

    fn whole(&self, index: usize) -> Option<i64> {
        self.text(index).parse().ok()
    }

    fn moment_us(&self, index: usize) -> Option<i64> {
        micros_since_1970(self.text(index))
    }

    fn error(&self, index: usize, name: &str, problem: Problem) -> InputError {
        let place = Place::Cell { row: self.place, column: index + 1, name: name.to_owned() };
        InputError { file: self.file.clone(), place, problem }
    }
}

/// Spellings of "not a number" by R, pandas, SQL, spreadsheets and the C library of Windows that Rust does not
/// parse.
const NOT_A_NUMBER: [&str; 10] =
    ["NA", "N/A", "#N/A", "<NA>", "null", "NULL", "None", "nan(ind)", "-nan(ind)", "-1.#IND"];

/// Parses a number.
fn number(text: &str) -> Option<f64> {
    let parsed = text.parse().ok();
    parsed.or_else(|| NOT_A_NUMBER.contains(&text).then_some(f64::NAN))
}

/// Number of columns of six axes.
const COLUMNS_OF_A_TABLE: usize = 6;

/// Marks a line as a comment.
const COMMENT: u8 = b'#';

/// Most bytes read to find the first line of the table.
const LONGEST_HEAD: usize = 1 << 18;

/// Most bytes read to find a header below the first line.
const LONGEST_PREAMBLE: u64 = 1 << 14;

/// Most lines above a header.
const LONGEST_PREAMBLE_LINES: usize = 50;

/// Number of commas in the first line from which a table is separated by commas, because six axes need five separators.
const SURELY_COMMAS: usize = 5;

/// Properties found in the first lines of a file.
struct Head {
    /// Bytes read to find them.
    bytes: Vec<u8>,
    /// Column separator: a comma, a semicolon or a tab.
    separator: u8,
    /// Number of lines above the header that are neither blank nor comments; they are blank in `bytes`.
    preamble: usize,
    /// Last comment before the first other line, with its line number.
    comment: Option<(u64, StringRecord)>,
}

impl Head {
    /// Reads the required part of a file.
    fn of(source: &mut dyn Read) -> io::Result<Self> {
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

/// Blanks the lines that some loggers write above the header without a comment mark, and returns their number. Line
/// numbers are kept. There are such lines if the first line is neither a row of numbers nor a header, and a header
/// follows soon.
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
        self.is_row() && cells(self.bytes).is_some_and(|cells| is_header(&cells))
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

/// Longest row, bytes: 16 MB. The longest known row of a robot has 0.1 MB.
const LONGEST_ROW: usize = 16 << 20;

/// State of a text that is being read.
#[derive(Default)]
struct Progress {
    /// Bytes left for the current row.
    left: Cell<usize>,
    /// The last byte.
    last: Cell<Option<u8>>,
    has_ended: Cell<bool>,
    is_too_long: Cell<bool>,
}

impl Progress {
    /// Starts a row.
    fn begin_row(&self) {
        self.left.set(LONGEST_ROW);
    }

    /// Returns whether the row exceeds [`LONGEST_ROW`].
    const fn is_too_long(&self) -> bool {
        self.is_too_long.get()
    }

    /// Returns whether the text has ended within a line.
    fn ended_within_a_line(&self) -> bool {
        self.has_ended.get() && self.last.get().is_some_and(|byte| byte != b'\n')
    }
}

/// A text that records its progress.
struct Watched<R> {
    text: R,
    progress: Rc<Progress>,
}

impl<R> Watched<R> {
    fn new(text: R) -> (Self, Rc<Progress>) {
        let progress = Rc::new(Progress::default());
        let watched = Self { text, progress: Rc::clone(&progress) };
        (watched, progress)
    }
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let progress = &self.progress;
        if progress.left.get() == 0 {
            progress.is_too_long.set(true);
            return Err(io::Error::other("a row is too long"));
        }
        let count = self.text.read(buffer)?;
        match buffer[..count].last() {
            Some(last) => progress.last.set(Some(*last)),
            None => progress.has_ended.set(!buffer.is_empty()),
        }
        progress.left.set(progress.left.get().saturating_sub(count));
        Ok(count)
    }
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
