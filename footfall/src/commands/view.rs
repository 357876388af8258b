//! `footfall view`: feet that stream, in Foxglove and `PlotJuggler`.

use std::thread;
use std::time::Duration;

use clap::{Args, ValueEnum};
use live::link::pace::Speed;
use live::{LinkError, Source};

use super::feet::FeetArguments;
use super::monitor::SOURCES;
use crate::error::Error;
use crate::files::finish_when_interrupted;
use crate::messages::{aside, warn};
use crate::report::print_text;
use crate::stream::{Stream, deadline, is_over};
use crate::view::pages::pages;
use crate::view::server::{Reach, Server};
use crate::view::{foxglove_layout, plotjuggler_layout};

/// How often it is looked whether the end has come, once the source has ended.
const LOOK: Duration = Duration::from_millis(50);

/// What `footfall view` takes.
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Where the feet stream from.
    #[arg(help = SOURCES, required_unless_present = "layout")]
    pub source: Option<Source>,
    /// Which nodes are feet.
    #[command(flatten)]
    pub nodes: FeetArguments,
    /// The address or name of this machine at which viewers connect: 0.0.0.0 or :: for those of other
    /// machines, too. Whoever can connect sees all
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub host: String,
    /// The port at which viewers connect; 0 takes one that is free
    #[arg(long, default_value_t = 8765)]
    pub port: u16,
    /// Stop after this time; Ctrl-C stops it, too. The end of what is played does not
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
    /// The layout for feet of these names.
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
        let name = format!("footfall {source}");
        finish_when_interrupted();
        let mut stream = Stream::open(source.clone().at_speed(Speed::REAL), self.nodes.feet()?);
        stream.wait_until_open()?;
        let mut server = Server::start(&self.host, self.port, &name)?;
        let url = server.url();
        let app_url = server.app_url();
        let also = match server.reach() {
            Reach::OneAddress => "",
            Reach::AllAddresses => ", and at all other addresses of this machine",
        };
        aside(format!(
            "serving {source} at {url}{also}\n\
             Foxglove: {app_url}\n\
             PlotJuggler: Streaming, Foxglove Bridge, {url}"
        ));
        let deadline = deadline(self.seconds);
        let ended = stream.run(deadline, &mut server);
        stream.report();
        let ended = match ended {
            Ok(Some(error @ LinkError::Ended(_))) => {
                warn(format!("{error}; viewers stay connected until Ctrl-C"));
                Ok(())
            }
            Ok(Some(error)) => Err(error.into()),
            Ok(None) => Ok(()),
            Err(error) => Err(error),
        };
        // What is played is still on its way to viewers, which show it as long as they are connected.
        while ended.is_ok() && !is_over(deadline) {
            thread::sleep(LOOK);
        }
        server.stop();
        ended
    }
}
