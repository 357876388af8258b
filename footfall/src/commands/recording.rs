//! What the commands that estimate from recordings share: options, and the configuration file.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use estimator_core::{Gravity, Mounting, Params, WindowLength};
use recordings::input::{Correction, Format, Hints, Mapping, TableOptions, TimeUnit, Times, Units};
use recordings::plausible::Finding;

use crate::config::{
    ConfigError, Origins, Overrides, Preset, RateOrigin, parse_axes, parse_gravity,
    parse_sample_rate,
};
use crate::error::Error;
use crate::report::warn;

/// How recordings are read and which parameters they are estimated with. Later wins: preset,
/// configuration file, options.
#[derive(Debug, Args)]
pub struct RecordingArguments {
    /// How the input is laid out; may be left out where a header names the columns (csv)
    #[arg(long, value_parser = format_parser())]
    pub format: Option<Format>,
    /// Where the parameters start from
    #[arg(long, value_enum, default_value_t)]
    pub preset: Preset,
    /// A TOML file with parameters that differ from the preset
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Sample rate, where the input does not tell or its nominal rate is wrong
    #[arg(long, value_name = "HZ", value_parser = parse_sample_rate)]
    pub sample_rate: Option<f32>,
    /// Whether the accelerations contain gravity: included or removed
    #[arg(long, value_name = "included|removed", value_parser = parse_gravity)]
    pub gravity: Option<Gravity>,
    /// How the sensor lies.
    #[command(flatten)]
    pub mounting: MountingArguments,
    /// How tables of others are read.
    #[command(flatten)]
    pub table: TableArguments,
    /// Fail where a recording is not plausible: wrong units, gravity that is there or not, a clock
    /// that jumps
    #[arg(long)]
    pub strict: bool,
}

/// How the sensor lies in the foot.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct MountingArguments {
    /// The mounting, where it was given.
    #[arg(
        long,
        value_name = "x,-z,y|w,x,y,z",
        value_parser = parse_axes,
        allow_hyphen_values = true,
        help = "The sensor's axes along the foot's x, y and z, which is up; or a unit quaternion from \
                the sensor's frame to the foot's. footfall calibrate finds it"
    )]
    pub axes: Option<Mounting>,
}

/// How a csv of others is read; docs/formats.md lists what is recognised without.
#[derive(Clone, Debug, Default, Args)]
pub struct TableArguments {
    /// Which columns stand for ours.
    #[arg(
        long,
        value_name = "OURS=THEIRS,...",
        help = "Columns that stand for ours, by their name or its last parts, such as \
                t=stamp,ax=linear_acceleration.x; those of ROS, PlotJuggler and Unitree are known"
    )]
    pub map: Option<Mapping>,
    /// Units of the six axes where they are not m/s2,rad/s: g and dps
    #[arg(long, value_name = "g,dps")]
    pub units: Option<Units>,
    /// Unit of the times where it is not s: ms, us or ns
    #[arg(long, value_name = "s|ms|us|ns")]
    pub time_unit: Option<TimeUnit>,
    /// Times that are not in order: keep (an error), drop-bad (leave those rows out) or rate (space
    /// all rows by the sample rate)
    #[arg(long, value_name = "keep|drop-bad|rate")]
    pub times: Option<Times>,
}

impl TableArguments {
    fn options(&self) -> TableOptions {
        TableOptions {
            mapping: self.map.clone().unwrap_or_default(),
            units: self.units.unwrap_or_default(),
            time_unit: self.time_unit,
            times: self.times.unwrap_or_default(),
        }
    }
}

/// A configuration file, or one that changes nothing. It is read once, so a pipe will do.
#[derive(Default)]
pub(super) struct Configuration {
    /// The file as it was named.
    pub name: Option<String>,
    pub text: String,
    pub overrides: Overrides,
}

/// Reads the name of a format; the help lists all of them.
fn format_parser() -> impl TypedValueParser<Value = Format> {
    let names = Format::ALL.map(|format| PossibleValue::new(format.name()).help(format.help()));
    PossibleValuesParser::new(names).try_map(|name| name.parse::<Format>())
}

/// Findings about a recording that was read with `hints`: the axes that they name take the place of those.
pub(super) fn with_mounting(findings: Vec<Finding>, hints: &Hints) -> Vec<Finding> {
    let mounting = &hints.correction.mounting;
    let findings = findings.into_iter();
    findings
        .map(|finding| finding.with_mounting(mounting))
        .collect()
}

impl RecordingArguments {
    /// Reports what is not plausible about a recording.
    ///
    /// # Errors
    /// Anything is, and `--strict` is given.
    pub(super) fn report(&self, file: &str, findings: &[Finding]) -> Result<(), Error> {
        for finding in findings {
            warn(format!("{file}: {finding}"));
        }
        if self.strict && !findings.is_empty() {
            return Err(Error::Implausible {
                file: file.to_owned(),
                count: findings.len(),
            });
        }
        Ok(())
    }

    /// The preset for recordings of a format, with what the configuration sets.
    pub(super) fn params(&self, configuration: &Configuration, format: Format) -> Params {
        let mut params = self.preset.params(format);
        configuration.overrides.apply(&mut params);
        params
    }

    /// What is known about the files beyond their format.
    pub(super) fn hints(&self, configuration: &Configuration) -> Result<Hints, Error> {
        let hints = configuration.hints(self.sample_rate, self.gravity, self.mounting)?;
        Ok(Hints {
            table: self.table.options(),
            ..hints
        })
    }
}

impl Configuration {
    pub(super) fn read(path: Option<&Path>) -> Result<Self, Error> {
        let Some(path) = path else {
            return Ok(Self::default());
        };
        let file = path.display().to_string();
        match fs::read_to_string(path) {
            Ok(text) => Ok(Self {
                overrides: Overrides::parse(&text, &file)?,
                name: Some(file),
                text,
            }),
            Err(source) => Err(ConfigError::Unreadable { file, source }.into()),
        }
    }

    /// What is known about a file beyond its format; options win over the configuration.
    pub(super) fn hints(
        &self,
        sample_rate: Option<f32>,
        gravity: Option<Gravity>,
        MountingArguments { axes }: MountingArguments,
    ) -> Result<Hints, Error> {
        let file = self.name.as_deref().unwrap_or_default();
        let correction = self.overrides.correction(file)?;
        Ok(Hints {
            sample_rate: sample_rate.or(self.overrides.sample_rate_hz),
            gravity: gravity.or(self.overrides.gravity),
            correction: Correction {
                mounting: axes.unwrap_or(correction.mounting),
                ..correction
            },
            table: TableOptions::default(),
        })
    }

    /// Who set the parameters, for errors; `sample_rate` and `window` are those of the options.
    pub(super) fn origins<'a>(
        &'a self,
        recording: &'a str,
        sample_rate: Option<f32>,
        window: Option<WindowLength>,
    ) -> Origins<'a> {
        Origins {
            file: self.name.as_deref(),
            overrides: &self.overrides,
            window,
            recording,
            sample_rate: match (sample_rate, self.overrides.sample_rate_hz) {
                (Some(_), _) => RateOrigin::Option,
                (None, Some(_)) => RateOrigin::Configuration,
                (None, None) => RateOrigin::Recording,
            },
        }
    }
}
