//! Rows of cells from a file, with the line numbers people see in an editor.

use std::fs::File;
use std::io::{self, Chain, Cursor, Read};
use std::path::Path;
use std::rc::Rc;

use csv::{ReaderBuilder, StringRecord, Terminator, Trim};

use super::compressed::decompressed;
use super::error::{Cell, InputError, Place};
use super::head::{COMMENT, Head};
use super::iso8601::micros_since_1970;
use super::layout;
use super::lines::{LONGEST_ROW, Progress, Watched};

/// A line with as many separators is a row: six axes need them.
const SEPARATORS_OF_A_ROW: usize = 5;

/// A text that ends with a line feed.
type Text = Chain<Watched<Box<dyn Read>>, &'static [u8]>;

/// A file open for reading, row by row.
pub(super) struct Table {
    file: String,
    recording_name: String,
    reader: csv::Reader<Text>,
    progress: Rc<Progress>,
    separator: u8,
    /// How many lines above the header are neither blank nor comments.
    preamble: usize,
    /// A row that was looked at and not taken yet.
    peeked: Option<Row>,
    /// The comment above the first row.
    comment: Option<Row>,
}

impl Table {
    /// Opens a file that is known to be a table.
    pub(super) fn open(path: &Path) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let opened = File::open(path).and_then(|file| decompressed(Box::new(file)));
        match opened.and_then(|text| Self::of(name.clone(), recording_name(path), text)) {
            Ok(table) => Ok(table),
            Err(source) => Err(InputError::Unreadable { file: name, source }),
        }
    }

    /// The table in a text.
    pub(super) fn of(
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
            peeked: None,
            comment: head.comment.map(|(line, cells)| Row {
                file: file.clone(),
                place: Place::Line(line),
                cells,
            }),
            file,
            reader: ReaderBuilder::new()
                .has_headers(false)
                .delimiter(head.separator)
                .comment(Some(COMMENT))
                // Counts are checked against what the format expects, not against line 1.
                .flexible(true)
                // A carriage return is taken for space around a cell, so that every row
                // ends right after its line feed: see `line`.
                .terminator(Terminator::Any(b'\n'))
                .trim(Trim::All)
                .from_reader(text.chain(&b"\n"[..])),
        })
    }

    /// The comment above the first row, where it names the columns of numbers below it.
    pub(super) fn comment_header(&mut self) -> Option<Row> {
        let comment = self.comment.clone()?;
        let first = self.peek_row().ok().flatten()?;
        let text = first.text(0);
        let is_value = text.parse::<f64>().is_ok() || micros_since_1970(text).is_some();
        (is_value && layout::is_header(&comment.cells)).then_some(comment)
    }

    /// The file, as it was named.
    pub(super) fn file(&self) -> &str {
        &self.file
    }

    /// What the recording in the file is called.
    pub(super) fn recording_name(&self) -> &str {
        &self.recording_name
    }

    /// The row that [`next_row`](Self::next_row) will give.
    pub(super) fn peek_row(&mut self) -> Result<Option<&Row>, InputError> {
        if self.peeked.is_none() {
            self.peeked = self.next_row()?;
        }
        Ok(self.peeked.as_ref())
    }

    /// That there is no sample in the file.
    pub(super) fn empty(&self) -> InputError {
        InputError::Empty {
            file: self.file.clone(),
        }
    }

    /// The next line that is not blank; `None` at the end of the file.
    pub(super) fn next_row(&mut self) -> Result<Option<Row>, InputError> {
        if let Some(row) = self.peeked.take() {
            return Ok(Some(row));
        }
        loop {
            let mut cells = StringRecord::new();
            self.progress.begin_row();
            // Or blank lines before the row.
            let begins = self.reader.position().line();
            match self.reader.read_record(&mut cells) {
                Ok(false) => return Ok(None),
                Ok(true) if cells.len() == 1 && cells[0].is_empty() => {}
                Ok(true) => {
                    self.check_quotes(&cells, begins)?;
                    return Ok(Some(Row {
                        file: self.file.clone(),
                        place: Place::Line(self.line()),
                        cells,
                    }));
                }
                Err(error) => return Err(self.failure(error)),
            }
        }
    }

    /// The line of the row just read. The position a record carries is no help: it is where blank
    /// lines before the record begin. But the reader stands right after the row's line feed, which
    /// the last row has too, because one is appended to the file.
    fn line(&self) -> u64 {
        self.reader.position().line() - 1
    }

    /// Makes sure that no rows are within the quotes of a cell, and lost with it.
    fn check_quotes(&self, cells: &StringRecord, line: u64) -> Result<(), InputError> {
        // All cells of the row at once: line feeds are rare.
        if !cells.as_slice().contains('\n') {
            return Ok(());
        }
        let is_row = |line: &str| {
            let separators = line.bytes().filter(|byte| *byte == self.separator);
            separators.count() >= SEPARATORS_OF_A_ROW
        };
        // The rest of the row in which the quote closes is no row of its own.
        let swallowed = |cell: &str| cell.lines().skip(1).any(is_row);
        if !cells.iter().any(swallowed) {
            return Ok(());
        }
        Err(InputError::RowsInQuotes {
            file: self.file.clone(),
            line,
            until: self.line(),
        })
    }

    /// Whether the row that was just taken is the last, and its line has no end: then the rest of
    /// it may be missing.
    pub(super) fn is_cut_off(&mut self) -> bool {
        matches!(self.peek_row(), Ok(None)) && self.progress.ended_within_a_line()
    }

    /// The sentence on the lines above the header.
    pub(super) fn preamble_notice(&self) -> Option<String> {
        let file = &self.file;
        match self.preamble {
            0 => None,
            1 => Some(format!("{file}: the line above the header is passed over")),
            lines => Some(format!(
                "{file}: {lines} lines above the header are passed over"
            )),
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
            csv::ErrorKind::Utf8 { err, .. } => InputError::NotUtf8 {
                file,
                line: self.line(),
                column: err.field() + 1,
            },
            csv::ErrorKind::Io(source) => InputError::Unreadable { file, source },
            _ => InputError::Unreadable {
                file,
                source: io::Error::other(message),
            },
        }
    }
}

