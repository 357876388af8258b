//! `footfall monitor`: shows the current state of streaming feet.

use std::io::{self, Write};
use std::time::Duration;

use clap::Args;
use feet::Feed;

use super::options::listen::ListenArguments;
use crate::error::Error;
use crate::files::unless_closed;
use crate::monitor::robot::EVENT_DELAY;
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
    /// Print a JSON object for each foot once a second, and one for each event
    #[arg(long)]
    pub json: bool,
    /// Stop after this time
    #[arg(long, value_name = "SECONDS", value_parser = crate::stream::parse_seconds)]
    pub seconds: Option<f64>,
}

impl MonitorArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let (source, feet) = self.listen.listen()?;
        let feed = Feed::open(source);
        let end = deadline(feed.clock(), self.seconds);
        let mut robot = MonitorState::new(feet);
        let watched = unless_closed(watch(&feed, &mut robot, end, self.json));
        warn_of_lost(&feed);
        watched.map_err(Error::Print)?;
        unless_ended(robot.ended)
    }
}

fn watch(
    feed: &Feed,
    robot: &mut MonitorState,
    end: Option<Duration>,
    json: bool,
) -> io::Result<()> {
    let mut to = io::stdout().lock();
    let clock = feed.clock();
    loop {
        let due = next(clock, LINE, end);
        // Events are printed on arrival.
        while clock.now() < due && !robot.has_ended() {
            robot.listen(feed, due.min(clock.now() + EVENT_DELAY));
            for event in robot.take_events() {
                match json {
                    true => lines::write_event_json(&event, &mut to)?,
                    false => lines::write_event(&event, &mut to)?,
                }
            }
            to.flush()?;
        }
        match json {
            true => lines::write_json(robot, &mut to)?,
            false => lines::write_text(robot, &mut to)?,
        }
        if robot.has_ended() || is_over(clock, end) {
            return Ok(());
        }
    }
}
