//! Patterns of recording paths: robot, foot and day.

use std::str::FromStr;

use super::identity::{Day, Identity};

/// Pattern of the last parts of a recording's name, such as `{robot}/*/{day}_{foot}.csv`.
///
/// `*` matches any text within a part, `**` any number of parts; `{robot}` and `{foot}` match at least one
/// character each, and as few as possible; `{day}` matches `YYYY-MM-DD` or `YYYYMMDD`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathPattern {
    parts: Vec<Part>,
}

/// Part of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    /// `**`.
    Any,
    One(Vec<Token>),
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Token {
    Text(String),
    Star,
    Value(Value),
}

samples::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    enum Value {
        Robot = "{robot}",
        Foot = "{foot}",
        Day = "{day}",
    }
}

/// Matched values, in the order of the pattern.
type Found<'a> = Vec<(Value, &'a str)>;

impl PathPattern {
    /// Sets the fields of `identity` found in its name.
    ///
    /// # Errors
    /// The name does not match the pattern; nothing is set.
    pub fn apply(&self, identity: &mut Identity) -> Result<(), NotAsThePattern> {
        let name = identity.name.clone();
        let parts: Vec<&str> = name.split('/').collect();
        let starts = 0..parts.len();
        let found = starts
            .into_iter()
            .find_map(|start| match_parts(&self.parts, &parts[start..]))
            .ok_or(NotAsThePattern)?;
        let of = |wanted: Value| {
            let value = found.iter().find(|(value, _)| *value == wanted);
            value.map(|(_, text)| (*text).to_owned())
        };
        let day = of(Value::Day).map(|text| text.parse::<Day>());
        let day = day.transpose().map_err(|_| NotAsThePattern)?;
        if let Some(robot) = of(Value::Robot) {
            identity.robot = robot;
        }
        identity.foot = of(Value::Foot).or(identity.foot.take());
        identity.day = day.or(identity.day);
        Ok(())
    }
}

/// Error for a name that does not match the pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotAsThePattern;

impl FromStr for PathPattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split('/').map(|part| match part {
            "**" => Ok(Part::Any),
            part => tokens(part).map(Part::One),
        });
        let parts = parts.collect::<Result<Vec<_>, _>>()?;
        let values = parts.iter().flat_map(|part| match part {
            Part::Any => &[],
            Part::One(tokens) => &tokens[..],
        });
        let mut values: Vec<Value> = values
            .filter_map(|token| match token {
                Token::Value(value) => Some(*value),
                Token::Text(_) | Token::Star => None,
            })
            .collect();
        let count = values.len();
        values.sort_by_key(|value| *value as u8);
        values.dedup();
        if values.is_empty() {
            return Err(format!(
                "{text:?} names nothing: write {{robot}}, {{foot}} or {{day}} where they stand, such \
                 as {{robot}}/*/{{foot}}.csv"
            ));
        }
        if values.len() < count {
            return Err(format!("{text:?} names a value twice"));
        }
        Ok(Self { parts })
    }
}

fn tokens(part: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = part;
    while !rest.is_empty() {
        let at = rest.find(['*', '{']).unwrap_or(rest.len());
        let (text, special) = rest.split_at(at);
        if !text.is_empty() {
            tokens.push(Token::Text(text.to_owned()));
        }
        rest = special;
        if let Some(after) = rest.strip_prefix('*') {
            // Two stars in a part are equivalent to one.
            if tokens.last() != Some(&Token::Star) {
                tokens.push(Token::Star);
            }
            rest = after;
        } else if !rest.is_empty() {
            let mut values = Value::ALL.into_iter();
            let Some(value) = values.find(|value| rest.starts_with(value.name())) else {
                return Err(format!(
                    "{part:?} has something else than {{robot}}, {{foot}} or {{day}} in braces"
                ));
            };
            tokens.push(Token::Value(value));
            rest = &rest[value.name().len()..];
        }
    }
    Ok(tokens)
}

fn match_parts<'a>(pattern: &[Part], parts: &[&'a str]) -> Option<Found<'a>> {
    match pattern.split_first() {
        None => parts.is_empty().then(Vec::new),
        Some((Part::Any, pattern)) => {
            (0..=parts.len()).find_map(|skipped| match_parts(pattern, &parts[skipped..]))
        }
        Some((Part::One(tokens), pattern)) => {
            let (part, parts) = parts.split_first()?;
            // The match within one part does not affect the others.
            let mut found = match_tokens(tokens, part)?;
            found.extend(match_parts(pattern, parts)?);
            Some(found)
        }
    }
}

fn match_tokens<'a>(tokens: &[Token], text: &'a str) -> Option<Found<'a>> {
    let Some((token, tokens)) = tokens.split_first() else {
        return text.is_empty().then(Vec::new);
    };
    let least = match token {
        Token::Text(expected) => return match_tokens(tokens, text.strip_prefix(&**expected)?),
        Token::Star => 0,
        Token::Value(_) => 1,
    };
    let ends = text.char_indices().map(|(at, _)| at).chain([text.len()]);
    for end in ends.skip(least) {
        let (taken, rest) = text.split_at(end);
        if *token == Token::Value(Value::Day) && taken.parse::<Day>().is_err() {
            continue;
        }
        if let Some(mut found) = match_tokens(tokens, rest) {
            if let Token::Value(value) = token {
                found.insert(0, (*value, taken));
            }
            return Some(found);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(pattern: &str, name: &str) -> Option<(String, Option<String>, Option<String>)> {
        let mut identity = Identity::new(name, "before");
        let pattern: PathPattern = pattern.parse().unwrap();
        pattern.apply(&mut identity).ok()?;
        let day = identity.day.map(|day| day.to_string());
        Some((identity.robot, identity.foot, day))
    }

    fn some(text: &str) -> Option<String> {
        Some(text.to_owned())
    }

    #[test]
    fn pattern_fields_are_read_from_the_path() {
        let name = "data/2024-05-01/spot-3/run1_fl.csv";
        for (pattern, expected) in [
            ("{robot}/*", ("spot-3", None, None)),
            (
                "{day}/{robot}/*_{foot}.csv",
                ("spot-3", some("fl"), some("2024-05-01")),
            ),
            ("data/**/{foot}_*", ("before", some("run1"), None)),
            ("{day}/**", ("before", None, some("2024-05-01"))),
            ("**/{robot}-*/*", ("spot", None, None)),
            ("{robot}*.csv", ("r", None, None)),
        ] {
            let (robot, foot, day) = expected;
            let expected = Some((robot.to_owned(), foot, day));
            assert_eq!(applied(pattern, name), expected, "{pattern}");
        }
    }

    #[test]
    fn unmatched_path_sets_nothing() {
        for pattern in [
            "other/{robot}/*",
            "{robot}_*.parquet",
            "{day}/*",
            "*/*/*/*/{robot}",
        ] {
            assert_eq!(applied(pattern, "data/x/spot/run_1.csv"), None, "{pattern}");
        }
        assert_eq!(applied("{foot}_{robot}", "_ä"), None);
        assert_eq!(
            applied("{foot}_{robot}", "é_ä"),
            Some(("ä".to_owned(), some("é"), None))
        );
    }

    #[test]
    fn invalid_pattern_is_rejected() {
        for (pattern, why) in [
            ("*/*", "names nothing"),
            ("{robot}/{robot}", "twice"),
            ("{leg}/*", "in braces"),
            ("{robot", "in braces"),
        ] {
            let said = pattern.parse::<PathPattern>().unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}
