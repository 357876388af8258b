//! Rejected parameters, reported by the option or key that sets them, with unit and file.

use std::fmt::{self, Formatter};
use std::ops::RangeInclusive;

use estimator_core::any::{AnyParams, Method};
use estimator_core::half_widths::WindowLength;
use estimator_core::parameter::{self, Parameter};
use estimator_core::{ParamsError, Stream};

use crate::file::{Overrides, Position};
use crate::keys::split_axis;
use crate::value::{Notation, parameter_named};
use options::TimeUnit;
use options::display_in_plain_words;
use options::hint::{Hint, InWords, Setting, Vocabulary};
use samples::estimate::check;

/// Error of the parameters that result from preset, configuration file, recording and options: at least one refusal, a
/// line for each.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterRefusal(Vec<Refusal>);

/// A parameter that is refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Source of the parameter.
    pub subject: Subject,
    /// Reason of the refusal.
    pub reason: Reason,
}

/// Source of a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A setting of the program.
    Option(Setting),
    /// A key of the configuration file or of the preset, with its position.
    Key(String),
    /// The sample rate of the recording with this name.
    RateOf(String),
}

/// Reason of a refusal.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The value is out of its range.
    OutOfRange {
        /// The value, as it is written in this unit.
        value: String,
        /// Least value in the range.
        least: String,
        /// Largest value in the range.
        most: String,
        /// Unit after the numbers, with a space before it; empty without one.
        unit: String,
        /// Further limit of the range; empty without one.
        limit: &'static str,
        /// Remedy, if the value suggests one.
        hint: Option<Hint>,
    },
    /// The window has too few or too many samples.
    WindowLength {
        /// Samples in the window at the sample rate.
        samples: u32,
        /// Most samples of a window.
        capacity: usize,
    },
    /// The parameter has an effect with half-widths only.
    WithoutEffect,
    /// Another error of the estimator, in its own words.
    Other(ParamsError),
}

/// Source of the sample rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateOrigin {
    /// An option of the program.
    Option,
    /// The configuration file.
    Configuration,
    /// The recording: its times or its format.
    Recording,
}

/// Sources of the parameters.
#[derive(Clone, Copy, Debug)]
pub struct Origins<'a> {
    /// Name of the configuration file, if any.
    pub file: Option<&'a str>,
    /// Text of the configuration file.
    pub text: &'a str,
    /// Settings in the configuration file.
    pub overrides: &'a Overrides,
    /// Length of the window, if given as an option.
    pub window: Option<WindowLength>,
    /// Name of the recording.
    pub recording: &'a str,
    /// Source of the sample rate.
    pub sample_rate: RateOrigin,
}

impl ParameterRefusal {
    /// Returns the refusals.
    #[must_use]
    pub fn refusals(&self) -> &[Refusal] {
        &self.0
    }

    /// Joins the refusals of several parameters.
    pub(super) fn of_all(refusals: Vec<Self>) -> Result<(), Self> {
        let all: Vec<Refusal> = refusals.into_iter().flat_map(|Self(each)| each).collect();
        if all.is_empty() { Ok(()) } else { Err(Self(all)) }
    }

    fn of(subject: Subject, reason: Reason) -> Self {
        Self(vec![Refusal { subject, reason }])
    }
}

impl std::error::Error for ParameterRefusal {}

display_in_plain_words!(ParameterRefusal, Refusal);

impl InWords for ParameterRefusal {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        for (k, refusal) in self.0.iter().enumerate() {
            f.write_str(if k == 0 { "" } else { "\n" })?;
            refusal.write_in(words, f)?;
        }
        Ok(())
    }
}

impl InWords for Refusal {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        match &self.subject {
            Subject::Option(setting) => f.write_str(&words.name(*setting))?,
            Subject::Key(key) => f.write_str(key)?,
            Subject::RateOf(recording) => write!(f, "{recording}: the sample rate")?,
        }
        match &self.reason {
            Reason::OutOfRange { value, least, most, unit, limit, hint } => {
                write!(f, " is {value}{unit}, allowed is {least} to {most}{unit}{limit}")?;
                match hint {
                    Some(hint) => {
                        f.write_str("; ")?;
                        hint.write_in(words, f)
                    }
                    None => Ok(()),
                }
            }
            Reason::WindowLength { samples, capacity } => write!(
                f,
                " comes to {samples} samples at this sample rate, allowed is 1 to {capacity}"
            ),
            Reason::WithoutEffect => f.write_str(
                " has an effect with method = \"half_widths\" only: leave it out, or set this method in the configuration",
            ),
            Reason::Other(error) => write!(f, ": {error}"),
        }
    }
}

