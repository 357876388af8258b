//! Serial port, or the line of a board in lock step instead of one.

use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use serial2::SerialPort;

use super::{LineClock, LinkError};
#[cfg(unix)]
use lock_step::LockStepClient;
#[cfg(unix)]
pub(super) use lock_step::is_in_lock_step;

/// Timeout of a write.
const WRITE_TIMEOUT: Duration = Duration::from_millis(500);

/// Time in which a board on USB hands over the bytes that it had ready for an earlier program. It takes some frames of USB.
const LEFT_OVER: Duration = Duration::from_millis(10);

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Open serial port.
pub(super) struct Port {
    pub(super) name: Arc<str>,
    pub(super) clock: LineClock,
    device: PortDevice,
}

/// Device of a port: a serial port of the system, or a socket of a board.
enum PortDevice {
    Serial(SerialPort),
    #[cfg(unix)]
    LockStep(LockStepClient),
}

impl Port {
    pub(super) fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let device = PortDevice::open(name, baud).map_err(LinkError::device(name))?;
        let clock = match &device {
            PortDevice::Serial(_) => LineClock::default(),
            #[cfg(unix)]
            PortDevice::LockStep(line) => line.clock.clone(),
        };
        let name = name.into();
        Ok(Self { name, clock, device })
    }

    /// Reads the bytes that arrive within `longest`; empty if there are none.
    pub(super) fn read(&mut self, longest: Duration) -> Result<Vec<u8>, LinkError> {
        // The system's timeout, and the steps of boards, have a resolution of 1 ms.
        let longest = longest.max(Duration::from_millis(1));
        let bytes = match &mut self.device {
            PortDevice::Serial(port) => read(port, longest),
            #[cfg(unix)]
            PortDevice::LockStep(line) => line.run(longest),
        };
        bytes.map_err(LinkError::device(&self.name))
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let written = match &mut self.device {
            PortDevice::Serial(port) => port.write_all(bytes),
            #[cfg(unix)]
            PortDevice::LockStep(line) => line.write(bytes),
        };
        written.map_err(LinkError::device(&self.name))
    }

    /// Lets the time of boards in lock step pass while another line waits, until this one is used again.
    pub(super) fn park(&mut self) -> Result<(), LinkError> {
        match &mut self.device {
            PortDevice::Serial(_) => Ok(()),
            #[cfg(unix)]
            PortDevice::LockStep(line) => line.park().map_err(LinkError::device(&self.name)),
        }
    }
}

impl PortDevice {
    fn open(name: &str, baud: u32) -> io::Result<Self> {
        #[cfg(unix)]
        if is_in_lock_step(name) {
            return LockStepClient::open(name).map(Self::LockStep);
        }
        let mut port = SerialPort::open(name, baud)?;
        lock(&port)?;
        port.set_write_timeout(WRITE_TIMEOUT)?;
        // Windows leaves DTR low, but a foot on USB sends only while DTR is high. An error is ignored, because some adapters
        // have no DTR.
        let _ = port.set_dtr(true);
        // A board on USB keeps a packet that an earlier program has not read. Discard it, because its contacts are old, and
        // all contacts since then would count as missing.
        thread::sleep(LEFT_OVER);
        let _ = port.discard_input_buffer();
        Ok(Self::Serial(port))
    }
}

/// Locks the port against other programs that would take bytes from it. The lock is advisory: footfall and
/// pyserial's `exclusive` respect it. It ends when the port is closed.
#[cfg(unix)]
fn lock(port: &SerialPort) -> io::Result<()> {
    use rustix::fs::{FlockOperation, flock};
    use rustix::io::Errno;

    match flock(port, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(()),
        Err(Errno::WOULDBLOCK) => {
            Err(io::Error::new(io::ErrorKind::ResourceBusy, "another program has it open"))
        }
        // The system does not support locks on ports.
        Err(Errno::NOTSUP | Errno::NOSYS | Errno::INVAL) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// Does nothing: the system opens a port for one program only.
#[cfg(not(unix))]
fn lock(_: &SerialPort) -> io::Result<()> {
    Ok(())
}

/// Reads the bytes that arrive within `longest`; empty if there are none.
fn read(port: &mut SerialPort, longest: Duration) -> io::Result<Vec<u8>> {
    port.set_read_timeout(longest)?;
    let mut piece = vec![0; PIECE];
    loop {
        match port.read(&mut piece) {
            // An unplugged port is readable but returns no bytes.
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                piece.truncate(count);
                return Ok(piece);
            }
            Err(error) => match error.kind() {
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => return Ok(Vec::new()),
                io::ErrorKind::Interrupted => {}
                _ => return Err(error),
            },
        }
    }
}

/// Line of a board in lock step: a Unix socket of `virtual-board serve --lock-step`, whose source has the table of
/// requests. The boards' time passes only during requests.
#[cfg(unix)]
mod lock_step {
    use std::fs;
    use std::io::{self, ErrorKind, Read, Write};
    use std::os::unix::fs::FileTypeExt;
    use std::os::unix::net::UnixStream;
    use std::time::Duration;

    use crate::link::LineClock;

    /// Kinds of requests.
    const WRITE: u8 = b'W';
    const RUN: u8 = b'R';
    const PARK: u8 = b'P';

    /// Length of an answer without its bytes: the time and their number.
    const HEAD: usize = 12;

    /// Returns whether the port with this name is in lock step.
    pub(in crate::link) fn is_in_lock_step(port: &str) -> bool {
        fs::metadata(port).is_ok_and(|found| found.file_type().is_socket())
    }

    /// Open line.
    pub struct LockStepClient {
        stream: UnixStream,
        pub clock: LineClock,
    }

    impl LockStepClient {
        pub fn open(port: &str) -> io::Result<Self> {
            let mut line =
                Self { stream: UnixStream::connect(port)?, clock: LineClock::in_steps() };
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
        pub fn run(&mut self, longest: Duration) -> io::Result<Vec<u8>> {
            let us = u32::try_from(longest.as_micros()).unwrap_or(u32::MAX);
            self.request(RUN, us, &[])
        }

        /// Lets time pass while another line of this program waits, until the next request.
        pub fn park(&mut self) -> io::Result<()> {
            self.request(PARK, 0, &[]).map(|_| ())
        }

        pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
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
}
