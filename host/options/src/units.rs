//! Units of readings and of times, factors, the mark before a fraction, and the treatment of times.

use std::fmt;
use std::str::FromStr;

use estimator_core::params::STANDARD_GRAVITY;

use crate::problem::OptionProblem;

/// Factors of readings, such as the units of a count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Factor of the accelerometer, finite and not 0.
    pub acceleration: f64,
    /// Factor of the gyroscope, finite and not 0.
    pub rate: f64,
    /// Factor of the load, finite and not 0.
    pub load: f64,
}

impl Default for Scale {
    fn default() -> Self {
        Self { acceleration: 1.0, rate: 1.0, load: 1.0 }
    }
}

impl fmt::Display for Scale {
    /// Writes factors as [`FromStr`] reads them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.acceleration, self.rate)?;
        if self.load == 1.0 { Ok(()) } else { write!(f, ",{}", self.load) }
    }
}

impl FromStr for Scale {
    type Err = OptionProblem;

    /// Reads numbers separated by commas: the factors of accelerometer and gyroscope, and of the load, if given.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let factor = |text: &str| -> Option<f64> {
            let factor = text.trim().parse().ok()?;
            (f64::is_finite(factor) && factor != 0.0).then_some(factor)
        };
        let factors: Option<Vec<f64>> = text.split(',').map(factor).collect();
        match factors.as_deref() {
            Some(&[acceleration, rate]) => Ok(Self { acceleration, rate, ..Self::default() }),
            Some(&[acceleration, rate, load]) => Ok(Self { acceleration, rate, load }),
            _ => Err(OptionProblem::Scale(text.to_owned())),
        }
    }
}

samples::named! {
    /// Mark before the fraction of a number.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Decimal {
        /// `1.5`.
        #[default]
        Point = ".",
        /// `1,5`.
        Comma = ",",
    } or |name| format!("invalid {name:?}: expected . or ,")
}

/// Units of a table's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Units {
    /// Unit of `ax`, `ay` and `az`.
    pub acceleration: AccelerationUnit,
    /// Unit of `wx`, `wy` and `wz`.
    pub rate: RateUnit,
}

samples::named! {
    /// A unit of acceleration.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum AccelerationUnit {
        /// m/s².
        #[default]
        MetresPerSecondSquared = "m/s2",
        /// g, 9.80665 m/s².
        StandardGravity = "g",
        /// A thousandth of g.
        MilliG = "mg",
        /// mm/s².
        MillimetresPerSecondSquared = "mm/s2",
    }
}

samples::named! {
    /// A unit of angular rate.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum RateUnit {
        /// rad/s.
        #[default]
        RadiansPerSecond = "rad/s",
        /// °/s.
        DegreesPerSecond = "dps",
        /// A thousandth of °/s.
        MilliDegreesPerSecond = "mdps",
        /// Revolutions per minute.
        RevolutionsPerMinute = "rpm",
    }
}

impl AccelerationUnit {
    /// The unit with this spelling.
    pub fn written(text: &str) -> Option<Self> {
        Self::of_name(match &*short(text) {
            "m/s^2" | "m/s²" | "m/s/s" | "m/s**2" | "ms^-2" | "m*s^-2" | "m/(s^2)" => "m/s2",
            "mm/s^2" | "mm/s²" | "mm/s/s" | "mm/s**2" | "mms^-2" | "mm*s^-2" | "mm/(s^2)" => {
                "mm/s2"
            }
            "milli-g" | "millig" => "mg",
            name => name,
        })
    }
}

impl RateUnit {
    /// The unit with this spelling.
    pub fn written(text: &str) -> Option<Self> {
        Self::of_name(match &*short(text) {
            "deg/s" => "dps",
            "mdeg/s" | "millideg/s" => "mdps",
            name => name,
        })
    }
}

/// A spelling in small letters with short words: `deg/s` for `Degrees/Second`.
fn short(text: &str) -> String {
    let mut text = text.to_lowercase().replace(' ', "");
    for (word, short) in [
        ("degrees", "deg"),
        ("degree", "deg"),
        ("°", "deg"),
        ("radians", "rad"),
        ("radian", "rad"),
        ("millimeters", "mm"),
        ("millimetres", "mm"),
        ("meters", "m"),
        ("metres", "m"),
        ("seconds", "s"),
        ("second", "s"),
        ("sec", "s"),
        ("per", "/"),
    ] {
        text = text.replace(word, short);
    }
    text
}

impl Units {
    /// Returns whether this is the name of a unit.
    pub fn are_named(text: &str) -> bool {
        AccelerationUnit::written(text).is_some() || RateUnit::written(text).is_some()
    }