/// What was read already, and the rest.
pub(super) fn beginning_with(bytes: Vec<u8>, rest: Box<dyn Read>) -> Box<dyn Read> {
    Box::new(Cursor::new(bytes).chain(rest))
}

/// Where a recording comes from, as its title: the file's name without its extension, nor the one
/// of its compression.
#[must_use]
pub fn recording_name(path: &Path) -> String {
    let compressed = path.extension().is_some_and(|extension| {
        ["gz", "zst", "zstd"]
            .iter()
            .any(|known| extension == *known)
    });
    let whole = if compressed {
        Path::new(path.file_stem().unwrap_or_default())
    } else {
        path
    };
    whole
        .file_stem()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// One line.
#[derive(Clone)]
pub(super) struct Row {
    file: String,
    pub(super) place: Place,
    cells: StringRecord,
}

impl Row {
    /// The names of columns of a file that has no lines.
    #[cfg(feature = "parquet")]
    pub(super) fn of_names(file: &str, names: &[String]) -> Self {
        Self {
            file: file.to_owned(),
            place: Place::Names,
            cells: names.iter().collect(),
        }
    }

    /// The cells, without space around them.
    pub(super) fn cells(&self) -> impl Iterator<Item = &str> {
        self.cells.iter()
    }

    /// How many cells it has.
    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    /// A row at the same place with other cells.
    pub(super) fn with_cells(&self, cells: StringRecord) -> Self {
        Self {
            file: self.file.clone(),
            place: self.place,
            cells,
        }
    }

    /// Makes sure that the row has `expected` cells.
    pub(super) fn expect_columns(&self, expected: usize) -> Result<(), InputError> {
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

    /// What stands in column `index` (from 0).
    pub(super) fn text(&self, index: usize) -> &str {
        self.cells.get(index).unwrap_or_default()
    }

    /// Where a cell is, for messages.
    pub(super) fn cell(&self, index: usize, name: &str) -> Cell {
        Cell {
            file: self.file.clone(),
            place: self.place,
            column: index + 1,
            name: name.to_owned(),
        }
    }
}
