//! Serial port of a foot.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use serial2::SerialPort;

use super::slcan::Adapter;
use super::{Arrival, Arrived, Link, LinkError, Sending, now};
use crate::source::DEFAULT_KBIT;

/// Timeout of a write.
const WRITE_TIMEOUT: Duration = Duration::from_millis(500);

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Open serial port.
pub(super) struct Port {
    name: Arc<str>,
    port: SerialPort,
}

impl Port {
    pub(super) fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let mut port = SerialPort::open(name, baud).map_err(LinkError::device(name))?;
        take_alone(&port).map_err(LinkError::device(name))?;
        port.set_write_timeout(WRITE_TIMEOUT)
            .map_err(LinkError::device(name))?;
        Ok(Self {
            name: name.into(),
            port,
        })
    }

    pub(super) fn name(&self) -> Arc<str> {
        Arc::clone(&self.name)
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

/// Language on the serial line of a foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Messages of the foot's program.
    Messages,
    /// CAN frames as text, as its bootloader does.
    Text,
}

/// Serial line of a foot.
pub struct SerialLine {
    /// The bootloader as an adapter, and the port of both.
    adapter: Adapter,
    language: Language,
}

impl SerialLine {
    /// Opens a serial port, to speak with a program.
    ///
    /// # Errors
    /// The port is missing or cannot be used.
    pub fn open(port: &str, baud: u32) -> Result<Self, LinkError> {
        Ok(Self {
            adapter: Adapter::at(Port::open(port, baud)?),
            language: Language::Messages,
        })
    }

    /// Changes the language.
    ///
    /// # Errors
    /// The line has broken, or there is no bootloader that answers.
    pub fn speak(&mut self, language: Language) -> Result<(), LinkError> {
        match language {
            // The bootloader has no bus, and takes any rate of one.
            Language::Text => self.adapter.join(DEFAULT_KBIT)?,
            Language::Messages => self.adapter.leave(),
        }
        self.language = language;
        Ok(())
    }
}

impl Link for SerialLine {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        if self.language == Language::Text {
            return self.adapter.receive(longest);
        }
        let bytes = self.adapter.port.read(longest)?;
        let port = self.adapter.port.name();
        Ok((!bytes.is_empty()).then(|| (now(), Arrival::Bytes { port, bytes })))
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        match (sending, self.language) {
            (_, Language::Text) => self.adapter.send(sending),
            (Sending::Bytes { bytes, .. }, Language::Messages) => self.adapter.port.write(bytes),
            (Sending::Frame(_), Language::Messages) => Err(LinkError::WrongKind {
                device: self.adapter.port.name().to_string(),
                takes: "bytes of the serial line",
            }),
        }
    }

    fn as_serial_line(&mut self) -> Option<&mut SerialLine> {
        Some(self)
    }
}
