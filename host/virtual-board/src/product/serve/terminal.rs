//! A pseudo-terminal: a program opens its far end as a serial port, and bytes pass unchanged in both directions.
//!
//! As with an adapter, bytes that are not read in time are lost: writing never waits for the reader.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

/// Maximum number of bytes that wait for a reader, besides those of the system: half a second of a busy bus.
pub(super) const MOST_WAITING: usize = 64 * 1024;

/// A terminal.
#[derive(Debug)]
pub struct Terminal {
    near: File,
    /// Path of the far end.
    pub(crate) path: PathBuf,
    /// Whether a program has the far end open.
    is_open: bool,
    waiting: Vec<u8>,
    /// Number of bytes lost because the reader was too slow.
    pub(crate) lost: u64,
}

/// Result of a write to the far end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// The bytes wait for the reader, or no program has the far end open.
    Taken,
    /// The bytes were lost: the reader is too slow.
    Lost,
}

impl Terminal {
    /// Opens a terminal whose far end is closed.
    ///
    /// # Errors
    /// If the system has no terminal left.
    pub fn open() -> io::Result<Self> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let name = ptsname(&near, Vec::new())?;
        let path = PathBuf::from(name.to_string_lossy().into_owned());
        let flags = fcntl_getfl(&near)?;
        fcntl_setfl(&near, flags | OFlags::NONBLOCK)?;
        let mut terminal =
            Self { near: near.into(), path, is_open: false, waiting: Vec::new(), lost: 0 };
        terminal.clean()?;
        Ok(terminal)
    }

    /// Resets the far end: raw mode, no old bytes. It must have been open once for the system to report that it is
    /// closed.
    fn clean(&mut self) -> io::Result<()> {
        let far = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags((OFlags::NOCTTY | OFlags::NONBLOCK).bits() as i32)
            .open(&self.path)?;
        let mut settings = tcgetattr(&far)?;
        settings.make_raw();
        tcsetattr(&far, OptionalActions::Now, &settings)?;
        tcflush(&far, QueueSelector::IOFlush)?;
        self.waiting.clear();
        Ok(())
    }

    /// Reads bytes from the far end, at most `most`.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn read(&mut self, most: usize) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; most];
        // The end of the file, or EIO, means that no program has the far end open.
        const CLOSED: i32 = rustix::io::Errno::IO.raw_os_error();
        let (count, is_open) = match self.near.read(&mut bytes) {
            Ok(count) => (count, count > 0 || most == 0),
            Err(error) if error.raw_os_error() == Some(CLOSED) => (0, false),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::Interrupted => (0, true),
                _ => return Err(error),
            },
        };
        if self.is_open && !is_open {
            self.clean()?;
        }
        self.is_open = is_open;
        bytes.truncate(count);
        Ok(bytes)
    }

    /// Writes bytes to the far end, all or none.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<Sent> {
        if !self.is_open {
            return Ok(Sent::Taken);
        }
        if self.waiting.len() + bytes.len() > MOST_WAITING {
            self.lost += bytes.len() as u64;
            return Ok(Sent::Lost);
        }
        self.waiting.extend_from_slice(bytes);
        Ok(Sent::Taken)
    }

    /// Writes pending bytes as far as the system accepts them.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn flush(&mut self) -> io::Result<()> {
        while !self.waiting.is_empty() {
            match self.near.write(&self.waiting) {
                Ok(0) => break,
                Ok(count) => {
                    self.waiting.drain(..count);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn far(terminal: &Terminal) -> File {
        let mut options = OpenOptions::new();
        options.read(true).write(true);
        let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits() as i32;
        let file = options.custom_flags(flags).open(&terminal.path);
        file.expect("the far end opens")
    }

    #[test]
    fn bytes_pass_unchanged_in_both_directions() {
        let mut terminal = Terminal::open().expect("a terminal");
        let mut port = far(&terminal);
        let all: Vec<u8> = (0..=255).collect();
        port.write_all(&all).expect("written");
        assert_eq!(terminal.read(1000).expect("read"), all);
        assert_eq!(terminal.write(&all).expect("written"), Sent::Taken);
        terminal.flush().expect("flushed");
        let mut got = [0; 1000];
        assert_eq!(port.read(&mut got).expect("read"), 256);
        assert_eq!(got[..256], all[..]);
    }

    #[test]
    fn slow_readers_lose_whole_pieces_and_new_ones_get_no_old_bytes() {
        let mut terminal = Terminal::open().expect("a terminal");
        assert_eq!(terminal.write(b"nobody").expect("written"), Sent::Taken);
        let port = far(&terminal);
        terminal.read(1).expect("it is open");
        let piece = [7; 1000];
        let mut sent = 0;
        while terminal.write(&piece).expect("written") == Sent::Taken {
            terminal.flush().expect("flushed");
            sent += 1;
        }
        assert!(sent > 60 && terminal.lost == 1000, "{sent}");
        drop(port);
        terminal.read(1).expect("it is closed");
        let mut port = far(&terminal);
        terminal.read(1).expect("it is open");
        terminal.flush().expect("flushed");
        let mut got = [0; 10];
        let nothing = port.read(&mut got).map_err(|error| error.kind());
        assert_eq!(nothing, Err(ErrorKind::WouldBlock));
    }
}
