//! The rows of a table with names for its columns become those of a recording.

use estimator_core::Gravity;

use super::cells::Cells;
use super::clock::{TimeColumn, unit_since_1970};
use super::error::InputError;
use super::header::Columns;
use super::layout::{Blanks, Layout};
use super::loaded::Hints;
use super::names::{FoundTime, find_time, guess};
use super::options::TimeUnit;
use super::rows::{Refused, Rows, Source};
use super::stored::Stored;
use super::table::Row;

/// The title of a column `force`.
pub(super) const LOAD_TITLE: &str = "force (N)";

/// What became of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Taken {
    /// It is a sample.
    Sample,
    /// All six axes are blank in it: it is left out.
    Nothing,
}

/// A table whose rows are taken in.
pub(super) struct Intake<'a> {
    file: &'a str,
    hints: &'a Hints,
    layout: Layout,
    columns: Columns,
    rows: Rows,
    time: Option<TimeColumn>,
    /// What is to be said about the table beside its columns.
    pub(super) notices: Vec<String>,
}

impl<'a> Intake<'a> {
    /// A table with the `columns` of `layout`.
    pub(super) fn new(file: &'a str, hints: &'a Hints, layout: Layout, columns: Columns) -> Self {
        Self {
            file,
            hints,
            layout,
            columns,
            rows: Rows::new(hints.table.times),
            time: None,
            notices: Vec::new(),
        }
    }

    /// How many cells a row has.
    pub(super) const fn width(&self) -> usize {
        self.columns.count
    }

    /// Takes in a row.
    pub(super) fn take(&mut self, row: &impl Cells) -> Result<Taken, InputError> {
        let columns = &self.columns;
        let blanks = self.layout.blanks;
        if columns.t.is_some() && blanks == Blanks::NotANumber && columns.has_no_axis(row) {
            self.rows.repairs.blank_rows += 1;
            return Ok(Taken::Nothing);
        }
        let time_us = match columns.t {
            None => None,
            Some(index) => {
                let column = self.time.get_or_insert_with(|| TimeColumn {
                    index,
                    nanoseconds: columns.nanoseconds,
                    unit: time_unit(&self.layout, self.hints, row, index),
                });
                Some(column.micros(row)?)
            }
        };
        let sample = columns.sample(row, blanks, self.hints)?;
        let pushed = self.rows.push(time_us, sample);
        pushed.map_err(|refused| match (refused, &self.time) {
            (Refused::Time(not_after), Some(column)) => column.order_error(row, &not_after),
            (refused, _) => refused.into_error(self.file),
        })?;
        Ok(Taken::Sample)
    }

    /// Which samples are kept, where some may be left out.
    pub(super) fn kept(&self) -> Option<Vec<bool>> {
        self.rows.kept()
    }

    /// The recording, with the samples that [`Self::kept`] has chosen.
    pub(super) fn finish(
        self,
        name: String,
        kept: Option<Vec<bool>>,
    ) -> Result<Stored, InputError> {
        let mut notices = self.notices;
        notices.extend(self.layout.notice);
        if self.layout.names_ignored {
            notices.extend(self.columns.notice(self.file));
        }
        let source = Source {
            file: self.file,
            name,
            foot: None,
            gravity: Gravity::Included,
            load_title: LOAD_TITLE.to_owned(),
            notices,
        };
        let stored = self
            .rows
            .finish(source, self.hints, kept)
            .map_err(|error| error.with_time_column(time_by_another_name(&self.layout.header)))?;
        let told = self.hints.table.time_unit.or(self.layout.time_unit);
        if let (Some(time), None) = (self.time, told) {
            check_guess(self.file, time.unit, stored.about.sample_rate)?;
        }
        Ok(stored)
    }
}

/// The unit of the times: the one that is given, or that of the column's name, or the one in which
/// the first time makes sense.
fn time_unit(layout: &Layout, hints: &Hints, first: &impl Cells, index: usize) -> TimeUnit {
    let by_size = || {
        let value = first.optional(index, "t").ok().flatten();
        unit_since_1970(value.unwrap_or_default())
    };
    hints
        .table
        .time_unit
        .or(layout.time_unit)
        .unwrap_or_else(by_size)
}

/// Rates that sensors have, Hz.
const PLAUSIBLE_RATES: std::ops::RangeInclusive<f64> = 10.0..=1.0e5;

/// Makes sure that times that were taken for those since 1970 by their size make a plausible rate, where
/// they do in a smaller unit: a clock that counts from the start of a computer may show as much.
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
        Some(meant) => Err(InputError::GuessedUnit {
            file: file.to_owned(),
            read_in: unit,
            meant,
        }),
        None => Ok(()),
    }
}

/// The column of a table of ours that may be meant by `t`.
fn time_by_another_name(header: &Row) -> Option<String> {
    let names: Vec<String> = header.cells().map(str::to_owned).collect();
    match find_time(&names) {
        Some(FoundTime::Column(index, _)) => Some(names[index].clone()),
        Some(FoundTime::Stamp(..)) => None,
        None => guess("t", &names).map(|index| names[index].clone()),
    }
}
