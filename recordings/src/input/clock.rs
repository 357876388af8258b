//! The clock of a `csv`: the column `t`.

use estimator_core::Timestamp;

use super::error::InputError;
use super::iso8601::micros_since_1970;
use super::options::TimeUnit;
use super::table::Row;
use super::time::MAX_TIME_S;

/// The column that holds the time, and how it is read.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimeColumn {
    /// Its index.
    pub(super) index: usize,
    /// The index of the nanoseconds, where it holds whole seconds only.
    pub(super) nanoseconds: Option<usize>,
    pub(super) unit: TimeUnit,
}

impl TimeColumn {
    /// The time of a row, rounded to a microsecond.
    pub(super) fn micros(&self, row: &Row) -> Result<i64, InputError> {
        let text = row.text(self.index);
        if let Some(micros) = micros_since_1970(text) {
            return Ok(micros);
        }
        let value = row.number(self.index, "t")?;
        let per_second = self.unit.per_second();
        if !(-MAX_TIME_S * per_second..=MAX_TIME_S * per_second).contains(&value) {
            return Err(InputError::Time {
                cell: row.cell(self.index, "t"),
                text: text.to_owned(),
                unit: self.unit,
            });
        }
        let fraction = match self.nanoseconds {
            Some(index) => (row.number(index, "t.nanosec")? / 1.0e3).round() as i64,
            None => 0,
        };
        // Nanoseconds since 1970 have more digits than an f64.
        let whole = match (self.unit, text.parse::<i64>()) {
            (TimeUnit::Nanoseconds, Ok(nanoseconds)) => (nanoseconds + 500).div_euclid(1000),
            _ => (value * (1.0e6 / per_second)).round() as i64,
        };
        Ok(whole + fraction)
    }
}

/// The unit in which a number makes sense as a time since 1970: from 2001 to 2096 each unit has a
/// range of its own.
pub(super) fn unit_since_1970(value: f64) -> TimeUnit {
    let units = TimeUnit::ALL.into_iter().skip(1);
    let is_unit = |unit: &TimeUnit| (1.0e9..=MAX_TIME_S).contains(&(value / unit.per_second()));
    units.into_iter().find(is_unit).unwrap_or_default()
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
        column: &TimeColumn,
    ) -> Result<Timestamp, InputError> {
        match self.newest_us.replace(now_us) {
            Some(previous_us) if now_us <= previous_us => Err(InputError::TimeOrder {
                cell: row.cell(column.index, "t"),
                text: row.text(column.index).to_owned(),
                unit: column.unit,
                previous: previous_us as f64 / (1.0e6 / column.unit.per_second()),
            }),
            _ => Ok(Timestamp::from_micros(now_us.abs_diff(self.start_us))),
        }
    }
}
