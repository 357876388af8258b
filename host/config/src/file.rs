//! A configuration file: its settings, read by the table of keys, and its errors by line and key.

use std::collections::BTreeMap;
use std::{fmt, io};

use estimator_core::any::{AnyParams, Method};
use estimator_core::half_widths::WindowLength;
use estimator_core::mounting::Mounting;
use estimator_core::parameter::Parameter;
use estimator_core::params::GyroTiming;
use estimator_core::{Gravity, Learning, Learnt, LearntError};
use serde::de::{DeserializeOwned, IgnoredAny};
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::keys::{CorrectionKey, Key, Kind, axis, keys, keys_of_a_foot};
use crate::value::{
    checked_sample_rate, parse_gravity, parse_gyro_timing, parse_learning, parse_method,
    parse_window,
};
use options::{Correction, is_among};
use samples::mounting::parse_axes;

/// Name and text of a configuration file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfigFile {
    /// Name, as given.
    pub name: String,
    /// Text.
    pub text: String,
}

/// Settings in a configuration file, which override the preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Settings for all feet.
    pub all: Settings,
    /// Settings of single feet, by name; they override the settings for all feet.
    pub feet: BTreeMap<String, Settings>,
}

/// Error of a configuration file.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be opened or read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// Name of the file, as given.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not valid TOML, or has unknown keys or invalid values: a line for each.
    #[error("{}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Wrong {
        /// The errors, in the order of the file; at least one.
        errors: Vec<KeyError>,
    },
}

/// Error of a key or a line of a configuration file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{file}, {position}{}: {message}", key.as_ref().map(|key| format!(", key {key}")).unwrap_or_default())]
pub struct KeyError {
    /// Name of the file, as given.
    pub file: String,
    /// Position in the file.
    pub position: Position,
    /// Key with its table, if the line has one.
    pub key: Option<String>,
    /// Description of the error.
    pub message: String,
}

/// Number of errors that are shown.
const MOST_ERRORS: usize = 20;

impl Overrides {
    /// Parses the text of a configuration file; `file` names it in errors.
    ///
    /// # Errors
    /// The errors of all keys, each with its line, or the first of the syntax.
    pub fn parse(text: &str, file: &str) -> Result<Self, ConfigError> {
        let mut reader = Reader::default();
        let all = match DeTable::parse(text) {
            Ok(table) => reader.read_all(table.get_ref()),
            Err(error) => {
                let byte = error.span().map_or(0, |span| span.start);
                reader.error(byte, error.message().trim().replace('\n', ", "));
                Settings::default()
            }
        };
        if reader.errors.is_empty() {
            return Ok(Self { all, feet: reader.feet });
        }
        reader.errors.sort_by_key(|(byte, _)| *byte);
        let errors = reader.errors.into_iter().take(MOST_ERRORS);
        let errors = errors.map(|(byte, message)| {
            let position = Position::of_byte(text, byte);
            KeyError {
                file: file.to_owned(),
                position,
                key: key_on_line(text, position.line),
                message,
            }
        });
        Err(ConfigError::Wrong { errors: errors.collect() })
    }

    /// Returns the correction of the sensor's errors and its mounting in the foot.
    #[must_use]
    pub fn correction(&self) -> Correction {
        self.all.corrected(Correction::NONE)
    }

    /// Returns the corrections of single feet, by name.
    #[must_use]
    pub fn foot_corrections(&self) -> BTreeMap<String, Correction> {
        let all = self.correction();
        let feet = self.feet.iter();
        feet.map(|(name, foot)| (name.clone(), foot.corrected(all))).collect()
    }

    /// Applies the settings of a foot with these names to `params`, after the settings of all feet.
    pub fn apply_foot(&self, names: &[&str], params: &mut AnyParams) {
        let mut feet = self.feet.iter();
        let own = feet.find(|(foot, _)| is_among(foot, names));
        if let Some((_, own)) = own {
            own.apply(params);
        }
    }

    /// Applies the settings for all feet to `params`.
    pub fn apply(&self, params: &mut AnyParams) {
        self.all.apply(params);
    }
}

