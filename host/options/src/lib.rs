//! How a recording is read, if its format does not define it: its format, units, columns, topics and times. Errors
//! and findings name these options in the words of a program.
//!
//! | part | module |
//! |---|---|
//! | all options of a file | [`InputOptions`] |
//! | formats by name | [`mod@format`] |
//! | units of readings and times, factors, treatment of times | [`units`] |
//! | columns by our names, and the names that other programs give them | [`columns`], [`mapping`], [`names`] |
//! | topics of feet and of their loads | [`topics`] |
//! | errors of a sensor and its mounting | [`correction`] |
//! | hints of errors, findings and notices, in the words of a program | [`hint`] |
//! | words for values | [`words`] |
//! | reasons why the text of an option is invalid | [`problem`] |

pub mod columns;
pub mod correction;
pub mod format;
pub mod hint;
pub mod mapping;
pub mod names;
pub mod problem;
pub mod topics;
pub mod units;
pub mod words;

use std::collections::BTreeMap;

use estimator_core::Gravity;

use crate::hint::{Hint, Notice};

pub use columns::{is_axis, is_ours};
pub use correction::Correction;
pub use format::{Content, Format};
pub use mapping::Mapping;
pub use problem::OptionProblem;
pub use topics::{BagOptions, LoadTopic, Rename, Topics, matches_pattern};
pub use units::{AccelerationUnit, Decimal, RateUnit, Scale, TimeUnit, Times, Units};

/// Properties of a file that its format does not define.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputOptions {
    /// Sample rate in Hz, above 0, if given.
    pub sample_rate: Option<f32>,
    /// Whether the samples contain gravity, if different from the format's default.
    pub gravity: Option<Gravity>,
    /// Static calibration and mounting of the sensor.
    pub correction: Correction,
    /// Corrections of single feet, which replace `correction`: by the name of the foot, or of a recording of one foot.
    pub foot_corrections: BTreeMap<String, Correction>,
    /// Interpretation of named columns. Units, scale and the treatment of times also apply to bags, and the mapping to
    /// messages of other types in them.
    pub table: TableOptions,
    /// Topics of a bag that are read.
    pub bag: BagOptions,
    /// Whether the contacts in a bag are the estimates; a stored recording then describes the contacts.
    pub contacts: ContactUse,
}

impl InputOptions {
    /// Correction of a foot with these names: its own, else the correction of all feet.
    #[must_use]
    pub fn correction_of(&self, names: &[&str]) -> &Correction {
        let mut own = self.foot_corrections.iter();
        own.find(|(foot, _)| is_among(foot, names))
            .map_or(&self.correction, |(_, correction)| correction)
    }
}

/// Returns whether a foot is among names. Upper and lower case of ASCII letters are equal.
pub fn is_among(foot: &str, names: impl IntoIterator<Item = impl AsRef<str>>) -> bool {
    let mut names = names.into_iter();
    names.any(|name| name.as_ref().eq_ignore_ascii_case(foot))
}

/// Source of the estimates of a recording that has contacts of its foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactUse {
    /// The contacts are ignored.
    #[default]
    Ignored,
    /// The contacts are the estimates.
    Recorded,
}

impl ContactUse {
    /// Returns the use of contacts in a recording whose estimates may be computed again from its samples.
    #[must_use]
    pub const fn unless_estimated(again: bool) -> Self {
        if again { Self::Ignored } else { Self::Recorded }
    }
}

/// Returns a notice about given options that only change an estimate, for a file whose contacts are its estimates;
/// `None` without such an option.
#[must_use]
pub fn without_effect(file: &str, options: &[&str]) -> Option<Notice> {
    let named = options.join(", ");
    (!options.is_empty()).then(|| {
        let text =
            format!("{file}: {named} apply to estimates, not to contacts as they were recorded");
        Notice::with_hint(text, Hint::EstimateAgain)
    })
}

/// Properties of a `csv` beyond its header. The default is a table of ours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableOptions {
    /// Mapping of columns to ours.
    pub mapping: Mapping,
    /// The units of the six axes.
    pub units: Units,
    /// Factors of the readings, applied before the units, and of the load.
    pub scale: Scale,
    /// Mark before the fraction of numbers in a text.
    pub decimal: Decimal,
    /// Unit of the times, if given.
    pub time_unit: Option<TimeUnit>,
    /// Treatment of times that are not in order.
    pub times: Times,
}

impl TableOptions {
    /// Converts six readings to SI units, accelerations first.
    #[must_use]
    pub fn to_si(&self, readings: [f64; 6]) -> [f64; 6] {
        let [ax, ay, az, wx, wy, wz] = match self.mapping.exchange() {
            Some(exchange) => exchange.map(|(index, sign)| sign * readings[index]),
            None => readings,
        };
        let (a, w) = (self.scale.acceleration, self.scale.rate);
        let scaled = [a * ax, a * ay, a * az, w * wx, w * wy, w * wz];
        self.units.to_si(scaled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::params::STANDARD_GRAVITY;

    #[test]
    fn counts_are_scaled_before_their_units_apply() {
        let options = TableOptions {
            scale: "0.5,2".parse().unwrap(),
            units: "mg,mdps".parse().unwrap(),
            ..TableOptions::default()
        };
        let [ax, .., wz] = options.to_si([2000.0, 0.0, 0.0, 0.0, 0.0, 90_000.0]);
        assert_eq!(ax, f64::from(STANDARD_GRAVITY));
        assert_eq!(wz, std::f64::consts::PI);
        assert_eq!(options.scale.to_string().parse(), Ok(options.scale));
        let with_load: Scale = "1,1,-9.8".parse().unwrap();
        assert_eq!((with_load.load, with_load.to_string().parse()), (-9.8, Ok(with_load)));
        for wrong in ["", "1", "1,0", "nan,1", "1,inf", "1,2,0", "1,2,3,4"] {
            assert!(wrong.parse::<Scale>().is_err(), "{wrong}");
        }
    }
}
