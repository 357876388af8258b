//! Units of parameters, and constants for their conversion.

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY: f32 = 9.806_65;

/// One degree in radians.
pub(crate) const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// Unit of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unit {
    /// A ratio, a probability or a factor.
    One,
    /// Hz.
    Hertz,
    /// s.
    Second,
    /// m.
    Metre,
    /// m/s.
    MetrePerSecond,
    /// m/s².
    MetrePerSecondSquared,
    /// rad/s.
    RadianPerSecond,
    /// The unit of the load signal: N for a calibrated load cell.
    LoadSignal,
    /// Natural logarithm of m/s².
    LogMetrePerSecondSquared,
    /// Natural logarithm of m/s.
    LogMetrePerSecond,
}

impl Unit {
    /// Symbol of the unit; empty for [`Unit::One`].
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::One => "",
            Self::Hertz => "Hz",
            Self::Second => "s",
            Self::Metre => "m",
            Self::MetrePerSecond => "m/s",
            Self::MetrePerSecondSquared => "m/s²",
            Self::RadianPerSecond => "rad/s",
            Self::LoadSignal => "N",
            Self::LogMetrePerSecondSquared => "ln(m/s²)",
            Self::LogMetrePerSecond => "ln(m/s)",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_unique_and_a_ratio_has_an_empty_one() {
        let units = [
            Unit::One,
            Unit::Hertz,
            Unit::Second,
            Unit::Metre,
            Unit::MetrePerSecond,
            Unit::MetrePerSecondSquared,
            Unit::RadianPerSecond,
            Unit::LoadSignal,
            Unit::LogMetrePerSecondSquared,
            Unit::LogMetrePerSecond,
        ];
        for unit in units {
            let same = units.into_iter().filter(|u| u.symbol() == unit.symbol());
            assert_eq!(same.count(), 1, "{unit:?}");
        }
        assert_eq!(Unit::One.symbol(), "");
    }
}
