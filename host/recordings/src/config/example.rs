//! Configuration file with every key, as `footfall config` prints it.

use crate::input::Format;
use estimator_core::{Method, Params};
use wire::dictionary::Address;

use super::Preset;
use super::keys::{Key, keys};

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
        text += &format!("\n# {}\n", key.meaning());
        text += &format!("# {}\n", facts(&key, &params));
        text += &format!("#{} = {}\n", key.path, key.value(&params));
    }
    text
}

/// Returns unit, range, object addresses, and a note.
fn facts(key: &Key, params: &Params) -> String {
    let address = |of: &Address| format!("0x{:04X}:{}", of.index, of.subindex);
    let object = match &key.objects()[..] {
        [] => String::new(),
        [only] => format!("on a foot {}", address(only)),
        [first, .., last] => format!("on a foot {} to {}", address(first), address(last)),
    };
    let facts = [key.unit(), &key.range(), &object, note(key, params)];
    let facts: Vec<&str> = facts.into_iter().filter(|fact| !fact.is_empty()).collect();
    facts.join("; ")
}

/// Returns a note on a key without effect for these parameters, or on its value; empty without one.
fn note(key: &Key, params: &Params) -> &'static str {
    let (table, _) = key.path.split_once('.').unwrap_or((&key.path, ""));
    match table {
        "learnt" => "an example, default: a cold start; footfall calibrate writes all of [learnt]",
        "bandwidth" | "half_width" | "window" if params.method == Method::SelfCalibrating => {
            "with method = \"half_widths\" only, else refused"
        }
        "sample_rate_hz" => "default: that of the recording's times",
        "gravity" => "default: that of the recording's format",
        "feet" => {
            "of the foot FL alone, which takes axes, decision, load, learnt, accelerometer and gyroscope"
        }
        _ => "",
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
                assert_eq!(overrides.correction(), crate::input::Correction::NONE);
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
        let error = Overrides::parse("zzz = 1", "x.toml").unwrap_err().to_string();
        let (_, expected) = error.split_once("expected one of ").expect("a list");
        let expected = expected.split(';').next().unwrap_or_default();
        let expected: BTreeSet<String> =
            expected.split(", ").map(|key| key.trim_matches('`').to_owned()).collect();
        assert_eq!(tops, expected);
        // Every key has a meaning and a range.
        for key in keys() {
            assert!(!key.meaning().is_empty(), "{}", key.path);
            assert!(!key.range().is_empty(), "{}", key.path);
        }
    }
}
