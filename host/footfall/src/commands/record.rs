//! `footfall record`: records streaming feet as MCAP for ROS 2.

use std::path::{Path, PathBuf};

use clap::Args;

use super::options::listen::ListenArguments;
use super::options::published::PublishedArguments;
use crate::error::Error;
use crate::targets::{self, Target};
#[cfg(feature = "bags")]
use {
    crate::files::finish_when_interrupted,
    crate::mcap_recording::McapRecording,
    crate::report::print_text,
    crate::stream::{Stream, deadline, unless_ended},
    feet::link::pace::Speed,
};

/// Arguments of `footfall record`.
#[derive(Debug, Args)]
pub struct RecordArguments {
    /// Feet that stream.
    #[command(flatten)]
    pub listen: ListenArguments,
    /// Frames, and messages of other programs.
    #[command(flatten)]
    pub published: PublishedArguments,
    /// Where they are recorded. Whatever ends the recording, what came a second before is in it
    #[arg(long, short, value_name = "OUT.mcap")]
    pub output: PathBuf,
    /// Stop after this time; Ctrl-C stops it, too
    #[arg(long, value_name = "SECONDS", value_parser = crate::stream::parse_seconds)]
    pub seconds: Option<f64>,
    /// Replace a file of this name
    #[arg(long)]
    pub overwrite: bool,
}

impl RecordArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let path = self.output.as_path();
        let input = self.listen.source.file().map(Path::to_owned);
        targets::check(input.as_slice(), &[Target::Bag(path)])?;
        #[cfg(feature = "bags")]
        self.record()?;
        Ok(())
    }

    /// Records until the feet, the time or the user ends it.
    #[cfg(feature = "bags")]
    fn record(self) -> Result<(), Error> {
        let path = self.output.as_path();
        finish_when_interrupted();
        let (source, feet) = self.listen.listen()?;
        // Recorded sources are read at full speed.
        let source = source.at_speed(Speed::Max);
        // An unreadable source must not replace an existing file.
        let mut stream = Stream::open(source, feet, self.published.bridge())?;
        let mut recording = McapRecording::create(path, self.overwrite)?;
        let end = deadline(stream.clock(), self.seconds);
        let ended = stream.run(end, &mut recording)?;
        stream.report();
        print_text(&recording.finish()?).map_err(Error::Print)?;
        unless_ended(ended)
    }
}