/// Settings for all feet, or for one. Values that are present override the preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Rate of the samples, Hz.
    pub sample_rate: Option<f32>,
    /// Whether samples contain gravity.
    pub gravity: Option<Gravity>,
    /// Mounting of the recording's sensor in the foot.
    pub axes: Option<Mounting>,
    /// Source of the limits of stillness.
    pub method: Option<Method>,
    /// Whether the foot continues to learn.
    pub learning: Option<Learning>,
    /// Values learnt earlier, for a warm start.
    pub learnt: Option<Learnt>,
    /// Length of the window.
    pub window: Option<WindowLength>,
    gyro_timing: Option<GyroTiming>,
    /// Numbers of the estimator, in the order of the file.
    numbers: Vec<(Parameter, f32)>,
    /// Errors of the recording's sensor.
    corrections: Vec<AxisCorrection>,
}

/// Value that a correction key sets for one axis.
#[derive(Clone, Debug, PartialEq)]
struct AxisCorrection {
    key: CorrectionKey,
    /// Index in the axes of the key, which are x, y and z of the sensor.
    axis: usize,
    value: f32,
}

impl Settings {
    /// Returns the value that is set for a number.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> Option<f32> {
        let mut numbers = self.numbers.iter();
        numbers.find_map(|(number, value)| (*number == parameter).then_some(*value))
    }

    /// Returns whether the file sets a number, or another number that limits it.
    pub(super) fn determines(&self, name: &str) -> bool {
        let is_limited = name == Parameter::LoadOffThreshold.name();
        let mut names = self.numbers.iter().map(|(number, _)| number.name());
        names.any(|set| set == name || is_limited && set == Parameter::LoadOnThreshold.name())
    }

    /// Returns whether a number is set in this table.
    pub(super) fn has(&self, table: &str) -> bool {
        let mut names = self.numbers.iter().map(|(number, _)| number.name());
        names.any(|name| name.split('.').next() == Some(table))
    }

    /// Applies the settings to `params`.
    pub fn apply(&self, params: &mut AnyParams) {
        set(&mut params.method, self.method);
        set(&mut params.params.learning, self.learning);
        set(&mut params.params.learnt, self.learnt.map(Some));
        set(&mut params.params.attitude.gyro_timing, self.gyro_timing);
        set(&mut params.half_widths.window, self.window);
        for (parameter, value) in &self.numbers {
            parameter.set(params, *value);
        }
    }

    /// Returns another correction with the mounting and the sensor's errors that are set.
    fn corrected(&self, mut correction: Correction) -> Correction {
        set(&mut correction.mounting, self.axes);
        for AxisCorrection { key, axis, value } in &self.corrections {
            let numbers = (key.numbers)(&mut correction);
            *[&mut numbers.x, &mut numbers.y, &mut numbers.z][*axis] = *value;
        }
        correction
    }
}

fn set<T: Copy>(field: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *field = value;
    }
}

/// Reader of a file: collects all errors of its keys, each with the byte at which it is.
#[derive(Default)]
struct Reader {
    feet: BTreeMap<String, Settings>,
    errors: Vec<(usize, String)>,
    /// The current table of learnt numbers.
    learnt: LearntTable,
}

/// Values of a table of learnt numbers, as far as they were read.
#[derive(Default)]
struct LearntTable {
    /// In the order of [`Learnt::ROWS`].
    numbers: [Option<f32>; Learnt::NUMBERS],
    version: Option<u32>,
    crc: Option<u32>,
}

type Value<'a> = Spanned<DeValue<'a>>;

impl Reader {
    /// Reads the settings for all feet, and the settings of single feet.
    fn read_all(&mut self, table: &DeTable<'_>) -> Settings {
        let mut all = Settings::default();
        self.read_table(table, "", &keys(), &mut all);
        all
    }

