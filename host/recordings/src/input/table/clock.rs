//! The clock of a table: the column `t`.

use super::cells::Cells;
use super::options::TimeUnit;
use crate::input::error::InputError;
use crate::input::time::MAX_TIME_S;

/// Largest distance from 1970 of times with a known unit, µs; it includes the year 9999.
const LATEST_US: u64 = 1 << 58;

/// Column of the time and its interpretation.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimeColumn {
    /// Index of the column.
    pub(super) index: usize,
    /// Index of the nanoseconds, if the column holds whole seconds only.
    pub(super) nanoseconds: Option<usize>,
    pub(super) unit: TimeUnit,
}

impl TimeColumn {
    /// Time of a row, rounded to 1 µs.
    pub(super) fn micros(&self, row: &impl Cells) -> Result<i64, InputError> {
        let no_time = |unit| InputError::Time {
            cell: row.cell(self.index, "t"),
            text: row.shown(self.index).into_owned(),
            unit,
        };
        if let Some(micros) = row.moment_us(self.index) {
            return match micros.unsigned_abs() {
                ..=LATEST_US => Ok(micros),
                _ => Err(no_time(TimeUnit::Microseconds)),
            };
        }
        let value = row.number(self.index, "t")?;
        let per_second = self.unit.per_second();
        if !(-MAX_TIME_S * per_second..=MAX_TIME_S * per_second).contains(&value) {
            return Err(no_time(self.unit));
        }
        let fraction = match self.nanoseconds {
            Some(index) => (row.number(index, "t.nanosec")? / 1.0e3).round() as i64,
            None => 0,
        };
        // Nanoseconds since 1970 have more digits than an f64.
        let whole = match (self.unit, row.whole(self.index)) {
            (TimeUnit::Nanoseconds, Some(nanoseconds)) => (nanoseconds + 500).div_euclid(1000),
            _ => (value * (1.0e6 / per_second)).round() as i64,
        };
        Ok(whole.saturating_add(fraction))
    }

    /// Error about a time that is not after that of the previous row.
    pub(super) fn order_error(&self, row: &impl Cells, previous_us: i64) -> InputError {
        InputError::TimeOrder {
            cell: row.cell(self.index, "t"),
            text: row.shown(self.index).into_owned(),
            unit: self.unit,
            previous: previous_us as f64 / (1.0e6 / self.unit.per_second()),
        }
    }
}

/// Unit in which a number is a plausible time since 1970: from 2001 to 2096 the ranges of the units do not
/// overlap.
pub(super) fn unit_since_1970(value: f64) -> TimeUnit {
    let units = TimeUnit::ALL.into_iter().skip(1);
    let is_unit = |unit: &TimeUnit| (1.0e9..=MAX_TIME_S).contains(&(value / unit.per_second()));
    units.into_iter().find(is_unit).unwrap_or_default()
}
