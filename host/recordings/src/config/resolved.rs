//! Settings of preset, configuration file and options, merged in this order.

use std::collections::BTreeMap;
use std::fmt::{self, Formatter};
use std::str::FromStr;

use estimator_core::mounting::Mounting;
use estimator_core::parameter::Parameter;
use estimator_core::params::WindowLength;
use estimator_core::{Gravity, Params, ParamsError};

use crate::config::file::{ConfigError, ConfigFile, Overrides};
use crate::config::preset::Preset;
use crate::config::refusal::{Origins, ParameterRefusal, RateOrigin};
use crate::display_in_plain_words;
use crate::estimate::CAPACITY;
use crate::hint::{InWords, Setting, Vocabulary};
use crate::input::Format;
use crate::input::{BagOptions, ContactUse, Correction, InputOptions, TableOptions, is_among};
use crate::mounting::parse_axes;

/// Settings of preset, configuration file and options. Options override the file, and the file overrides the
/// preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Resolved {
    /// Preset from which the parameters start.
    pub preset: Preset,
    /// Configuration file.
    pub file: Option<ConfigFile>,
    /// Settings in the file.
    pub overrides: Overrides,
    /// Option: length of the window.
    pub window: Option<WindowLength>,
    /// Option: sample rate, Hz.
    pub sample_rate: Option<f32>,
    /// Option: whether samples contain gravity.
    pub gravity: Option<Gravity>,
    /// Option: mounting of the sensors.
    pub axes: Option<FootAxes>,
}

impl Resolved {
    /// Takes the settings of a configuration file.
    ///
    /// # Errors
    /// The first error in the file.
    pub fn of_file(file: ConfigFile) -> Result<Self, ConfigError> {
        Ok(Self {
            overrides: Overrides::parse(&file.text, &file.name)?,
            file: Some(file),
            ..Self::default()
        })
    }

    /// Returns the parameters for recordings of a format.
    #[must_use]
    pub fn params(&self, format: Format) -> Params {
        let mut params = self.preset.params(format);
        self.overrides.apply(&mut params);
        if let Some(window) = self.window {
            params.window = window;
        }
        params
    }

    /// Returns the parameters for a foot with these names in recordings of a format.
    #[must_use]
    pub fn params_of(&self, names: &[&str], format: Format) -> Params {
        let mut params = self.params(format);
        self.overrides.apply_foot(names, &mut params);
        params
    }

    /// Returns the properties of files that their format does not define.
    #[must_use]
    pub fn input_options(&self, table: TableOptions, bag: BagOptions) -> InputOptions {
        let mut correction = self.overrides.correction();
        let mut foot_corrections = self.overrides.foot_corrections();
        if let Some(axes) = &self.axes {
            axes.set(&mut correction, &mut foot_corrections);
        }
        InputOptions {
            sample_rate: self.sample_rate.or(self.overrides.all.get(Parameter::SampleRate)),
            gravity: self.gravity.or(self.overrides.all.gravity),
            correction,
            foot_corrections,
            table,
            bag,
            contacts: ContactUse::Ignored,
        }
    }

    /// Returns the sources of the parameters, for errors about a recording.
    #[must_use]
    pub fn origins<'a>(&'a self, recording: &'a str) -> Origins<'a> {
        Origins {
            file: self.file.as_ref().map(|file| file.name.as_str()),
            text: self.file_text(),
            overrides: &self.overrides,
            window: self.window,
            recording,
            sample_rate: match (self.sample_rate, self.overrides.all.get(Parameter::SampleRate)) {
                (Some(_), _) => RateOrigin::Option,
                (None, Some(_)) => RateOrigin::Configuration,
                (None, None) => RateOrigin::Recording,
            },
        }
    }

    /// Checks the settings at the preset's sample rate.
    ///
    /// # Errors
    /// Each setting that is out of range, or the first without an effect.
    pub fn check(&self, format: Format) -> Result<(), ParameterRefusal> {
        self.check_params(format, |_| true)
    }

    /// Checks the parameters that do not depend on the recording. The length of the window in samples depends on it, and
    /// is checked after reading.
    ///
    /// # Errors
    /// Each parameter that is out of range, or the first without an effect.
    pub fn check_before_reading(&self, format: Format) -> Result<(), ParameterRefusal> {
        self.check_params(format, |error| !matches!(error, ParamsError::WindowLength { .. }))
    }

