//! How the recording of an IMU is read that is played as a source, for all commands that listen to feet.

use analysis::config::Resolved;
use clap::Args;
use live::Source;
use recordings::input::Hints;

use super::recording::{BagArguments, MountingArguments, TableArguments};
use crate::error::Error;

/// How the recording of an IMU is read that is played.
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
}

impl PlayedArguments {
    /// Returns the source, read as the options say.
    ///
    /// # Errors
    /// There are options, and the source is not a file.
    pub(super) fn read(&self, source: Source) -> Result<Source, Error> {
        let resolved = Resolved {
            axes: self.mounting.axes.clone(),
            ..Resolved::default()
        };
        let hints = resolved.hints(self.table.options(), self.bag.options())?;
        if hints != Hints::default() && source.file().is_none() {
            let source = source.to_string();
            return Err(Error::NotPlayed {
                source_text: source,
            });
        }
        Ok(source.read_with(hints))
    }
}
