//! Dates with times as in ISO 8601 and RFC 3339: `2024-05-01T12:00:00.123456+02:00`, or with a space for the `T`
//! as in pandas. Without a zone they are in UTC: only differences matter.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

/// Microseconds since 1970 in UTC; `None` if the text is not a date with a time, seconds included. Leap seconds are
/// ignored, as in POSIX.
#[must_use]
pub fn micros_since_1970(text: &str) -> Option<i64> {
    // The colon before the seconds.
    if text.as_bytes().get(16) != Some(&b':') {
        return None;
    }
    let without_zone = || text.parse::<DateTime>().ok()?.to_zoned(TimeZone::UTC).ok();
    let time = text.parse::<Timestamp>().ok();
    let time = time.or_else(|| without_zone().map(|zoned| zoned.timestamp()))?;
    i64::try_from((time.as_nanosecond() + 500).div_euclid(1000)).ok()
}

/// Returns whether a text is a date with a time in another form, such as `30.11.2026 12:00:00,123` or `11/30/2026 12:00`.
/// The order of day and month is then not known.
#[must_use]
pub fn is_in_another_form(text: &str) -> bool {
    let Some((date, time)) = text.split_once([' ', 'T']) else {
        return false;
    };
    let numbers: Vec<&str> = date.trim_end_matches(',').split(['.', '/', '-']).collect();
    let is_number = |part: &&str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    numbers.len() == 3
        && numbers.iter().all(is_number)
        && time.contains(':')
        && micros_since_1970(text).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_spreadsheets_are_in_another_form() {
        for text in [
            "30.11.2026 12:00:00,123",
            "30.11.2026 12:00",
            "11/30/2026 12:00:00 PM",
            "2026/11/30 12:00:00",
            "30-11-26, 12:00:00",
        ] {
            assert!(is_in_another_form(text), "{text}");
        }
        for text in [
            "2026-11-30 12:00:00.123",
            "30.11.2026",
            "1.5",
            "1.2.3",
            "time 12:00",
            "a.b.c 12:00",
            "",
        ] {
            assert!(!is_in_another_form(text), "{text}");
        }
    }

    #[test]
    fn dates_are_counted_from_1970() {
        // Expected values are from `date -u +%s -d …` of GNU coreutils.
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0),
            ("2000-02-29T12:00:00Z", 951_825_600),
            ("2024-05-01T12:00:00", 1_714_564_800),
            ("2024-05-01 12:00:00+00:00", 1_714_564_800),
            ("2024-05-01T14:00:00+02:00", 1_714_564_800),
            ("2024-05-01T06:30:00-0530", 1_714_564_800),
            ("1969-12-31T23:59:59Z", -1),
        ] {
            assert_eq!(micros_since_1970(text), Some(seconds * 1_000_000), "{text}");
        }
    }

    #[test]
    fn fractions_are_rounded_to_a_microsecond() {
        for (fraction, micros) in [(".5", 500_000), (".123456789", 123_457), (".000001Z", 1)] {
            let text = format!("1970-01-01T00:00:00{fraction}");
            assert_eq!(micros_since_1970(&text), Some(micros), "{text}");
        }
    }

    #[test]
    fn other_texts_are_not_dates() {
        for text in [
            "",
            "0.01",
            "2024-05-01",
            "2024-13-01T00:00:00",
            "2024-05-01T24:00:00",
            "2024-05-01T12:00",
            "2024-05-01T12:00:00.",
            "2024-05-01T12:00:00+2",
            "2024-05-01T12:00:00Zulu",
            "24-05-01T12:00:00",
            "2024-05-01Tä:00:00+äö",
        ] {
            assert_eq!(micros_since_1970(text), None, "{text}");
        }
    }
}
