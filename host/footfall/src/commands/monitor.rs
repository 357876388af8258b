//! `footfall monitor`: shows the current state of streaming feet.

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use clap::Args;
use feet::Feed;

use super::listen::ListenArguments;
use crate::error::Error;
#[cfg(not(feature = "screen"))]
use crate::feature::Feature;
use crate::files::unless_closed;
#[cfg(not(feature = "screen"))]
use crate::messages::aside;
use crate::monitor::robot::PICTURE;
#[cfg(feature = "screen")]
use crate::monitor::terminal::watch_screen;
use crate::monitor::{MonitorState, lines};
use crate::stream::{deadline, is_over, next, unless_ended, warn_of_lost};

/// Period of the lines of a foot.
const LINE: Duration = Duration::from_secs(1);

/// Arguments of `footfall monitor`.
#[derive(Debug, Args)]
pub struct MonitorArguments {
    /// Feet that stream.
    #[command(flatten)]
    pub listen: ListenArguments,
    /// Print lines once a second, as where standard output is no terminal
    #[arg(long)]
    pub plain: bool,
    /// Print a JSON object for each foot once a second, and one for each event
    #[arg(long)]
    pub json: bool,
    /// Stop after this time
    #[arg(long, value_name = "SECONDS", value_parser = crate::stream::parse_seconds)]
    pub seconds: Option<f64>,
}

/// Format of the lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Text,
    Json,
}

impl MonitorArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let name = self.listen.source.to_string();
        let (source, feet) = self.listen.listen()?;
        let feed = Feed::open(source);
        let end = deadline(feed.clock(), self.seconds);
        let mut robot = MonitorState::new(feet);
        let watched = match (self.json, self.plain || !io::stdout().is_terminal()) {
            (true, _) => unless_closed(watch_lines(&feed, &mut robot, end, Form::Json)),
            (false, true) => unless_closed(watch_lines(&feed, &mut robot, end, Form::Text)),
            #[cfg(feature = "screen")]
            (false, false) => watch_screen(&feed, &mut robot, end, &name),
            #[cfg(not(feature = "screen"))]
            (false, false) => {
                aside(Feature::Screen.missing_for(format_args!("a picture of {name}")));
                unless_closed(watch_lines(&feed, &mut robot, end, Form::Text))
            }
        };
        warn_of_lost(&feed);
        watched.map_err(Error::Print)?;
        unless_ended(robot.ended)
    }
}

fn watch_lines(
    feed: &Feed,
    robot: &mut MonitorState,
    end: Option<Duration>,
    form: Form,
) -> io::Result<()> {
    let mut to = io::stdout().lock();
    let mut seen = 0;
    let clock = feed.clock();
    loop {
        let due = next(clock, LINE, end);
        // Events are printed on arrival.
        while clock.now() < due && !robot.has_ended() {
            robot.listen(feed, due.min(clock.now() + PICTURE));
            let (events, now_seen) = robot.events_since(seen);
            seen = now_seen;
            for event in events {
                match form {
                    Form::Json => lines::write_event_json(event, &mut to)?,
                    Form::Text => lines::write_event(event, &mut to)?,
                }
            }
            to.flush()?;
        }
        match form {
            Form::Json => lines::write_json(robot, &mut to)?,
            Form::Text => lines::write_text(robot, &mut to)?,
        }
        if robot.has_ended() || is_over(clock, end) {
            return Ok(());
        }
    }
}
