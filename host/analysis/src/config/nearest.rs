//! Suggestions for unknown keys.

use strsim::normalized_damerau_levenshtein as likeness;

use super::keys::keys;

/// Least likeness of a suggested key, in [0, 1].
const ALIKE: f64 = 0.7;

/// Least likeness of the last parts, because a long table name makes all keys in it alike.
const ALIKE_IN_LAST_PART: f64 = 0.6;

/// Weight of the likeness of the last part alone, for a key in another table.
const ELSEWHERE: f64 = 0.8;

/// Largest difference in likeness from the best suggestion.
const AS_GOOD: f64 = 0.1;

/// Suffixes of keys that are units.
const UNITS: [&str; 6] = ["_m_s2", "_rad_s", "_m_s", "_hz", "_m", "_s"];

/// Returns the keys and tables most similar to a path or its last part, best first.
#[must_use]
pub fn nearest(path: &str) -> Vec<String> {
    let mut found: Vec<(f64, String)> = candidates()
        .into_iter()
        .filter_map(|key| likeness_to(path, &key).map(|likeness| (likeness, key)))
        .collect();
    found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let best = found.first().map_or(1.0, |(best, _)| *best);
    found
        .into_iter()
        .take_while(|(likeness, _)| *likeness > best - AS_GOOD)
        .map(|(_, key)| key)
        .collect()
}

/// `a`, `b` or `c`.
#[must_use]
pub fn or(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [others @ .., last] => format!("{} or {last}", others.join(", ")),
    }
}

/// Returns all keys, and the tables they are in.
fn candidates() -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for key in keys() {
        let dots = key.path.match_indices('.').map(|(at, _)| at);
        let tables = dots.map(|at| key.path[..at].to_owned());
        for path in tables.chain([key.path.clone()]) {
            if !all.contains(&path) {
                all.push(path);
            }
        }
    }
    all
}

fn likeness_to(path: &str, key: &str) -> Option<f64> {
    let last = last_of(path);
    let last = with_or_without_unit(key, |key| likeness(last, last_of(key)));
    let whole = with_or_without_unit(key, |key| likeness(path, key));
    let likeness = whole.max(ELSEWHERE * last);
    (likeness >= ALIKE && last >= ALIKE_IN_LAST_PART).then_some(likeness)
}

/// Returns the likeness with or without the unit of the key, whichever is greater.
fn with_or_without_unit(key: &str, likeness: impl Fn(&str) -> f64) -> f64 {
    let bare = UNITS.into_iter().find_map(|unit| key.strip_suffix(unit));
    likeness(key).max(bare.map_or(0.0, likeness))
}

fn last_of(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typos_and_missing_tables_and_units_are_recognised() {
        for (written, meant) in [
            ("decision.thresold", "decision.threshold"),
            ("decison.threshold", "decision.threshold"),
            ("threshold", "decision.threshold"),
            ("on_delay", "decision.on_delay_s"),
            ("decision.off_delay", "decision.off_delay_s"),
            ("sample_rate", "sample_rate_hz"),
            ("half_width.acceleration", "half_width.acceleration_m_s2"),
            ("attitude.rest.rate", "attitude.rest.rate_rad_s"),
            ("gyro_timing", "attitude.gyro_timing"),
            ("metod", "method"),
            ("decison", "decision"),
        ] {
            let nearest = nearest(written);
            assert_eq!(
                nearest.first().map(String::as_str),
                Some(meant),
                "{written}"
            );
        }
        assert_eq!(
            nearest("load.threshold"),
            [
                "load.on_threshold",
                "decision.threshold",
                "load.off_threshold"
            ]
        );
        for nothing in ["", "colour", "attitude.rest.colour_s"] {
            assert!(nearest(nothing).is_empty(), "{nothing}");
        }
    }
}
