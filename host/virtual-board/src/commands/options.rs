//! Option values that the commands share.

use virtual_board::product::fault::SelectedFault;

/// One day: a larger value is rejected as a mistake.
const MOST_SECONDS: f64 = 86_400.0;

/// Parses seconds, zero allowed.
pub fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    seconds
        .filter(|seconds| (0.0..=MOST_SECONDS).contains(seconds))
        .ok_or_else(|| format!("write seconds from 0 to {MOST_SECONDS}"))
}

/// Parses seconds, zero rejected.
pub fn duration(text: &str) -> Result<f64, String> {
    let some = seconds(text).ok().filter(|seconds| *seconds > 0.0);
    some.ok_or_else(|| format!("write seconds above 0 and up to {MOST_SECONDS}"))
}

/// Parses a fault and its time of injection, ms: `NAME@MS` or `NAME:VARIANT@MS`.
pub fn fault_at(text: &str) -> Result<(SelectedFault, u32), String> {
    let Some((name, ms)) = text.split_once('@') else {
        let names = virtual_board::product::fault::names();
        return Err(format!("NAME@MS, the name one of {names}"));
    };
    let ms = ms.parse().map_err(|_| format!("{ms} is no time in ms"))?;
    Ok((name.parse()?, ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_limited_to_a_day_and_durations_exclude_zero() {
        assert_eq!((seconds("0"), seconds("2.5")), (Ok(0.0), Ok(2.5)));
        assert_eq!((duration("0").ok(), duration("2.5")), (None, Ok(2.5)));
        for text in ["-5", "nan", "inf", "86401", "soon", ""] {
            assert!(seconds(text).is_err() && duration(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_fault_requires_its_time() {
        let (fault, ms) = fault_at("power-cut:17@1000").expect("a fault");
        assert_eq!((fault.scenario.name, ms), ("power-cut", 1000));
        assert!(fault_at("clear@1300").is_ok());
        for text in ["frozen", "frozen@soon", "thawed@1000", "power-cut:x@1"] {
            assert!(fault_at(text).is_err(), "{text}");
        }
    }
}
