//! Display of the feet on a terminal, and key input.

use std::time::Duration;
use std::{io, mem, thread};

use feet::Feed;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::MonitorState;
use super::hang_up::Keyboard;
use super::robot::PICTURE;
use super::screen::{Running, draw};
use crate::files::finish_when_interrupted;
use crate::messages::aside;
use crate::stream::{is_over, next};

/// Shows the feet until a key, the end of the source, an interruption, or until the terminal is gone.
///
/// # Errors
/// The terminal cannot be used.
pub fn watch_screen(
    feed: &Feed,
    robot: &mut MonitorState,
    end: Option<Duration>,
    source: &str,
) -> io::Result<()> {
    // Terminating on the signal would leave the terminal without echo and cursor.
    finish_when_interrupted();
    let mut terminal = ratatui::try_init()?;
    let keyboard = Keyboard::open();
    let watched = watch(&mut terminal, &keyboard, feed, robot, end, source);
    if keyboard.is_gone() {
        // There is nothing to restore. Dropping it would show the cursor, print that it cannot, and abort where nothing
        // can be printed.
        mem::forget(terminal);
    } else {
        ratatui::restore();
    }
    watched?;
    if let Some(event) = robot.finish_recording() {
        aside(format!("{event}\n"));
    }
    Ok(())
}

fn watch(
    terminal: &mut DefaultTerminal,
    keyboard: &Keyboard,
    feed: &Feed,
    robot: &mut MonitorState,
    end: Option<Duration>,
    source: &str,
) -> io::Result<()> {
    let mut running = Running::Live;
    while !is_over(feed.clock(), end) {
        robot.listen(feed, next(feed.clock(), PICTURE, end));
        if robot.has_ended() {
            // After the source has ended, the last state stays on screen until a key is pressed.
            thread::sleep(PICTURE);
        }
        if keyboard.is_gone() {
            return Ok(());
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
            let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
            match key.code {
                KeyCode::Char('c') if is_control => return Ok(()),
                KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
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
            match terminal.draw(|frame| draw(frame, robot, source, running)) {
                Err(_) if keyboard.is_gone() => return Ok(()),
                drawn => drawn?,
            };
        }
    }
    Ok(())
}
