//! Words of Python for the settings that errors, findings and notices name: `units="g,dps"`.

use std::fmt::Display;

use pyo3::PyErr;
use recordings::hint::{InWords, Setting, Vocabulary};

use crate::parameters::value_error;

/// Arguments of the package.
struct Arguments;

impl Vocabulary for Arguments {
    fn name(&self, setting: Setting) -> String {
        match setting {
            Setting::EstimateAgain => "estimate_again=True".to_owned(),
            other => format!("{}=", argument(other)),
        }
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        match setting {
            // A number.
            Setting::SampleRate => format!("{}={value}", argument(setting)),
            // A pair of numbers.
            Setting::Scale => format!("{}=({value})", argument(setting)),
            other => format!("{}=\"{value}\"", argument(other)),
        }
    }
}

fn argument(setting: Setting) -> String {
    match setting {
        Setting::SampleRate => "rate".to_owned(),
        other => other.name().replace(' ', "_"),
    }
}

/// Returns the text of an error, a finding or a notice, with arguments in it.
pub(crate) fn in_words(what: &impl InWords) -> String {
    what.in_words(&Arguments)
}

/// Returns the error of a wrong argument or recording, with arguments in its text.
#[expect(clippy::needless_pass_by_value, reason = "it maps errors, which are passed by value")]
pub(crate) fn refused(error: impl InWords) -> PyErr {
    value_error(in_words(&error))
}

/// Texts of notices, with arguments in them.
pub(crate) fn all_in_words<S: InWords>(all: &[S]) -> Vec<String> {
    all.iter().map(in_words).collect()
}
