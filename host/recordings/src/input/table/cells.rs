//! Cells of a row, independent of the table's storage, and those that hold a label or a validity.

use std::borrow::Cow;

use crate::samples::recording::Label;
use crate::samples::validity::of_name;
use estimator_core::Validity;

use super::reader::Row;
use crate::input::error::{Cell, InputError};
use crate::input::iso8601::micros_since_1970;

/// A row of a table; columns are indexed from 0.
pub(in crate::input) trait Cells {
    /// Returns whether a cell is blank.
    fn is_blank(&self, index: usize) -> bool;

    /// Content of a cell, as text.
    fn shown(&self, index: usize) -> Cow<'_, str>;

    /// Number in a cell; `None` if it is blank.
    fn optional(&self, index: usize, name: &str) -> Result<Option<f64>, InputError>;

    /// Number in a cell if it is an integer: nanoseconds have more digits than an f64.
    fn whole(&self, index: usize) -> Option<i64>;

    /// Time in a cell, µs, if the cell defines its unit.
    fn moment_us(&self, index: usize) -> Option<i64>;

    /// Position of a cell, for messages.
    fn cell(&self, index: usize, name: &str) -> Cell;

    /// Number in a cell that must not be blank.
    fn number(&self, index: usize, name: &str) -> Result<f64, InputError> {
        self.optional(index, name)?
            .ok_or_else(|| InputError::Blank { cell: self.cell(index, name) })
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
            text => number(text).map(Some).ok_or_else(|| InputError::NotANumber {
                cell: self.cell(index, name),
                text: text.to_owned(),
            }),
        }
    }

    fn whole(&self, index: usize) -> Option<i64> {
        self.text(index).parse().ok()
    }

    fn moment_us(&self, index: usize) -> Option<i64> {
        micros_since_1970(self.text(index))
    }

    fn cell(&self, index: usize, name: &str) -> Cell {
        Cell {
            file: self.file.clone(),
            place: self.place,
            column: index + 1,
            name: name.to_owned(),
        }
    }
}

/// Spellings of "not a number" by R, pandas, SQL, spreadsheets and the C library of Windows that Rust does not
/// parse.
const NOT_A_NUMBER: [&str; 10] =
    ["NA", "N/A", "#N/A", "<NA>", "null", "NULL", "None", "nan(ind)", "-nan(ind)", "-1.#IND"];

/// Parses a number.
pub(super) fn number(text: &str) -> Option<f64> {
    let parsed = text.parse().ok();
    parsed.or_else(|| NOT_A_NUMBER.contains(&text).then_some(f64::NAN))
}

/// Label in column `index`: 1 stable, 0 not.
pub(in crate::input) fn label(
    row: &impl Cells,
    index: usize,
    value: f64,
) -> Result<Label, InputError> {
    if value == 1.0 {
        Ok(Label::Stable)
    } else if value == 0.0 {
        Ok(Label::NotStable)
    } else {
        Err(InputError::Label {
            cell: row.cell(index, "label"),
            text: row.shown(index).into_owned(),
        })
    }
}

/// Label in column `index`, which may also be a word, as pandas and R write it, or unknown.
pub(super) fn optional_label(row: &impl Cells, index: usize) -> Result<Option<Label>, InputError> {
    let text = row.shown(index);
    if text.eq_ignore_ascii_case("true") {
        return Ok(Some(Label::Stable));
    }
    if text.eq_ignore_ascii_case("false") {
        return Ok(Some(Label::NotStable));
    }
    match row.optional(index, "label")? {
        Some(value) if !value.is_nan() => label(row, index, value).map(Some),
        _ => Ok(None),
    }
}

/// Validity in column `index`.
pub(super) fn validity(row: &impl Cells, index: usize) -> Result<Validity, InputError> {
    if row.is_blank(index) {
        return Ok(Validity::Valid);
    }
    let text = row.shown(index);
    of_name(&text).ok_or_else(|| InputError::Validity {
        cell: row.cell(index, "validity"),
        text: text.into_owned(),
    })
}
