//! How the recording of an IMU is read and estimated that is played as a source, for all commands that listen to feet.

use std::path::PathBuf;

use clap::Args;
use feet::{Playback, Source};
use recordings::config::{Preset, Resolved};
use recordings::input::{ContactUse, Format, Hints};

use super::recording::{
    BagArguments, MountingArguments, TableArguments, estimator_options, preset_parser, read_config,
};
use crate::commands::headings::ESTIMATOR;
use crate::error::Error;

/// How the recording of an IMU is read and estimated that is played.
#[derive(Clone, Debug, Default, Args)]
pub struct PlayedArguments {
    /// Which topics of a bag are read.
    #[command(flatten)]
    pub bag: BagArguments,
    /// How tables of others are read.
    #[command(flatten)]
    pub table: TableArguments,
    /// How the sensor lies.
    #[command(flatten)]
    pub mounting: MountingArguments,
    /// Preset of the parameters with which the recording of an IMU is estimated
    #[arg(long, value_parser = preset_parser(), default_value = Preset::default().name(), help_heading = ESTIMATOR)]
    pub preset: Preset,
    /// A TOML file with parameters that differ from the preset, of all feet or of single ones
    #[arg(long, value_name = "FILE.toml", help_heading = ESTIMATOR)]
    pub config: Option<PathBuf>,
    /// Estimate from the samples of a bag again; otherwise the contacts that its feet sent and that were recorded
    /// with the samples are the estimates, and no parameter applies
    #[arg(long, help_heading = ESTIMATOR)]
    pub estimate_again: bool,
}

impl PlayedArguments {
    /// Returns the source, read and estimated as the options say.
    ///
    /// # Errors
    /// There are options, and the source is not a file; or the configuration file cannot be read, or has an error.
    pub(crate) fn read(&self, source: Source) -> Result<Source, Error> {
        let config = self.config.as_deref();
        let settings = Resolved {
            preset: self.preset,
            axes: self.mounting.axes.clone(),
            ..config.map(read_config).transpose()?.unwrap_or_default()
        };
        settings.check_before_reading(Format::Csv)?;
        let playback = Playback {
            hints: Hints {
                contacts: ContactUse::unless_estimated(self.estimate_again),
                ..settings.hints(self.table.options(), self.bag.options())
            },
            estimator_options: estimator_options(self.preset, config, None, &self.mounting),
            settings,
        };
        if playback != Playback::default() && source.file().is_none() {
            return Err(Error::NotPlayed(source.to_string()));
        }
        Ok(source.played_with(playback))
    }
}
