//! The clock of a `csv`: the column `t`.

use estimator_core::Timestamp;

use super::error::InputError;
use super::table::Row;
use super::time::MAX_TIME_S;

/// The time in column `index`, rounded to a microsecond.
pub(super) fn time_us(row: &Row, index: usize) -> Result<i64, InputError> {
    let value = row.number(index, "t")?;
    if (-MAX_TIME_S..=MAX_TIME_S).contains(&value) {
        Ok((value * 1.0e6).round() as i64)
    } else {
        Err(InputError::Time {
            cell: row.cell(index, "t"),
            text: row.text(index).to_owned(),
        })
    }
}

/// The file's clock, which may start anywhere but runs forward.
pub(super) struct Clock {
    /// The time of the first row, µs.
    pub(super) start_us: i64,
    newest_us: Option<i64>,
}

impl Clock {
    pub(super) const fn starting_at(start_us: i64) -> Self {
        Self {
            start_us,
            newest_us: None,
        }
    }

    /// The time of a row since the first one.
    pub(super) fn advance_to(
        &mut self,
        now_us: i64,
        row: &Row,
        index: usize,
    ) -> Result<Timestamp, InputError> {
        match self.newest_us.replace(now_us) {
            Some(previous_us) if now_us <= previous_us => Err(InputError::TimeOrder {
                cell: row.cell(index, "t"),
                text: row.text(index).to_owned(),
                previous: previous_us as f64 / 1.0e6,
            }),
            _ => Ok(Timestamp::from_micros(now_us.abs_diff(self.start_us))),
        }
    }
}
