//! Numbers of the estimator, under their names in its table: a row added there is a key here.

use std::fmt;

use estimator_core::{Axis, GyroTiming, Parameter, Params, parameter};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

use super::set;
use super::value::parse_gyro_timing;

/// Numbers set by a table of the file and its sub-tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    values: Vec<(Parameter, f32)>,
    gyro_timing: Option<GyroTiming>,
}

impl Numbers {
    /// Returns the value that the file sets for a number.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> Option<f32> {
        let mut values = self.values.iter();
        values.find_map(|(of, value)| (*of == parameter).then_some(*value))
    }

    /// Returns the numbers with their values, in the order of the file.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Parameter, f32)> + '_ {
        self.values.iter().copied()
    }

    pub(super) fn apply(&self, params: &mut Params) {
        for (parameter, value) in &self.values {
            parameter.set(params, *value);
        }
        set(&mut params.attitude.gyro_timing, self.gyro_timing);
    }

    fn deserialize<'de, D: Deserializer<'de>>(table: &str, from: D) -> Result<Self, D::Error> {
        let mut numbers = Self::default();
        let seed = Table {
            path: table,
            numbers: &mut numbers,
        };
        seed.deserialize(from)?;
        Ok(numbers)
    }
}

pub(super) fn attitude<'de, D: Deserializer<'de>>(from: D) -> Result<Numbers, D::Error> {
    Numbers::deserialize("attitude", from)
}

pub(super) fn decision<'de, D: Deserializer<'de>>(from: D) -> Result<Numbers, D::Error> {
    Numbers::deserialize("decision", from)
}

pub(super) fn load<'de, D: Deserializer<'de>>(from: D) -> Result<Numbers, D::Error> {
    Numbers::deserialize("load", from)
}

pub(super) fn velocity<'de, D: Deserializer<'de>>(from: D) -> Result<Numbers, D::Error> {
    Numbers::deserialize("velocity", from)
}

/// Splits the name of a number of one axis into the key of all axes and the axis.
pub(super) fn split_axis(name: &str) -> (&str, Option<&str>) {
    match name.rsplit_once('.') {
        Some((key, axis)) if Axis::ALL.iter().any(|of| of.name() == axis) => (key, Some(axis)),
        _ => (name, None),
    }
}

/// Kind of entry in a table.
#[derive(Clone, Copy)]
enum Meaning {
    Number(Parameter),
    GyroTiming,
    /// Nested table.
    Table,
}

/// Returns the valid keys of the table at this path, in the order of the table of limits.
fn keys(path: &str) -> Vec<(String, Meaning)> {
    let mut keys: Vec<(String, Meaning)> = Vec::new();
    let timing = (parameter::GYRO_DELAY.name, Meaning::GyroTiming);
    let numbers = Parameter::ALL.map(|number| (number.name(), Meaning::Number(number)));
    for (name, meaning) in [timing].into_iter().chain(numbers) {
        let Some(name) = name
            .strip_prefix(path)
            .and_then(|rest| rest.strip_prefix('.'))
        else {
            continue;
        };
        let (key, meaning) = match (name.split_once('.'), meaning) {
            (Some((table, _)), _) => (table.to_owned(), Meaning::Table),
            (None, _) => (name.to_owned(), meaning),
        };
        if keys.iter().all(|(other, _)| *other != key) {
            keys.push((key, meaning));
        }
    }
    keys
}

/// Reads a key of the table at this path.
struct Key<'a>(&'a str);

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = (String, Meaning);

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Self::Value, D::Error> {
        from.deserialize_identifier(self)
    }
}

impl Visitor<'_> for Key<'_> {
    type Value = (String, Meaning);

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<Self::Value, E> {
        let keys = keys(self.0);
        let found = keys.iter().find(|(known, _)| known == key);
        found.cloned().ok_or_else(|| {
            let known: Vec<String> = keys.iter().map(|(known, _)| format!("`{known}`")).collect();
            let expected = match &known[..] {
                [one, other] => format!("{one} or {other}"),
                _ => format!("one of {}", known.join(", ")),
            };
            E::custom(format!("unknown field `{key}`, expected {expected}"))
        })
    }
}

/// Reads the table at this path.
struct Table<'a> {
    path: &'a str,
    numbers: &'a mut Numbers,
}

impl<'de> DeserializeSeed<'de> for Table<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        from.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Table<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the table {}", self.path)
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<(), M::Error> {
        while let Some((key, meaning)) = map.next_key_seed(Key(self.path))? {
            match meaning {
                Meaning::Number(number) => {
                    self.numbers.values.push((number, map.next_value()?));
                }
                Meaning::GyroTiming => {
                    let text: String = map.next_value()?;
                    let timing = parse_gyro_timing(&text).map_err(M::Error::custom)?;
                    self.numbers.gyro_timing = Some(timing);
                }
                Meaning::Table => map.next_value_seed(Table {
                    path: &format!("{}.{key}", self.path),
                    numbers: self.numbers,
                })?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Overrides;
    use super::*;

    #[test]
    fn every_number_can_be_set_by_its_key() {
        for number in Parameter::ALL {
            let name = number.name();
            // Axes and the sample rate have separate keys.
            if name.contains("width.") || name == "sample_rate_hz" {
                continue;
            }
            let overrides = Overrides::parse(&format!("{name} = 0.25\n"), "x.toml").expect(name);
            let mut params = Params::DEFAULT;
            overrides.apply(&mut params);
            let mut expected = Params::DEFAULT;
            number.set(&mut expected, 0.25);
            assert_eq!(params, expected, "{name}");
        }
    }

    #[test]
    fn unknown_key_error_lists_the_known_keys() {
        for (text, expected) in [
            (
                "decision.on_delay = 1",
                "unknown field `on_delay`, expected one of `threshold`, `on_delay_s`, `off_delay_s`",
            ),
            (
                "load.threshold = 1",
                "unknown field `threshold`, expected `on_threshold` or `off_threshold`",
            ),
            (
                "attitude.rest.time_s = 1",
                "unknown field `time_s`, expected one of `duration_s`, `acceleration_m_s2`, \
                 `rate_rad_s`, `bias_limit_rad_s`, `bias_time_constant_s`",
            ),
            (
                "attitude.gain = 1",
                "unknown field `gain`, expected one of `gyro_timing`, `motion_time_constant_s`, \
                 `quiet_gain`, `quiet_acceleration_m_s2`, `quiet_rate_rad_s`, `rest`",
            ),
        ] {
            let error = Overrides::parse(text, "x.toml").unwrap_err().to_string();
            let (_, message) = error.split_once(": ").expect("a message");
            assert_eq!(message, expected);
        }
    }
}
