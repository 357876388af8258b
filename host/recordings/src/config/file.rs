//! A configuration file: its settings, and its errors by line and key.

use std::collections::BTreeMap;
use std::{fmt, io};

use estimator_core::Params;
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::config::settings::{Reader, Settings};
use crate::input::{Correction, is_among};

/// Name and text of a configuration file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfigFile {
    /// Name, as given.
    pub name: String,
    /// Text.
    pub text: String,
}

/// Settings in a configuration file, which override those of the preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Settings for all feet.
    pub all: Settings,
    /// Settings of single feet, by name; they override those for all feet.
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
            Ok(table) => reader.all(table.get_ref()),
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                reader.errors.push((at, error.message().trim().replace('\n', ", ")));
                Settings::default()
            }
        };
        if reader.errors.is_empty() {
            return Ok(Self { all, feet: reader.feet });
        }
        reader.errors.sort_by_key(|(at, _)| *at);
        let errors = reader.errors.into_iter().take(MOST_ERRORS);
        let errors = errors.map(|(at, message)| {
            let position = Position::of_byte(text, at);
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

    /// Applies the settings of a foot with these names to `params`, after those of all.
    pub fn apply_foot(&self, names: &[&str], params: &mut Params) {
        let mut feet = self.feet.iter();
        let own = feet.find(|(foot, _)| is_among(foot, names));
        if let Some((_, own)) = own {
            own.apply(params);
        }
    }

    /// Applies the settings for all feet to `params`.
    pub fn apply(&self, params: &mut Params) {
        self.all.apply(params);
    }
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
