//! Converts the rows of a table with named columns into the rows of a recording.

use estimator_core::Gravity;

use super::cells::Cells;
use super::clock::{TimeColumn, unit_since_1970};
use super::columns::Columns;
use super::layout::{Blanks, Layout};
use super::names::{FoundTime, find_time, guess};
use super::options::TimeUnit;
use super::reader::Row;
use crate::input::error::InputError;
use crate::input::loaded::{Hints, OLDEST_LOAD_US, finite_load};
use crate::input::store::rows::{Refused, Rows};
use crate::input::store::stored::{About, Stored};

/// Title of a column `force`.
pub(super) const LOAD_TITLE: &str = "force (N)";

/// A table whose rows are being read.
pub(super) struct Intake<'a> {
    file: &'a str,
    hints: &'a Hints,
    layout: Layout,
    columns: Columns,
    rows: Rows,
    time: Option<TimeColumn>,
    /// Newest load and its time, µs, of a table in which the load has rows of its own.
    load: Option<(i64, f64)>,
    /// Rows with a load alone.
    load_rows: usize,
    /// Samples without a load.
    unloaded: usize,
    /// Notices about the table other than those about its columns.
    pub(super) notices: Vec<String>,
}

impl<'a> Intake<'a> {
    /// Starts a table whose header must have the columns of a recording.
    pub(super) fn new(file: &'a str, hints: &'a Hints, layout: Layout) -> Result<Self, InputError> {
        let columns = Columns::checked(&layout.header)?;
        Ok(Self {
            file,
            hints,
            layout,
            columns,
            rows: Rows::new(hints.table.times),
            time: None,
            load: None,
            load_rows: 0,
            unloaded: 0,
            notices: Vec::new(),
        })
    }

    /// Indices of all columns that are read.
    #[cfg(feature = "parquet")]
    pub(super) fn used(&self) -> Vec<usize> {
        self.columns.used().collect()
    }

    /// Number of cells in a row.
    pub(super) const fn width(&self) -> usize {
        self.columns.count
    }

    /// Processes a row, which is left out if all six axes are blank.
    pub(super) fn take(&mut self, row: &impl Cells) -> Result<(), InputError> {
        let blanks = self.layout.blanks;
        let is_foreign = self.columns.t.is_some() && blanks == Blanks::NotANumber;
        if is_foreign && self.columns.has_no_axis(row) {
            self.rows.repairs.blank_rows += 1;
            let has_time = self.columns.t.is_some_and(|index| !row.is_blank(index));
            if let Some(load) = self.columns.load(row)? {
                self.load_rows += 1;
                if has_time {
                    self.load = self.time_us(row)?.map(|time_us| (time_us, load));
                }
            }
            return Ok(());
        }
        let time_us = self.time_us(row)?;
        let mut sample = self.columns.sample(row, blanks, self.hints)?;
        if let (Some((newest_us, load)), Some(now_us)) = (&mut self.load, time_us) {
            if let Some(here) = self.columns.load(row)? {
                (*newest_us, *load) = (now_us, here);
            } else if *newest_us <= now_us && now_us.abs_diff(*newest_us) <= OLDEST_LOAD_US {
                sample.load = finite_load(*load);
            }
        }
        self.unloaded += usize::from(sample.load.is_none());
        let pushed = self.rows.push(time_us, sample);
        pushed.map_err(|refused| match (refused, &self.time) {
            (Refused::Time { previous_us }, Some(column)) => column.order_error(row, previous_us),
            (refused, _) => refused.into_error(self.file),
        })
    }

    /// Time of a row, µs; `None` in a table without times. Their unit is the given one, that of the column's name, or
    /// the one in which the first time is plausible.
    fn time_us(&mut self, row: &impl Cells) -> Result<Option<i64>, InputError> {
        let Some(index) = self.columns.t else {
            return Ok(None);
        };
        let column = self.time.get_or_insert_with(|| TimeColumn {
            index,
            nanoseconds: self.columns.nanoseconds,
            unit: self.hints.table.time_unit.or(self.layout.time_unit).unwrap_or_else(|| {
                let value = row.optional(index, "t").ok().flatten();
                unit_since_1970(value.unwrap_or_default())
            }),
        });
        column.micros(row).map(Some)
    }

    /// Returns the recording.
    pub(super) fn finish(self, name: String) -> Result<Stored, InputError> {
        let mut notices = self.notices;
        notices.extend(self.layout.notice);
        if self.layout.names_ignored {
            notices.extend(self.columns.notice(self.file));
        }
        if self.load_rows > 0 && self.unloaded > 0 {
            let samples = match self.unloaded {
                1 => "1 sample has".to_owned(),
                count => format!("{count} samples have"),
            };
            notices.push(format!(
                "{}: {samples} no load: none of the {} rows with a load alone stands before and is at most {} ms older",
                self.file,
                self.load_rows,
                OLDEST_LOAD_US / 1000
            ));
        }
        let about = About {
            name,
            gravity: Gravity::Included,
            load_title: LOAD_TITLE.to_owned(),
            notices,
            ..About::default()
        };
        let stored = self
            .rows
            .finish(self.file, about, self.hints)
            .map_err(|error| error.with_time_column(time_by_another_name(&self.layout.header)))?;
        let told = self.hints.table.time_unit.or(self.layout.time_unit);
        if let (Some(time), None) = (self.time, told) {
            check_guess(self.file, time.unit, stored.about.sample_rate)?;
        }
        Ok(stored)
    }
}

/// Plausible rates of sensors, Hz.
const PLAUSIBLE_RATES: std::ops::RangeInclusive<f64> = 10.0..=1.0e5;

/// Checks the rate of times taken for times since 1970 by their size: an error if the rate is plausible only in a
/// smaller unit. A clock that counts from the start of a computer may show similar values.
fn check_guess(file: &str, unit: TimeUnit, rate: f32) -> Result<(), InputError> {
    let is_plausible = |other: &TimeUnit| {
        let faster = other.per_second() / unit.per_second();
        PLAUSIBLE_RATES.contains(&(f64::from(rate) * faster))
    };
    if unit == TimeUnit::Seconds || is_plausible(&unit) {
        return Ok(());
    }
    let mut smaller = TimeUnit::ALL.into_iter();
    let meant = smaller.find(|other| other.per_second() > unit.per_second() && is_plausible(other));
    match meant {
        Some(meant) => Err(InputError::GuessedUnit { file: file.to_owned(), read_in: unit, meant }),
        None => Ok(()),
    }
}

/// Column of a table of ours that may be intended as `t`.
fn time_by_another_name(header: &Row) -> Option<String> {
    let names: Vec<String> = header.cells().map(str::to_owned).collect();
    match find_time(&names) {
        Some(FoundTime::Column(index, _)) => Some(names[index].clone()),
        Some(FoundTime::Stamp(..)) => None,
        None => guess("t", &names).map(|index| names[index].clone()),
    }
}
