//! A row of the table of what can be set, the check of a number against its range, and the error.

use core::fmt;

use crate::units::Unit;

/// A row of the table: what one number may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The path in [`Params`](crate::Params).
    pub name: &'static str,
    /// The unit of the numbers.
    pub unit: Unit,
    /// The least that it may be.
    pub least: f32,
    /// The most that it may be.
    pub most: f32,
    /// What it is unless it is set.
    pub default: f32,
}

impl Row {
    /// Accepts what lies in the range.
    pub(crate) const fn check(&self, value: f32) -> Result<(), ParamsError> {
        in_range(self.name, value, self.least, self.most)
    }
}

/// The ranges alone, as the foot's flash holds them: without names, units and defaults. Evaluated by
/// the compiler only, which would report an index out of range.
#[allow(clippy::indexing_slicing)]
pub(crate) const fn ranges<const N: usize>(rows: &[Row; N]) -> [(f32, f32); N] {
    let mut ranges = [(0.0, 0.0); N];
    let mut i = 0;
    while i < N {
        ranges[i] = (rows[i].least, rows[i].most);
        i += 1;
    }
    ranges
}

/// Why parameters were refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamsError {
    /// A number is outside its range, or not a number.
    OutOfRange {
        /// The field's path in [`Params`](crate::Params); empty on a microcontroller, to save room.
        field: &'static str,
        /// What it was set to.
        value: f32,
        /// The least it may be.
        min: f32,
        /// The most it may be.
        max: f32,
    },
    /// The window comes to no sample at all or to more than there is room for.
    WindowLength {
        /// The window in samples at the sample rate set.
        samples: u32,
        /// The most it may be.
        capacity: usize,
    },
}

impl fmt::Display for ParamsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange {
                field,
                value,
                min,
                max,
            } => write!(f, "{field} is {value}, allowed is {min} to {max}"),
            Self::WindowLength { samples, capacity } => write!(
                f,
                "window comes to {samples} samples at this sample rate, allowed is 1 to {capacity}"
            ),
        }
    }
}

impl core::error::Error for ParamsError {}

/// The name of a field, for people. A foot has no use for it: on a microcontroller it is empty and
/// takes no room.
pub(crate) const fn name(field: &'static str) -> &'static str {
    if cfg!(target_os = "none") { "" } else { field }
}

/// Accepts `min..=max`; a NaN lies in no range.
pub(crate) const fn in_range(
    field: &'static str,
    value: f32,
    min: f32,
    max: f32,
) -> Result<(), ParamsError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(ParamsError::OutOfRange {
            field,
            value,
            min,
            max,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_field_value_and_range() {
        let error = in_range("half_width.ax", -0.5, 1.0e-6, 1.0e4).unwrap_err();
        assert_eq!(
            std::format!("{error}"),
            "half_width.ax is -0.5, allowed is 0.000001 to 10000"
        );
    }
}