    /// Reads the table whose keys begin with `within`.
    fn read_table(&mut self, table: &DeTable<'_>, within: &str, keys: &[Key], to: &mut Settings) {
        for (key, value) in in_order(table) {
            let path = format!("{within}{}", key.get_ref());
            let below = format!("{path}.");
            if path == "feet" && keys.iter().any(|known| known.path.starts_with(&below)) {
                self.read_feet(value);
            } else if let Some(known) = keys.iter().find(|known| known.path == path) {
                self.read_setting(&known.kind, value, to);
            } else if keys.iter().any(|known| known.path.starts_with(&below)) {
                let errors_before = self.errors.len();
                if let Some(table) = self.table_of(value, &format!("the table {path}")) {
                    self.read_table(table, &below, keys, to);
                }
                if path == "learnt" && self.errors.len() == errors_before {
                    to.learnt = self.learnt(value);
                }
            } else {
                self.unknown(key, &names_below(keys, within));
            }
        }
    }

    fn read_feet(&mut self, value: &Value<'_>) {
        let Some(feet) = self.table_of(value, "the table feet") else {
            return;
        };
        for (name, value) in in_order(feet) {
            let mut own = Settings::default();
            let mut earlier = self.feet.keys();
            let same_foot = earlier.find(|foot| foot.eq_ignore_ascii_case(name.get_ref()));
            if let Some(same_foot) = same_foot {
                let message = format!("feet.{same_foot} and feet.{} are one foot", name.get_ref());
                self.error(name.span().start, message);
            }
            if let Some(table) = self.table_of(value, "a table of settings") {
                self.read_table(table, "", &keys_of_a_foot(), &mut own);
            }
            self.feet.insert(name.get_ref().to_string(), own);
        }
    }

    fn read_setting(&mut self, kind: &Kind, value: &Value<'_>, to: &mut Settings) {
        match kind {
            Kind::SampleRate => {
                let rate = self.deserialized(value, "a number").map(checked_sample_rate);
                to.sample_rate = rate.and_then(|rate| self.value_or_error(value, rate));
            }
            Kind::Gravity => to.gravity = self.word(value, parse_gravity),
            Kind::Axes => to.axes = self.word(value, parse_axes),
            Kind::Method => to.method = self.word(value, parse_method),
            Kind::Learning => to.learning = self.word(value, parse_learning),
            Kind::Window => to.window = self.word(value, parse_window),
            Kind::GyroTiming => to.gyro_timing = self.word(value, parse_gyro_timing),
            Kind::Learnt(index) => {
                self.learnt.numbers[*index] = self.deserialized(value, "a number");
            }
            Kind::LearntVersion => self.learnt.version = self.deserialized(value, "a version"),
            Kind::LearntCrc => self.learnt.crc = self.deserialized(value, "a CRC of 32 bits"),
            Kind::Numbers(parameters) => to.numbers.extend(self.numbers(value, parameters)),
            Kind::Correction(key) => {
                let check = |axis: &str, number| key.checked(axis, number);
                let read = self.numbers_by_axis(value, &key.axes, check).into_iter();
                let corrections =
                    read.map(|(axis, value)| AxisCorrection { key: *key, axis, value });
                to.corrections.extend(corrections);
            }
        }
    }

    /// Reads one number, or numbers of the axes of a sensor: one for all, or a table of them.
    fn numbers(&mut self, value: &Value<'_>, parameters: &[Parameter]) -> Vec<(Parameter, f32)> {
        match parameters {
            [number] => {
                let read = self.deserialized(value, "a number");
                read.map(|read| (*number, read)).into_iter().collect()
            }
            axes if value.get_ref().is_table() => {
                let names: Vec<&str> = axes.iter().map(|number| axis(*number)).collect();
                let read = self.numbers_by_axis(value, &names, |_, read| Ok(read));
                read.into_iter().map(|(index, number)| (axes[index], number)).collect()
            }
            axes => match self.deserialized(value, "a number or a table of axes") {
                Some(read) => axes.iter().map(|number| (*number, read)).collect(),
                None => Vec::new(),
            },
        }
    }

    /// Reads a table of axes: indices in `axes`, and numbers that pass a check.
    fn numbers_by_axis(
        &mut self,
        value: &Value<'_>,
        axes: &[&str],
        check: impl Fn(&str, f32) -> Result<f32, String>,
    ) -> Vec<(usize, f32)> {
        let mut read = Vec::new();
        let table = self.table_of(value, "a table of axes");
        for (key, value) in table.into_iter().flat_map(in_order) {
            match axes.iter().position(|axis| axis == key.get_ref()) {
                Some(index) => {
                    let number = self.deserialized(value, "a number");
                    let number = number.map(|number| check(axes[index], number));
                    let number = number.and_then(|number| self.value_or_error(value, number));
                    read.extend(number.map(|number| (index, number)));
                }
                None => self.unknown(key, axes),
            }
        }
        read
    }

