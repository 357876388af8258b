//! Line of a board in lock step: a Unix socket of `virtual-board serve --lock-step`, whose source has the table of
//! requests. The boards' time passes only during requests.

use std::fs;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use super::LineClock;

/// Kinds of requests.
const WRITE: u8 = b'W';
const RUN: u8 = b'R';
const PARK: u8 = b'P';

/// Length of an answer without its bytes: the time and their number.
const HEAD: usize = 12;

/// Returns whether the port with this name is in lock step.
pub(super) fn is_in_lock_step(port: &str) -> bool {
    fs::metadata(port).is_ok_and(|found| found.file_type().is_socket())
}

/// Open line.
pub(super) struct LockStepClient {
    stream: UnixStream,
    pub(super) clock: LineClock,
}

impl LockStepClient {
    pub(super) fn open(port: &str) -> io::Result<Self> {
        let mut line = Self { stream: UnixStream::connect(port)?, clock: LineClock::in_steps() };
        // Reads the time.
        line.run(Duration::ZERO).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof | ErrorKind::BrokenPipe | ErrorKind::ConnectionReset => {
                io::Error::new(ErrorKind::ResourceBusy, "another program has it open")
            }
            _ => error,
        })?;
        Ok(line)
    }

    /// Lets time pass until there is output, at most `longest`; returns the output.
    pub(super) fn run(&mut self, longest: Duration) -> io::Result<Vec<u8>> {
        let us = u32::try_from(longest.as_micros()).unwrap_or(u32::MAX);
        self.request(RUN, us, &[])
    }

    /// Lets time pass while another line of this program waits, until the next request.
    pub(super) fn park(&mut self) -> io::Result<()> {
        self.request(PARK, 0, &[]).map(|_| ())
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let length = u32::try_from(bytes.len()).map_err(|_| ErrorKind::InvalidInput)?;
        self.request(WRITE, length, bytes).map(|_| ())
    }

    fn request(&mut self, kind: u8, number: u32, bytes: &[u8]) -> io::Result<Vec<u8>> {
        let [a, b, c, d] = number.to_le_bytes();
        let request = [&[kind, a, b, c, d], bytes].concat();
        self.stream.write_all(&request)?;
        let mut head = [0; HEAD];
        self.stream.read_exact(&mut head)?;
        let [t0, t1, t2, t3, t4, t5, t6, t7, length @ ..] = head;
        let us = u64::from_le_bytes([t0, t1, t2, t3, t4, t5, t6, t7]);
        self.clock.advance_to(us);
        let mut output = Vec::new();
        let length = u64::from(u32::from_le_bytes(length));
        let count = Read::by_ref(&mut self.stream).take(length).read_to_end(&mut output)?;
        if count as u64 == length { Ok(output) } else { Err(ErrorKind::UnexpectedEof.into()) }
    }
}