    /// Converts six readings to SI units, accelerations first; SI readings are unchanged.
    #[must_use]
    pub fn to_si(self, readings: [f64; 6]) -> [f64; 6] {
        let g = f64::from(STANDARD_GRAVITY);
        let acceleration = |value: f64| match self.acceleration {
            AccelerationUnit::MetresPerSecondSquared => value,
            AccelerationUnit::StandardGravity => value * g,
            AccelerationUnit::MilliG => value / 1000.0 * g,
            AccelerationUnit::MillimetresPerSecondSquared => value / 1000.0,
        };
        let rate = |value: f64| match self.rate {
            RateUnit::RadiansPerSecond => value,
            RateUnit::DegreesPerSecond => value.to_radians(),
            RateUnit::MilliDegreesPerSecond => (value / 1000.0).to_radians(),
            RateUnit::RevolutionsPerMinute => (value * 6.0).to_radians(),
        };
        let [ax, ay, az] = [readings[0], readings[1], readings[2]].map(acceleration);
        let [wx, wy, wz] = [readings[3], readings[4], readings[5]].map(rate);
        [ax, ay, az, wx, wy, wz]
    }
}

impl fmt::Display for Units {
    /// Writes units as [`FromStr`] reads them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.acceleration.name(), self.rate.name())
    }
}

impl FromStr for Units {
    type Err = OptionProblem;

    /// Reads one or two units, separated by a comma, in any order: `m/s2` or `g`, `rad/s` or `dps`, also `m/s^2`,
    /// `m/s²`, `deg/s` or `°/s`.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let (mut acceleration, mut rate) = (None, None);
        for unit in text.split(',').map(str::trim) {
            let twice = match (AccelerationUnit::written(unit), RateUnit::written(unit)) {
                (Some(unit), _) => acceleration.replace(unit).is_some(),
                (None, Some(unit)) => rate.replace(unit).is_some(),
                (None, None) => return Err(OptionProblem::UnknownUnit(unit.to_owned())),
            };
            if twice {
                return Err(OptionProblem::TwoUnits(text.to_owned()));
            }
        }
        Ok(Self { acceleration: acceleration.unwrap_or_default(), rate: rate.unwrap_or_default() })
    }
}

/// Rate, Hz, from which times in ms are plausible for a foot. Below it, another unit may be meant.
const USUAL_RATE: f64 = 50.0;

/// Largest rate in ms or in ticks, Hz, at which times read in s are suspected to be in these units. At larger rates, the
/// sensor may just be slow.
const FASTEST: f64 = 2.002e3;

samples::named! {
    /// Unit of a table's times.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum TimeUnit {
        /// s.
        #[default]
        Seconds = "s",
        /// ms.
        Milliseconds = "ms",
        /// Ticks of 10 kHz, as `SampleTimeFine` of an Xsens `MTi` counts.
        HundredMicroseconds = "100us",
        /// µs.
        Microseconds = "us",
        /// ns.
        Nanoseconds = "ns",
    } or |name| format!("{name:?} is not a unit of time: write s, ms, 100us, us or ns")
}

impl TimeUnit {
    /// Rates of the sensors on feet, Hz.
    pub const RATES_OF_FEET: std::ops::RangeInclusive<f64> = 20.0..=7.0e3;

    /// Units of time without the ticks that only one family of sensors has.
    pub const COMMON: [Self; 4] =
        [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// The unit with this spelling.
    pub fn written(text: &str) -> Option<Self> {
        Self::of_name(match text {
            "sec" => "s",
            "µs" | "μs" => "us",
            "100µs" | "100μs" => "100us",
            name => name,
        })
    }

    /// Name of the unit in a sentence.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::HundredMicroseconds => "ticks of 100 µs",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }

    /// Number of units per second.
    #[must_use]
    pub const fn per_second(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1.0e3,
            Self::HundredMicroseconds => 1.0e4,
            Self::Microseconds => 1.0e6,
            Self::Nanoseconds => 1.0e9,
        }
    }

    /// Returns the units below s in which times are plausible for a foot, with the rate in each, Hz. `rate_in_s` is the rate
    /// if the times were in s. If the times are ambiguous, several units fit.
    #[must_use]
    pub fn that_fit(rate_in_s: f64) -> Vec<(Self, f64)> {
        let rates = Self::ALL.into_iter().skip(1).map(|unit| (unit, rate_in_s * unit.per_second()));
        let fitting: Vec<_> = rates
            .filter(|(unit, rate)| {
                let is_coarse = matches!(unit, Self::Milliseconds | Self::HundredMicroseconds);
                Self::RATES_OF_FEET.contains(rate) && (*rate <= FASTEST || !is_coarse)
            })
            .collect();
        match fitting[..] {
            [(Self::Milliseconds, rate), ..] if rate >= USUAL_RATE => fitting[..1].to_vec(),
            _ => fitting,
        }
    }
}

