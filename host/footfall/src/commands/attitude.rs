//! `footfall attitude`.

use std::path::PathBuf;

use analysis::config::Preset;
use clap::Args;
use recordings::input::Format;
use recordings::plausible::Finding;
use recordings::replay::replay_observed;
use scoring::inclination::InclinationScore;

use super::headings::ESTIMATOR;
use super::recording::{ReadingArguments, check};
use crate::attitude::AttitudeReport;
use crate::error::Error;
use crate::messages::warn;
use crate::progress::{self, Bars};
use crate::report::{SummaryStyle, print, print_text};
use crate::targets;

/// Arguments of `footfall attitude`.
#[derive(Debug, Args)]
pub struct AttitudeArguments {
    /// Recordings in csv or Parquet; rows count where qw,qx,qy,qz are filled in and movement, if there,
    /// is 1. The orientations are the sensor's
    #[arg(required = true, value_name = "INPUT.csv|parquet")]
    pub inputs: Vec<PathBuf>,
    /// How they are read.
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// A TOML file with parameters that differ from the default
    #[arg(long, value_name = "FILE.toml", help_heading = ESTIMATOR)]
    pub config: Option<PathBuf>,
    /// Print a Markdown table
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

impl AttitudeArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let config = self.config.as_deref();
        let resolved = self.reading.resolved(Preset::Default, config)?;
        let params = resolved.params(Format::Csv);
        targets::check_inputs(&self.inputs)?;
        let hints = self.reading.hints(&resolved)?;
        let scores: Result<Vec<_>, Error> = self
            .inputs
            .iter()
            .map(|input| {
                let (loaded, truth) = progress::open(input, self.reading.format, &Bars::default())?
                    .read_with_orientation(&hints)?;
                loaded.notices.iter().for_each(warn);
                let file = input.display().to_string();
                let name = loaded.recording.name.as_str();
                resolved.check_axes(&[name])?;
                let mut findings = check(&loaded.recording, &loaded.recording.name, &hints);
                findings.retain(concerns_attitude);
                self.reading.report(&file, &findings)?;
                let origins = resolved.origins(&file);
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
            print(&report, SummaryStyle::of(self.json), [])
        }
        .map_err(Error::Print)
    }
}

/// Returns whether a finding concerns the samples rather than a walking foot.
const fn concerns_attitude(finding: &Finding) -> bool {
    !matches!(
        finding,
        Finding::GravityNotAlongZ { .. } | Finding::Clips { .. } | Finding::LowRate { .. }
    )
}
