//! Feet that stream, for all commands that listen to them.

use clap::Args;
use feet::Source;
use feet::decode::Feet;

use super::feet::FeetArguments;
use super::played::PlayedArguments;
use crate::error::Error;

/// Help text on the syntax of a source.
pub(crate) const SOURCES: &str = "Where the feet stream from: usb, uart:/dev/ttyACM0[@BAUD], can:can0, \
                       slcan:/dev/ttyACM0[@KBIT], file:can.log[@SPEED], or demo[:feet=4] for \
                       simulated feet";

/// Feet that stream.
#[derive(Debug, Args)]
pub struct ListenArguments {
    /// Where the feet stream from.
    #[arg(help = SOURCES, default_value = "usb")]
    pub source: Source,
    /// Which nodes are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
    /// How a recording of an IMU is read.
    #[command(flatten)]
    pub played: PlayedArguments,
}

impl ListenArguments {
    /// Returns the source and the feet.
    ///
    /// # Errors
    /// Names of feet contradict each other, or there are options of reading for a source that is not a file.
    pub(crate) fn listen(self) -> Result<(Source, Feet), Error> {
        let feet = self.feet.feet()?;
        Ok((self.played.read(self.source)?, feet))
    }
}
