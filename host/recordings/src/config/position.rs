//! Positions in the text of a configuration file.

use std::fmt;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

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
