//! Dates with times as in ISO 8601 and RFC 3339: `2024-05-01T12:00:00.123456+02:00`, or with a space for the `T`
//! as in pandas. Without a zone they are in UTC: only differences matter.

/// Microseconds since 1970 in UTC; `None` if the text is not a date with a time. Leap seconds are ignored, as in
/// POSIX.
pub(super) fn micros_since_1970(text: &str) -> Option<i64> {
    let (date, rest) = text.split_once(['T', ' '])?;
    let mut parts = date.splitn(3, '-');
    let year = digits(parts.next()?, 4)?;
    let month = digits(parts.next()?, 2).filter(|month| (1..=12).contains(month))?;
    let day = digits(parts.next()?, 2).filter(|day| (1..=31).contains(day))?;
    let zone_at = rest.find(['Z', '+', '-']).unwrap_or(rest.len());
    let (time, zone) = rest.split_at(zone_at);
    let mut parts = time.splitn(3, ':');
    let hour = digits(parts.next()?, 2).filter(|hour| *hour < 24)?;
    let minute = digits(parts.next()?, 2).filter(|minute| *minute < 60)?;
    let seconds = parts.next()?;
    let (second, fraction) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let second = digits(second, 2).filter(|second| *second <= 60)?;
    let seconds = days_since_1970(year, month, day) * 86_400 + hour * 3600 + minute * 60 + second;
    Some((seconds - zone_seconds(zone)?) * 1_000_000 + micros(fraction)?)
}

/// Number of exactly `count` digits.
fn digits(text: &str, count: usize) -> Option<i64> {
    let all = text.len() == count && text.bytes().all(|byte| byte.is_ascii_digit());
    all.then(|| text.parse().ok())?
}

/// Decimals of a second, rounded to µs.
fn micros(fraction: &str) -> Option<i64> {
    if fraction.is_empty() || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let value: f64 = format!("0.{fraction}").parse().ok()?;
    Some((value * 1.0e6).round() as i64)
}

/// Offset of a zone from UTC, s; positive to the east.
fn zone_seconds(zone: &str) -> Option<i64> {
    let ahead = match zone.chars().next() {
        None | Some('Z') => return (zone.len() < 2).then_some(0),
        Some('-') => -1,
        Some(_) => 1,
    };
    let zone = zone[1..].replace(':', "");
    let (hours, minutes) = zone.split_at_checked(2)?;
    let minutes = if minutes.is_empty() { "00" } else { minutes };
    Some(ahead * (3600 * digits(hours, 2)? + 60 * digits(minutes, 2)?))
}

/// Days since 1970-01-01 in the Gregorian calendar (Howard Hinnant, `days_from_civil`,
/// <https://howardhinnant.github.io/date_algorithms.html>).
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    era * 146_097 + day_of_era - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

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
