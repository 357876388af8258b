//! Rows of cells from a file, with line numbers as in an editor.

use std::borrow::Cow;
use std::io::{self, Chain, Cursor, Read};
use std::path::Path;
use std::rc::Rc;

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use super::head::{COMMENT, Head};
use super::lines::{LONGEST_ROW, Progress, Watched};
use super::names;
use super::options::Decimal;
use crate::input::error::{InputError, RowPlace};
use crate::input::iso8601::micros_since_1970;
use crate::samples::compressed::without_ending;

/// Number of separators from which a line is a row: six axes need them.
const SEPARATORS_OF_A_ROW: usize = 5;

/// A text that ends with a line feed.
type Text = Chain<Watched<Box<dyn Read>>, &'static [u8]>;

/// A file that is read row by row.
pub(in crate::input) struct Table {
    /// Path of the file, as given.
    pub(in crate::input) file: String,
    /// Name of the recording in the file.
    pub(in crate::input) recording_name: String,
    reader: csv::Reader<Text>,
    progress: Rc<Progress>,
    separator: u8,
    /// Number of lines above the header that are neither blank nor comments.
    preamble: usize,
    /// Mark before the fractions of its numbers.
    decimal: Decimal,
    /// A row that was peeked at and not taken yet.
    peeked: Option<Row>,
    /// Comment above the first row.
    comment: Option<Row>,
}

impl Table {
    /// Opens a file that is known to be a table.
    #[cfg(test)]
    pub(in crate::input) fn open(path: &Path) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let opened = std::fs::File::open(path)
            .and_then(|file| crate::samples::compressed::decompressed(Box::new(file)));
        let table = opened.and_then(|text| Self::of(name.clone(), recording_name(path), text));
        table.map_err(|source| InputError::unreadable(&name, source))
    }

    /// Creates the table of a text.
    pub(in crate::input) fn of(
        file: String,
        recording_name: String,
        mut text: Box<dyn Read>,
    ) -> io::Result<Self> {
        let head = Head::of(&mut text)?;
        let (text, progress) = Watched::new(beginning_with(head.bytes, text));
        Ok(Self {
            recording_name,
            progress,
            separator: head.separator,
            preamble: head.preamble,
            decimal: Decimal::Point,
            peeked: None,
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
    pub(super) fn comment_header(&mut self) -> Option<Row> {
        let comment = self.comment.clone()?;
        let first = self.peek_row().ok().flatten()?;
        let text = first.text(0);
        let is_value = text.parse::<f64>().is_ok() || micros_since_1970(text).is_some();
        (is_value && names::is_header(&comment.cells)).then_some(comment)
    }

    /// Sets the mark before the fractions of all numbers that are not read yet.
    pub(in crate::input) fn set_decimal(&mut self, decimal: Decimal) {
        self.decimal = decimal;
        if let Some(row) = self.peeked.take() {
            self.peeked = Some(self.with_points(row));
        }
    }

    /// The row with a point before the fraction of each number.
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
    pub(in crate::input) fn peek_row(&mut self) -> Result<Option<&Row>, InputError> {
        if self.peeked.is_none() {
            self.peeked = self.next_row()?;
        }
        Ok(self.peeked.as_ref())
    }

    /// Returns the next line that is not blank; `None` at the end of the file.
    pub(in crate::input) fn next_row(&mut self) -> Result<Option<Row>, InputError> {
        if let Some(row) = self.peeked.take() {
            return Ok(Some(row));
        }
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

    /// Line of the row just read. The position in a record is not usable: it is the start of the blank lines
    /// before the record. The reader, however, is right after the row's line feed, which the last row has, too,
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
        Err(InputError::RowsInQuotes { file: self.file.clone(), line, until: self.line() })
    }

    /// Returns whether the row just taken is the last and lacks a line end, so that the rest of it may be missing.
    pub(super) fn is_cut_off(&mut self) -> bool {
        matches!(self.peek_row(), Ok(None)) && self.progress.ended_within_a_line()
    }

    /// Sentence about the lines above the header.
    pub(super) fn preamble_notice(&self) -> Option<String> {
        let file = &self.file;
        match self.preamble {
            0 => None,
            1 => Some(format!("{file}: the line above the header is passed over")),
            lines => Some(format!("{file}: {lines} lines above the header are passed over")),
        }
    }

    fn failure(&self, error: csv::Error) -> InputError {
        let file = self.file.clone();
        if self.progress.is_too_long() {
            return InputError::LongRow {
                file,
                line: self.reader.position().line(),
                most_bytes: LONGEST_ROW,
            };
        }
        let message = error.to_string();
        match error.into_kind() {
            csv::ErrorKind::Utf8 { err, .. } => {
                InputError::NotUtf8 { file, line: self.line(), column: err.field() + 1 }
            }
            csv::ErrorKind::Io(source) => InputError::Unreadable { file, source },
            _ => InputError::Unreadable { file, source: io::Error::other(message) },
        }
    }
}

/// Prepends bytes that were already read to the rest.
pub(in crate::input) fn beginning_with(bytes: Vec<u8>, rest: Box<dyn Read>) -> Box<dyn Read> {
    Box::new(Cursor::new(bytes).chain(rest))
}

/// Title of a recording: the file's name without its extension and that of its compression.
#[must_use]
pub fn recording_name(path: &Path) -> String {
    let stem = without_ending(path).file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// A row of the table.
#[derive(Clone)]
pub(in crate::input) struct Row {
    /// Path of the file, as given.
    pub(super) file: String,
    pub(super) place: RowPlace,
    cells: StringRecord,
}

impl Row {
    /// Names of the columns of a file without lines.
    #[cfg(feature = "parquet")]
    pub(super) fn of_names(file: &str, names: &[String]) -> Self {
        Self { file: file.to_owned(), place: RowPlace::Names, cells: names.iter().collect() }
    }

    /// Cells, without surrounding space.
    pub(in crate::input) fn cells(&self) -> impl Iterator<Item = &str> {
        self.cells.iter()
    }

    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns a row at the same position with other cells.
    pub(super) fn with_cells(&self, cells: StringRecord) -> Self {
        Self { file: self.file.clone(), place: self.place, cells }
    }

    /// Checks that the row has `expected` cells.
    pub(in crate::input) fn expect_columns(&self, expected: usize) -> Result<(), InputError> {
        if self.cells.len() == expected {
            Ok(())
        } else {
            Err(InputError::ColumnCount {
                file: self.file.clone(),
                place: self.place,
                found: self.cells.len(),
                expected,
            })
        }
    }

    /// Content of column `index` (from 0).
    pub(super) fn text(&self, index: usize) -> &str {
        self.cells.get(index).unwrap_or_default()
    }
}
