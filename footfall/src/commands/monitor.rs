//! `footfall monitor`: feet that stream, as they are now.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use clap::Args;
use live::link::pace::Speed;
use live::{Feed, Source};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::feet::FeetArguments;
use crate::error::Error;
use crate::files::{finish_when_interrupted, unless_closed};
use crate::messages::aside;
use crate::monitor::screen::{Running, draw};
use crate::monitor::{Robot, lines};
use crate::stream::{deadline, is_over, warn_of_lost};

/// Time from one picture to the next.
const PICTURE: Duration = Duration::from_millis(50);

/// Time from one line of a foot to its next.
const LINE: Duration = Duration::from_secs(1);

/// How a source is written, for helps.
pub(super) const SOURCES: &str = "Where the feet stream from: uart:/dev/ttyACM0[@BAUD], can:can0, \
                       slcan:/dev/ttyACM0[@KBIT], file:can.log[@SPEED], or demo[:feet=4] for \
                       simulated feet";

/// What `footfall monitor` takes.
#[derive(Debug, Args)]
pub struct MonitorArguments {
    /// Where the feet stream from.
    #[arg(help = SOURCES)]
    pub source: Source,
    /// Which nodes are feet.
    #[command(flatten)]
    pub feet: FeetArguments,
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

/// How lines are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Text,
    Json,
}

impl MonitorArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let name = self.source.to_string();
        let end = deadline(self.seconds);
        let feet = self.feet.feet()?;
        let feed = Feed::open(self.source.at_speed(Speed::REAL));
        let mut robot = Robot::new(feet);
        let watched = match (self.json, self.plain || !io::stdout().is_terminal()) {
            (true, _) => unless_closed(watch_lines(&feed, &mut robot, end, Form::Json)),
            (false, true) => unless_closed(watch_lines(&feed, &mut robot, end, Form::Text)),
            (false, false) => watch_screen(&feed, &mut robot, end, &name),
        };
        warn_of_lost(&feed);
        watched.map_err(Error::Print)?;
        robot
            .into_failure()
            .map_or(Ok(()), |error| Err(error.into()))
    }
}

/// Takes in what comes until `due`.
fn listen(feed: &Feed, robot: &mut Robot, due: Instant) {
    loop {
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() || robot.has_ended() {
            return;
        }
        match feed.next(left) {
            Some(fed) => robot.take(fed),
            None => robot.idle(robot.quiet_for()),
        }
    }
}

/// The next moment to show something, and the end where that comes first.
fn next(period: Duration, end: Option<Instant>) -> Instant {
    let due = Instant::now() + period;
    end.map_or(due, |end| due.min(end))
}

fn watch_lines(feed: &Feed, robot: &mut Robot, end: Option<Instant>, form: Form) -> io::Result<()> {
    let mut to = io::stdout().lock();
    let mut seen = 0;
    loop {
        let due = next(LINE, end);
        // Events are written as they come.
        while Instant::now() < due && !robot.has_ended() {
            listen(feed, robot, due.min(Instant::now() + PICTURE));
            let (events, now_seen) = robot.events_since(seen);
            seen = now_seen;
            for event in events {
                match form {
                    Form::Text => lines::write_event(event, &mut to)?,
                    Form::Json => lines::write_event_json(event, &mut to)?,
                }
            }
            to.flush()?;
        }
        match form {
            Form::Text => lines::write_text(robot, &mut to)?,
            Form::Json => lines::write_json(robot, &mut to)?,
        }
        if robot.has_ended() || is_over(end) {
            return Ok(());
        }
    }
}

/// Gives the terminal back however the picture ends.
struct Restored;

impl Drop for Restored {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

fn watch_screen(
    feed: &Feed,
    robot: &mut Robot,
    end: Option<Instant>,
    source: &str,
) -> io::Result<()> {
    // A signal that ended the program at once would leave the terminal without echo and cursor.
    finish_when_interrupted();
    let mut terminal = ratatui::try_init()?;
    let restored = Restored;
    let mut running = Running::Live;
    'watch: while !is_over(end) {
        listen(feed, robot, next(PICTURE, end));
        if robot.has_ended() {
            // What is left on the screen is the end: keys are waited for.
            event::poll(PICTURE)?;
        }
        let mut is_changed = running == Running::Live;
        while event::poll(Duration::ZERO)? {
            let key = match event::read()? {
                Event::Key(key) if key.kind == KeyEventKind::Press => key,
                Event::Resize(..) => {
                    is_changed = true;
                    continue;
                }
                _ => continue,
            };
            is_changed = true;
            match key.code {
                KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => {
                    break 'watch;
                }
                KeyCode::Char('q') | KeyCode::Esc => break 'watch,
                KeyCode::Char(' ' | 'p') => {
                    running = match running {
                        Running::Live => Running::Paused,
                        Running::Paused => Running::Live,
                    };
                }
                KeyCode::Char('m') => robot.mark(),
                KeyCode::Char('r') => robot.toggle_recording(),
                _ => {}
            }
        }
        if is_changed {
            terminal.draw(|frame| draw(frame, robot, source, running))?;
        }
    }
    drop(restored);
    if let Some(event) = robot.finish_recording() {
        aside(format!("{event}\n"));
    }
    Ok(())
}
