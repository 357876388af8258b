//! Parquet with the columns of a `csv`: the same names, units and rules. Columns within a struct have the names of
//! both, joined by a dot. Row groups are read sequentially.
//!
//! | type of a column | read as |
//! |---|---|
//! | integers and floats of all widths, booleans | a number |
//! | timestamps and durations | a time |
//! | texts, also in a dictionary | a name of a validity; a date with a time; a number |
//! | null | blank |

use std::borrow::Cow;
use std::fs::File;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type,
    Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, Int64Array, RecordBatch};
use arrow_buffer::{ArrowNativeType, NullBuffer};
use arrow_schema::{DataType, Fields, TimeUnit};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::errors::ParquetError;

use crate::csv::Intake;
use crate::header::{Index, Layout};
use crate::reader::{Cells, Row};
use options::InputOptions;
use stored::Stored;
use stored::container::Container;
use stored::error::{InputError, Place, Problem, RowPlace};
use stored::iso8601::micros_since_1970;

/// Rows decoded at once.
const BATCH: usize = 8192;

/// Prefix that pandas gives an unnamed index.
const PANDAS_INDEX: &str = "__index_level_";

/// Reads a file.
///
/// # Errors
/// The first error found, with its row and column.
pub fn read(
    container: &Container,
    input_options: &InputOptions,
) -> Result<Vec<Stored>, InputError> {
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
    let layout = Layout::named(&header, &input_options.table, index(&leaves))?;
    let mut intake = Intake::new(file, input_options, layout)?;
    intake.retain_foot_columns(|index| is_read(&leaves[index].data_type));
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
        let number = |row: usize| rows_before + row as u64 + 1;
        let row = |row| BatchRow { file, columns: &columns, row, number: number(row) };
        if rows_before == 0 {
            intake.look_at((0..batch.num_rows()).map(row));
        }
        (0..batch.num_rows()).try_for_each(|index| intake.take(&row(index)))?;
        rows_before += batch.num_rows() as u64;
    }
    intake.finish(&container.name)
}

