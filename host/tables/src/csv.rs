//! Tables with a header: `t,ax,ay,az,wx,wy,wz,force,label,validity` in any order, of which the six
//! axes are required.
//!
//! | column | unit | blank cell |
//! |---|---|---|
//! | `t` | s, from any start, advancing by at least 1 µs per row | error |
//! | `ax`, `ay`, `az` | m/s², gravity included unless declared otherwise | error |
//! | `wx`, `wy`, `wz` | rad/s | error |
//! | `force` | N | load unknown |
//! | `label` | 1 stable, 0 not stable | truth unknown |
//! | `foot` | name of the foot, by which the table is split | one foot |
//! | `validity` | a name of [`VALIDITIES`](samples::VALIDITIES): validity at the source | valid |
//!
//! Other columns are ignored, and named in a notice. The sample rate is the roundest number of Hz compatible with
//! the times between rows, gaps excluded, or the given rate; if both are known they must agree within 10 %.
//!
//! Tables of other origin are read by their names for these columns, listed in `names`, or by a
//! [`Mapping`](options::Mapping). In these tables a blank cell of an axis is NaN. A row without any axis belongs
//! to another signal, and is left out and counted. Times may be dates with times as in ISO 8601.

use estimator_core::parameter::SAMPLE_RATE;
use estimator_core::{Axis, Gravity, Timestamp, Validity};

use crate::feet::{Candidate, FootColumn, LOOKED_AT, name_in};
use crate::header::{Blanks, Layout, NANOSECONDS, OTHER_SEPARATORS, shortened, suggestion};
use crate::reader::{Cells, Row, Table};
use options::hint::{Hint, Notice};
use options::names::{FoundTime, find_time, guess};
use options::{InputOptions, TimeUnit, is_ours};
use samples::{Label, RecordedSample, finite_load, imu_sample, validity_of_name};
use stored::error::{InputError, MAX_TIME_S, Problem};
use stored::rate::{PLAUSIBLE_RATES, unit_of_step};
use stored::{About, OLDEST_LOAD_US, Refused, Rows, Stored, StreamedSample};

/// Reads a table with a header: one recording, or one for each foot that a column names.
///
/// # Errors
/// The first error found, with file, line and column.
pub fn read(mut table: Table, input_options: &InputOptions) -> Result<Vec<Stored>, InputError> {
    let Some(layout) = Layout::of(&mut table, &input_options.table)? else {
        return Err(InputError::empty(&table.file));
    };
    let file = table.file.clone();
    let mut intake = Intake::new(&file, input_options, layout)?;
    intake.notices.extend(table.preamble_notice());
    intake.look_at(table.peek_rows(LOOKED_AT));
    take_rows(&mut table, &mut intake, &mut |_| Ok(()))?;
    intake.finish(&table.recording_name)
}

/// Passes each sample of a table on as soon as its row is complete; returns the notices about the table.
///
/// # Errors
/// The first error found, with file, line and column, or the error of `each`.
pub fn stream(
    mut table: Table,
    input_options: &InputOptions,
    each: &mut dyn FnMut(StreamedSample) -> Result<(), InputError>,
) -> Result<Vec<Notice>, InputError> {
    let Some(layout) = Layout::of(&mut table, &input_options.table)? else {
        return Err(InputError::empty(&table.file));
    };
    let file = table.file.clone();
    let mut intake = Intake::new(&file, input_options, layout)?;
    intake.is_stream = true;
    intake.notices.extend(table.preamble_notice());
    let mut was_smoothed = false;
    take_rows(&mut table, &mut intake, &mut |intake| {
        intake.expect_one_foot()?;
        let Some(rows) = intake.feet.first_mut().map(|foot| &mut foot.rows) else {
            return Ok(());
        };
        was_smoothed |= rows.is_smoothing();
        rows.take_newest().map_or(Ok(()), &mut *each)
    })?;
    let loads = intake.feet.first().and_then(|foot| foot.load_notice(&file));
    let notices = intake.all_notices().into_iter().chain(loads);
    let mut notices: Vec<Notice> = notices.map(Notice::from).collect();
    if was_smoothed {
        let text = format!("{file}: times jitter around a steady rate, and are smoothed");
        notices.push(Notice::with_hint(text, Hint::KeepTimes));
    }
    Ok(notices)
}