samples::named! {
    /// Treatment of times that are not in order.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Times {
        /// Times are kept, and smoothed if they jitter without gaps. A time that does not advance is an error.
        #[default]
        Auto = "auto",
        /// Times are kept unchanged. A time that does not advance is an error.
        Keep = "keep",
        /// The fewest possible rows are left out so that times advance: duplicates, steps back, single rows far ahead.
        DropBad = "drop-bad",
        /// Between gaps rows are spaced as their samples were, for stamps that jitter; gaps are kept.
        Smooth = "smooth",
        /// Rows are spaced by the sample rate, for rows that arrive in batches; gaps are closed.
        Rate = "rate",
    } or |name| format!("invalid {name:?}: expected auto, keep, drop-bad, smooth or rate")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_in_any_order_and_default_to_si() {
        let g_dps = Units {
            acceleration: AccelerationUnit::StandardGravity,
            rate: RateUnit::DegreesPerSecond,
        };
        assert_eq!("g,dps".parse(), Ok(g_dps));
        assert_eq!("dps, g".parse(), Ok(g_dps));
        assert_eq!("m/s2,rad/s".parse(), Ok(Units::default()));
        assert_eq!(
            "m/s^2,°/s".parse::<Units>().map(|units| units.to_string()),
            Ok("m/s2,dps".to_owned())
        );
        assert_eq!(g_dps.to_string(), "g,dps");
        let g = Units { acceleration: AccelerationUnit::StandardGravity, ..Units::default() };
        assert_eq!("g".parse(), Ok(g));
        for wrong in ["", "g,g", "g,m/s2", "mph"] {
            assert!(wrong.parse::<Units>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn units_are_known_by_their_usual_spellings() {
        for text in ["m/s^2", "m / s²", "M/S/S", "meters/second^2", "m/sec2", "m s^-2"] {
            let si = AccelerationUnit::MetresPerSecondSquared;
            assert_eq!(AccelerationUnit::written(text), Some(si), "{text}");
        }
        for text in ["mm/s2", "mm/s^2", "MM/S²", "millimeters/second^2"] {
            let unit = AccelerationUnit::MillimetresPerSecondSquared;
            assert_eq!(AccelerationUnit::written(text), Some(unit), "{text}");
        }
        for text in ["dps", "deg/s", "°/s", "Degrees/Second", "degrees per second", "DEG/SEC"] {
            assert_eq!(RateUnit::written(text), Some(RateUnit::DegreesPerSecond), "{text}");
        }
        for text in ["rad/s", "Rad/Sec", "radians/s", "radians per second"] {
            assert_eq!(RateUnit::written(text), Some(RateUnit::RadiansPerSecond), "{text}");
        }
        assert_eq!(RateUnit::written("left foot"), None);
    }

    #[test]
    fn g_and_degrees_become_si_and_si_is_unchanged() {
        let readings = [1.0, 0.1, -2.0, 180.0, 0.3, -90.0];
        let [ax, .., wx, _, _] = "g,dps".parse::<Units>().unwrap().to_si(readings);
        assert_eq!(ax, f64::from(STANDARD_GRAVITY));
        assert_eq!(wx, std::f64::consts::PI);
        assert_eq!(Units::default().to_si(readings), readings);
    }

    #[test]
    fn units_that_fit_are_those_that_make_the_times_of_a_foot() {
        let names = |rate_in_s: f64| {
            TimeUnit::that_fit(rate_in_s).iter().map(|(unit, _)| unit.name()).collect::<Vec<_>>()
        };
        assert_eq!(names(1.0), ["ms"]);
        assert_eq!(names(0.1), ["ms"]);
        assert_eq!(names(1.0e-3), ["us"]);
        assert_eq!(names(1.0e-6), ["ns"]);
        // The times may be of an MTi at 100 Hz. In the second case they may be of an MTi at 200 Hz, or of a logger at
        // 20 Hz in ms.
        assert_eq!(names(0.01), ["100us"]);
        assert_eq!(names(0.02), ["ms", "100us"]);
        // A sensor at 5 Hz.
        assert_eq!(names(5.0), [""; 0]);
    }

    #[test]
    fn unknown_words_error_lists_the_known_ones() {
        assert_eq!("us".parse(), Ok(TimeUnit::Microseconds));
        assert_eq!(
            "min".parse::<TimeUnit>(),
            Err("\"min\" is not a unit of time: write s, ms, 100us, us or ns".to_owned())
        );
        assert_eq!("drop-bad".parse(), Ok(Times::DropBad));
        assert!("drop".parse::<Times>().is_err());
    }
}
