//! Name, unit and range of a number that can be set, and the error of a value that is refused.

use core::fmt;

use crate::units::Unit;

/// Row of a table of numbers: name, meaning, unit, range and default.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Row {
    /// Name in files, in messages and on a foot, with the suffix of the unit.
    pub name: &'static str,
    /// Meaning, as a phrase.
    pub about: &'static str,
    /// The unit of the numbers.
    pub unit: Unit,
    /// Least valid value.
    pub least: f32,
    /// Largest valid value.
    pub most: f32,
    /// Default value.
    pub default: f32,
}

impl Row {
    /// Accepts values within the range.
    pub(crate) const fn check(&self, value: f32) -> Result<(), ParamsError> {
        in_range(self.name, value, self.least, self.most)
    }
}

/// Accepts `min..=max`; a NaN is outside every range.
pub(crate) const fn in_range(
    field: &'static str,
    value: f32,
    min: f32,
    max: f32,
) -> Result<(), ParamsError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(ParamsError::OutOfRange { field, value, min, max })
    }
}

/// The display name of a field. A foot has no use for it, so on a microcontroller it is empty and
/// takes no space.
pub(crate) const fn name(field: &'static str) -> &'static str {
    if cfg!(target_os = "none") { "" } else { field }
}

/// Reason why parameters were rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ParamsError {
    /// A number is outside its range, or not a number.
    OutOfRange {
        /// Name of the number; empty on a microcontroller, to save room.
        field: &'static str,
        /// Rejected value.
        value: f32,
        /// Least valid value.
        min: f32,
        /// Largest valid value.
        max: f32,
    },
    /// The window contains no sample or exceeds the capacity.
    WindowLength {
        /// The window in samples at the rate of the stream.
        samples: u32,
        /// Largest valid length, in samples.
        capacity: usize,
    },
    /// No constant has the name.
    UnknownConstant,
}

impl fmt::Display for ParamsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { field, value, min, max } => {
                write!(f, "{field} is {value}, allowed is {min} to {max}")
            }
            Self::WindowLength { samples, capacity } => write!(
                f,
                "window comes to {samples} samples at this sample rate, allowed is 1 to {capacity}"
            ),
            Self::UnknownConstant => f.write_str("no constant has this name"),
        }
    }
}

impl core::error::Error for ParamsError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_names_field_value_and_range() {
        let error = in_range("half_width.ax", -0.5, 1.0e-6, 1.0e4).unwrap_err();
        assert_eq!(std::format!("{error}"), "half_width.ax is -0.5, allowed is 0.000001 to 10000");
    }
}
