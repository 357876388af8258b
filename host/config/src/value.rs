//! Values as text, in files and on the command line: words, lengths of windows, delays, rates, numbers with their unit.

use estimator_core::any::Method;
use estimator_core::half_widths::WindowLength;
use estimator_core::parameter::{self, Parameter, Unit};
use estimator_core::params::GyroTiming;
use estimator_core::{Gravity, Learning};

use options::words::{GRAVITIES, value_of};
use samples::number::shown;

/// Words for the source of the limits of stillness.
pub const METHODS: [(&str, Method); 2] =
    [("self_calibrating", Method::SelfCalibrating), ("half_widths", Method::HalfWidths)];

/// Words for whether a foot continues to learn.
pub const LEARNINGS: [(&str, Learning); 2] = [("on", Learning::On), ("frozen", Learning::Frozen)];

/// Formats the length of a window as [`parse_window`] reads it.
#[must_use]
pub fn window_text(window: WindowLength) -> String {
    match window {
        WindowLength::Duration(seconds) => format!("{}ms", Notation::Milliseconds.number(seconds)),
        WindowLength::Samples(samples) => format!("{samples}samples"),
    }
}

/// Formats the timing of a gyroscope as [`parse_gyro_timing`] reads it.
#[must_use]
pub fn gyro_timing_text(timing: GyroTiming) -> String {
    match timing {
        GyroTiming::PeriodMean => "period_mean".to_owned(),
        GyroTiming::Delay(seconds) => {
            format!("{}ms", Notation::Milliseconds.number(seconds))
        }
    }
}

/// Parses the length of a window: a duration such as `50ms`, or a count such as `50samples`.
///
/// # Errors
/// A sentence with the accepted notation.
pub fn parse_window(text: &str) -> Result<WindowLength, String> {
    let window = match text.strip_suffix("samples") {
        Some(count) => count.trim_end().parse().ok().map(WindowLength::Samples),
        None => duration(text).map(WindowLength::Duration),
    };
    window.ok_or_else(|| {
        format!(
            "{text:?} is not a window: write a duration such as 50ms or a count such as 50samples"
        )
    })
}

/// Parses a time since the first sample, s.
///
/// # Errors
/// A sentence with the accepted notation.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    seconds.filter(|seconds: &f64| (0.0..=1.0e9).contains(seconds)).ok_or_else(|| {
        format!("{text:?} is not a time since the first sample: write seconds, such as 2.5")
    })
}

/// Parses a sample rate in Hz, which is above 0.
///
/// # Errors
/// A sentence with the accepted notation.
pub fn parse_sample_rate(text: &str) -> Result<f32, String> {
    text.parse().map_err(|_| no_sample_rate(text)).and_then(checked_sample_rate)
}

/// Checks that a sample rate in Hz is above 0 and finite.
pub(super) fn checked_sample_rate(rate: f32) -> Result<f32, String> {
    if rate.is_finite() && rate > 0.0 { Ok(rate) } else { Err(no_sample_rate(&rate.to_string())) }
}

fn no_sample_rate(text: &str) -> String {
    format!("{text} is not a sample rate: write a number of Hz above 0")
}

/// Parses whether gravity is `included` or `removed`.
///
/// # Errors
/// A sentence with both words.
pub fn parse_gravity(text: &str) -> Result<Gravity, String> {
    value_of(&GRAVITIES, text)
}

/// Parses the method: `self_calibrating` or `half_widths`.
///
/// # Errors
/// A sentence with both words.
pub(super) fn parse_method(text: &str) -> Result<Method, String> {
    value_of(&METHODS, text)
}

/// Parses whether learning is `on` or `frozen`.
///
/// # Errors
/// A sentence with both words.
pub(super) fn parse_learning(text: &str) -> Result<Learning, String> {
    value_of(&LEARNINGS, text)
}