/// Returns the result of a call of the library, or an error if the library finds the file damaged.
fn sound<T>(file: &str, call: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, InputError> {
    let damaged = |error: ParquetError| {
        // One line, although the library's errors may have several.
        let source = error.to_string().replace('\n', " ").into();
        InputError::of_file(file, Problem::Damaged { source, advice: None })
    };
    match guarded(call) {
        Some(result) => result.map_err(damaged),
        None => Err(damaged(ParquetError::General("its parts do not fit together".to_owned()))),
    }
}

/// A column that is not a struct.
struct Leaf {
    /// Name of the column, after the names of the structs around it.
    name: String,
    /// Index among the columns, then within each struct.
    path: Vec<usize>,
    data_type: DataType,
}

/// Lists the columns of a schema, with the columns of structs at the position of the struct.
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
        let problem = Problem::ColumnType {
            column: self.name.clone(),
            found: self.data_type.to_string(),
            wanted: "numbers, times or texts",
        };
        Err(InputError::of_file(file, problem))
    }

    /// Values in a batch that has the columns `roots` of the file.
    fn column(&self, batch: &RecordBatch, roots: &[usize]) -> Option<Column> {
        let (root, within) = self.path.split_first()?;
        let place = roots.iter().position(|other| other == root)?;
        let mut array = batch.columns().get(place)?.clone();
        let mut nulls = array.logical_nulls();
        for child in within {
            let inner = array.as_struct_opt()?.columns().get(*child)?.clone();
            nulls = NullBuffer::union(nulls.as_ref(), inner.logical_nulls().as_ref());
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
        column
            .number(self.row)
            .map_err(|text| self.error(index, name, Problem::NotANumber(text.to_owned())))
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

    fn error(&self, index: usize, name: &str, problem: Problem) -> InputError {
        let row = RowPlace::Row(self.number);
        let place = Place::Cell { row, column: index + 1, name: name.to_owned() };
        InputError { file: self.file.to_owned(), place, problem }
    }
}

/// Returns whether the values of a type are times.
const fn is_time(data_type: &DataType) -> bool {
    matches!(data_type, DataType::Timestamp(..) | DataType::Duration(_))
}

/// Returns whether the values of a type can be read. Pandas writes a column without values as nulls.
fn is_read(data_type: &DataType) -> bool {
    match data_type {
        DataType::Dictionary(key, value) => key.is_integer() && is_text(value),
        DataType::Boolean | DataType::Null => true,
        other => is_time(other) || is_text(other) || other.is_integer() || other.is_floating(),
    }
}

const fn is_text(data_type: &DataType) -> bool {
    matches!(data_type, DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View)
}

/// Values of a column; `None` is blank.
enum Column {
    Floats(Vec<Option<f64>>),
    Wholes(Vec<Option<i64>>),
    /// Times in µs.
    Moments(Vec<Option<i64>>),
    Texts(Vec<Option<String>>),
}

impl Column {
    /// Values of an array, except the values in `nulls`; `None` if its type is not supported.
    fn of(array: &ArrayRef, nulls: Option<&NullBuffer>) -> Option<Self> {
        let source = Values { array, nulls };
        Some(match array.data_type() {
            DataType::Float16 => Self::Floats(source.primitive::<Float16Type, _>(f64::from)?),
            DataType::Float32 => Self::Floats(source.primitive::<Float32Type, _>(f64::from)?),
            DataType::Float64 => Self::Floats(source.primitive::<Float64Type, _>(|v| v)?),
            DataType::Int8 => Self::Wholes(source.wholes::<Int8Type>()?),
            DataType::Int16 => Self::Wholes(source.wholes::<Int16Type>()?),
            DataType::Int32 => Self::Wholes(source.wholes::<Int32Type>()?),
            DataType::Int64 => Self::Wholes(source.wholes::<Int64Type>()?),
            DataType::UInt8 => Self::Wholes(source.wholes::<UInt8Type>()?),
            DataType::UInt16 => Self::Wholes(source.wholes::<UInt16Type>()?),
            DataType::UInt32 => Self::Wholes(source.wholes::<UInt32Type>()?),
            DataType::UInt64 => Self::Wholes(source.wholes::<UInt64Type>()?),
            DataType::Boolean => {
                let values = array.as_boolean_opt()?;
                Self::Wholes(source.each(|row| i64::from(values.value(row))))
            }
            DataType::Null => Self::Floats(vec![None; array.len()]),
            DataType::Timestamp(unit, _) | DataType::Duration(unit) => {
                let counts = array.to_data().into_builder().data_type(DataType::Int64);
                let counts = Int64Array::from(counts.build().ok()?);
                Self::Moments(source.each(|row| micros(counts.value(row), *unit)))
            }
            DataType::Dictionary(..) => Self::Texts(source.words()?),
            _ => Self::Texts(source.texts()?),
        })
    }

    fn is_blank(&self, row: usize) -> bool {
        match self {
            Self::Floats(values) => values[row].is_none(),
            Self::Wholes(values) | Self::Moments(values) => values[row].is_none(),
            Self::Texts(values) => values[row].as_ref().is_none_or(String::is_empty),
        }
    }

    /// Number of a row; the error is a text that is not a number. A timestamp is not a number: it has neither the
    /// unit nor the start of one.
    fn number(&self, row: usize) -> Result<Option<f64>, &str> {
        match self {
            Self::Floats(values) => Ok(values[row]),
            Self::Wholes(values) => Ok(values[row].map(|value| value as f64)),
            Self::Moments(values) => values[row].map_or(Ok(None), |_| Err("a time")),
            Self::Texts(values) => match values[row].as_deref() {
                None | Some("") => Ok(None),
                Some(text) => text.trim().parse().map(Some).map_err(|_| text),
            },
        }
    }

    fn whole(&self, row: usize) -> Option<i64> {
        match self {
            Self::Wholes(values) => values[row],
            Self::Texts(values) => values[row].as_deref()?.trim().parse().ok(),
            _ => None,
        }
    }

    fn shown(&self, row: usize) -> Cow<'_, str> {
        let text = match self {
            Self::Floats(values) => values[row].map(|value| value.to_string()),
            Self::Wholes(values) => values[row].map(|value| value.to_string()),
            Self::Moments(values) => {
                values[row].map(|micros| format!("{} s", micros as f64 / 1.0e6))
            }
            Self::Texts(values) => return values[row].as_deref().unwrap_or_default().into(),
        };
        text.unwrap_or_default().into()
    }
}

