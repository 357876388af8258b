//! Identity of a recording, and the path of its result files,
//! `TABLE/robot=R/foot=F/day=YYYY-MM-DD/KEY.parquet`, as Hive names partitions.

use std::fmt;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use samples::compressed::without_ending;

/// Placeholder for an unknown value.
pub const UNKNOWN: &str = "unknown";

/// Longest name or value in the name of a file or folder, bytes. Systems allow 255.
const LONGEST: usize = 200;

/// Hexadecimal digits of a hash that distinguish names: of a million names, two have the same with a
/// probability of 27 in a thousand million.
const HASH_DIGITS: usize = 16;

/// Microseconds in a day.
const DAY_US: i64 = 86_400_000_000;

/// Earliest time that counts as a date, 2001-09-09, µs since 1970; a clock that counts from power-up does not
/// reach it.
const FIRST_DATE_US: i64 = 1_000_000_000_000_000;

/// End of the times that count as a date, 2100-01-01, µs since 1970.
const LAST_DATE_US: i64 = 4_102_444_800_000_000;

/// Identity of a recording, known before it is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Unique name of the recording: its path below a folder common to all.
    pub name: String,
    /// The robot that was recorded.
    pub robot: String,
    /// Foot of a recording with a single, unnamed foot; if `None`, the last part of the name without extension.
    pub foot: Option<String>,
    /// Day, used if the recording's clock has no date.
    pub day: Option<Day>,
}

impl Identity {
    /// Creates the identity of a recording with this name and robot.
    #[must_use]
    pub fn new(name: &str, robot: &str) -> Self {
        Self {
            name: name.to_owned(),
            robot: robot.to_owned(),
            foot: None,
            day: None,
        }
    }

    /// Returns the name of its files without extension: the recording's name made safe, and a hash of it.
    #[must_use]
    pub fn key(&self) -> String {
        let safe: String = self.name.chars().map(safe_or_dash).collect();
        // The distinguishing part of a name is at its end.
        let end = &safe[safe.len().saturating_sub(LONGEST)..];
        let end = end.trim_matches(['-', '.']);
        format!("{end}-{}", short_hash(&self.name))
    }

    /// Returns the foot of a recording with a single, unnamed foot.
    #[must_use]
    pub fn only_foot(&self) -> String {
        self.foot.clone().unwrap_or_else(|| stem(&self.name))
    }
}

/// Location of the files of one foot of a recording, below the folder of a table.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FootFiles {
    /// The robot.
    pub robot: String,
    /// The foot.
    pub foot: String,
    /// The day as `YYYY-MM-DD`, or `unknown`.
    pub day: String,
    /// The name of the file without extension.
    pub key: String,
}

impl FootFiles {
    /// Returns the path of the file, below the folder of a table.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        let Self {
            robot,
            foot,
            day,
            key,
        } = self;
        [("robot", robot), ("foot", foot), ("day", day)]
            .into_iter()
            .map(|(name, value)| format!("{name}={}", encoded(value)))
            .chain([format!("{key}.parquet")])
            .collect()
    }
}

/// A day in UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Day {
    year: i64,
    month: i64,
    day: i64,
}

impl Day {
    /// Returns the day of a time in µs since 1970; `None` if the clock does not count from 1970.
    #[must_use]
    pub fn of_clock(micros: i64) -> Option<Self> {
        (FIRST_DATE_US..LAST_DATE_US)
            .contains(&micros)
            .then(|| civil_from_days(micros.div_euclid(DAY_US)))
    }
}

impl FromStr for Day {
    type Err = String;

    /// Reads `YYYY-MM-DD` or `YYYYMMDD`.
    fn from_str(text: &str) -> Result<Self, String> {
        let error = || format!("invalid day {text:?}: write YYYY-MM-DD, such as 2024-05-01");
        let digits = match text.len() {
            10 if text.as_bytes()[4] == b'-' && text.as_bytes()[7] == b'-' => text.replace('-', ""),
            _ => text.to_owned(),
        };
        if digits.len() != 8 || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(error());
        }
        let number = |range: std::ops::Range<usize>| digits[range].parse::<i64>();
        let (Ok(year), Ok(month), Ok(day)) = (number(0..4), number(4..6), number(6..8)) else {
            return Err(error());
        };
        let longest = match month {
            2 if year % 4 == 0 && (year % 100 != 0 || year % 400 == 0) => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            1..=12 => 31,
            _ => 0,
        };
        if (1..=longest).contains(&day) {
            Ok(Self { year, month, day })
        } else {
            Err(error())
        }
    }
}

impl fmt::Display for Day {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { year, month, day } = self;
        write!(f, "{year:04}-{month:02}-{day:02}")
    }
}

/// Returns a day as it appears in a path.
pub(super) fn day_or_unknown(day: Option<Day>) -> String {
    day.map_or_else(|| UNKNOWN.to_owned(), |day| day.to_string())
}

/// The date of a day counted from 1970 in the Gregorian calendar (Howard Hinnant, `civil_from_days`,
/// <https://howardhinnant.github.io/date_algorithms.html>).
fn civil_from_days(days: i64) -> Day {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    Day {
        year: year_of_era + era * 400 + i64::from(month <= 2),
        month,
        day: day_of_year - (153 * month_from_march + 2) / 5 + 1,
    }
}

