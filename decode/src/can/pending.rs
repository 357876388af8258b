//! The newest rows: those that a frame may still complete.

use std::collections::VecDeque;

use estimator_core::Timestamp;

use crate::report::Report;
use crate::row::{Clock, Row};
use crate::{DecodeError, Sink};

/// The number of rows that are kept: a second of four feet. Frames beside a contact follow it within
/// milliseconds, and the first SYNC that a foot reports within a tenth of a second.
const KEPT: usize = 4096;

/// The newest rows of a log, with the number of those that have left.
#[derive(Default)]
pub(crate) struct Pending {
    rows: VecDeque<Row>,
    left: usize,
}

impl Pending {
    /// The index that the next row will have, from the start of the log.
    pub(super) fn next_index(&self) -> usize {
        self.left + self.rows.len()
    }

    /// The index of the oldest row that is kept.
    pub(super) const fn first_index(&self) -> usize {
        self.left
    }

    pub(super) fn push(&mut self, row: Row) {
        self.rows.push_back(row);
    }

    /// The row with this index; `None` where it has left.
    pub(super) fn get_mut(&mut self, index: usize) -> Option<&mut Row> {
        self.rows.get_mut(index.checked_sub(self.left)?)
    }

    /// Puts the rows of the foot of this one that are by time of reception onto its clock, with
    /// what is to be added to it, µs.
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

    /// Hands on what is older than the rows that are kept.
    pub(super) fn settle(
        &mut self,
        report: &mut Report,
        sink: Sink<'_>,
    ) -> Result<(), DecodeError> {
        while self.rows.len() > KEPT {
            self.hand_on(report, sink)?;
        }
        Ok(())
    }

    /// Hands on all of them.
    pub(super) fn settle_all(
        &mut self,
        report: &mut Report,
        sink: Sink<'_>,
    ) -> Result<(), DecodeError> {
        while !self.rows.is_empty() {
            self.hand_on(report, sink)?;
        }
        Ok(())
    }

    fn hand_on(&mut self, report: &mut Report, sink: Sink<'_>) -> Result<(), DecodeError> {
        self.take(report)
            .map_or(Ok(()), |row| sink(row).map_err(DecodeError::Rows))
    }

    /// The oldest row, which leaves.
    pub(super) fn take(&mut self, report: &mut Report) -> Option<Row> {
        let row = self.rows.pop_front()?;
        self.left += 1;
        report.count_row(&row);
        Some(row)
    }
}
