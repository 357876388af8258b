//! Serial port, or the line of a board in lock step.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use serial2::SerialPort;

#[cfg(unix)]
use super::lock_step::{LockStepClient, is_in_lock_step};
use super::{LineClock, LinkError};

/// Timeout of a write.
const WRITE_TIMEOUT: Duration = Duration::from_millis(500);

/// Maximum size of one read, bytes.
const PIECE: usize = 4096;

/// Open serial port.
pub(super) struct Port {
    pub(super) name: Arc<str>,
    pub(super) clock: LineClock,
    device: PortDevice,
}

/// Device of a port.
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
}

impl Port {
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
        opened(name, baud).map(Self::Serial)
    }
}

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

fn opened(name: &str, baud: u32) -> io::Result<SerialPort> {
    let mut port = SerialPort::open(name, baud)?;
    take_alone(&port)?;
    port.set_write_timeout(WRITE_TIMEOUT)?;
    // Windows leaves DTR low, and a foot on USB sends only while it is high. An error is ignored, as some adapters lack this
    // line.
    let _ = port.set_dtr(true);
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
fn take_alone(_: &SerialPort) -> io::Result<()> {
    Ok(())
}
