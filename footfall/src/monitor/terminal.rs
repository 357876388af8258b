//! Display of the feet on a terminal, and key input.

use std::time::{Duration, Instant};
use std::{io, mem, thread};

use live::Feed;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::Robot;
use super::hang_up::Keyboard;
use super::listen::{PICTURE, listen, next};
use super::screen::{Running, draw};
use crate::files::finish_when_interrupted;
use crate::messages::aside;
use crate::stream::is_over;

/// Restores the terminal when dropped.
struct Restored;

impl Drop for Restored {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Shows the feet until a key, the end of the source, an interruption, or until the terminal is gone.
///
/// # Errors
/// The terminal cannot be used.
pub fn watch_screen(
    feed: &Feed,
    robot: &mut Robot,
    end: Option<Instant>,
    source: &str,
) -> io::Result<()> {
    // Terminating on the signal would leave the terminal without echo and cursor.
    finish_when_interrupted();
    let mut terminal = ratatui::try_init()?;
    let restored = Restored;
    let keyboard = Keyboard::open();
    let mut running = Running::Live;
    'watch: while !is_over(end) {
        listen(feed, robot, next(PICTURE, end));
        if robot.has_ended() {
            // After the source has ended, the last state stays on screen until a key is pressed.
            thread::sleep(PICTURE);
        }
        if keyboard.is_gone() {
            break;
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
            match terminal.draw(|frame| draw(frame, robot, source, running)) {
                Err(_) if keyboard.is_gone() => break,
                drawn => drawn?,
            };
        }
    }
    if keyboard.is_gone() {
        // There is nothing to restore, and its error could not be shown.
        mem::forget(restored);
    } else {
        drop(restored);
    }
    if let Some(event) = robot.finish_recording() {
        aside(format!("{event}\n"));
    }
    Ok(())
}
