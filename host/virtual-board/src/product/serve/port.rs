//! Line to a program: a pseudo-terminal, or a socket in lock step.

use std::io;

use super::lock_step::LockStepLine;
use super::terminal::{Sent, Terminal};

/// A line.
#[derive(Debug)]
pub enum Port {
    /// In real time.
    Terminal(Terminal),
    /// In lock step.
    LockStep(LockStepLine),
}

impl Port {
    /// Reads bytes of the program, at most `most`.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn read(&mut self, most: usize) -> io::Result<Vec<u8>> {
        match self {
            Self::Terminal(terminal) => terminal.read(most),
            Self::LockStep(line) => Ok(line.read(most)),
        }
    }

    /// Writes bytes to the program, all or none.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<Sent> {
        match self {
            Self::Terminal(terminal) => terminal.write(bytes),
            Self::LockStep(line) => Ok(line.write(bytes)),
        }
    }

    /// Writes pending bytes as far as the system accepts them.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Terminal(terminal) => terminal.flush(),
            Self::LockStep(_) => Ok(()),
        }
    }

    /// Number of bytes lost because the program was too slow.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        match self {
            Self::Terminal(terminal) => terminal.lost,
            Self::LockStep(line) => line.lost,
        }
    }
}
