//! Detection of the format of a log from its first lines.

use estimator_core::Timestamp;

use super::{Form, LogTimes, Reader, candump};

/// Returns a reader for the log that begins with these bytes; `None` if no line matches a format. The
/// first line that matches decides. Bytes that are not text are skipped.
#[must_use]
pub fn recognise(head: &[u8]) -> Option<Reader> {
    let text = String::from_utf8_lossy(head);
    let form = text.lines().find_map(form_of)?;
    let times = match form {
        Form::CandumpTerminal => printed_times(&text),
        _ => LogTimes::Absolute,
    };
    Some(Reader { form, times, elapsed: 0 })
}

fn form_of(line: &str) -> Option<Form> {
    let line = line.trim_start_matches('\u{feff}');
    if candump::log_line(line).is_some() {
        Some(Form::CandumpLog)
    } else if candump::terminal_line(line).is_some() {
        Some(Form::CandumpTerminal)
    } else {
        None
    }
}

/// Upper limit of the time between two frames of a log, µs: eleven days.
const LONGEST_DIFFERENCE_US: u64 = 1_000_000_000_000;

/// Distinguishes differences from absolute times: absolute times rarely decrease, differences do every few
/// lines.
fn printed_times(text: &str) -> LogTimes {
    let lines = text.lines().filter_map(candump::terminal_line);
    let times = lines.filter_map(|line| line.time.map(Timestamp::as_micros));
    let times: Vec<u64> = times.collect();
    let falls = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
    let rises = times.windows(2).filter(|pair| pair[1] > pair[0]).count();
    // A steady bus repeats the same difference.
    let is_steady = rises <= 1 && times.len() > 2 && times.last() > Some(&0);
    match falls * 10 > falls + rises || is_steady {
        // Times since 1970: the clocks of two interfaces may differ, or stamp several frames alike.
        _ if times.iter().any(|time| *time > LONGEST_DIFFERENCE_US) => LogTimes::Absolute,
        true => LogTimes::Differences,
        false => LogTimes::Absolute,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recognised(text: &str) -> Option<(Form, LogTimes)> {
        recognise(text.as_bytes()).map(|reader| (reader.form, reader.times))
    }

    #[test]
    fn first_valid_line_determines_the_format() {
        for form in Form::ALL {
            for text in [
                form.example().to_owned(),
                format!("\u{feff}{}\r\n", form.example()),
                format!("cut off\n\n{}\n", form.example()),
            ] {
                let found = recognise(text.as_bytes()).map(|reader| reader.form);
                assert_eq!(found, Some(form), "{text:?}");
            }
        }
        for text in ["", "t,ax,ay\n0,1,2\n", "date of birth\n", "1.5 a b c\n"] {
            assert_eq!(recognised(text), None, "{text:?}");
        }
    }

    #[test]
    fn differences_are_distinguished_from_absolute_times() {
        let log = |times: &[&str]| {
            let line = |time: &&str| format!(" ({time})  can0  191   [1]  00\n");
            recognised(&times.iter().map(line).collect::<String>()).map(|(_, times)| times)
        };
        for (times, expected) in [
            (&["000.000000", "000.001000", "000.002000"][..], LogTimes::Absolute),
            (&["1609459200.000000", "1609459200.001000"], LogTimes::Absolute),
            (&["000.000000"], LogTimes::Absolute),
            (&["1609459200.000000"; 4], LogTimes::Absolute),
            (
                &[
                    "1609459200.000000",
                    "1609459199.000000",
                    "1609459200.001000",
                    "1609459199.001000",
                ],
                LogTimes::Absolute,
            ),
            (
                &["000.000000", "000.000889", "000.000111", "000.000889", "000.000111"],
                LogTimes::Differences,
            ),
            (&["000.000000", "000.001000", "000.001000", "000.001000"], LogTimes::Differences),
        ] {
            assert_eq!(log(times), Some(expected), "{times:?}");
        }
        assert_eq!(
            recognised("can0  191   [1]  00\n".repeat(3).as_str()),
            Some((Form::CandumpTerminal, LogTimes::Absolute))
        );
    }
}