impl Origins<'_> {
    /// Checks that every setting has an effect with `params`, and that the settings of single feet are in range.
    ///
    /// # Errors
    /// The first option or key without effect, or out of range in the table of a foot.
    pub fn check_effects(&self, params: &AnyParams) -> Result<(), ParameterRefusal> {
        for (foot, own) in &self.overrides.feet {
            let mut of_foot = *params;
            own.apply(&mut of_foot);
            if let Err(ParamsError::OutOfRange { field, value, min, max }) =
                check(&of_foot, Stream::KILOHERTZ)
                && own.determines(field)
            {
                let key = Subject::Key(self.in_file(&format!("feet.{foot}.{field}")));
                return Err(out_of_range(key, field, value, &(min..=max), None));
            }
        }
        let all = &self.overrides.all;
        let mut tables = ["half_width", "bandwidth"].into_iter();
        let table = tables.find(|table| all.has(table));
        let key = table.or(all.window.map(|_| parameter::WINDOW.name));
        let set = match self.window {
            Some(_) => Some(Subject::Option(Setting::Window)),
            None => key.map(|key| Subject::Key(self.in_file(key))),
        };
        match set.filter(|_| params.method != Method::HalfWidths) {
            None => Ok(()),
            Some(set) => Err(ParameterRefusal::of(set, Reason::WithoutEffect)),
        }
    }

    /// Describes an error by the option or key that causes it.
    #[must_use]
    pub fn explain(&self, error: &ParamsError) -> ParameterRefusal {
        match error {
            ParamsError::WindowLength { samples, capacity } => {
                let reason = Reason::WindowLength { samples: *samples, capacity: *capacity };
                ParameterRefusal::of(self.window(), reason)
            }
            ParamsError::OutOfRange { field, value, min, max } => {
                let range = *min..=*max;
                let (subject, hint) = if *field == parameter::SAMPLE_RATE.name {
                    (self.rate(), self.unit_of_times(*value, &range))
                } else if *field == parameter::WINDOW.name {
                    (self.window(), None)
                } else {
                    (Subject::Key(self.key_name(field)), None)
                };
                out_of_range(subject, field, *value, &range, hint)
            }
            _ => ParameterRefusal::of(
                Subject::Key("the parameters".to_owned()),
                Reason::Other(*error),
            ),
        }
    }

    fn window(&self) -> Subject {
        match (self.window, self.overrides.all.window) {
            (Some(_), _) => Subject::Option(Setting::Window),
            (None, Some(_)) => Subject::Key(self.in_file(parameter::WINDOW.name)),
            (None, None) => Subject::Key("the preset's window".to_owned()),
        }
    }

    fn rate(&self) -> Subject {
        match self.sample_rate {
            RateOrigin::Option => Subject::Option(Setting::SampleRate),
            RateOrigin::Configuration => Subject::Key(self.in_file(parameter::SAMPLE_RATE.name)),
            RateOrigin::Recording => Subject::RateOf(self.recording.to_owned()),
        }
    }

    fn key_name(&self, name: &str) -> String {
        let (key, axis) = split_axis(name);
        let axis = axis.map(|axis| format!(" ({axis})"));
        self.in_file(key) + &axis.unwrap_or_default()
    }

    fn in_file(&self, key: &str) -> String {
        // One of a pair of thresholds may be in the file and the other in the preset. A key of the preset gets the position
        // of its table.
        let (table, _) = key.rsplit_once('.').unwrap_or_default();
        let position = Position::of_key(self.text, key);
        let position = position.or_else(|| Position::of_key(self.text, table));
        match (self.file, position) {
            (Some(file), Some(position)) => format!("{file}, {position}, key {key}"),
            (Some(file), None) => format!("{file}, key {key}"),
            (None, _) => format!("the preset's {key}"),
        }
    }

    /// Returns a hint on the unit of the times if the rate measured from them, Hz, is far below or above its range.
    fn unit_of_times(&self, rate: f32, range: &RangeInclusive<f32>) -> Option<Hint> {
        if self.sample_rate != RateOrigin::Recording {
            return None;
        }
        if rate > *range.end() {
            return Some(Hint::Batches);
        }
        match &TimeUnit::that_fit(f64::from(rate))[..] {
            [] => None,
            [(unit, _)] => Some(Hint::TimesLookLike(*unit)),
            several => Some(Hint::TimesLookLikeOneOf(several.to_vec())),
        }
    }
}

