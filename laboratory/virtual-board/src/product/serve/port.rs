//! Lines to programs: pseudo-terminals in real time, or sockets in lock step. [`Links`] are their stable names in a
//! directory.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, OpenOptionsExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

use super::lock_step::LockStepLine;
use super::output::{Output, Sent};
use super::{Passage, ServeError, ServeOptions};

/// Line to a program: a pseudo-terminal, or a socket in lock step.
#[derive(Debug)]
pub enum Port {
    /// In real time.
    Terminal(Terminal),
    /// In lock step.
    LockStep(LockStepLine),
}

impl Port {
    /// Opens a line that is created with `links` under a name; returns it with its path.
    ///
    /// # Errors
    /// If the terminal, the socket or its link cannot be created.
    pub(super) fn open(
        options: &ServeOptions,
        links: &mut Links,
        name: &str,
    ) -> Result<(Self, PathBuf), ServeError> {
        match (options.passage, &options.links) {
            (Passage::LockStep, None) => Err(ServeError::NoFolder),
            (Passage::LockStep, Some(folder)) => {
                let (path, listener) = links.add_socket(folder, name)?;
                Ok((Self::LockStep(LockStepLine::new(listener)?), path))
            }
            (Passage::Speed(_), folder) => {
                let terminal = Terminal::open()?;
                let path = match folder {
                    Some(folder) => links.add(folder, name, &terminal.path)?,
                    None => terminal.path.clone(),
                };
                Ok((Self::Terminal(terminal), path))
            }
        }
    }

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
            Self::Terminal(terminal) => terminal.output.lost,
            Self::LockStep(line) => line.output.lost,
        }
    }
}

/// A pseudo-terminal: a program opens its far end as a serial port, and bytes pass unchanged in both directions. As with an
/// adapter, bytes that are not read in time are lost: writing never waits for the reader.
#[derive(Debug)]
pub struct Terminal {
    near: File,
    /// Path of the far end.
    pub(crate) path: PathBuf,
    /// Whether a program has the far end open.
    is_open: bool,
    output: Output,
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
            Self { near: near.into(), path, is_open: false, output: Output::default() };
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
        self.output.waiting.clear();
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
        Ok(self.output.push(bytes))
    }

    /// Writes pending bytes as far as the system accepts them.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn flush(&mut self) -> io::Result<()> {
        while !self.output.waiting.is_empty() {
            match self.near.write(&self.output.waiting) {
                Ok(0) => break,
                Ok(count) => {
                    self.output.waiting.drain(..count);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// Links and sockets that are removed on drop.
#[derive(Debug, Default)]
pub struct Links {
    /// Paths and targets of links.
    links: Vec<(PathBuf, PathBuf)>,
    /// Paths of sockets, and their inodes.
    sockets: Vec<(PathBuf, u64)>,
}

impl Links {
    /// Creates a link in a directory, which is created if missing. An existing link is replaced, an existing file
    /// is not.
    ///
    /// # Errors
    /// If the link cannot be created.
    pub fn add(&mut self, folder: &Path, name: &str, target: &Path) -> Result<PathBuf, ServeError> {
        let path = folder.join(name);
        let made = fs::create_dir_all(folder)
            .and_then(|()| remove(&path))
            .and_then(|()| symlink(target, &path));
        made.map_err(|error| ServeError::Link(path.clone(), error))?;
        self.links.push((path.clone(), target.to_owned()));
        Ok(path)
    }

    /// Creates a socket in a directory, in the same way as a link.
    ///
    /// # Errors
    /// If the socket cannot be created.
    pub fn add_socket(
        &mut self,
        folder: &Path,
        name: &str,
    ) -> Result<(PathBuf, UnixListener), ServeError> {
        let path = folder.join(name);
        let made = fs::create_dir_all(folder)
            .and_then(|()| remove(&path))
            .and_then(|()| UnixListener::bind(&path))
            .and_then(|listener| Ok((listener, fs::symlink_metadata(&path)?.ino())));
        let (listener, inode) = made.map_err(|error| ServeError::Link(path.clone(), error))?;
        self.sockets.push((path.clone(), inode));
        Ok((path, listener))
    }
}

/// Removes a link or a socket, if any.
fn remove(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() || found.file_type().is_socket() => fs::remove_file(path),
        Ok(_) => Err(ErrorKind::AlreadyExists.into()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        for (path, target) in &self.links {
            // Another program may have removed it, or replaced it by its own.
            if fs::read_link(path).is_ok_and(|found| found == *target) {
                let _ = remove(path);
            }
        }
        for (path, inode) in &self.sockets {
            if fs::symlink_metadata(path).is_ok_and(|found| found.ino() == *inode) {
                let _ = remove(path);
            }
        }
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
        assert_eq!(terminal.write(b"early").expect("written"), Sent::Taken);
        let port = far(&terminal);
        terminal.read(1).expect("it is open");
        let piece = [7; 1000];
        let mut sent = 0;
        while terminal.write(&piece).expect("written") == Sent::Taken {
            terminal.flush().expect("flushed");
            sent += 1;
        }
        assert!(sent > 60 && terminal.output.lost == 1000, "{sent}");
        drop(port);
        terminal.read(1).expect("it is closed");
        let mut port = far(&terminal);
        terminal.read(1).expect("it is open");
        terminal.flush().expect("flushed");
        let mut got = [0; 10];
        let nothing = port.read(&mut got).map_err(|error| error.kind());
        assert_eq!(nothing, Err(ErrorKind::WouldBlock));
    }

    #[test]
    fn a_link_replaces_a_link_but_no_file_and_is_removed() {
        let folder = std::env::temp_dir().join(format!("footfall-links-{}", std::process::id()));
        let mut links = Links::default();
        let path = links.add(&folder, "FL.uart", Path::new("/dev/null"));
        let path = path.expect("a link");
        links.add(&folder, "FL.uart", Path::new("/dev/zero")).expect("another");
        assert_eq!(fs::read_link(&path).expect("a link"), Path::new("/dev/zero"));
        fs::write(folder.join("file"), "x").expect("a file");
        let error = links.add(&folder, "file", Path::new("/dev/null"));
        assert!(error.is_err_and(|error| error.to_string().contains("file")));
        drop(links);
        assert!(fs::symlink_metadata(&path).is_err());
        let mut links = Links::default();
        let path = links.add(&folder, "FL.uart", Path::new("/dev/null"));
        let path = path.expect("a link");
        let mut of_another = Links::default();
        let taken = of_another.add(&folder, "FL.uart", Path::new("/dev/zero"));
        assert!(taken.is_ok());
        drop(links);
        assert!(fs::symlink_metadata(&path).is_ok(), "it is of another now");
        drop(of_another);
        let mut sockets = Links::default();
        let (path, _listener) = sockets.add_socket(&folder, "FL.uart").expect("a socket");
        assert!(path.exists());
        drop(sockets);
        assert!(!path.exists());
        fs::remove_dir_all(&folder).expect("removed");
    }
}