    fn check_params(
        &self,
        format: Format,
        counts: impl Fn(&ParamsError) -> bool,
    ) -> Result<(), ParameterRefusal> {
        let mut params = self.params(format);
        let origins = self.origins("");
        origins.check_effects(&params)?;
        let mut refusals = Vec::new();
        while let Err(error) = params.validate_for::<CAPACITY>()
            && counts(&error)
        {
            refusals.push(origins.explain(&error));
            // The next error is found with the preset's number in its place.
            let ParamsError::OutOfRange { field, .. } = error else {
                break;
            };
            let Some(number) = Parameter::ALL.into_iter().find(|of| of.name() == field) else {
                break;
            };
            let preset = number.get(&self.preset.params(format));
            // A pair of thresholds is one error.
            if number == Parameter::LoadOffThreshold || number.get(&params) == preset {
                break;
            }
            number.set(&mut params, preset);
        }
        ParameterRefusal::of_all(refusals)
    }

    /// Checks that each foot with axes of its own, set by the option, is among these names.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check_axes(&self, names: &[&str]) -> Result<(), NoSuchFoot> {
        match self.absent_foot(names) {
            None => Ok(()),
            Some(foot) => Err(NoSuchFoot { foot: foot.to_owned(), feet: names.join(", ") }),
        }
    }

    /// Returns the first foot with axes of its own, set by the option, that is not among these names.
    #[must_use]
    pub fn absent_foot(&self, names: &[&str]) -> Option<&str> {
        self.axes.as_ref().and_then(|axes| axes.absent(names))
    }

    /// Returns a sentence if the file has settings of single feet, and none of them is among these names.
    #[must_use]
    pub fn unused_feet(&self, names: &[&str]) -> Option<String> {
        let feet = &self.overrides.feet;
        let is_unused = !feet.is_empty() && !feet.keys().any(|foot| is_among(foot, names));
        let feet: Vec<&str> = feet.keys().map(String::as_str).collect();
        is_unused.then(|| {
            format!(
                "{} has settings of {}, but there is {}",
                self.file_name(),
                feet.join(", "),
                names.join(", ")
            )
        })
    }

    /// Returns the name of the file; empty without one.
    #[must_use]
    pub fn file_name(&self) -> &str {
        self.file.as_ref().map_or("", |file| file.name.as_str())
    }

    /// Returns the text of the file; empty without one.
    #[must_use]
    pub fn file_text(&self) -> &str {
        self.file.as_ref().map_or("", |file| file.text.as_str())
    }
}

/// Axes are given for a foot that is not in the recordings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoSuchFoot {
    /// Name of the foot, as given.
    pub foot: String,
    /// Names of the feet in the recordings, separated by commas.
    pub feet: String,
}

impl std::error::Error for NoSuchFoot {}

display_in_plain_words!(NoSuchFoot);

impl InWords for NoSuchFoot {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        let (axes, Self { foot, feet }) = (words.name(Setting::Axes), self);
        write!(f, "{axes} names the foot {foot}, but there is {feet}")
    }
}

/// Mounting of the sensors: the same in all feet, or one of each foot.
#[derive(Clone, Debug, PartialEq)]
pub enum FootAxes {
    /// Of all feet.
    All(Mounting),
    /// By the name of the foot.
    Each(BTreeMap<String, Mounting>),
}

impl FootAxes {
    /// The first foot with a mounting that is not among these names.
    pub fn absent(&self, names: &[&str]) -> Option<&str> {
        let Self::Each(mountings) = self else {
            return None;
        };
        let mut feet = mountings.keys().map(String::as_str);
        feet.find(|foot| !is_among(foot, names))
    }

    /// Replaces the mountings in the correction of all feet and in those of single feet.
    pub fn set(&self, all: &mut Correction, feet: &mut BTreeMap<String, Correction>) {
        match self {
            Self::All(mounting) => {
                all.mounting = *mounting;
                for correction in feet.values_mut() {
                    correction.mounting = *mounting;
                }
            }
            Self::Each(mountings) => {
                for (foot, mounting) in mountings {
                    let mut names = feet.keys();
                    let known = names.find(|name| name.eq_ignore_ascii_case(foot)).cloned();
                    let own = feet.entry(known.unwrap_or_else(|| foot.clone()));
                    own.or_insert(*all).mounting = *mounting;
                }
            }
        }
    }
}

impl FromStr for FootAxes {
    type Err = String;