/// Refuses the value of a parameter outside its range.
fn out_of_range(
    subject: Subject,
    field: &str,
    value: f32,
    range: &RangeInclusive<f32>,
    hint: Option<Hint>,
) -> ParameterRefusal {
    let notation = Notation::of(field);
    let limit = match parameter_named(field) {
        Some(Parameter::LoadOffThreshold) => ", and not above load.on_threshold",
        _ => "",
    };
    let reason = Reason::OutOfRange {
        value: notation.number(value),
        least: notation.number(*range.start()),
        most: notation.number(*range.end()),
        unit: notation.symbol(),
        limit,
        hint,
    };
    ParameterRefusal::of(subject, reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Gravity;
    use options::hint::Bracketed;

    /// Returns the overrides in a file, and the default preset with them.
    fn applied(text: &str) -> (Overrides, AnyParams) {
        let overrides = Overrides::parse(text, "c.toml").unwrap();
        let mut params = AnyParams::DEFAULT;
        overrides.apply(&mut params);
        (overrides, params)
    }

    fn refusal(text: &str, window: Option<WindowLength>) -> String {
        let (overrides, mut params) = applied(text);
        params.half_widths.window = window.unwrap_or(params.half_widths.window);
        let origins = Origins {
            file: Some("c.toml"),
            text: "",
            overrides: &overrides,
            window,
            recording: "x.csv",
            sample_rate: RateOrigin::Configuration,
        };
        let rate = overrides.all.sample_rate.unwrap_or(1_000.0);
        let stream = Stream::new(rate, Gravity::Included);
        let error = stream.and_then(|stream| check(&params, stream)).unwrap_err();
        origins.explain(&error).in_words(&Bracketed)
    }

    #[test]
    fn error_names_key_unit_and_file() {
        for (text, expected) in [
            ("sample_rate_hz = 1", "sample_rate_hz is 1 Hz, allowed is 20 to 10000 Hz"),
            (
                "method = 'half_widths'\nwindow = '0ms'",
                "window is 0 ms, allowed is 0.1 to 1000000 ms",
            ),
            (
                "bandwidth.acceleration_m_s2 = -1",
                "bandwidth.acceleration_m_s2 (ax) is -1 m/s², allowed is 1e-6 to 1000 m/s²",
            ),
            (
                "half_width.angular_rate_rad_s.wy = 0",
                "half_width.angular_rate_rad_s (wy) is 0 rad/s, allowed is 1e-6 to 3 rad/s",
            ),
            ("decision.threshold = 1.5", "decision.threshold is 1.5, allowed is 0.01 to 0.99"),
            ("decision.on_delay_s = -1", "decision.on_delay_s is -1 s, allowed is 0 to 10 s"),
            ("decision.off_delay_s = -1", "decision.off_delay_s is -1 s, allowed is 0 to 0.2 s"),
            ("load.on_threshold = nan", "load.on_threshold is NaN, allowed is -1e9 to 1e9"),
            (
                "load.off_threshold = -1e10",
                "load.off_threshold is -1e10, allowed is -1e9 to 12, and not above load.on_threshold",
            ),
            (
                "load.off_threshold = 13",
                "load.off_threshold is 13, allowed is -1e9 to 12, and not above load.on_threshold",
            ),
            (
                "load.on_threshold = 5",
                "load.off_threshold is 6, allowed is -1e9 to 5, and not above load.on_threshold",
            ),
            (
                "attitude.gyro_timing = '60ms'",
                "attitude.gyro_timing is 60 ms, allowed is 0 to 50 ms",
            ),
            (
                "attitude.motion_time_constant_s = 0",
                "attitude.motion_time_constant_s is 0 s, allowed is 0.1 to 100 s",
            ),
            ("attitude.quiet_gain = 0", "attitude.quiet_gain is 0, allowed is 1 to 10000"),
            (
                "attitude.quiet_acceleration_m_s2 = 0",
                "attitude.quiet_acceleration_m_s2 is 0 m/s², allowed is 0.001 to 10 m/s²",
            ),
            (
                "attitude.quiet_rate_rad_s = 0",
                "attitude.quiet_rate_rad_s is 0 rad/s, allowed is 1e-4 to 1 rad/s",
            ),
            (
                "attitude.rest.duration_s = 0",
                "attitude.rest.duration_s is 0 s, allowed is 0.1 to 100 s",
            ),
            (
                "attitude.rest.acceleration_m_s2 = 0",
                "attitude.rest.acceleration_m_s2 is 0 m/s², allowed is 0.001 to 10 m/s²",
            ),
            (
                "attitude.rest.rate_rad_s = 0",
                "attitude.rest.rate_rad_s is 0 rad/s, allowed is 1e-4 to 1 rad/s",
            ),
            (
                "attitude.rest.bias_limit_rad_s = -1",
                "attitude.rest.bias_limit_rad_s is -1 rad/s, allowed is 0 to 1 rad/s",
            ),
            (
                "attitude.rest.bias_time_constant_s = 0",
                "attitude.rest.bias_time_constant_s is 0 s, allowed is 0.1 to 1000 s",
            ),
        ] {
            assert_eq!(refusal(text, None), format!("c.toml, key {expected}"));
        }
    }

    /// Returns a file with all learnt values, one of them changed.
    fn with_learnt(from: &str, to: &str) -> String {
        let text = "[learnt]\nstill = -1\nmoving = 1\nspeed = -5\nstill_seconds = 2\n\
         moving_seconds = 3\nversion = 1\n";
        assert!(text.contains(from));
        text.replacen(from, to, 1)
    }

    #[test]
    fn implausible_learnt_value_is_rejected_by_key() {
        for (from, to, expected) in [
            ("speed = -5", "speed = -20", "learnt.speed is -20, allowed is -11.5 to 0"),
            ("moving = 1", "moving = -2", "learnt.moving is -2, allowed is -1 to 6"),
            ("still = -1", "still = nan", "learnt.still is NaN, allowed is -4.6 to 6"),
            (
                "still_seconds = 2",
                "still_seconds = -2",
                "learnt.still_seconds is -2, allowed is 0 to 1000",
            ),
        ] {
            assert_eq!(refusal(&with_learnt(from, to), None), format!("c.toml, key {expected}"));
        }
    }

    #[test]
    fn setting_without_effect_is_rejected_by_name() {
        let refused = |text: &str, window| {
            let (overrides, params) = applied(text);
            let origins = Origins {
                file: Some("c.toml"),
                text: "",
                overrides: &overrides,
                window,
                recording: "x.csv",
                sample_rate: RateOrigin::Configuration,
            };
            let refusal = origins.check_effects(&params).err();
            refusal.map(|refusal| refusal.in_words(&Bracketed))
        };
        let window = Some(WindowLength::Samples(50));
        for (text, window, name) in [
            ("half_width.acceleration_m_s2 = 1", None, "c.toml, key half_width"),
            ("[bandwidth]\nangular_rate_rad_s = { wx = 1 }", None, "c.toml, key bandwidth"),
            ("window = '20ms'", None, "c.toml, key window"),
            ("", window, "[window]"),
        ] {
            let refusal = refused(text, window).expect(text);
            let expected = format!("{name} has an effect with method = \"half_widths\" only");
            assert!(refusal.starts_with(&expected), "{refusal}");
            let with_effect = format!("method = 'half_widths'\n{text}");
            assert_eq!(refused(&with_effect, window), None);
        }
        assert_eq!(refused("load.on_threshold = 20", None), None);
    }

    #[test]
    fn option_is_named_before_key() {
        assert_eq!(
            refusal(
                "method = 'half_widths'\nwindow = '20ms'",
                Some(WindowLength::Duration(-0.005))
            ),
            "[window] is -5 ms, allowed is 0.1 to 1000000 ms"
        );
        assert_eq!(
            refusal("method = 'half_widths'\nwindow = '0samples'", None),
            "c.toml, key window comes to 0 samples at this sample rate, allowed is 1 to 4096"
        );
    }
}
