//! The newest rows, which further frames may still complete.

use std::collections::VecDeque;

use estimator_core::Timestamp;

use crate::decode::report::Report;
use crate::decode::row::{Clock, ContactRow, Turn};
use crate::decode::{DecodeError, RowSink};

/// Number of rows kept: a second of four feet. The other frames of a sample follow the contact within
/// milliseconds; the first SYNC that a foot reports follows within a tenth of a second.
pub(super) const KEPT: usize = 4096;

/// The newest rows of a log, and the number of rows already handed on.
#[derive(Default)]
pub(crate) struct Pending {
    rows: VecDeque<ContactRow>,
    left: usize,
}

impl Pending {
    /// Index of the next row, from the start of the log.
    pub(super) fn next_index(&self) -> usize {
        self.left + self.rows.len()
    }

    /// Index of the oldest row kept.
    pub(super) const fn first_index(&self) -> usize {
        self.left
    }

    pub(super) fn push(&mut self, row: ContactRow) {
        self.rows.push_back(row);
    }

    /// The row with this index; `None` if it was handed on.
    pub(super) fn get_mut(&mut self, index: usize) -> Option<&mut ContactRow> {
        self.rows.get_mut(index.checked_sub(self.left)?)
    }

    /// Sets the common time of all kept rows of the foot of row `index` to its own clock plus `offset`, µs, if
    /// that row still uses the time of reception.
    pub(super) fn align(&mut self, index: usize, offset: i64) {
        let Some(row) = self.get_mut(index) else {
            return;
        };
        if matches!(row.common, Some((_, Clock::Sync))) {
            return;
        }
        let (interface, node, segment) = (row.interface.clone(), row.node, row.segment);
        for row in &mut self.rows {
            if row.node == node && row.segment == segment && row.interface == interface {
                let common = row.timestamp.as_micros().checked_add_signed(offset);
                if let Some(common) = common {
                    row.common = Some((Timestamp::from_micros(common), Clock::Sync));
                }
            }
        }
    }

    /// Makes the turn of the rows of a foot from row `from` on known: shifts their times by `shift_us`. `change`
    /// is applied to each.
    pub(super) fn place(
        &mut self,
        from: usize,
        newest: usize,
        shift_us: i64,
        change: impl Fn(&mut ContactRow),
    ) {
        let Some(last) = self.get_mut(newest) else {
            return;
        };
        let (interface, node) = (last.interface.clone(), last.node);
        for row in self.rows.iter_mut().skip(from.saturating_sub(self.left)) {
            if row.node == node && row.interface == interface {
                let micros = row.timestamp.as_micros().saturating_add_signed(shift_us);
                row.timestamp = Timestamp::from_micros(micros);
                row.turn = Turn::Known;
                change(row);
            }
        }
    }

    /// Hands on the oldest rows until `kept` are left.
    pub(super) fn settle(
        &mut self,
        kept: usize,
        report: &mut Report,
        sink: RowSink<'_>,
    ) -> Result<(), DecodeError> {
        while self.rows.len() > kept
            && let Some(row) = self.take(report)
        {
            sink(row).map_err(DecodeError::Rows)?;
        }
        Ok(())
    }

    /// Removes and returns the oldest row.
    pub(super) fn take(&mut self, report: &mut Report) -> Option<ContactRow> {
        let row = self.rows.pop_front()?;
        self.left += 1;
        report.count_row(&row);
        Some(row)
    }
}
