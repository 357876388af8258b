//! Values of a column in a batch, of any type.

use std::borrow::Cow;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowDictionaryKeyType, ArrowPrimitiveType, DurationMicrosecondType, DurationMillisecondType,
    DurationNanosecondType, DurationSecondType, Float16Type, Float32Type, Float64Type, Int8Type,
    Int16Type, Int32Type, Int64Type, TimestampMicrosecondType, TimestampMillisecondType,
    TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef};
use arrow_buffer::NullBuffer;
use arrow_schema::{DataType, TimeUnit};

/// Interpretation of the values of a type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number,
    Moment,
    Text,
}

impl Kind {
    /// Kind of a type; `None` if it is not supported.
    pub(super) fn of(data_type: &DataType) -> Option<Self> {
        match data_type {
            DataType::Timestamp(..) | DataType::Duration(_) => Some(Self::Moment),
            DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => Some(Self::Text),
            DataType::Dictionary(key, value)
                if key.is_integer() && Self::of(value) == Some(Self::Text) =>
            {
                Some(Self::Text)
            }
            DataType::Boolean | DataType::Float16 | DataType::Float32 | DataType::Float64 => {
                Some(Self::Number)
            }
            integer if integer.is_integer() => Some(Self::Number),
            // Only nulls: pandas writes a column without values as this type.
            DataType::Null => Some(Self::Number),
            _ => None,
        }
    }
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
            DataType::Int8 => Self::Wholes(source.primitive::<Int8Type, _>(i64::from)?),
            DataType::Int16 => Self::Wholes(source.primitive::<Int16Type, _>(i64::from)?),
            DataType::Int32 => Self::Wholes(source.primitive::<Int32Type, _>(i64::from)?),
            DataType::Int64 => Self::Wholes(source.primitive::<Int64Type, _>(|v| v)?),
            DataType::UInt8 => Self::Wholes(source.primitive::<UInt8Type, _>(i64::from)?),
            DataType::UInt16 => Self::Wholes(source.primitive::<UInt16Type, _>(i64::from)?),
            DataType::UInt32 => Self::Wholes(source.primitive::<UInt32Type, _>(i64::from)?),
            DataType::UInt64 => {
                let saturated = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
                Self::Wholes(source.primitive::<UInt64Type, _>(saturated)?)
            }
            DataType::Boolean => {
                let values = array.as_boolean_opt()?;
                Self::Wholes(source.each(|row| i64::from(values.value(row))))
            }
            DataType::Null => Self::Floats(vec![None; array.len()]),
            DataType::Timestamp(unit, _) => Self::Moments(source.timestamps(*unit)?),
            DataType::Duration(unit) => Self::Moments(source.durations(*unit)?),
            DataType::Dictionary(key, _) => Self::Texts(match &**key {
                DataType::Int8 => source.dictionary::<Int8Type>()?,
                DataType::Int16 => source.dictionary::<Int16Type>()?,
                DataType::Int32 => source.dictionary::<Int32Type>()?,
                DataType::Int64 => source.dictionary::<Int64Type>()?,
                DataType::UInt8 => source.dictionary::<UInt8Type>()?,
                DataType::UInt16 => source.dictionary::<UInt16Type>()?,
                DataType::UInt32 => source.dictionary::<UInt32Type>()?,
                DataType::UInt64 => source.dictionary::<UInt64Type>()?,
                _ => return None,
            }),
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
        match self {
            Self::Floats(values) => values[row]
                .map_or_else(String::new, |v| v.to_string())
                .into(),
            Self::Wholes(values) => values[row]
                .map_or_else(String::new, |v| v.to_string())
                .into(),
            Self::Moments(values) => {
                let text = |micros| format!("{} s", micros as f64 / 1.0e6);
                values[row].map_or_else(String::new, text).into()
            }
            Self::Texts(values) => values[row].as_deref().unwrap_or_default().into(),
        }
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
        (0..self.array.len())
            .map(|row| is_there(row).then(|| value(row)))
            .collect()
    }

    fn primitive<A: ArrowPrimitiveType, T>(
        &self,
        convert: impl Fn(A::Native) -> T,
    ) -> Option<Vec<Option<T>>> {
        let values = self.array.as_primitive_opt::<A>()?;
        Some(self.each(|row| convert(values.value(row))))
    }

    fn timestamps(&self, unit: TimeUnit) -> Option<Vec<Option<i64>>> {
        match unit {
            TimeUnit::Second => self.primitive::<TimestampSecondType, _>(seconds),
            TimeUnit::Millisecond => self.primitive::<TimestampMillisecondType, _>(milliseconds),
            TimeUnit::Microsecond => self.primitive::<TimestampMicrosecondType, _>(|v| v),
            TimeUnit::Nanosecond => self.primitive::<TimestampNanosecondType, _>(nanoseconds),
        }
    }

    fn durations(&self, unit: TimeUnit) -> Option<Vec<Option<i64>>> {
        match unit {
            TimeUnit::Second => self.primitive::<DurationSecondType, _>(seconds),
            TimeUnit::Millisecond => self.primitive::<DurationMillisecondType, _>(milliseconds),
            TimeUnit::Microsecond => self.primitive::<DurationMicrosecondType, _>(|v| v),
            TimeUnit::Nanosecond => self.primitive::<DurationNanosecondType, _>(nanoseconds),
        }
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

    fn dictionary<K: ArrowDictionaryKeyType>(&self) -> Option<Vec<Option<String>>> {
        let dictionary = self.array.as_dictionary_opt::<K>()?;
        let nulls = dictionary.values().logical_nulls();
        let words = Values {
            array: dictionary.values(),
            nulls: nulls.as_ref(),
        };
        let words = words.texts()?;
        let word = |row| {
            dictionary
                .key(row)
                .and_then(|key| words.get(key).cloned().flatten())
        };
        Some(self.each(word).into_iter().map(Option::flatten).collect())
    }
}

fn seconds(value: i64) -> i64 {
    value.saturating_mul(1_000_000)
}

fn milliseconds(value: i64) -> i64 {
    value.saturating_mul(1000)
}

fn nanoseconds(value: i64) -> i64 {
    value.div_euclid(1000) + i64::from(value.rem_euclid(1000) >= 500)
}