/// Parses the time of the gyroscope's measurement: `period_mean`, or a delay such as `1.5ms`.
///
/// # Errors
/// A sentence with the accepted notation.
pub fn parse_gyro_timing(text: &str) -> Result<GyroTiming, String> {
    if text == "period_mean" {
        return Ok(GyroTiming::PeriodMean);
    }
    duration(text).map(GyroTiming::Delay).ok_or_else(|| {
        format!("{text:?} is not a timing: write \"period_mean\" or a delay such as \"1.5ms\"")
    })
}

/// Parses a number of milliseconds with its unit, returned in s.
fn duration(text: &str) -> Option<f32> {
    let milliseconds: f64 = text.strip_suffix("ms")?.trim_end().parse().ok()?;
    Some((milliseconds * 1.0e-3) as f32)
}

/// Returns the parameter with this name. An error of the estimator has the name of a parameter only.
pub(super) fn parameter_named(name: &str) -> Option<Parameter> {
    Parameter::ALL.into_iter().find(|parameter| parameter.name() == name)
}

/// Notation of a number: in the unit of the table of limits, or in ms.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Notation {
    /// In this unit.
    As(Unit),
    /// In ms, although the field is in s.
    Milliseconds,
}

impl Notation {
    /// Returns the notation of the number with this name.
    pub(super) fn of(name: &str) -> Self {
        if [parameter::WINDOW.name, parameter::GYRO_DELAY.name].contains(&name) {
            return Self::Milliseconds;
        }
        let unit = match parameter_named(name) {
            Some(parameter) => parameter.row().unit,
            None if name == parameter::SAMPLE_RATE.name => parameter::SAMPLE_RATE.unit,
            None => Unit::One,
        };
        Self::As(unit)
    }

    /// Formats the value of a field in this notation.
    pub(super) fn number(self, value: f32) -> String {
        match self {
            // Scaled in decimal, because 1e-4 s in binary is not quite 0.1 ms.
            Self::Milliseconds => match value.to_string().parse::<f64>() {
                Ok(seconds) => shown((1.0e3 * seconds) as f32),
                Err(_) => shown(1.0e3 * value),
            },
            Self::As(_) => shown(value),
        }
    }

    /// Returns the unit after a number; empty for loads, which are in the unit of the recording.
    pub(super) fn symbol(self) -> String {
        match self {
            Self::Milliseconds => " ms".to_owned(),
            Self::As(Unit::One | Unit::LoadSignal) => String::new(),
            Self::As(unit) => format!(" {}", unit.symbol()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn method_and_learning_are_words() {
        assert_eq!(parse_method("half_widths"), Ok(Method::HalfWidths));
        assert_eq!(parse_method("self_calibrating"), Ok(Method::SelfCalibrating));
        assert!(parse_method("paper").is_err());
        assert_eq!(parse_learning("on"), Ok(Learning::On));
        assert_eq!(parse_learning("frozen"), Ok(Learning::Frozen));
        assert!(parse_learning("off").is_err());
    }

    #[test]
    fn a_window_is_a_duration_or_a_count() {
        assert_eq!(parse_window("50ms"), Ok(WindowLength::Duration(0.05)));
        assert_eq!(parse_window("12.5ms"), Ok(WindowLength::Duration(0.0125)));
        assert_eq!(parse_window("50samples"), Ok(WindowLength::Samples(50)));
        for wrong in ["50", "ms", "50s", "1.5samples", "-3samples", ""] {
            assert!(parse_window(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_sample_rate_is_a_positive_number() {
        assert_eq!(parse_sample_rate("285.714"), Ok(285.714));
        for wrong in ["0", "-1", "nan", "inf", "1e99", "fast"] {
            assert!(parse_sample_rate(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn gyro_timing_is_a_word_or_a_delay() {
        assert_eq!(parse_gyro_timing("period_mean"), Ok(GyroTiming::PeriodMean));
        assert_eq!(parse_gyro_timing("1.5ms"), Ok(GyroTiming::Delay(0.0015)));
        assert!(parse_gyro_timing("1.5").is_err());
    }
}