    /// Takes the learnt numbers that were read. They are valid only together and with their version.
    fn learnt(&mut self, table: &Value<'_>) -> Option<Learnt> {
        const AGAIN: &str = "calibrate the foot again";
        let LearntTable { numbers: read, version, crc } = std::mem::take(&mut self.learnt);
        let mut numbers = [0.0; Learnt::NUMBERS];
        for ((number, read), row) in numbers.iter_mut().zip(read).zip(Learnt::ROWS) {
            let name = row.name.trim_start_matches("learnt.");
            *number = self.value_or_error(table, read.ok_or(format!("missing field `{name}`")))?;
        }
        let missing =
            || format!("missing field `version`: these numbers may mean something else: {AGAIN}");
        let version = self.value_or_error(table, version.ok_or_else(missing))?;
        let learnt = Learnt::from_array(numbers);
        let checked = if version != Learnt::VERSION {
            Err(LearntError::Version(version))
        } else if crc.is_some_and(|crc| crc != learnt.crc()) {
            Err(LearntError::Damaged)
        } else {
            Ok(learnt)
        };
        self.value_or_error(table, checked.map_err(|error| format!("{error}: {AGAIN}")))
    }

    fn word<T>(
        &mut self,
        value: &Value<'_>,
        parse: impl FnOnce(&str) -> Result<T, String>,
    ) -> Option<T> {
        let text: String = self.deserialized(value, "a string")?;
        self.value_or_error(value, parse(&text))
    }

    /// Returns a value as a table. Errors state `expected`.
    fn table_of<'a, 'b>(
        &mut self,
        value: &'a Value<'b>,
        expected: &str,
    ) -> Option<&'a DeTable<'b>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            // It is deserialized only for the error, which names the type that was found.
            let _ = self.deserialized::<BTreeMap<String, IgnoredAny>>(value, expected);
        }
        table
    }

    /// Returns a value as `T`. Errors state `expected`.
    fn deserialized<T: DeserializeOwned>(
        &mut self,
        value: &Value<'_>,
        expected: &str,
    ) -> Option<T> {
        let read = T::deserialize(ValueDeserializer::from(value.clone()));
        let read = read.map_err(|error| {
            let message = error.message();
            match message.split_once(", expected ") {
                Some((what, _)) => format!("{what}, expected {expected}"),
                None => message.to_owned(),
            }
        });
        self.value_or_error(value, read)
    }

    /// Returns the value that was read, or adds the error at its place in the file.
    fn value_or_error<T>(&mut self, at: &Value<'_>, read: Result<T, String>) -> Option<T> {
        read.map_err(|message| self.error(at.span().start, message)).ok()
    }

    fn unknown(&mut self, key: &Spanned<impl AsRef<str>>, known: &[&str]) {
        let names: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
        let name = key.get_ref().as_ref();
        let names = names.join(", ");
        let message = format!("unknown field `{name}`, expected one of {names}");
        self.error(key.span().start, message);
    }

    fn error(&mut self, byte: usize, message: String) {
        self.errors.push((byte, message));
    }
}

/// Names that may stand in the table whose keys begin with `within`, each once: keys, and tables below.
fn names_below<'a>(keys: &'a [Key], within: &str) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    let below = keys.iter().filter_map(|key| key.path.strip_prefix(within));
    for name in below.filter_map(|rest| rest.split('.').next()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Returns the entries of a table in the order of the file.
fn in_order<'a, 'b>(
    table: &'a DeTable<'b>,
) -> Vec<(&'a Spanned<toml::de::DeString<'b>>, &'a Value<'b>)> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries
}

/// Returns the key on a line (from 1), with the table it is in.
fn key_on_line(text: &str, line: usize) -> Option<String> {
    let so_far: Vec<&str> = text.lines().take(line).map(str::trim).collect();
    let (key, _) = so_far.last()?.split_once('=')?;
    let table = so_far.iter().rev().find_map(|line| line.strip_prefix('[')?.split(']').next());
    Some(match table {
        Some(table) => format!("{}.{}", table.trim(), key.trim()),
        None => key.trim().to_owned(),
    })
}