/// Returns the last part of a name, without the extensions of a recording.
fn stem(name: &str) -> String {
    let last = name.rsplit('/').next().unwrap_or(name);
    let whole = without_ending(Path::new(last));
    let stem = whole.file_stem().unwrap_or_default().to_string_lossy();
    if stem.is_empty() {
        UNKNOWN.to_owned()
    } else {
        stem.into_owned()
    }
}

fn is_safe(c: char) -> bool {
    c.is_ascii_alphanumeric() || "-_.".contains(c)
}

fn safe_or_dash(c: char) -> char {
    if is_safe(c) { c } else { '-' }
}

/// Encodes a value for the name of a Hive folder: unsafe bytes in hexadecimal after a percent sign. A value that
/// is too long is cut and ends with a hash.
#[must_use]
pub fn encoded(value: &str) -> String {
    let value = if value.is_empty() { UNKNOWN } else { value };
    let mut encoded = String::new();
    for c in value.chars() {
        let mut piece = String::new();
        if is_safe(c) {
            piece.push(c);
        } else {
            for byte in c.encode_utf8(&mut [0; 4]).bytes() {
                // Writing to a string does not fail.
                let _ = write!(piece, "%{byte:02X}");
            }
        }
        if encoded.len() + piece.len() > LONGEST {
            return format!("{encoded}~{}", short_hash(value));
        }
        encoded += &piece;
    }
    encoded
}

/// Decodes a value from the name of a folder as written by [`encoded`]; a long value is not restored.
pub(super) fn decoded(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let hexadecimal = after
            .get(..2)
            .and_then(|digits| str::from_utf8(digits).ok());
        let byte = hexadecimal.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match byte.filter(|_| *first == b'%') {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns the first digits of a name's hash.
fn short_hash(name: &str) -> String {
    let mut hash = blake3::hash(name.as_bytes()).to_hex().to_string();
    hash.truncate(HASH_DIGITS);
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similar_names_have_different_keys() {
        let keys =
            ["a/b.csv", "a-b.csv", "a b.csv", "A/b.csv"].map(|name| Identity::new(name, "r").key());
        assert!(keys[0].starts_with("a-b.csv-"), "{}", keys[0]);
        for (k, key) in keys.iter().enumerate() {
            assert!(key.chars().all(is_safe), "{key}");
            assert!(keys[..k].iter().all(|before| before != key), "{key}");
        }
    }

    #[test]
    fn long_name_keeps_its_end_in_the_key() {
        let name = format!("{}/walk.csv", "ä".repeat(500));
        let key = Identity::new(&name, "r").key();
        assert!(
            key.contains("walk.csv-") && key.len() <= LONGEST + 1 + HASH_DIGITS,
            "{key}"
        );
        assert!(!Identity::new("", "r").key().is_empty());
    }

    #[test]
    fn values_are_encoded_as_safe_folder_names() {
        for (value, expected) in [
            ("spot-1_a.b", "spot-1_a.b"),
            ("a/left", "a%2Fleft"),
            ("a=b %", "a%3Db%20%25"),
            ("Füße", "F%C3%BC%C3%9Fe"),
            ("..", ".."),
            ("", "unknown"),
        ] {
            assert_eq!(encoded(value), expected);
            assert_eq!(
                decoded(expected),
                if value.is_empty() { UNKNOWN } else { value }
            );
        }
        let long = ["ä", "b"].map(|c| encoded(&c.repeat(400)));
        for encoded in long {
            assert!(encoded.len() <= LONGEST + 1 + HASH_DIGITS, "{encoded}");
            assert!(
                !encoded.contains('%') || encoded.starts_with("%C3%A4%C3%A4"),
                "{encoded}"
            );
            assert!(!encoded.contains("%C3~"), "{encoded}");
        }
    }

    #[test]
    fn place_path_consists_of_partitions() {
        let place = FootFiles {
            robot: "spot 1".to_owned(),
            foot: "fl".to_owned(),
            day: "2024-05-01".to_owned(),
            key: "walk".to_owned(),
        };
        let expected = "robot=spot%201/foot=fl/day=2024-05-01/walk.parquet";
        assert_eq!(place.path(), Path::new(expected));
    }

    #[test]
    fn days_follow_the_calendar() {
        // `date -u -d @…` of GNU coreutils.
        for (seconds, day) in [
            (951_825_600, None),
            (1_000_000_000, Some("2001-09-09")),
            (1_709_164_800, Some("2024-02-29")),
            (1_714_607_999, Some("2024-05-01")),
            (4_102_444_799, Some("2099-12-31")),
            (4_102_444_800, None),
            (0, None),
            (-5, None),
        ] {
            let found = Day::of_clock(seconds * 1_000_000).map(|day| day.to_string());
            assert_eq!(found.as_deref(), day, "{seconds}");
        }
    }

    #[test]
    fn day_parses_with_and_without_dashes() {
        for text in ["2024-02-29", "20240229"] {
            assert_eq!(text.parse::<Day>().unwrap().to_string(), "2024-02-29");
        }
        for wrong in [
            "",
            "2023-02-29",
            "2024-13-01",
            "2024-1-1",
            "24-05-01",
            "2024-05-0ä",
            "20240532",
        ] {
            assert!(wrong.parse::<Day>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn unnamed_foot_takes_the_file_name() {
        for (name, foot) in [
            ("spot/fl.csv", "fl"),
            ("fl.csv.gz", "fl"),
            ("walk_2024", "walk_2024"),
            ("a/walk.v2.parquet", "walk.v2"),
            ("", "unknown"),
        ] {
            assert_eq!(Identity::new(name, "r").only_foot(), foot);
        }
    }
}
