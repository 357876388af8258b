//! Configuration file with every key, as `footfall config` prints it.

use std::fmt::Write;

use crate::input::Format;
use estimator_core::{Method, Params};
use wire::dictionary::Address;

use super::Preset;
use super::keys::{Key, OF_FOOT, keys};

/// Returns a file in which every key is commented out, with its preset value, meaning, unit and range. Each line
/// is valid alone, without the header of a table.
#[must_use]
pub fn example(preset: Preset) -> String {
    let params = preset.params(Format::Csv);
    let name = preset.name();
    let mut text = format!(
        "# A configuration of footfall, for --config, with the values of --preset {name}.\n\
         # All keys may be left out. Remove the # before those that are to differ;\n\
         # `footfall config --check FILE` says whether they can be what they are.\n"
    );
    for key in keys() {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{}", commented(&sentence(&key)));
        let _ = writeln!(text, "# {}", facts(&key));
        if let Some(note) = note(&key, &params) {
            let _ = writeln!(text, "# {note}");
        }
        let _ = writeln!(text, "#{} = {}", key.path, key.value(&params));
    }
    text
}

/// Returns the meaning, with a capital letter.
fn sentence(key: &Key) -> String {
    let meaning = key.meaning();
    let mut letters = meaning.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).collect()
}

/// Returns unit, range and object addresses.
fn facts(key: &Key) -> String {
    let mut facts = vec![key.range()];
    if !key.unit().is_empty() {
        facts.insert(0, key.unit().to_owned());
    }
    let object = objects_text(&key.objects());
    if !object.is_empty() {
        facts.push(format!("on a foot {object}"));
    }
    facts.join("; ")
}

/// Returns a note on a key without effect for these parameters, or on its value.
fn note(key: &Key, params: &Params) -> Option<&'static str> {
    if key.path.starts_with("learnt.") {
        return Some(
            "An example; footfall calibrate writes all of [learnt]. Default: a cold start",
        );
    }
    if ["bandwidth.", "half_width.", "window"]
        .iter()
        .any(|of| key.path.starts_with(of))
    {
        let is_refused = params.method == Method::SelfCalibrating;
        return is_refused.then_some("With method = \"half_widths\" only, else refused");
    }
    match key.path.as_str() {
        "sample_rate_hz" => Some("Default: that of the recording's times"),
        "gravity" => Some("Default: that of the recording's format"),
        "feet.FL.axes" => {
            Some("Of the foot FL alone; [feet.FL] also takes learnt, accelerometer and gyroscope")
        }
        path if path.starts_with(OF_FOOT) => Some("Of the foot FL alone"),
        _ => None,
    }
}

/// Wraps a text into lines of at most 78 characters that begin with `# `.
fn commented(text: &str) -> String {
    const WIDTH: usize = 78;
    let mut lines = vec![String::from("#")];
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("# {word}")),
        }
    }
    lines.join("\n") + "\n"
}

/// Formats addresses of one object, such as `0x2011, sub-indices 1 to 3`.
fn objects_text(addresses: &[Address]) -> String {
    match addresses {
        [] => String::new(),
        [only] if only.subindex == 0 => format!("0x{:04X}", only.index),
        [only] => format!("0x{:04X}, sub-index {}", only.index, only.subindex),
        [first, .., last] => format!(
            "0x{:04X}, sub-indices {} to {}",
            first.index, first.subindex, last.subindex
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::Overrides;
    use super::*;

    const PRESETS: [Preset; 2] = [Preset::Default, Preset::Paper];

    /// Returns the keys of an example with their values, without the `#`.
    fn set(text: &str) -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.strip_prefix('#'));
        lines
            .filter(|line| line.contains(" = ") && !line.starts_with(' '))
            .map(str::to_owned)
            .collect()
    }

    #[test]
    fn the_example_changes_nothing() {
        for preset in PRESETS {
            let overrides = Overrides::parse(&example(preset), "x.toml").unwrap();
            assert_eq!(overrides, Overrides::default());
        }
    }

    #[test]
    fn each_example_line_parses_to_the_preset_value() {
        for preset in PRESETS {
            let lines = set(&example(preset));
            assert_eq!(lines.len(), keys().len());
            let params = preset.params(Format::Csv);
            for line in &lines {
                // Learnt values are valid only together, and no preset has any.
                if line.starts_with("learnt.") {
                    continue;
                }
                let overrides = Overrides::parse(line, "x.toml").expect(line);
                assert_ne!(overrides, Overrides::default(), "{line}");
                let mut with = params;
                overrides.apply(&mut with);
                assert_eq!(with, params, "{line}");
                let correction = overrides.correction("x.toml").expect(line);
                assert_eq!(correction, crate::input::Correction::NONE);
            }
        }
    }

    #[test]
    fn uncommented_example_is_valid() {
        for preset in PRESETS {
            let overrides = Overrides::parse(&set(&example(preset)).join("\n"), "x.toml").unwrap();
            let mut params = preset.params(Format::Csv);
            overrides.apply(&mut params);
            assert!(params.validate::<256>().is_ok());
            assert!(params.learnt.is_some());
        }
    }

    #[test]
    fn example_lists_every_key() {
        let tops: BTreeSet<String> = keys()
            .iter()
            .map(|key| key.path.split('.').next().unwrap_or_default().to_owned())
            .collect();
        // The reader lists the known keys.
        let error = Overrides::parse("zzz = 1", "x.toml")
            .unwrap_err()
            .to_string();
        let (_, expected) = error.split_once("expected one of ").expect("a list");
        let expected = expected.split(';').next().unwrap_or_default();
        let expected: BTreeSet<String> = expected
            .split(", ")
            .map(|key| key.trim_matches('`').to_owned())
            .collect();
        assert_eq!(tops, expected);
        // Every key has a meaning and a range.
        for key in keys() {
            assert!(!key.meaning().is_empty(), "{}", key.path);
            assert!(!key.range().is_empty(), "{}", key.path);
        }
    }
}