/// Position in a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Position {
    /// Returns the position of a byte.
    #[must_use]
    pub fn of_byte(text: &str, byte: usize) -> Self {
        let before = text.get(..byte).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        Self {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// Returns the position of a key, given with its tables; `None` if it is not in the text.
    #[must_use]
    pub fn of_key(text: &str, path: &str) -> Option<Self> {
        let root = DeTable::parse(text).ok()?;
        let byte = byte_of(root.get_ref(), path)?;
        Some(Self::of_byte(text, byte))
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column {}", self.line, self.column)
    }
}

/// Returns the byte at which a key begins, given with its tables.
fn byte_of(table: &DeTable<'_>, path: &str) -> Option<usize> {
    let (first, rest) = match path.split_once('.') {
        Some((first, rest)) => (first, Some(rest)),
        None => (path, None),
    };
    let (key, value) = table.iter().find(|(key, _)| key.get_ref() == first)?;
    match (rest, Spanned::get_ref(value)) {
        (None, _) => Some(key.span().start),
        (Some(rest), DeValue::Table(table)) => byte_of(table, rest),
        (Some(_), _) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_can_be_set_by_its_key() {
        for number in Parameter::ALL {
            let name = number.name();
            let overrides = Overrides::parse(&format!("{name} = 0.25\n"), "x.toml").expect(name);
            let mut params = AnyParams::DEFAULT;
            overrides.apply(&mut params);
            let mut expected = AnyParams::DEFAULT;
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
                "unknown field `threshold`, expected one of `on_threshold`, `off_threshold`",
            ),
            ("gyroscope.bias = 1", "unknown field `bias`, expected one of `bias_rad_s`"),
            (
                "feet.FL.window = 1",
                "unknown field `window`, expected one of `axes`, `decision`, `load`, `velocity`, \
             `learnt`, `accelerometer`, `gyroscope`",
            ),
            ("load = 3", "invalid type: integer `3`, expected the table load"),
            ("feet.FL = 3", "invalid type: integer `3`, expected a table of settings"),
            ("gyroscope.bias_rad_s = 3", "invalid type: integer `3`, expected a table of axes"),
            (
                "attitude.rest.time_s = 1",
                "unknown field `time_s`, expected one of `duration_s`, `acceleration_m_s2`, \
             `rate_rad_s`, `bias_limit_rad_s`, `bias_time_constant_s`",
            ),
            (
                "attitude.gain = 1",
                "unknown field `gain`, expected one of `motion_time_constant_s`, `quiet_gain`, \
             `quiet_acceleration_m_s2`, `quiet_rate_rad_s`, `rest`, `gyro_timing`",
            ),
        ] {
            let error = Overrides::parse(text, "x.toml").unwrap_err().to_string();
            let (_, message) = error.split_once(": ").expect("a message");
            assert_eq!(message, expected);
        }
    }

    #[test]
    fn key_is_found_in_tables_and_dotted_paths() {
        let text = "window = '9ms'\n[attitude]\n  rest.rate_rad_s = 1\n[gyroscope]\nbias_rad_s = { wx = 0, wy = 2 }\n";
        for (key, line, column) in [
            ("window", 1, 1),
            ("attitude.rest.rate_rad_s", 3, 8),
            ("gyroscope.bias_rad_s", 5, 1),
            ("gyroscope.bias_rad_s.wy", 5, 24),
        ] {
            assert_eq!(Position::of_key(text, key), Some(Position { line, column }), "{key}");
        }
        assert_eq!(Position::of_key(text, "attitude.rest.duration_s"), None);
        assert_eq!(Position::of_key("not = [toml", "not"), None);
        // Characters, not bytes, and no panic beyond the end or within one.
        assert_eq!(Position::of_byte("é = 1", 3).column, 3);
        assert_eq!(Position::of_byte("é", 1).line, 1);
        assert_eq!(Position::of_byte("a\n", 99).line, 2);
    }
}
