//! Suggestions for unknown keys.

use super::keys::{OF_FOOT, keys};
use crate::nearest::nearest;

/// Returns the keys and tables most similar to a path or its last part, best first.
pub(super) fn near_keys(path: &str) -> Vec<String> {
    let candidates = candidates(path).into_iter();
    nearest(candidates.map(|key| (key.clone(), key)), path)
}

/// Returns the keys that may be meant by a path, and the tables they are in: those of its foot, or those of all feet.
fn candidates(written: &str) -> Vec<String> {
    let foot = written
        .strip_prefix("feet.")
        .and_then(|rest| rest.split('.').next());
    let mut all: Vec<String> = Vec::new();
    for key in keys() {
        let path = match (foot, key.path.strip_prefix(OF_FOOT)) {
            (None, None) => key.path,
            (Some(foot), Some(key)) => format!("feet.{foot}.{key}"),
            _ => continue,
        };
        let dots = path.match_indices('.').map(|(at, _)| at);
        let tables = dots.map(|at| path[..at].to_owned());
        for path in tables.chain([path.clone()]) {
            if !all.contains(&path) {
                all.push(path);
            }
        }
    }
    all
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
            let near = near_keys(written);
            assert_eq!(near.first().map(String::as_str), Some(meant), "{written}");
        }
        assert_eq!(
            near_keys("load.threshold"),
            [
                "load.on_threshold",
                "decision.threshold",
                "load.off_threshold"
            ]
        );
        for nothing in ["", "colour", "attitude.rest.colour_s"] {
            assert!(near_keys(nothing).is_empty(), "{nothing}");
        }
    }
}