/// An array, with the nulls in it or around it.
struct Values<'a> {
    array: &'a ArrayRef,
    nulls: Option<&'a NullBuffer>,
}

impl Values<'_> {
    fn each<T>(&self, value: impl Fn(usize) -> T) -> Vec<Option<T>> {
        let is_there = |row| self.nulls.is_none_or(|nulls| nulls.is_valid(row));
        (0..self.array.len()).map(|row| is_there(row).then(|| value(row))).collect()
    }

    fn primitive<A: ArrowPrimitiveType, T>(
        &self,
        convert: impl Fn(A::Native) -> T,
    ) -> Option<Vec<Option<T>>> {
        let values = self.array.as_primitive_opt::<A>()?;
        Some(self.each(|row| convert(values.value(row))))
    }

    /// Integers; those beyond an i64 become the largest.
    fn wholes<A: ArrowPrimitiveType>(&self) -> Option<Vec<Option<i64>>> {
        self.primitive::<A, _>(|value| value.to_i64().unwrap_or(i64::MAX))
    }

    fn texts(&self) -> Option<Vec<Option<String>>> {
        Some(match self.array.data_type() {
            DataType::Utf8 => {
                let values = self.array.as_string_opt::<i32>()?;
                self.each(|row| values.value(row).to_owned())
            }
            DataType::LargeUtf8 => {
                let values = self.array.as_string_opt::<i64>()?;
                self.each(|row| values.value(row).to_owned())
            }
            DataType::Utf8View => {
                let values = self.array.as_string_view_opt()?;
                self.each(|row| values.value(row).to_owned())
            }
            _ => return None,
        })
    }

    /// Texts of a dictionary.
    fn words(&self) -> Option<Vec<Option<String>>> {
        let dictionary = self.array.as_any_dictionary_opt()?;
        let array = dictionary.values();
        if array.is_empty() {
            return Some(vec![None; self.array.len()]);
        }
        let nulls = array.logical_nulls();
        let nulls = nulls.as_ref();
        let words = Values { array, nulls }.texts()?;
        let keys = dictionary.normalized_keys();
        let words = self.each(|row| words[keys[row]].clone());
        Some(words.into_iter().map(Option::flatten).collect())
    }
}

/// Time in µs, from a count of a unit.
fn micros(count: i64, unit: TimeUnit) -> i64 {
    match unit {
        TimeUnit::Second => count.saturating_mul(1_000_000),
        TimeUnit::Millisecond => count.saturating_mul(1000),
        TimeUnit::Microsecond => count,
        TimeUnit::Nanosecond => count.div_euclid(1000) + i64::from(count.rem_euclid(1000) >= 500),
    }
}

thread_local! {
    /// Whether a panic of this thread is expected.
    static IS_GUARDED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// Returns the result of `call`; `None` if it panics. Nothing is printed about the panic.
///
/// parquet 60 asserts properties of valid files, for instance that ranges are not negative and that levels of
/// nulls are not empty.
pub(super) fn guarded<T>(call: impl FnOnce() -> T) -> Option<T> {
    static SILENCE: Once = Once::new();
    SILENCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |about| {
            if !IS_GUARDED.get() {
                others(about);
            }
        }));
    });
    IS_GUARDED.set(true);
    // Values involved in a panic are not used afterwards.
    let result = panic::catch_unwind(AssertUnwindSafe(call));
    IS_GUARDED.set(false);
    result.ok()
}

#[cfg(test)]
mod tests;