/// Processes all rows of a table, and calls `after_each` after each.
fn take_rows(
    table: &mut Table,
    intake: &mut Intake<'_>,
    after_each: &mut dyn FnMut(&mut Intake<'_>) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let file = table.file.clone();
    loop {
        let row = match table.next_row() {
            Ok(Some(row)) => row,
            Ok(None) => break,
            Err(error) if error.ended_early() => {
                intake.notices.push(format!(
                    "{file}: the compressed data ends early; what comes before is read"
                ));
                break;
            }
            Err(error) => return Err(error),
        };
        let taken = row.expect_columns(intake.width()).and_then(|()| intake.take(&row));
        match taken {
            Ok(()) => after_each(intake)?,
            Err(error) if error.may_be_a_cut(row.len()) && table.is_cut_off() => {
                let place = row.place;
                intake
                    .notices
                    .push(format!("{file}{place}: the last line is cut off, and left out"));
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Title of a column `force`.
const LOAD_TITLE: &str = "force (N)";

/// A table whose rows are being read.
pub struct Intake<'a> {
    file: &'a str,
    input_options: &'a InputOptions,
    layout: Layout,
    columns: Columns,
    time: Option<TimeColumn>,
    foot_column: FootColumn,
    /// Rows of each foot, at least one foot.
    feet: Vec<FootRows>,
    /// Whether each row is taken before the next.
    is_stream: bool,
    /// Notices about the table, except notices about its columns.
    pub notices: Vec<String>,
}

/// Rows of a foot.
struct FootRows {
    /// Name of the foot; empty if the table has one foot.
    name: String,
    rows: Rows,
    /// Newest load and its time, µs, for a table in which the load has its own rows.
    load: Option<(i64, f64)>,
    /// Rows with a load alone.
    load_rows: usize,
    /// Samples, and samples without a load.
    samples: usize,
    unloaded: usize,
}

impl FootRows {
    fn new(name: String, input_options: &InputOptions, is_stream: bool) -> Self {
        let times = input_options.table.times;
        let rows = if is_stream { Rows::of_stream(times) } else { Rows::new(times) };
        Self { name, rows, load: None, load_rows: 0, samples: 0, unloaded: 0 }
    }

    /// Returns a sentence on samples without a load, if other samples have loads.
    fn load_notice(&self, place: &str) -> Option<String> {
        let Self { load_rows, unloaded, .. } = self;
        let samples = match unloaded {
            1 => "1 sample has".to_owned(),
            count => format!("{count} samples have"),
        };
        (*load_rows > 0 && *unloaded > 0).then(|| {
            format!(
                "{place}: {samples} no load: none of the {load_rows} rows with a load alone stands before and is at most {} ms older",
                OLDEST_LOAD_US / 1000
            )
        })
    }
}

impl<'a> Intake<'a> {
    /// Starts a table whose header must have the columns of a recording.
    pub fn new(
        file: &'a str,
        input_options: &'a InputOptions,
        layout: Layout,
    ) -> Result<Self, InputError> {
        let columns = Columns::checked(&layout.header)?;
        Ok(Self {
            file,
            input_options,
            foot_column: FootColumn::of(&layout.header, input_options),
            layout,
            columns,
            time: None,
            feet: Vec::new(),
            is_stream: false,
            notices: Vec::new(),
        })
    }

    /// Looks at the first rows, before they are processed, for a column that names their feet.
    pub fn look_at<C: Cells>(&mut self, rows: impl Iterator<Item = C>) {
        // Rows of other signals have names of their own.
        let columns = &self.columns;
        self.foot_column.look_at(rows.filter(|row| !columns.has_no_axis(row)));
    }

    /// Restricts the columns that may name feet to those that can be read.
    #[cfg(feature = "parquet")]
    pub fn retain_foot_columns(&mut self, is_read: impl Fn(usize) -> bool) {
        self.foot_column.retain(is_read);
    }

    /// Indices of all columns that are read.
    #[cfg(feature = "parquet")]
    pub fn used(&self) -> Vec<usize> {
        let mut used: Vec<usize> = self.columns.used().chain(self.foot_column.indices()).collect();
        used.sort_unstable();
        used.dedup();
        used
    }

    /// Number of cells in a row.
    pub const fn width(&self) -> usize {
        self.columns.count
    }

    /// Processes a row, which is left out if all six axes are blank.
    pub fn take(&mut self, row: &impl Cells) -> Result<(), InputError> {
        // A sheet saved as a table may end in rows of separators alone.
        if self.columns.t.is_some() && self.columns.is_blank(row) {
            return Ok(());
        }
        let blanks = self.layout.blanks;
        let is_foreign = self.columns.t.is_some() && blanks == Blanks::NotANumber;
        let foot = self.foot(row)?;
        if is_foreign && self.columns.has_no_axis(row) {
            self.feet[foot].rows.repairs.blank_rows += 1;
            let has_time = self.columns.t.is_some_and(|index| !row.is_blank(index));
            if let Some(load) = self.columns.load(row, self.input_options)? {
                self.feet[foot].load_rows += 1;
                if has_time {
                    let time_us = self.time_us(row, foot)?;
                    self.feet[foot].load = time_us.map(|time_us| (time_us, load));
                }
            }
            return Ok(());
        }
        let time_us = self.time_us(row, foot)?;
        let mut sample = self.columns.sample(row, blanks, self.input_options)?;
        let foot = &mut self.feet[foot];
        if let (Some((newest_us, load)), Some(now_us)) = (&mut foot.load, time_us) {
            if let Some(here) = self.columns.load(row, self.input_options)? {
                (*newest_us, *load) = (now_us, here);
            } else if *newest_us <= now_us && now_us.abs_diff(*newest_us) <= OLDEST_LOAD_US {
                sample.load = finite_load(*load);
            }
        }
        foot.samples += 1;
        foot.unloaded += usize::from(sample.load.is_none());
        let pushed = foot.rows.push(time_us, sample);
        pushed.map_err(|refused| match (refused, &self.time) {
            (Refused::Time { previous_us, .. }, Some(column)) => {
                column.order_error(row, previous_us)
            }
            (refused, _) => refused.into_error(self.file),
        })
    }

    /// Index of the foot of a row.
    fn foot(&mut self, row: &impl Cells) -> Result<usize, InputError> {
        let name = match &self.foot_column {
            FootColumn::None => String::new(),
            FootColumn::Known(index) => name_in(row, *index),
            FootColumn::Possible(_) => self.after_names(row)?,
        };
        if let Some(foot) = self.feet.iter().position(|foot| foot.name == name) {
            return Ok(foot);
        }
        self.feet.push(FootRows::new(name, self.input_options, self.is_stream));
        Ok(self.feet.len() - 1)
    }

    /// Decides whether one of several columns names feet, once its name has changed. It names feet if the time has gone
    /// back. Returns the name of the foot.
    fn after_names(&mut self, row: &impl Cells) -> Result<String, InputError> {
        let before = std::mem::replace(&mut self.foot_column, FootColumn::None);
        let FootColumn::Possible(candidates) = before else { return Ok(String::new()) };
        let is_same = |candidate: &Candidate| {
            let name = candidate.name.as_ref();
            name.is_none_or(|name| *name == name_in(row, candidate.index))
        };
        let (mut left, changed): (Vec<_>, Vec<_>) = candidates.into_iter().partition(is_same);
        if let Some(Candidate { index, name: Some(name), .. }) = changed.first() {
            let newest_us = self.feet.first().and_then(|foot| foot.rows.newest_us());
            let time_us = self.time_us(row, 0)?;
            let goes_back = time_us.zip(newest_us).is_some_and(|(now, newest)| now <= newest);
            if let Some(first) = self.feet.first_mut()
                && goes_back
            {
                first.name.clone_from(name);
                self.foot_column = FootColumn::Known(*index);
                return Ok(name_in(row, *index));
            }
        }
        if self.is_stream {
            left.extend(changed);
            if let Some(feet) = self.feet_in_stream(row, &mut left) {
                return Err(InputError::of_file(self.file, Problem::SeveralFeet(feet)));
            }
        }
        for candidate in &mut left {
            candidate.name.get_or_insert_with(|| name_in(row, candidate.index));
        }
        self.foot_column = FootColumn::possible(left);
        Ok(String::new())
    }

    /// Adds the names in a row of a stream to columns that may name feet. Returns the feet, if their rows alternate.
    fn feet_in_stream(
        &self,
        row: &impl Cells,
        candidates: &mut [Candidate],
    ) -> Option<Vec<String>> {
        if self.columns.has_no_axis(row) {
            return None;
        }
        let mut columns = candidates.iter_mut();
        columns.find_map(|candidate| candidate.feet_in_stream(name_in(row, candidate.index)))
    }

    /// Time of a row, µs; `None` in a table without times. The unit is given by an option or by the column's name.
    /// Otherwise it is the unit in which the first time is plausible.
    fn time_us(&mut self, row: &impl Cells, foot: usize) -> Result<Option<i64>, InputError> {
        let Some(index) = self.columns.t else {
            return Ok(None);
        };
        let known_unit = self.input_options.table.time_unit.or(self.layout.time_unit);
        let value = || row.optional(index, "t").ok().flatten().unwrap_or_default();
        let column = self.time.get_or_insert_with(|| TimeColumn {
            index,
            nanoseconds: self.columns.nanoseconds,
            unit: known_unit.unwrap_or_else(|| unit_since_1970(value())),
        });
        let micros = column.micros(row).map_err(|mut error| {
            if let (Problem::Time { meant, .. }, None) = (&mut error.problem, known_unit) {
                let step_us = self.feet.get(foot).and_then(|foot| foot.rows.usual_step_us());
                *meant = unit_of_long_time(value(), step_us);
            }
            error
        });
        micros.map(Some)
    }

    /// Checks that a stream has the rows of one foot, because the rows of several feet would be mixed.
    fn expect_one_foot(&self) -> Result<(), InputError> {
        if self.feet.len() < 2 {
            return Ok(());
        }
        let feet = self.feet.iter().map(|foot| foot.name.clone()).collect();
        Err(InputError::of_file(self.file, Problem::SeveralFeet(feet)))
    }

    /// Index of the column that names feet, if it does.
    const fn known_foot_column(&self) -> Option<usize> {
        match self.foot_column {
            FootColumn::Known(index) => Some(index),
            FootColumn::None | FootColumn::Possible(_) => None,
        }
    }

    /// Takes the notices about the table and its columns.
    fn all_notices(&mut self) -> Vec<String> {
        let mut notices = std::mem::take(&mut self.notices);
        notices.extend(self.layout.notice.take());
        if self.layout.names_ignored {
            notices.extend(self.columns.notice(self.file, self.known_foot_column()));
        }
        if let Some(index) = self.known_foot_column() {
            let column = self.layout.header.cells().nth(index).unwrap_or_default();
            let names = |has_samples: bool| {
                let feet = self.feet.iter().filter(|foot| (foot.samples > 0) == has_samples);
                feet.map(|foot| foot.name.as_str()).collect::<Vec<_>>().join(", ")
            };
            let (feet, others) = (names(true), names(false));
            notices.push(format!("{}: split into feet by column {column}: {feet}", self.file));
            if !others.is_empty() {
                notices.push(format!(
                    "{}: rows of {others} have no axes, and are left out",
                    self.file
                ));
            }
        }
        notices
    }

    /// Returns the recording of each foot.
    pub fn finish(mut self, name: &str) -> Result<Vec<Stored>, InputError> {
        let known = self.known_foot_column();
        if self.feet.is_empty() {
            return Err(InputError::empty(self.file));
        }
        let notices = self.all_notices();
        let mut notices: Vec<Notice> = notices.into_iter().map(Notice::from).collect();
        let mut recordings = Vec::new();
        let has_samples = self.feet.iter().any(|foot| foot.samples > 0);
        // Rows of other signals are of no foot.
        self.feet.retain(|foot| foot.samples > 0 || !has_samples);
        for foot in std::mem::take(&mut self.feet) {
            let foot_name = known.map(|_| foot.name.clone());
            let place = match &foot_name {
                Some(foot) => format!("{}, foot {foot}", self.file),
                None => self.file.to_owned(),
            };
            let about = About {
                name: name.to_owned(),
                foot: foot_name,
                gravity: Gravity::Included,
                load_title: self.layout.load_name.clone().unwrap_or_else(|| LOAD_TITLE.to_owned()),
                notices: std::mem::take(&mut notices),
                ..About::default()
            };
            recordings.push(self.finish_foot(foot, about, &place)?);
        }
        Ok(recordings)
    }

    fn finish_foot(
        &self,
        foot: FootRows,
        mut about: About,
        place: &str,
    ) -> Result<Stored, InputError> {
        about.notices.extend(foot.load_notice(place).map(Notice::from));
        let mut stored = foot
            .rows
            .finish(place, about, self.input_options)
            .map_err(|error| error.with_time_column(time_by_another_name(&self.layout.header)))?;
        let table = &self.input_options.table;
        let rate = stored.about.sample_rate;
        match (self.time, table.time_unit, self.layout.time_unit) {
            (Some(_), Some(unit), _) => {
                let mut mapped = table.mapping.columns();
                let name = mapped.find(|(ours, _)| *ours == "t").map_or("t", |(_, theirs)| theirs);
                stored.about.notices.extend(check_unit(place, name, unit, rate)?);
            }
            (Some(time), None, None) => check_guess(place, time.unit, rate)?,
            _ => {}
        }
        Ok(stored)
    }
}

/// Position of each known column.
#[derive(Default)]
struct Columns {
    /// Number of cells in a row.
    count: usize,
    /// Index of the column `t`.
    t: Option<usize>,
    /// Index of the nanoseconds of a stamp whose seconds are `t`.
    nanoseconds: Option<usize>,
    axes: [Option<usize>; 6],
    force: Option<usize>,
    label: Option<usize>,
    validity: Option<usize>,
    /// Indices and names that are unknown in a recording.
    ignored: Vec<(usize, String)>,
    duplicate: Option<(usize, String)>,
}

impl Columns {
    /// Parses a header. No column is known if the header holds numbers.
    fn from_header(header: &Row) -> Self {
        let mut columns = Self::default();
        if header.cells().any(|name| name.parse::<f64>().is_ok()) {
            return columns;
        }
        columns.count = header.len();
        for (index, name) in header.cells().enumerate() {
            let index_of = match name {
                "t" => &mut columns.t,
                NANOSECONDS => &mut columns.nanoseconds,
                "force" => &mut columns.force,
                "label" => &mut columns.label,
                "validity" => &mut columns.validity,
                _ => match Axis::ALL.iter().position(|axis| axis.name() == name) {
                    Some(axis) => &mut columns.axes[axis],
                    None => {
                        columns.ignored.push((index, name.to_owned()));
                        continue;
                    }
                },
            };
            if index_of.replace(index).is_some() {
                columns.duplicate = Some((index, name.to_owned()));
            }
        }
        columns
    }

    /// Parses a header that must have all required columns.
    fn checked(header: &Row) -> Result<Self, InputError> {
        let columns = Self::from_header(header);
        if let Some((index, name)) = &columns.duplicate {
            return Err(header.error(*index, name, Problem::DuplicateColumn));
        }
        let axes = Axis::ALL.into_iter().zip(columns.axes);
        let missing = axes.filter(|(_, index)| index.is_none());
        let missing: Vec<_> = missing.map(|(axis, _)| axis.name()).collect();
        if missing.is_empty() {
            return Ok(columns);
        }
        // If lines end in a carriage return alone, the whole file is one row. Those at the ends of the row were trimmed.
        let is_one_row = header.cells().any(|name| name.contains('\r'));
        let line_ends = is_one_row.then_some(Hint::LineEnds);
        let hint = line_ends.or_else(|| columns.slip());
        let hint = hint.or_else(|| suggestion(header, &missing));
        let problem = Problem::MissingColumns { columns: missing.join(", "), hint };
        Err(InputError::of_row(&header.file, header.place, problem))
    }

    /// Indices of all columns that are read.
    #[cfg(feature = "parquet")]
    fn used(&self) -> impl Iterator<Item = usize> {
        let others = [self.t, self.nanoseconds, self.force, self.label, self.validity];
        self.axes.into_iter().chain(others).flatten()
    }

    /// Reason why known names are not recognised, if any.
    fn slip(&self) -> Option<Hint> {
        let known = |name: &str| is_ours(&name.to_lowercase());
        self.ignored.iter().find_map(|(_, name)| {
            let separator = name.chars().find(|c| OTHER_SEPARATORS.contains(c));
            match separator {
                // If only one part is a known name, the separator belongs to something else, such as a unit.
                Some(found) => {
                    let names = name.split(found).map(str::trim).filter(|name| known(name));
                    (names.count() > 1).then_some(Hint::Separator(found))
                }
                None => known(name).then_some(Hint::LowerCase),
            }
        })
    }

    /// Sentence that lists the ignored columns, except the one with this index.
    fn notice(&self, file: &str, read: Option<usize>) -> Option<String> {
        let ignored = self.ignored.iter().filter(|(index, _)| Some(*index) != read);
        let ignored: Vec<String> = ignored.map(|(_, name)| name.clone()).collect();
        let names = shortened(&ignored);
        (!ignored.is_empty()).then(|| format!("{file}: ignored columns: {names}"))
    }

    /// Returns whether a row has no value in any column.
    fn is_blank(&self, row: &impl Cells) -> bool {
        (0..self.count).all(|index| row.is_blank(index))
    }

    /// Returns whether a row has no value in any axis.
    fn has_no_axis(&self, row: &impl Cells) -> bool {
        let mut axes = self.axes.iter().flatten();
        axes.all(|index| row.is_blank(*index))
    }

    /// Load of a row times its factor, which may be NaN; `None` if it is blank.
    fn load(
        &self,
        row: &impl Cells,
        input_options: &InputOptions,
    ) -> Result<Option<f64>, InputError> {
        let load = self.force.map_or(Ok(None), |index| row.optional(index, "force"))?;
        Ok(load.map(|load| input_options.table.scale.load * load))
    }

    /// Returns the sample of a row, whose time is set later.
    fn sample(
        &self,
        row: &impl Cells,
        blanks: Blanks,
        input_options: &InputOptions,
    ) -> Result<RecordedSample, InputError> {
        let mut axes = [0.0; 6];
        for ((value, index), axis) in axes.iter_mut().zip(self.axes).zip(Axis::ALL) {
            if let Some(index) = index {
                *value = match blanks {
                    Blanks::Refused => row.number(index, axis.name())?,
                    Blanks::NotANumber => row.optional(index, axis.name())?.unwrap_or(f64::NAN),
                };
            }
        }
        let axes = input_options.table.to_si(axes);
        let label = self.label.map(|index| optional_label(row, index));
        let label = label.transpose()?.flatten();
        let validity = self.validity.map(|index| validity(row, index));
        let validity = validity.transpose()?.unwrap_or(Validity::Valid);
        Ok(RecordedSample {
            imu: imu_sample(Timestamp::default(), axes, validity),
            load: self.load(row, input_options)?.and_then(finite_load),
            label,
        })
    }
}

/// Label in column `index`: 1 stable, 0 not.
pub fn label(row: &impl Cells, index: usize, value: f64) -> Result<Label, InputError> {
    if value == 1.0 {
        Ok(Label::Stable)
    } else if value == 0.0 {
        Ok(Label::NotStable)
    } else {
        Err(row.error(index, "label", Problem::Label(row.shown(index).into_owned())))
    }
}

/// Label in column `index`, which may also be a word, as pandas and R write it, or unknown.
fn optional_label(row: &impl Cells, index: usize) -> Result<Option<Label>, InputError> {
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
fn validity(row: &impl Cells, index: usize) -> Result<Validity, InputError> {
    if row.is_blank(index) {
        return Ok(Validity::Valid);
    }
    let text = row.shown(index);
    let unknown = || row.error(index, "validity", Problem::Validity(text.to_string()));
    validity_of_name(&text).ok_or_else(unknown)
}

/// Largest distance from 1970 of times with a known unit, µs; it includes the year 9999.
const LATEST_US: u64 = 1 << 58;

/// Column of the time and its interpretation.
#[derive(Clone, Copy, Debug)]
struct TimeColumn {
    /// Index of the column.
    index: usize,
    /// Index of the nanoseconds, if the column holds whole seconds only.
    nanoseconds: Option<usize>,
    unit: TimeUnit,
}

impl TimeColumn {
    /// Time of a row, rounded to 1 µs.
    fn micros(&self, row: &impl Cells) -> Result<i64, InputError> {
        let no_time = |unit| {
            let text = row.shown(self.index).into_owned();
            row.error(self.index, "t", Problem::Time { text, unit, meant: None })
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

    /// Error about a time that is not after the time of the previous row.
    fn order_error(&self, row: &impl Cells, previous_us: i64) -> InputError {
        let text = row.shown(self.index).into_owned();
        let previous = previous_us as f64 / (1.0e6 / self.unit.per_second());
        row.error(self.index, "t", Problem::TimeOrder { text, unit: self.unit, previous })
    }
}

/// Returns the unit in which a number is a plausible time since 1970. It is unambiguous, because from 2001 to 2096 the
/// ranges of the units do not overlap.
fn unit_since_1970(value: f64) -> TimeUnit {
    let units = TimeUnit::COMMON.into_iter().skip(1);
    let is_unit = |unit: &TimeUnit| (1.0e9..=MAX_TIME_S).contains(&(value / unit.per_second()));
    units.into_iter().find(is_unit).unwrap_or_default()
}

/// Time from which a count of an unknown unit is assumed to be in ns, because in µs it would be more than 46 days.
const LEAST_NANOSECONDS: f64 = 4.0e12;

/// Returns the unit of a time that would be too far from zero in s. The unit follows from `step_us`, the usual step between
/// rows if the times were in s, µs. Without a step, very large times are in ns.
fn unit_of_long_time(value: f64, step_us: Option<u64>) -> Option<TimeUnit> {
    if value.abs() > MAX_TIME_S * TimeUnit::Nanoseconds.per_second() {
        return None;
    }
    match step_us {
        Some(step_us) => unit_of_step(step_us as f64 / 1.0e6),
        None => (value.abs() > LEAST_NANOSECONDS).then_some(TimeUnit::Nanoseconds),
    }
}

/// Checks the rate of times that were assumed, by their size, to be times since 1970. It is an error if the rate is
/// plausible only in a smaller unit. A clock that counts from the start of a computer may show similar values.
fn check_guess(file: &str, unit: TimeUnit, rate: f32) -> Result<(), InputError> {
    let is_plausible = |other: &TimeUnit| {
        let faster = other.per_second() / unit.per_second();
        PLAUSIBLE_RATES.contains(&(f64::from(rate) * faster))
    };
    if unit == TimeUnit::Seconds || is_plausible(&unit) {
        return Ok(());
    }
    let mut smaller = TimeUnit::COMMON.into_iter();
    let meant = smaller.find(|other| other.per_second() > unit.per_second() && is_plausible(other));
    match meant {
        Some(meant) => {
            Err(InputError::of_file(file, Problem::GuessedUnit { read_in: unit, meant }))
        }
        None => Ok(()),
    }
}

/// Lowest rate of a foot that is recorded in ms without a doubt about the unit, Hz.
const LEAST_IN_MILLISECONDS: f64 = 50.0;

/// Lowest rate that the estimator takes, Hz.
const LOWEST_RATE: f64 = SAMPLE_RATE.least as f64;

/// Column of the sensors by Xsens, in units of 100 µs of an `MTi` and in µs of a DOT.
const XSENS: (&str, [TimeUnit; 2]) =
    ("SampleTimeFine", [TimeUnit::HundredMicroseconds, TimeUnit::Microseconds]);

/// Checks a unit that was given for the column of this name by the rate in it, Hz. Returns a notice if ticks of
/// 10 kHz may be meant, whose rate in ms is a tenth of the true one.
///
/// # Errors
/// The rate is below that of feet, but not in another unit, or the column is known to have another unit.
fn check_unit(
    file: &str,
    name: &str,
    unit: TimeUnit,
    rate: f32,
) -> Result<Option<Notice>, InputError> {
    let rate = f64::from(rate);
    let (fine, units) = XSENS;
    let is_other = name.ends_with(fine) && !units.contains(&unit);
    let mut fitting = if is_other {
        let in_s = rate / unit.per_second();
        units.map(|unit| (unit, in_s * unit.per_second())).to_vec()
    } else {
        TimeUnit::that_fit(rate / unit.per_second())
    };
    fitting.retain(|(other, rate)| *other != unit && TimeUnit::RATES_OF_FEET.contains(rate));
    if fitting.is_empty() || (unit == TimeUnit::Seconds && !is_other) {
        return Ok(None);
    }
    if rate < LOWEST_RATE || is_other {
        return Err(InputError::of_file(file, Problem::UnitOfTimes { rate, unit, fitting }));
    }
    let may_be_ticks = unit == TimeUnit::Milliseconds && rate < LEAST_IN_MILLISECONDS;
    Ok(may_be_ticks.then(|| {
        let text = format!("{file}: column t gives {rate:.0} Hz in {}", unit.words());
        Notice::with_hint(text, Hint::TimesLookLikeOneOf(fitting))
    }))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::header::check_is_csv;
    use std::io::{Read, Write};
    use stored::container::Text;

    use estimator_core::{Gravity, Load, Timestamp, Validity, Vec3};

    use options::{TimeUnit, Units};
    use samples::{Label, VALIDITIES};
    use stored::Loaded;
    use stored::error::{Place, RowPlace};

    fn read_text(
        text: impl AsRef<[u8]>,
        input_options: &InputOptions,
    ) -> Result<Loaded, InputError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_ref()).unwrap();
        let mut feet = read(Table::open(file.path())?, input_options)?;
        assert_eq!(feet.len(), 1, "feet");
        Ok(feet.remove(0).into_loaded().unwrap())
    }

    fn loaded(text: impl AsRef<[u8]>) -> Loaded {
        read_text(text, &InputOptions::default()).unwrap()
    }

    #[test]
    fn columns_may_be_in_any_order() {
        let Loaded { recording, notices, .. } =
            loaded("label,wz,wy,wx,az,ay,ax,force,t\n1,6,5,4,3,2,1,7,0\n0,6,5,4,3,2,1,,0.002\n");
        let [first, second] = recording.samples[..] else {
            panic!("two rows");
        };
        assert_eq!(first.imu.specific_force.0, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(first.imu.angular_rate.0, Vec3::new(4.0, 5.0, 6.0));
        assert_eq!((first.load, first.label), (Some(Load(7.0)), Some(Label::Stable)));
        assert_eq!((second.load, second.label), (None, Some(Label::NotStable)));
        assert_eq!(second.imu.timestamp, Timestamp::from_micros(2000));
        assert_eq!(recording.sample_rate, 500.0);
        assert!(notices.is_empty());
    }

    /// Feet of a table by name, with their number of samples and rate.
    fn feet(text: &str) -> Vec<(Option<String>, usize, f32)> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        let feet = read(Table::open(file.path()).unwrap(), &InputOptions::default()).unwrap();
        let of = |foot: Stored| (foot.about.foot, foot.about.samples, foot.about.sample_rate);
        feet.into_iter().map(of).collect()
    }

    /// Rows of feet, each with its time in ms.
    fn rows_of(column: &str, rows: impl Iterator<Item = (String, u32)>) -> String {
        let row = |(foot, ms): (String, u32)| format!("{ms}e-3,1,2,3,4,5,6,{foot}\n");
        format!("t,ax,ay,az,wx,wy,wz,{column}\n{}", rows.map(row).collect::<String>())
    }

    #[test]
    fn table_of_several_feet_is_split_by_its_column() {
        let two = [(Some("FL".to_owned()), 100, 100.0), (Some("FR".to_owned()), 100, 100.0)];
        let names = |k: u32| ["FL", "FR"][k as usize % 2].to_owned();
        // Three tables: the feet have equal times, their times interleave, or one foot follows the other.
        let equal = rows_of("foot", (0..200).map(|k| (names(k), k / 2 * 10)));
        let interleaved = rows_of("leg_name", (0..200).map(|k| (names(k), k * 5)));
        let joined = rows_of("foot", (0..200).map(|k| (names(k / 100), k % 100 * 10)));
        for text in [equal, interleaved, joined] {
            assert_eq!(feet(&text), two);
        }
        // Another column of a known name is of the whole table.
        let shared =
            rows_of("frame_id,side", (0..200).map(|k| (format!("base,{}", names(k)), k * 5)));
        assert_eq!(feet(&shared), two);
        let shared = (0..200).map(|k| (format!("base,{}", names(k / 100)), k % 100 * 10));
        assert_eq!(feet(&rows_of("frame_id,side", shared)), two);
        // Rows of other signals have no axes.
        let more = rows_of("topic", (0..200).map(|k| (names(k), k * 5)))
            .replace("1,2,3,4,5,6,FL\n", "1,2,3,4,5,6,FL\n999e-3,,,,,,,odom\n")
            .replace("t,ax,ay,az", "time,acc_x,acc_y,acc_z")
            .replace("wx,wy,wz", "gyr_x,gyr_y,gyr_z");
        assert_eq!(feet(&more), two);
    }

    #[test]
    fn column_of_a_contact_does_not_split_a_table() {
        let contact = |k: u32| (k / 40 % 2).to_string();
        let words = |k: u32| ["stance", "swing"][(k / 40 % 2) as usize].to_owned();
        for text in [
            rows_of("foot", (0..1000).map(|k| (contact(k), k * 10))),
            rows_of("foot", (0..1000).map(|k| (words(k), k * 10))),
        ] {
            assert_eq!(feet(&text), [(None, 1000, 100.0)]);
        }
    }

    #[test]
    fn mapped_column_of_feet_splits_without_alternating() {
        let text = rows_of("board", (0..200).map(|k| ((k / 100).to_string(), k * 10)));
        let mut input_options = InputOptions::default();
        input_options.table.mapping = "foot=board".parse().unwrap();
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        let feet = read(Table::open(file.path()).unwrap(), &input_options).unwrap();
        let names: Vec<_> = feet.iter().map(|foot| foot.about.foot.as_deref()).collect();
        assert_eq!(names, [Some("0"), Some("1")]);
    }

    #[test]
    fn windows_line_ends_and_byte_order_mark_are_ignored() {
        let plain = "t,ax,ay,az,wx,wy,wz\n0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n";
        let windows = format!("\u{feff}{}", plain.replace('\n', "\r\n"));
        assert_eq!(loaded(windows).recording.samples, loaded(plain).recording.samples);
    }

    #[test]
    fn line_numbers_are_those_of_an_editor() {
        for end in ["\n", "\r\n"] {
            let lines = ["ax,ay,az,wx,wy,wz", "0,0,0,0,0,0", "", "0,0,x,0,0,0"];
            for text in [lines.join(end), lines.join(end) + end] {
                match read_text(text, &InputOptions::default()) {
                    Err(InputError { place: Place::Cell { row, column, .. }, .. }) => {
                        assert_eq!((row, column), (RowPlace::Line(4), 3));
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }

    #[test]
    fn unknown_names_error_shows_how_to_map() {
        let missing = ": missing in the header: ax, ay, az, wx, wy, wz; map gives the columns \
                   for them, such as map ";
        for (header, mapping) in [
            ("a,b,c,d,e,f,g,h", "t=a,ax=b,ay=c,az=d,wx=e,wy=f,wz=g"),
            ("a,b,c,d,e,f", "ax=a,ay=b,az=c,wx=d,wy=e,wz=f"),
            ("when,u,v,w,p,q,r", "t=when,ax=u,ay=v,az=w,wx=p,wy=q,wz=r"),
        ] {
            let error = read_text(format!("{header}\n"), &InputOptions::default()).unwrap_err();
            let said = error.to_string();
            assert!(said.ends_with(&format!("{missing}{mapping}")), "{said}");
        }
        let few = read_text("a,b,c,d,e\n", &InputOptions::default()).unwrap_err();
        assert!(few.to_string().ends_with("wx, wy, wz"), "{few}");
    }

    #[test]
    fn unknown_format_error_suggests_mapping() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"a,b,c,d,e,f,1,2\n").unwrap();
        let mut table = Table::open(file.path()).unwrap();
        let said = check_is_csv(&mut table).unwrap_err().to_string();
        assert!(
            said.ends_with(
                "format pce-atlas, pce-go1, lcd or csv; map gives the columns for them, \
             such as map ax=a,ay=b,az=c,wx=d,wy=e,wz=f"
            ),
            "{said}"
        );
    }

    #[test]
    fn non_finite_value_makes_the_sample_invalid() {
        let recording =
            loaded("t,ax,ay,az,wx,wy,wz\n0,nan,inf,-inf,1e300,0,0\n1,0,0,0,0,0,0\n").recording;
        assert_eq!(recording.samples[0].imu.checked_validity(), Validity::Invalid);
    }

    #[test]
    fn clock_may_start_anywhere() {
        for (start, start_us) in
            [("-0.002", -2000), ("0.5", 500_000), ("1700000000.123457", 1_700_000_000_123_457)]
        {
            let second = start.parse::<f64>().unwrap() + 0.004;
            let text = format!("t,ax,ay,az,wx,wy,wz\n{start},1,2,3,4,5,6\n{second},1,2,3,4,5,6\n");
            let Loaded { recording, start_us: found, .. } = loaded(text);
            assert_eq!(found, start_us);
            let times = recording.samples.iter().map(|s| s.imu.timestamp.as_micros());
            assert!(times.eq([0, 4000]));
        }
    }

    #[test]
    fn validity_is_kept_and_unknown_name_is_an_error() {
        let table = |cell: &str| {
            format!("t,ax,ay,az,wx,wy,wz,validity\n0,1,2,3,4,5,6,{cell}\n1,0,0,0,0,0,0,\n")
        };
        for (name, validity) in VALIDITIES {
            let samples = loaded(table(name)).recording.samples;
            assert_eq!(
                [samples[0].imu.validity, samples[1].imu.validity],
                [validity, Validity::Valid]
            );
        }
        let error = read_text(table("maybe"), &InputOptions::default()).unwrap_err().to_string();
        assert!(
        error.ends_with(", line 2, column 8 (validity): \"maybe\" where valid, accelerometer_saturated, gyroscope_saturated, both_saturated, stale or invalid is expected"),
        "{error}"
    );
    }

    const WHOLE: &str = "t,ax,ay,az,wx,wy,wz\n0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n0.02,1,2,3,4,5,6\n";

    #[test]
    fn rows_of_separators_alone_are_skipped() {
        let read = loaded(WHOLE.to_owned() + ",,,,,,\n,,,,,,\n");
        assert_eq!((read.recording.samples.len(), read.notices.len()), (3, 0));
        // Without times the row counts as a sample.
        let steady = "ax,ay,az,wx,wy,wz\n1,2,3,4,5,6\n,,,,,\n";
        let input_options = InputOptions { sample_rate: Some(100.0), ..InputOptions::default() };
        assert!(read_text(steady, &input_options).is_err());
    }

    #[test]
    fn truncated_last_line_is_left_out_and_reported() {
        let line_begins = WHOLE.trim_end().rfind('\n').unwrap() + 1;
        for length in line_begins + 1..WHOLE.len() - 2 {
            let cut = loaded(&WHOLE[..length]);
            assert_eq!(cut.recording.samples.len(), 2, "{length}");
            assert!(
                cut.notices[0].text.ends_with(", line 4: the last line is cut off, and left out"),
                "{:?}",
                cut.notices
            );
        }
        // As after a loss of power before the file system wrote the data.
        let zeros = format!("{}{}", &WHOLE[..line_begins + 2], "\0".repeat(5000));
        assert_eq!(loaded(zeros).recording.samples.len(), 2);
        // A complete line without a line end is a row; a short one elsewhere is an error.
        let whole = loaded(WHOLE.trim_end());
        assert_eq!((whole.recording.samples.len(), whole.notices.len()), (3, 0));
        for text in [WHOLE.replace("0.01,1,", ""), WHOLE.replace("0.02,1,", "")] {
            let error = read_text(text, &InputOptions::default());
            assert!(error.is_err_and(|e| matches!(e.problem, Problem::ColumnCount { .. })));
        }
    }

    #[test]
    fn truncated_compressed_data_is_read_and_reported() {
        let rows: String = (0..2000).map(|k| format!("{k}e-2,1,{k},3,4,5,6\n")).collect();
        let text = format!("t,ax,ay,az,wx,wy,wz\n{rows}");
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(text.as_bytes()).unwrap();
        let bytes = encoder.finish().unwrap();
        let cut = loaded(&bytes[..bytes.len() - 500]);
        let (samples, whole) = (cut.recording.samples, loaded(&bytes).recording.samples);
        assert!((1000..2000).contains(&samples.len()), "{}", samples.len());
        assert_eq!(samples[..], whole[..samples.len()]);
        assert!(
            cut.notices[0]
                .text
                .ends_with(": the compressed data ends early; what comes before is read"),
            "{:?}",
            cut.notices
        );
        // Damaged data are rejected.
        let mut damaged = bytes;
        let end = damaged.len() - 6;
        damaged[end] ^= 1;
        assert!(read_text(&damaged, &InputOptions::default()).is_err());
    }

    #[test]
    fn rows_within_quotes_are_an_error() {
        let rows = |first: &str, last: &str| {
            let row = |k: u32, note: &str| format!("0.{k:02},1,2,3,4,5,6,{note}\n");
            let mut text = "t,ax,ay,az,wx,wy,wz,note\n".to_owned();
            for k in 0..8 {
                text += &row(
                    k,
                    match k {
                        2 => first,
                        6 => last,
                        _ => "",
                    },
                );
            }
            read_text(text, &InputOptions::default())
        };
        for (first, last, closes) in [("\"start", "end\"", 8), ("\"start", "", 10)] {
            match rows(first, last) {
                Err(InputError { place, problem: Problem::RowsInQuotes { until }, .. }) => {
                    assert_eq!((place, until), (Place::Row(RowPlace::Line(4)), closes));
                }
                other => panic!("{other:?}"),
            }
        }
        // A note may span two lines.
        let two = rows("\"start\nof the slip\"", "\"a, b\"").unwrap();
        assert_eq!(two.recording.samples.len(), 8);
    }

    #[test]
    fn row_without_end_does_not_fill_memory() {
        let begin = "t,ax,ay,az,wx,wy,wz\n0,1,2,3,4,5,6\n0.01,\"1".as_bytes();
        let endless = begin.chain(std::io::repeat(b'0'));
        let of = |text: Box<dyn Read>| {
            let text = Text { file: "x".to_owned(), name: "x".to_owned(), text };
            Table::of(text).unwrap()
        };
        let table = of(Box::new(endless));
        let error = read(table, &InputOptions::default()).err().unwrap();
        assert_eq!(error.place, Place::Row(RowPlace::Line(3)));
        assert!(matches!(error.problem, Problem::LongRow { .. }), "{error}");
        let table = of(Box::new(std::io::repeat(0)));
        assert!(read(table, &InputOptions::default()).is_err());
    }

    #[test]
    fn lines_above_the_header_are_skipped_and_reported() {
        let above = format!("Logger 1.2\nRun: 3\n{WHOLE}");
        let read = loaded(&above);
        assert_eq!(read.recording.samples, loaded(WHOLE).recording.samples);
        assert!(
            read.notices[0].text.ends_with(": 2 lines above the header are passed over"),
            "{:?}",
            read.notices
        );
        let error = read_text(above.replace("0.01,1", "0.01,x"), &InputOptions::default());
        assert!(matches!(
            error,
            Err(InputError { place: Place::Cell { row: RowPlace::Line(5), .. }, .. })
        ));
    }

    #[test]
    fn foreign_words_for_nan_make_a_sample_invalid() {
        for word in ["NA", "N/A", "#N/A", "null", "NULL", "None", "NaN", "-nan(ind)"] {
            let samples =
                loaded(WHOLE.replace("0.01,1", &format!("0.01,{word}"))).recording.samples;
            let validity = samples[1].imu.checked_validity();
            assert_eq!(validity, Validity::Invalid, "{word}");
        }
        let label = |word: &str| {
            let rows = format!("t,ax,ay,az,wx,wy,wz,label\n0,1,2,3,4,5,6,{word}\n1,1,2,3,4,5,6,\n");
            loaded(rows).recording.samples[0].label
        };
        for (word, expected) in [
            ("NA", None),
            ("True", Some(Label::Stable)),
            ("false", Some(Label::NotStable)),
            ("1.0", Some(Label::Stable)),
        ] {
            assert_eq!(label(word), expected, "{word}");
        }
    }

    #[test]
    fn decimal_comma_is_reported() {
        let text = "t;ax;ay;az;wx;wy;wz\n0;1,5;2;3;4;5;6\n";
        let said = read_text(text, &InputOptions::default()).unwrap_err().to_string();
        assert!(
        said.ends_with(
            "line 2, column 2 (ax): \"1,5\" is not a number: a comma before the fraction, not between thousands, \
             is read with decimal ,"
        ),
        "{said}"
    );
    }

    const WITH_UNITS: &str = "Time [ms],acc_x [m/s^2],acc_y [m/s^2],acc_z [m/s^2],\
                          gyr_x (rad/s),gyr_y (rad/s),gyr_z (rad/s)\n\
                          0,1,2,3,4,5,6\n10,1,2,3,4,5,6\n";

    #[test]
    fn units_in_brackets_are_not_part_of_a_name() {
        let read = loaded(WITH_UNITS);
        assert_eq!(read.recording.sample_rate, 100.0);
        assert_eq!(read.recording.samples, loaded(&WHOLE[..WHOLE.len() - 17]).recording.samples);
        // The same applies to our names.
        let ours = WITH_UNITS.replace("acc_", "a").replace("gyr_", "w").replace("Time", "t");
        assert_eq!(loaded(ours).recording.samples, read.recording.samples);
        let pressed = |unit: &str| {
            let with_force = format!("gyr_z (rad/s),force [{unit}]");
            let text = WITH_UNITS.replace("gyr_z (rad/s)", &with_force);
            let read = loaded(text.replace(",6\n", ",6,70\n"));
            read.recording.samples[0].load.map(|load| load.0)
        };
        assert_eq!(["N", "kN"].map(pressed), [Some(70.0), None]);
    }

    #[test]
    fn unit_in_a_name_must_match_the_one_read() {
        let text = WITH_UNITS.replace("m/s^2", "g").replace("rad/s", "deg/s");
        let error = read_text(&text, &InputOptions::default()).unwrap_err().to_string();
        assert!(
            error.ends_with(
                ", line 1: column \"acc_x [g]\" is in g by its name, but would be read in m/s2: \
             units g,dps"
            ),
            "{error}"
        );
        let mut input_options = InputOptions::default();
        input_options.table.units = "g,dps".parse().unwrap();
        let samples = read_text(&text, &input_options).unwrap().recording.samples;
        assert_eq!(samples[0].imu.specific_force.0.x, 9.80665);
        // An explicit mapping implies that the unit is known.
        let mapped = "ax=acc_x [g],ay=acc_y [g],az=acc_z [g],wx=gyr_x (deg/s),wy=gyr_y (deg/s),wz=gyr_z (deg/s),t=Time [ms]";
        input_options.table.units = Units::default();
        input_options.table.mapping = mapped.parse().unwrap();
        input_options.table.time_unit = Some(TimeUnit::Milliseconds);
        let samples = read_text(&text, &input_options).unwrap().recording.samples;
        assert_eq!(samples[0].imu.specific_force.0.x, 1.0);
    }

    #[test]
    fn times_wrongly_taken_for_1970_are_an_error() {
        for (start, step, meant) in [
            // 20 minutes and 20 days since the start of a computer.
            (
                1_200_000_000_000_u64,
                1_000_000,
                Err("ms since 1970, but looks like ns: time unit ns"),
            ),
            (
                1_700_000_000_000_000,
                1_000_000,
                Err("us since 1970, but looks like ns: time unit ns"),
            ),
            (1_700_000_000_000, 1_000, Err("ms since 1970, but looks like us: time unit us")),
            (1_700_000_000_000, 1, Ok(1000.0)),
            (1_700_000_000_000_000_000, 1_000_000, Ok(1000.0)),
        ] {
            let mut text = "t,ax,ay,az,wx,wy,wz\n".to_owned();
            for k in 0..5 {
                text += &format!("{},1,2,3,4,5,6\n", start + k * step);
            }
            let read = read_text(text, &InputOptions::default());
            match (read, meant) {
                (Ok(read), Ok(rate)) => assert_eq!(read.recording.sample_rate, rate),
                (Err(error), Err(end)) => {
                    let said = error.to_string();
                    assert!(said.ends_with(end), "{said}");
                }
                (other, _) => panic!("{start}: {other:?}"),
            }
        }
    }

    #[test]
    fn time_beyond_its_unit_error_suggests_the_option() {
        let text = WHOLE.replace("0.01,1", "10000029000,1");
        let said = read_text(text, &InputOptions::default()).unwrap_err().to_string();
        assert!(
        said.ends_with(
            "10000029000 is not a time in s: -4e9 to 4e9 is expected; time unit gives the unit: s, ms, 100us, us or ns"
        ),
        "{said}"
    );
    }

    #[test]
    fn time_beyond_seconds_error_names_the_unit() {
        for (start, step, unit, option) in [
            // Steps of rows at 500 Hz, up to a time that is too large in s.
            (0_u64, 2_000_000, "nanoseconds", "ns"),
            (3_999_900_000, 2_000, "microseconds", "us"),
            // Ten hours since the start of a computer.
            (36_000_000_000_000, 1_000_000, "nanoseconds", "ns"),
        ] {
            let mut text = "t,ax,ay,az,wx,wy,wz\n".to_owned();
            for k in 0..3_000 {
                text += &format!("{},1,2,3,4,5,6\n", start + k * step);
            }
            let said = read_text(text, &InputOptions::default()).unwrap_err().to_string();
            let end = format!("column t looks like {unit}, but is read in s: time unit {option}");
            assert!(said.ends_with(&end), "{said}");
        }
    }

    #[test]
    fn mapping_to_a_duplicate_name_is_an_error() {
        let mut input_options = InputOptions::default();
        input_options.table.mapping = "force=q".parse().unwrap();
        let text = "t,ax,ay,az,wx,wy,wz,q,q\n0,1,2,3,4,5,6,7,8\n";
        let said = read_text(text, &input_options).unwrap_err().to_string();
        assert!(said.ends_with(", line 1, column 9 (q): the header has this name twice"), "{said}");
    }

    #[test]
    fn load_in_rows_of_its_own_is_valid_for_100_ms() {
        let rows = "__time,/ft/z,/imu/linear_acceleration/x,/imu/linear_acceleration/y,\
        /imu/linear_acceleration/z,/imu/angular_velocity/x,/imu/angular_velocity/y,/imu/angular_velocity/z\n\
        100.00,,1,2,3,4,5,6\n100.01,70,,,,,,\n100.05,,1,2,3,4,5,6\n100.11,,1,2,3,4,5,6\n\
        100.12,,1,2,3,4,5,6\n100.13,71,1,2,3,4,5,6\n100.14,,1,2,3,4,5,6\n100.15,nan,,,,,,\n\
        100.16,,1,2,3,4,5,6\n";
        let mut input_options = InputOptions::default();
        input_options.table.mapping = "force=/ft/z".parse().unwrap();
        let read = read_text(rows, &input_options).unwrap();
        let loads: Vec<Option<f32>> =
            read.recording.samples.iter().map(|sample| sample.load.map(|load| load.0)).collect();
        let (old, new) = (Some(70.0), Some(71.0));
        assert_eq!(loads, [None, old, old, None, new, new, None]);
        assert_eq!(read.repairs.blank_rows, 2);
        let said: String = read.notices.iter().map(ToString::to_string).collect();
        assert!(
        said.contains(
            ": 3 samples have no load: none of the 2 rows with a load alone stands before and is at most \
             100 ms older"
        ),
        "{said}"
    );
    }

    #[test]
    fn blank_load_of_a_sample_is_unknown() {
        let rows = "timestamp,load,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n0.00,70,1,2,3,4,5,6\n0.01,,1,2,3,4,5,6\n";
        let mut input_options = InputOptions::default();
        input_options.table.mapping = "force=load".parse().unwrap();
        let samples = read_text(rows, &input_options).unwrap().recording.samples;
        assert_eq!(samples[1].load, None);
    }

    #[test]
    fn line_of_units_and_second_header_are_reported() {
        for (line, end) in [
            (
                "s,m/s^2,m/s^2,m/s^2,rad/s,rad/s,rad/s",
                ": take out the line of units, and name them with units and time unit",
            ),
            (
                "t,ax,ay,az,wx,wy,wz",
                ": the header is repeated here, as in a file made of two tables",
            ),
        ] {
            let text = WHOLE.replace("0.01,1,2,3,4,5,6", line);
            let said = read_text(text, &InputOptions::default()).unwrap_err().to_string();
            assert!(said.contains(", line 3, column 1 (t): ") && said.ends_with(end), "{said}");
        }
    }

    #[test]
    fn long_cell_is_shortened_in_the_error() {
        let text = WHOLE.replace("0.01,1", &format!("0.01,{}", "\0".repeat(5000)));
        let said = read_text(text, &InputOptions::default()).unwrap_err().to_string();
        assert!(said.len() < 300, "{said}");
    }

    /// Rows of an Xsens sensor with this many counts of its clock between them.
    fn fine_times(step: u32) -> String {
        let rows = (0..5).map(|k| format!("{},1,2,3,4,5,6\n", 4000 + k * step));
        "SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z\n".to_owned()
            + &rows.collect::<String>()
    }

    #[test]
    fn possible_time_column_is_suggested() {
        let said = read_text(fine_times(100), &InputOptions::default()).unwrap_err().to_string();
        assert!(said.ends_with("map t=SampleTimeFine"), "{said}");
    }

    #[test]
    fn unit_that_fits_better_than_the_given_one_is_named() {
        let with_unit = |text: &str, unit| {
            let mut input_options = InputOptions::default();
            input_options.table.mapping = "t=SampleTimeFine".parse().unwrap();
            input_options.table.time_unit = Some(unit);
            read_text(text, &input_options)
        };
        for (step, unit, fitting) in [
            (100, TimeUnit::Milliseconds, "in ticks of 100 µs it gives 100 Hz: time unit 100us"),
            (10, TimeUnit::Milliseconds, "in ticks of 100 µs it gives 1000 Hz: time unit 100us"),
            (16_667, TimeUnit::Milliseconds, "in microseconds it gives 60 Hz: time unit us"),
        ] {
            let said = with_unit(&fine_times(step), unit).unwrap_err().to_string();
            assert!(said.ends_with(fitting), "{said}");
        }
        let ticks = with_unit(&fine_times(100), TimeUnit::HundredMicroseconds).unwrap();
        assert_eq!(ticks.recording.sample_rate, 100.0);
        assert_eq!(ticks.notices.iter().filter(|n| n.text.contains("column t")).count(), 0);
        // In a column of another name, the given unit may be right.
        let mut input_options = InputOptions::default();
        input_options.table.time_unit = Some(TimeUnit::Milliseconds);
        let rows = (0..5).map(|k| format!("{},1,2,3,4,5,6\n", 25 * k)).collect::<String>();
        let read = read_text(format!("t,ax,ay,az,wx,wy,wz\n{rows}"), &input_options).unwrap();
        assert_eq!(read.recording.sample_rate, 40.0);
        let notice = read.notices[0].to_string();
        assert!(
            notice.ends_with("in ticks of 100 µs it gives 400 Hz: time unit 100us"),
            "{notice}"
        );
    }

    #[test]
    fn time_by_another_name_is_taken_and_said() {
        for (name, step) in [
            ("time", "0.01"),
            ("Time", "0.01"),
            ("timestamp", "0.01"),
            ("time_s", "0.01"),
            ("t_s", "0.01"),
            ("Time [ms]", "10"),
            ("t_us", "10000"),
        ] {
            let header = format!("{name},ax,ay,az,wx,wy,wz");
            let read = loaded(format!("{header}\n0,1,2,3,4,5,6\n{step},1,2,3,4,5,6\n"));
            assert_eq!(read.recording.sample_rate, 100.0, "{name}");
            let said: String = read.notices.iter().map(ToString::to_string).collect();
            assert!(said.ends_with(&format!(": t is {name}")), "{said}");
        }
    }

    #[test]
    fn load_by_another_name_is_taken_and_said() {
        let with =
            |name: &str| WHOLE.replace("wz\n", &format!("wz,{name}\n")).replace(",6\n", ",6,70\n");
        for name in ["fz", "Fz", "Fz [N]", "contact_force", "foot_force", "force_z"] {
            let read = loaded(with(name));
            assert_eq!(read.recording.samples[0].load, Some(Load(70.0)), "{name}");
            assert_eq!(read.recording.load_title, name);
            let said: String = read.notices.iter().map(ToString::to_string).collect();
            assert!(said.ends_with(&format!(": force is {name}")), "{said}");
        }
        for name in ["fz [kN]", "force_sensor", "fx"] {
            assert_eq!(loaded(with(name)).recording.samples[0].load, None, "{name}");
        }
        // A blank axis stays an error in a table of ours.
        let blank = with("fz").replace("0.01,1,", "0.01,,");
        assert!(read_text(blank, &InputOptions::default()).is_err());
        // One of two is not known to be the foot's.
        let two = with("fz").replace("wz,fz", "wz,fz,Fz").replace(",70", ",70,71");
        assert_eq!(loaded(two).recording.samples[0].load, None);
    }

    #[test]
    fn load_is_scaled_by_its_factor() {
        let mut input_options = InputOptions::default();
        input_options.table.scale = "1,1,-2".parse().unwrap();
        let text = WHOLE.replace("wz\n", "wz,fz\n").replace(",6\n", ",6,70\n");
        let read = read_text(text, &input_options).unwrap();
        assert_eq!(read.recording.samples[0].load, Some(Load(-140.0)));
        assert_eq!(read.recording.samples[0].imu.specific_force.0.x, 1.0);
    }

    #[test]
    fn mapped_load_is_taken_before_one_by_name() {
        let mut input_options = InputOptions::default();
        input_options.table.mapping = "force=mine".parse().unwrap();
        let text = WHOLE.replace("wz\n", "wz,fz,mine\n").replace(",6\n", ",6,70,71\n");
        let read = read_text(text, &input_options).unwrap();
        assert_eq!(read.recording.samples[0].load, Some(Load(71.0)));
    }

    #[test]
    fn rows_without_times_use_the_given_rate() {
        let input_options = InputOptions {
            sample_rate: Some(400.0),
            gravity: Some(Gravity::Removed),
            ..InputOptions::default()
        };
        let recording = read_text("ax,ay,az,wx,wy,wz\n0,0,0,0,0,0\n0,0,0,0,0,0\n", &input_options)
            .unwrap()
            .recording;
        assert_eq!(recording.samples[1].imu.timestamp, Timestamp::from_micros(2500));
        assert_eq!(recording.gravity, Gravity::Removed);
    }
}
