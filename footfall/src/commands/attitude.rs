//! `footfall attitude`.

use std::path::PathBuf;

use analysis::config::{Preset, parse_sample_rate};
use clap::Args;
use recordings::input::Format;
use recordings::replay::replay_observed;
use scoring::inclination::InclinationScore;

use super::recording::{Configuration, MountingArguments};
use crate::attitude::AttitudeReport;
use crate::error::Error;
use crate::progress::{self, Bars};
use crate::report::{SummaryStyle, print, print_text, warn};

/// What `footfall attitude` takes.
#[derive(Debug, Args)]
pub struct AttitudeArguments {
    /// Recordings in csv; rows count where qw,qx,qy,qz are filled in and movement, if there, is 1
    #[arg(required = true, value_name = "INPUT.csv")]
    pub inputs: Vec<PathBuf>,
    /// A TOML file with parameters that differ from the default
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Sample rate, where the files do not tell or their nominal rate is wrong
    #[arg(long, value_name = "HZ", value_parser = parse_sample_rate)]
    pub sample_rate: Option<f32>,
    /// How the sensor lies; the orientations in the files are the sensor's.
    #[command(flatten)]
    pub mounting: MountingArguments,
    /// Print a Markdown table
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

impl AttitudeArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let configuration = Configuration::read(self.config.as_deref())?;
        let mut params = Preset::Default.params(Format::Csv);
        configuration.overrides.apply(&mut params);
        let hints = configuration.hints(self.sample_rate, None, self.mounting)?;
        let scores: Result<Vec<_>, Error> = self
            .inputs
            .iter()
            .map(|input| {
                let (loaded, truth) = progress::open(input, Some(Format::Csv), &Bars::default())?
                    .read_with_orientation(&hints)?;
                loaded.notices.iter().for_each(warn);
                let file = input.display().to_string();
                let origins = configuration.origins(&file, self.sample_rate, None);
                origins.check_effects(&params)?;
                let bar = Bars::default().estimating(loaded.recording.samples.len() as u64);
                let estimated = replay_observed(&loaded.recording, &params, || bar.inc(1));
                bar.finish_and_clear();
                let (estimates, _) = estimated.map_err(|error| origins.explain(&error, &params))?;
                Ok(InclinationScore::of(&loaded.recording, &estimates, &truth))
            })
            .collect();
        let report = AttitudeReport::of(scores?);
        if self.markdown {
            print_text(&report.markdown())
        } else {
            let style = if self.json {
                SummaryStyle::Json
            } else {
                SummaryStyle::Text
            };
            print(&report, style, [])
        }
        .map_err(Error::Print)
    }
}
