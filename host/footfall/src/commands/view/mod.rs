//! `footfall view`: serves streaming feet to Foxglove and `PlotJuggler`.

#[cfg(feature = "foxglove")]
pub mod server;

use clap::{Args, ValueEnum};

use super::options::{
    FeetArguments, HELP_OF_SOURCES, PlayedArguments, PublishedArguments, TopicArguments,
};
use crate::SourceArgument;
use crate::error::Error;
#[cfg(not(feature = "foxglove"))]
use crate::feature::Feature;
use crate::report::print_text;
#[cfg(not(feature = "foxglove"))]
use crate::source::text_of;
use crate::stream::parse_duration;

/// Examples of `footfall view`.
pub const EXAMPLES: &str = "\
Examples:
  footfall view demo:feet=4
  footfall view uart:/dev/ttyACM0 --host 0.0.0.0
  footfall view --layout foxglove > footfall.json";

/// Arguments of `footfall view`.
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Sources of the feet.
    #[arg(value_name = "SOURCE", help = HELP_OF_SOURCES, required_unless_present = "layout")]
    pub sources: Vec<SourceArgument>,
    /// Nodes that are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
    /// How a played recording of an IMU is read.
    #[command(flatten)]
    pub played: PlayedArguments,
    /// Loads on topics, and their domain.
    #[command(flatten)]
    pub topics: TopicArguments,
    /// Frames, and messages of other programs.
    #[command(flatten)]
    pub published: PublishedArguments,
    /// Address or name of this machine to listen on; with 0.0.0.0 or ::, viewers on other machines can
    /// connect, too. Anyone who can connect sees everything
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub host: String,
    /// Port to listen on; 0 takes any free one
    #[arg(long, default_value_t = 8765)]
    pub port: u16,
    /// Origins of pages that may connect.
    #[arg(
        long,
        value_name = "ORIGIN",
        help = "Let pages of this origin connect, such as https://viewer.example; may be repeated. Foxglove's \
                pages, pages of this machine, and programs can always connect"
    )]
    pub allow_origin: Vec<String>,
    /// Stop after this time, or on Ctrl-C. The end of a played file does not stop it
    #[arg(long, value_name = "SECONDS", value_parser = parse_duration)]
    pub seconds: Option<f64>,
    /// Print a layout of the feet FL, FR, RL and RR for this viewer, and serve nothing
    #[arg(long, value_name = "VIEWER", conflicts_with = "sources")]
    pub layout: Option<Viewer>,
}

/// Viewer program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Viewer {
    /// Foxglove: JSON.
    #[value(help = "Foxglove: JSON")]
    Foxglove,
    /// `PlotJuggler`: XML.
    #[value(help = "PlotJuggler: XML")]
    Plotjuggler,
}

impl Viewer {
    /// Returns a layout for the feet FL, FR, RL and RR.
    #[must_use]
    pub const fn layout(self) -> &'static str {
        match self {
            Self::Foxglove => include_str!("../../../../../docs/reference/layouts/foxglove.json"),
            Self::Plotjuggler => {
                include_str!("../../../../../docs/reference/layouts/plotjuggler.xml")
            }
        }
    }
}

impl ViewArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        if let Some(viewer) = self.layout {
            return print_text(viewer.layout()).map_err(Error::Print);
        }
        let (sources, feet) = self.feet.of_sources(&self.sources, &self.played)?;
        let found = (self.topics.apply(sources)?, feet);
        #[cfg(feature = "foxglove")]
        return server::serve(
            found,
            (&self.host, self.port),
            self.allow_origin,
            self.published.bridge()?,
            self.seconds,
        );
        #[cfg(not(feature = "foxglove"))]
        Err(Feature::Foxglove
            .missing_for(format_args!("footfall view {}", text_of(&found.0)))
            .into())
    }
}
