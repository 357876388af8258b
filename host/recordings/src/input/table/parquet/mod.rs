//! Parquet with the columns of a `csv`: the same names, units and rules. Columns within a struct have the names of
//! both, joined by a dot. Row groups are read sequentially.
//!
//! | type of a column | read as |
//! |---|---|
//! | integers and floats of all widths, booleans | a number |
//! | timestamps and durations | a time |
//! | texts, also in a dictionary | a name of a validity; a date with a time; a number |
//! | null | blank |

mod column;
pub(crate) mod guarded;

use std::borrow::Cow;
use std::fs::File;

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray;
use arrow_schema::{DataType, Fields};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::errors::ParquetError;

use super::cells::Cells;
use super::intake::Intake;
use super::layout::{Index, Layout};
use super::reader::Row;
use crate::input::error::{Cell, InputError, RowPlace};
use crate::input::iso8601::micros_since_1970;
use crate::input::loaded::Hints;
use crate::input::open::Container;
use crate::input::refusal::ContainerError;
use crate::input::store::stored::Stored;
use column::{Column, is_read, is_time};
use guarded::guarded;

/// Rows decoded at once.
const BATCH: usize = 8192;

/// Prefix that pandas gives an unnamed index.
const PANDAS_INDEX: &str = "__index_level_";

/// Reads a file.
///
/// # Errors
/// The first error found, with its row and column.
pub(in crate::input) fn read(container: &Container, hints: &Hints) -> Result<Stored, InputError> {
    let file = container.file.as_str();
    let [part] = &container.parts[..] else {
        return Err(InputError::empty(file));
    };
    let bytes = File::open(&part.path).map_err(|source| InputError::unreadable(file, source))?;
    let about = sound(file, || ArrowReaderMetadata::load(&bytes, ArrowReaderOptions::default()))?;
    let mut leaves = Vec::new();
    find_leaves(about.schema().fields(), "", &[], &mut leaves);
    let names: Vec<String> = leaves.iter().map(|leaf| leaf.name.clone()).collect();
    let header = Row::of_names(file, &names);
    let layout = Layout::named(&header, &hints.table, index(&leaves))?;
    let mut intake = Intake::new(file, hints, layout)?;
    let used = intake.used();
    for index in &used {
        leaves[*index].check(file)?;
    }
    let mut roots: Vec<usize> = used.iter().map(|index| leaves[*index].path[0]).collect();
    roots.sort_unstable();
    roots.dedup();
    let mask = ProjectionMask::roots(about.parquet_schema(), roots.iter().copied());
    let mut reader = sound(file, || {
        ParquetRecordBatchReaderBuilder::new_with_metadata(bytes, about)
            .with_projection(mask)
            .with_batch_size(BATCH)
            .build()
    })?;
    let mut rows_before = 0;
    while let Some(batch) = sound(file, || Ok(reader.next().transpose()?))? {
        let columns: Vec<Option<Column>> = (0..leaves.len())
            .map(|index| used.contains(&index).then(|| leaves[index].column(&batch, &roots))?)
            .collect();
        for row in 0..batch.num_rows() {
            let row =
                BatchRow { file, columns: &columns, row, number: rows_before + row as u64 + 1 };
            intake.take(&row)?;
        }
        rows_before += batch.num_rows() as u64;
    }
    intake.finish(container.name.clone())
}

