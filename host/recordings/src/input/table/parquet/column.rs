//! Values of a column in a batch, of any type.

use std::borrow::Cow;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type,
    Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, Int64Array};
use arrow_buffer::{ArrowNativeType, NullBuffer};
use arrow_schema::{DataType, TimeUnit};

/// Returns whether the values of a type are times.
pub(super) const fn is_time(data_type: &DataType) -> bool {
    matches!(data_type, DataType::Timestamp(..) | DataType::Duration(_))
}

/// Returns whether the values of a type can be read. Pandas writes a column without values as nulls.
pub(super) fn is_read(data_type: &DataType) -> bool {
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
pub(super) enum Column {
    Floats(Vec<Option<f64>>),
    Wholes(Vec<Option<i64>>),
    /// Times in µs.
    Moments(Vec<Option<i64>>),
    Texts(Vec<Option<String>>),
}

impl Column {
    /// Values of an array except those in `nulls`; `None` if its type is not supported.
    pub(super) fn of(array: &ArrayRef, nulls: Option<&NullBuffer>) -> Option<Self> {
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

    pub(super) fn is_blank(&self, row: usize) -> bool {
        match self {
            Self::Floats(values) => values[row].is_none(),
            Self::Wholes(values) | Self::Moments(values) => values[row].is_none(),
            Self::Texts(values) => values[row].as_ref().is_none_or(String::is_empty),
        }
    }

    /// Number of a row; the error is a text that is not a number. A timestamp is not a number: it has neither the
    /// unit nor the start of one.
    pub(super) fn number(&self, row: usize) -> Result<Option<f64>, &str> {
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

    pub(super) fn whole(&self, row: usize) -> Option<i64> {
        match self {
            Self::Wholes(values) => values[row],
            Self::Texts(values) => values[row].as_deref()?.trim().parse().ok(),
            _ => None,
        }
    }

    pub(super) fn shown(&self, row: usize) -> Cow<'_, str> {
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
