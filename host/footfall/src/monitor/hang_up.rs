//! Detection of a terminal that is gone: its window was closed, or the connection to it was cut.
//!
//! crossterm does not return from the end of input of such a terminal: it loops. Keys are therefore polled only while
//! the terminal exists.

#[cfg(unix)]
use std::{
    fs::File,
    io::{self, IsTerminal},
    os::fd::AsFd,
};

#[cfg(unix)]
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// The terminal that keys come from: standard input, or the controlling terminal if that is something else.
#[cfg(unix)]
pub struct Keyboard(Option<File>);

/// Systems without signals tell of no hang-up.
#[cfg(not(unix))]
pub struct Keyboard;

#[cfg(unix)]
impl Keyboard {
    /// Opens the terminal. One that cannot be opened is never gone.
    #[must_use]
    pub fn open() -> Self {
        let stdin = io::stdin();
        let terminal = if stdin.is_terminal() {
            stdin.as_fd().try_clone_to_owned().map(File::from)
        } else {
            File::open("/dev/tty")
        };
        Self(terminal.ok())
    }

    /// Returns whether the terminal is gone.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        let Some(terminal) = &self.0 else {
            return false;
        };
        // Hang-ups and errors are reported without being asked for.
        let mut polled = [PollFd::new(terminal, PollFlags::empty())];
        let answered = poll(&mut polled, Some(&Timespec::default()));
        answered.is_ok() && !polled[0].revents().is_empty()
    }
}

#[cfg(not(unix))]
impl Keyboard {
    /// Opens the terminal.
    #[must_use]
    pub fn open() -> Self {
        Self
    }

    /// Returns whether the terminal is gone.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        false
    }
}
