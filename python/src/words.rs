//! Words of Python for the settings that errors, findings and notices name: `units="g,dps"` for a file, and what to do with
//! the arrays where an argument of files would help.

use std::fmt::Display;

use options::hint::{Hint, InWords, Setting, Vocabulary};
use options::{AccelerationUnit, RateUnit};
use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// Origin of samples, which determines the available arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// A file, by `read` or `estimate_file`.
    File,
    /// Arrays of the caller, by `estimate`.
    Arrays,
}

/// Arguments of `read` and `estimate_file`.
struct FileArguments;

impl Vocabulary for FileArguments {
    fn name(&self, setting: Setting) -> String {
        match setting {
            Setting::EstimateAgain => "estimate_again=True".to_owned(),
            Setting::Window => "the key window of config=".to_owned(),
            other => format!("{}=", argument(other)),
        }
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        match setting {
            // A number.
            Setting::SampleRate => format!("{}={value}", argument(setting)),
            // Numbers.
            Setting::Scale => format!("{}=({value})", argument(setting)),
            Setting::Window => format!("config={{\"window\": \"{value}\"}}"),
            other => format!("{}=\"{value}\"", argument(other)),
        }
    }
}

/// Arguments of `estimate`, which takes arrays in SI units and has no options for reading.
struct ArrayArguments;

impl Vocabulary for ArrayArguments {
    fn name(&self, setting: Setting) -> String {
        FileArguments.name(setting)
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        FileArguments.set(setting, value)
    }

    fn remedy(&self, hint: &Hint) -> Option<String> {
        let text = match hint {
            Hint::AccelerationUnit(AccelerationUnit::StandardGravity) => {
                "acc * 9.80665 is in m/s²".to_owned()
            }
            Hint::RateUnit(RateUnit::DegreesPerSecond) => "np.radians(gyr) is in rad/s".to_owned(),
            Hint::RateUnit(RateUnit::RevolutionsPerMinute) => {
                "gyr * np.pi / 30 is in rad/s".to_owned()
            }
            Hint::RateUnit(RateUnit::MilliDegreesPerSecond) => {
                "np.radians(gyr / 1000) is in rad/s".to_owned()
            }
            Hint::DegreesOrRevolutions => {
                "np.radians(gyr) or gyr * np.pi / 30 is in rad/s".to_owned()
            }
            Hint::OtherRateUnit => {
                "gyr must be in rad/s: multiply counts by their value".to_owned()
            }
            Hint::SplitFeet => "estimate each foot by itself".to_owned(),
            Hint::OtherUnit => "acc must be in m/s²: multiply counts by their value".to_owned(),
            Hint::TimesLookLike(unit) => {
                format!("t looks like {}: t / {:.0e} is in s", unit.words(), unit.per_second())
            }
            Hint::TimesLookLikeOneOf(units) => {
                let each = units.iter().map(|(unit, rate)| {
                    format!(
                        "t / {:.0e} is in s if t is in {}, which gives {rate:.0} Hz",
                        unit.per_second(),
                        unit.words()
                    )
                });
                each.collect::<Vec<_>>().join("; ")
            }
            Hint::OtherTimeUnit => "t must be in s, or datetime64".to_owned(),
            Hint::Batches | Hint::SpaceRows => STEADY.to_owned(),
            Hint::MissingSamples => format!("samples are missing, or {STEADY}"),
            Hint::ExchangeColumns(mapping) => exchanged(mapping),
            Hint::TurnRatesAround => {
                "one axis has the wrong sign, or two are exchanged; -gyr repairs it".to_owned()
            }
            Hint::TurnLoadAround => "-load has the other sign".to_owned(),
            _ => return None,
        };
        Some(text)
    }
}

/// Remedy for times of arrival.
const STEADY: &str = "leave out t and give rate=";

/// Exchange of columns of arrays for a mapping of the columns of a table.
fn exchanged(mapping: &str) -> String {
    let source = |axis: &str| {
        let source = mapping.split(',').find_map(|pair| pair.strip_prefix(axis)?.strip_prefix('='));
        source.unwrap_or(axis).to_owned()
    };
    if source("ax").starts_with('w') {
        return "exchange acc and gyr".to_owned();
    }
    if !mapping.contains("ax=") && !mapping.contains("ay=") && !mapping.contains("az=") {
        let axes = ["wx", "wy", "wz"].map(source);
        let place = |axis: &String| match axis.trim_start_matches('-') {
            "wx" => "0",
            "wy" => "1",
            _ => "2",
        };
        let sign = |axis: &String| if axis.starts_with('-') { "-1" } else { "1" };
        let (places, signs) = (axes.each_ref().map(place), axes.each_ref().map(sign));
        return format!(
            "gyr[:, [{}]] * [{}] has the axes of acc",
            places.join(", "),
            signs.join(", ")
        );
    }
    let places = ["ax", "ay", "az"].map(|axis| match source(axis).as_str() {
        "ax" => "0",
        "ay" => "1",
        _ => "2",
    });
    let places = places.join(", ");
    format!("acc[:, [{places}]] and gyr[:, [{places}]] exchange them")
}

fn argument(setting: Setting) -> String {
    match setting {
        Setting::SampleRate => "rate".to_owned(),
        other => other.name().replace(' ', "_"),
    }
}

/// Returns the text of an error, a finding or a notice about samples of this origin, with arguments in it.
pub(crate) fn in_words_of(origin: Origin, what: &impl InWords) -> String {
    match origin {
        Origin::File => what.in_words(&FileArguments),
        Origin::Arrays => what.in_words(&ArrayArguments),
    }
}

/// Returns the text of an error, a finding or a notice about a file, with arguments in it.
pub(crate) fn in_words(what: &impl InWords) -> String {
    in_words_of(Origin::File, what)
}

/// Returns the error of a wrong argument or recording, with arguments in its text.
#[expect(clippy::needless_pass_by_value, reason = "it maps errors, which are passed by value")]
pub(crate) fn refused(error: impl InWords) -> PyErr {
    value_error(in_words(&error))
}

/// Returns an error with this text.
pub(crate) fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Texts of notices, with arguments in them.
pub(crate) fn all_in_words<S: InWords>(all: &[S]) -> Vec<String> {
    all.iter().map(in_words).collect()
}
