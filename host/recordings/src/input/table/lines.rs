//! Limits the length of lines between a text and the reader of its rows, and records how the text ends.

use std::cell::Cell;
use std::io::{self, Read};
use std::rc::Rc;

/// Longest row, bytes: 16 MB. The longest known row of a robot has 0.1 MB.
pub(super) const LONGEST_ROW: usize = 16 << 20;

/// State of a text that is being read.
#[derive(Default)]
pub(super) struct Progress {
    /// Bytes left for the current row.
    left: Cell<usize>,
    /// The last byte.
    last: Cell<Option<u8>>,
    has_ended: Cell<bool>,
    is_too_long: Cell<bool>,
}

impl Progress {
    /// Starts a row.
    pub(super) fn begin_row(&self) {
        self.left.set(LONGEST_ROW);
    }

    /// Returns whether the row exceeds [`LONGEST_ROW`].
    pub(super) const fn is_too_long(&self) -> bool {
        self.is_too_long.get()
    }

    /// Returns whether the text has ended within a line.
    pub(super) fn ended_within_a_line(&self) -> bool {
        self.has_ended.get() && self.last.get().is_some_and(|byte| byte != b'\n')
    }
}

/// A text that records its progress.
pub(super) struct Watched<R> {
    text: R,
    progress: Rc<Progress>,
}

impl<R> Watched<R> {
    pub(super) fn new(text: R) -> (Self, Rc<Progress>) {
        let progress = Rc::new(Progress::default());
        let watched = Self { text, progress: Rc::clone(&progress) };
        (watched, progress)
    }
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let progress = &self.progress;
        if progress.left.get() == 0 {
            progress.is_too_long.set(true);
            return Err(io::Error::other("a row is too long"));
        }
        let count = self.text.read(buffer)?;
        match buffer[..count].last() {
            Some(last) => progress.last.set(Some(*last)),
            None => progress.has_ended.set(!buffer.is_empty()),
        }
        progress.left.set(progress.left.get().saturating_sub(count));
        Ok(count)
    }
}