    /// Reads a mounting as [`parse_axes`] does, or one for each foot, such as `FL=x,y,z,FR=-x,-y,z`.
    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains('=') {
            return parse_axes(text).map(Self::All);
        }
        let mut feet: BTreeMap<String, String> = BTreeMap::new();
        let mut name: Option<&str> = None;
        for part in text.split(',') {
            if let Some((foot, first)) = part.split_once('=') {
                let foot = foot.trim();
                if foot.is_empty() || is_among(foot, feet.keys()) {
                    return Err(format!("{text:?} names no foot before =, or one twice"));
                }
                feet.insert(foot.to_owned(), first.to_owned());
                name = Some(foot);
            } else if let Some(axes) = name.and_then(|name| feet.get_mut(name)) {
                *axes = format!("{axes},{part}");
            } else {
                return Err(format!("{text:?} has {part:?} before the name of a foot"));
            }
        }
        let parsed = feet.into_iter().map(|(foot, axes)| {
            let mounting = parse_axes(&axes).map_err(|error| format!("{foot}: {error}"))?;
            Ok((foot, mounting))
        });
        parsed.collect::<Result<_, String>>().map(Self::Each)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mounting::axes_text;

    fn of_file(text: &str) -> Resolved {
        Resolved::of_file(ConfigFile { name: "c.toml".to_owned(), text: text.to_owned() })
            .expect("a configuration")
    }

    fn input_options(resolved: &Resolved) -> InputOptions {
        resolved.input_options(TableOptions::default(), BagOptions::default())
    }

    #[test]
    fn options_override_the_file_and_the_file_the_preset() {
        let text = "sample_rate_hz = 500\ngravity = 'removed'\naxes = 'x,-z,y'\n\
                window = '40ms'\n[feet.FL]\naxes = '-x,-y,z'";
        let file = of_file(text);
        let options = Resolved {
            window: Some(WindowLength::Samples(7)),
            sample_rate: Some(400.0),
            gravity: Some(Gravity::Included),
            axes: "y,-x,z".parse().ok(),
            ..file.clone()
        };
        let [preset, file, options] = [&Resolved::default(), &file, &options].map(|resolved| {
            let input_options = input_options(resolved);
            (
                resolved.params(Format::Csv).window,
                input_options.sample_rate,
                input_options.gravity,
                axes_text(&input_options.correction.mounting),
                axes_text(&input_options.correction_of(&["FL"]).mounting),
            )
        });
        let window = Preset::Default.params(Format::Csv).window;
        let axes = |text: &str| text.to_owned();
        let [identity, of_all, own] = ["x,y,z", "x,-z,y", "-x,-y,z"].map(axes);
        let given = axes("y,-x,z");
        assert_eq!(preset, (window, None, None, identity.clone(), identity));
        let removed = Some(Gravity::Removed);
        let duration = WindowLength::Duration(0.04);
        assert_eq!(file, (duration, Some(500.0), removed, of_all, own));
        let count = WindowLength::Samples(7);
        let included = Some(Gravity::Included);
        assert_eq!(options, (count, Some(400.0), included, given.clone(), given));
    }

    #[test]
    fn rate_equal_to_that_of_the_file_is_attributed_to_the_option() {
        let origin = |resolved: &Resolved| resolved.origins("x.csv").sample_rate;
        let file = of_file("sample_rate_hz = 500");
        assert_eq!(origin(&Resolved::default()), RateOrigin::Recording);
        assert_eq!(origin(&file), RateOrigin::Configuration);
        let option = Resolved { sample_rate: Some(500.0), ..file };
        assert_eq!(origin(&option), RateOrigin::Option);
    }

    #[test]
    fn axes_of_each_foot_are_read() {
        let axes = |text: &str| text.parse::<FootAxes>();
        let turned = parse_axes("x,-z,y").unwrap();
        assert_eq!(axes("x,-z,y"), Ok(FootAxes::All(turned)));
        let Ok(FootAxes::Each(feet)) = axes("FL=x,-z,y,fr=1,0,0,0") else {
            panic!("two feet");
        };
        assert_eq!(feet["FL"], turned);
        assert_eq!(feet["fr"], Mounting::IDENTITY);
        for (text, why) in [
            ("x,FL=y,z", "has \"x\" before the name of a foot"),
            ("FL=x,y,z,fl=x,y,z", "one twice"),
            ("=x,y,z", "names no foot"),
            ("FL=x,y", "FL: \"x,y\" is neither axes nor a quaternion"),
        ] {
            let said = axes(text).unwrap_err();
            assert!(said.contains(why), "{text}: {said}");
        }
    }
}
