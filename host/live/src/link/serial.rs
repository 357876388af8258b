//! Serial port.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use serial2::SerialPort;

use super::LinkError;

/// Timeout of a write.
const WRITE_TIMEOUT: Duration = Duration::from_millis(500);

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Open serial port.
pub(super) struct Port {
    pub(super) name: Arc<str>,
    port: SerialPort,
}

impl Port {
    pub(super) fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let port = opened(name, baud).map_err(LinkError::device(name))?;
        let name = name.into();
        Ok(Self { name, port })
    }

    /// Reads the bytes that arrive within `longest`; empty if there are none.
    pub(super) fn read(&mut self, longest: Duration) -> Result<Vec<u8>, LinkError> {
        let error = LinkError::device(&self.name);
        // The system's timeout has a resolution of 1 ms.
        let longest = longest.max(Duration::from_millis(1));
        if let Err(source) = self.port.set_read_timeout(longest) {
            return Err(error(source));
        }
        let mut piece = vec![0; PIECE];
        loop {
            match self.port.read(&mut piece) {
                // An unplugged port is readable but returns no bytes.
                Ok(0) => return Err(error(io::ErrorKind::UnexpectedEof.into())),
                Ok(count) => {
                    piece.truncate(count);
                    return Ok(piece);
                }
                Err(source) => match source.kind() {
                    io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => return Ok(Vec::new()),
                    io::ErrorKind::Interrupted => {}
                    _ => return Err(error(source)),
                },
            }
        }
    }

    pub(super) fn write(&self, bytes: &[u8]) -> Result<(), LinkError> {
        let written = self.port.write_all(bytes);
        written.map_err(LinkError::device(&self.name))
    }
}

fn opened(name: &str, baud: u32) -> io::Result<SerialPort> {
    let mut port = SerialPort::open(name, baud)?;
    take_alone(&port)?;
    port.set_write_timeout(WRITE_TIMEOUT)?;
    Ok(port)
}

/// Locks the port against other programs that would take bytes from it. The lock is advisory: footfall and
/// pyserial's `exclusive` respect it. It ends when the port is closed.
#[cfg(unix)]
fn take_alone(port: &SerialPort) -> io::Result<()> {
    use rustix::fs::{FlockOperation, flock};
    use rustix::io::Errno;

    match flock(port, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(()),
        Err(Errno::WOULDBLOCK) => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another program has it open",
        )),
        // The system does not support locks on ports.
        Err(Errno::NOTSUP | Errno::NOSYS | Errno::INVAL) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// Does nothing: the system opens a port for one program only.
#[cfg(not(unix))]
fn take_alone(_: &SerialPort) -> io::Result<()> {
    Ok(())
}
