//! Allowed values of an entry.

use crate::abort::AbortCode;
use crate::value::Value;

/// Allowed values. A value outside a range is too high or too low; one that is missing from a list or lies in
/// the gap of a range is invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limits {
    /// Any value of the type.
    Any,
    /// From the first to the second value.
    Range(Value, Value),
    /// From the first to the second value, without those from the third to the fourth,
    /// inclusive.
    RangeWithout(&'static [Value; 4]),
    /// One of these.
    OneOf(&'static [Value]),
}

impl Limits {
    /// Checks whether `value`, which must have the right type, is allowed.
    ///
    /// # Errors
    /// The reason, as an abort code.
    pub fn check(self, value: Value) -> Result<(), AbortCode> {
        match self {
            Self::Any => Ok(()),
            Self::Range(low, high) => in_range(value, low, high),
            Self::RangeWithout(&[low, high, from, to]) => {
                if in_range(value, low, high).is_err() || in_range(value, from, to).is_ok() {
                    return Err(AbortCode::InvalidValue);
                }
                Ok(())
            }
            Self::OneOf(values) => {
                if values.contains(&value) {
                    Ok(())
                } else {
                    Err(AbortCode::InvalidValue)
                }
            }
        }
    }

    /// Minimum and maximum, if there are any.
    #[must_use]
    pub fn range(self) -> Option<(Value, Value)> {
        match self {
            Self::Any => None,
            Self::Range(low, high) | Self::RangeWithout(&[low, high, ..]) => Some((low, high)),
            Self::OneOf(values) => Some((*values.first()?, *values.last()?)),
        }
    }
}

fn in_range(value: Value, low: Value, high: Value) -> Result<(), AbortCode> {
    use core::cmp::Ordering::{Greater, Less};
    match (value.compare(low), value.compare(high)) {
        (Some(Less), _) => Err(AbortCode::TooLow),
        (_, Some(Greater)) => Err(AbortCode::TooHigh),
        (Some(_), Some(_)) => Ok(()),
        // Not a number.
        _ => Err(AbortCode::InvalidValue),
    }
}
