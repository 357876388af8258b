//! Words of the command line for the settings that errors, findings and notices name: `--units g,dps`.

use std::fmt::Display;

use recordings::hint::{InWords, Setting, Vocabulary};

/// Options of the command line.
#[derive(Clone, Copy, Debug)]
pub struct CommandLine;

impl Vocabulary for CommandLine {
    fn name(&self, setting: Setting) -> String {
        format!("--{}", setting.name().replace(' ', "-"))
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        format!("{} {value}", self.name(setting))
    }
}

/// Returns the text of an error, a finding or a notice, with options in it.
pub fn in_words(what: &impl InWords) -> String {
    what.in_words(&CommandLine)
}

#[cfg(test)]
mod tests {
    use recordings::hint::Hint;

    use super::*;

    #[test]
    fn hint_names_the_option_with_its_value() {
        assert_eq!(in_words(&Hint::Units("g,dps".parse().unwrap())), "--units g,dps");
        assert_eq!(
            in_words(&Hint::ChooseTopic { topics: true, frames: true }),
            "choose with --topic and --frame, or --topic all"
        );
        assert_eq!(in_words(&Hint::SampleRate), "--sample-rate HZ");
    }
}
