//! Columns named in the header of a `csv`, and the cells of a row in them.

use crate::samples::recording::RecordedSample;
use estimator_core::{Axis, Timestamp, Validity};

use super::cells::{Cells, optional_label, validity};
use super::layout::{Blanks, NANOSECONDS, shortened, suggestion};
use super::mapping::is_ours;
use super::reader::Row;
use crate::input::error::{InputError, Suggestion};
use crate::input::loaded::{Hints, finite_load, imu_sample};

/// Returns whether a row is a header, even a malformed one: it contains a known name.
pub(in crate::input) fn is_header(row: &Row) -> bool {
    row.cells()
        .flat_map(|cell| cell.split(OTHER_SEPARATORS))
        .any(|name| is_ours(&name.to_lowercase()))
}

/// Characters mistakenly used to separate the names of a header.
const OTHER_SEPARATORS: [char; 4] = [';', '\t', ' ', '|'];

/// Position of each known column.
#[derive(Default)]
pub(super) struct Columns {
    /// Number of cells in a row.
    pub(super) count: usize,
    /// Index of the column `t`.
    pub(super) t: Option<usize>,
    /// Index of the nanoseconds of a stamp whose seconds are `t`.
    pub(super) nanoseconds: Option<usize>,
    axes: [Option<usize>; 6],
    force: Option<usize>,
    label: Option<usize>,
    validity: Option<usize>,
    /// Names that are unknown in a recording.
    pub(super) ignored: Vec<String>,
    duplicate: Option<(usize, String)>,
}

impl Columns {
    /// Parses a header, in which no column is known if it holds numbers.
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
                        columns.ignored.push(name.to_owned());
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
    pub(super) fn checked(header: &Row) -> Result<Self, InputError> {
        let columns = Self::from_header(header);
        if let Some((index, name)) = &columns.duplicate {
            return Err(InputError::DuplicateColumn { cell: header.cell(*index, name) });
        }
        let axes = Axis::ALL.into_iter().zip(columns.axes);
        let missing = axes.filter(|(_, index)| index.is_none());
        let missing: Vec<_> = missing.map(|(axis, _)| axis.name()).collect();
        if missing.is_empty() {
            return Ok(columns);
        }
        let suggestion = columns.slip().or_else(|| suggestion(header, &missing));
        Err(InputError::MissingColumns {
            file: header.file.clone(),
            place: header.place,
            columns: missing.join(", "),
            suggestion,
        })
    }

    /// Indices of all columns that are read.
    #[cfg(feature = "parquet")]
    pub(super) fn used(&self) -> impl Iterator<Item = usize> {
        let others = [self.t, self.nanoseconds, self.force, self.label, self.validity];
        self.axes.into_iter().chain(others).flatten()
    }

    /// Reason why known names are not recognised, if any.
    fn slip(&self) -> Option<Suggestion> {
        let known = |name: &str| is_ours(&name.to_lowercase());
        self.ignored.iter().find_map(|name| {
            let separator = name.chars().find(|c| OTHER_SEPARATORS.contains(c));
            match separator {
                // A single name is followed by something else, such as a unit.
                Some(found) => {
                    let names = name.split(found).map(str::trim).filter(|name| known(name));
                    (names.count() > 1).then_some(Suggestion::Separator(found))
                }
                None => known(name).then_some(Suggestion::UpperCase),
            }
        })
    }

    /// Sentence that lists the ignored columns.
    pub(super) fn notice(&self, file: &str) -> Option<String> {
        let names = shortened(&self.ignored);
        (!self.ignored.is_empty()).then(|| format!("{file}: ignored columns: {names}"))
    }

    /// Returns whether a row has no value in any axis.
    pub(super) fn has_no_axis(&self, row: &impl Cells) -> bool {
        let mut axes = self.axes.iter().flatten();
        axes.all(|index| row.is_blank(*index))
    }

    /// Load of a row, N, which may be not a number; `None` if it is blank.
    pub(super) fn load(&self, row: &impl Cells) -> Result<Option<f64>, InputError> {
        self.force.map_or(Ok(None), |index| row.optional(index, "force"))
    }

    /// Values of a row; the time is set later.
    pub(super) fn sample(
        &self,
        row: &impl Cells,
        blanks: Blanks,
        hints: &Hints,
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
        let axes = hints.table.to_si(axes);
        let label = self.label.map(|index| optional_label(row, index));
        let label = label.transpose()?.flatten();
        let validity = self.validity.map(|index| validity(row, index));
        let validity = validity.transpose()?.unwrap_or(Validity::Valid);
        Ok(RecordedSample {
            imu: imu_sample(Timestamp::default(), axes, validity),
            load: self.load(row)?.and_then(finite_load),
            label,
        })
    }
}