/// Result of the library, or an error if it finds the file damaged.
fn sound<T>(file: &str, call: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, InputError> {
    let damaged = |error: ParquetError| ContainerError::Damaged {
        file: file.to_owned(),
        // One line, although the library's errors may have several.
        source: error.to_string().replace('\n', " ").into(),
        advice: None,
    };
    match guarded(call) {
        Some(result) => Ok(result.map_err(damaged)?),
        None => {
            Err(damaged(ParquetError::General("its parts do not fit together".to_owned())).into())
        }
    }
}

/// A column that is not a struct.
struct Leaf {
    /// Name of the column after those of the structs around it.
    name: String,
    /// Index among the columns, then within each struct.
    path: Vec<usize>,
    data_type: DataType,
}

/// Lists the columns of a schema, those of structs at the position of the struct.
fn find_leaves(fields: &Fields, before: &str, path: &[usize], leaves: &mut Vec<Leaf>) {
    for (place, field) in fields.iter().enumerate() {
        let name = match before {
            "" => field.name().clone(),
            _ => format!("{before}.{}", field.name()),
        };
        let path: Vec<usize> = path.iter().copied().chain([place]).collect();
        match field.data_type() {
            DataType::Struct(fields) => find_leaves(fields, &name, &path, leaves),
            data_type => leaves.push(Leaf { name, path, data_type: data_type.clone() }),
        }
    }
}

/// Column that may be the time without a name that identifies it: the index of pandas, or the only column with the
/// type of a time.
fn index(leaves: &[Leaf]) -> Index {
    let may_be_t = |leaf: &Leaf| is_time(&leaf.data_type) && leaf.name != "t";
    let is_index = |leaf: &Leaf| leaf.name.starts_with(PANDAS_INDEX);
    if let Some(at) = leaves.iter().position(|leaf| is_index(leaf) && may_be_t(leaf)) {
        return Index::Time(at);
    }
    let mut times = (0..leaves.len()).filter(|at| may_be_t(&leaves[*at]));
    match (times.next(), times.next()) {
        (Some(only), None) => Index::Time(only),
        _ if leaves.iter().any(is_index) => Index::Other,
        _ => Index::None,
    }
}

impl Leaf {
    /// Checks that its values can be read.
    fn check(&self, file: &str) -> Result<(), InputError> {
        if is_read(&self.data_type) {
            return Ok(());
        }
        Err(ContainerError::ColumnType {
            file: file.to_owned(),
            column: self.name.clone(),
            found: self.data_type.to_string(),
            wanted: "numbers, times or texts",
        }
        .into())
    }

    /// Values in a batch that has the columns `roots` of the file.
    fn column(&self, batch: &RecordBatch, roots: &[usize]) -> Option<Column> {
        let (root, within) = self.path.split_first()?;
        let place = roots.iter().position(|other| other == root)?;
        let mut array = batch.columns().get(place)?.clone();
        let mut nulls = array.logical_nulls();
        for child in within {
            let inner = array.as_struct_opt()?.columns().get(*child)?.clone();
            nulls = arrow_buffer::NullBuffer::union(nulls.as_ref(), inner.logical_nulls().as_ref());
            array = inner;
        }
        Column::of(&array, nulls.as_ref())
    }
}

/// A row of a batch.
struct BatchRow<'a> {
    file: &'a str,
    /// Columns of the file that are used.
    columns: &'a [Option<Column>],
    /// Index in the batch.
    row: usize,
    /// Number in the file, from 1.
    number: u64,
}

impl BatchRow<'_> {
    fn column(&self, index: usize) -> Option<&Column> {
        self.columns.get(index)?.as_ref()
    }
}

impl Cells for BatchRow<'_> {
    fn is_blank(&self, index: usize) -> bool {
        self.column(index).is_none_or(|column| column.is_blank(self.row))
    }

    fn shown(&self, index: usize) -> Cow<'_, str> {
        self.column(index).map_or(Cow::Borrowed(""), |column| column.shown(self.row))
    }

    fn optional(&self, index: usize, name: &str) -> Result<Option<f64>, InputError> {
        let Some(column) = self.column(index) else {
            return Ok(None);
        };
        column.number(self.row).map_err(|text| InputError::NotANumber {
            cell: self.cell(index, name),
            text: text.to_owned(),
        })
    }

    fn whole(&self, index: usize) -> Option<i64> {
        self.column(index)?.whole(self.row)
    }

    fn moment_us(&self, index: usize) -> Option<i64> {
        match self.column(index)? {
            Column::Moments(moments) => moments[self.row],
            Column::Texts(texts) => texts[self.row].as_deref().and_then(micros_since_1970),
            _ => None,
        }
    }

    fn cell(&self, index: usize, name: &str) -> Cell {
        Cell {
            file: self.file.to_owned(),
            place: RowPlace::Row(self.number),
            column: index + 1,
            name: name.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests;
