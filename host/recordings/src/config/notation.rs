//! Notation of the estimator's numbers in text.

use crate::number::shown;
use estimator_core::{Parameter, Unit, parameter};

/// Notation of a number: in the unit of the table of limits, or in ms.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Notation {
    /// In this unit.
    As(Unit),
    /// In ms, although the field is in s.
    Milliseconds,
}

impl Notation {
    /// Returns the notation of the number with this name.
    pub(super) fn of(name: &str) -> Self {
        if [parameter::WINDOW.name, parameter::GYRO_DELAY.name].contains(&name) {
            return Self::Milliseconds;
        }
        let mut rows = Parameter::ALL.into_iter().map(Parameter::row);
        let row = rows.find(|row| row.name == name);
        Self::As(row.map_or(Unit::One, |row| row.unit))
    }

    /// Formats the value of a field in this notation.
    pub(super) fn number(self, value: f32) -> String {
        match self {
            // Scaled in decimal, because 1e-4 s in binary is not quite 0.1 ms.
            Self::Milliseconds => match value.to_string().parse::<f64>() {
                Ok(seconds) => shown((1.0e3 * seconds) as f32),
                Err(_) => shown(1.0e3 * value),
            },
            Self::As(_) => shown(value),
        }
    }

    /// Returns the unit after a number; empty for loads, which are in the unit of the recording.
    pub(super) fn symbol(self) -> String {
        match self {
            Self::Milliseconds => " ms".to_owned(),
            Self::As(Unit::One | Unit::LoadSignal) => String::new(),
            Self::As(unit) => format!(" {}", unit.symbol()),
        }
    }
}
