//! `footfall view`: serves streaming feet to Foxglove and `PlotJuggler`.

use clap::{Args, ValueEnum};
use feet::Source;

use super::feet::FeetArguments;
use super::listen::SOURCES;
use super::played::PlayedArguments;
use super::published::PublishedArguments;
use crate::error::Error;
#[cfg(not(feature = "foxglove"))]
use crate::feature::Feature;
use crate::report::print_text;
use crate::view::pages::pages;
#[cfg(feature = "foxglove")]
use crate::view::serving::serve;
use crate::view::{foxglove_layout, plotjuggler_layout};

/// Arguments of `footfall view`.
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Where the feet stream from.
    #[arg(help = SOURCES, required_unless_present = "layout")]
    pub source: Option<Source>,
    /// Which nodes are feet.
    #[command(flatten)]
    pub nodes: FeetArguments,
    /// How a recording of an IMU is read.
    #[command(flatten)]
    pub played: PlayedArguments,
    /// Frames, and messages of other programs.
    #[command(flatten)]
    pub published: PublishedArguments,
    /// The address or name of this machine at which viewers connect: 0.0.0.0 or :: for those of other
    /// machines, too. Whoever can connect sees all
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub host: String,
    /// The port at which viewers connect; 0 takes one that is free
    #[arg(long, default_value_t = 8765)]
    pub port: u16,
    /// Stop after this time; Ctrl-C stops it, too. The end of a played file does not
    #[arg(long, value_name = "SECONDS", value_parser = crate::stream::parse_seconds)]
    pub seconds: Option<f64>,
    /// Print a layout that the viewer opens, and serve nothing
    #[arg(long, value_name = "VIEWER", conflicts_with = "source")]
    pub layout: Option<Viewer>,
    /// The names of the feet in the layout
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        conflicts_with = "source",
        default_value = "FL,FR,RL,RR"
    )]
    pub feet: Vec<String>,
}

/// A program that shows what is served.
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
    /// Returns the layout for feet with these names.
    #[must_use]
    pub fn layout(self, feet: &[String]) -> String {
        let pages = pages(feet);
        match self {
            Self::Foxglove => foxglove_layout::layout(&pages),
            Self::Plotjuggler => plotjuggler_layout::layout(&pages),
        }
    }
}

impl ViewArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        if let Some(viewer) = self.layout {
            return print_text(&viewer.layout(&self.feet)).map_err(Error::Print);
        }
        let Some(source) = self.source else {
            return Ok(());
        };
        let source = self.played.read(source)?;
        #[cfg(feature = "foxglove")]
        return serve(
            &source,
            (&self.host, self.port),
            (self.nodes.feet()?, self.published.bridge()),
            self.seconds,
        );
        #[cfg(not(feature = "foxglove"))]
        Err(Feature::Foxglove
            .missing_for(format_args!("footfall view {source}"))
            .into())
    }
}
