//! Cells that hold a label or a validity.

use estimator_core::Validity;

use super::error::InputError;
use super::table::Row;
use crate::recording::Label;
use crate::validity::VALIDITIES;

/// A label in column `index`: 1 is stable, 0 is not.
pub(super) fn label(row: &Row, index: usize, value: f64) -> Result<Label, InputError> {
    if value == 1.0 {
        Ok(Label::Stable)
    } else if value == 0.0 {
        Ok(Label::NotStable)
    } else {
        Err(InputError::Label {
            cell: row.cell(index, "label"),
            text: row.text(index).to_owned(),
        })
    }
}

/// The validity in column `index`.
pub(super) fn validity(row: &Row, index: usize) -> Result<Validity, InputError> {
    let text = row.text(index);
    if text.is_empty() {
        return Ok(Validity::Valid);
    }
    VALIDITIES
        .into_iter()
        .find(|(name, _)| *name == text)
        .map(|(_, validity)| validity)
        .ok_or_else(|| InputError::Validity {
            cell: row.cell(index, "validity"),
            text: text.to_owned(),
        })
}
