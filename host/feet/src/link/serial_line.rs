//! Serial line of a foot, whose program and bootloader speak differently.

use std::sync::Arc;
use std::time::Duration;

use super::serial::Port;
use super::slcan::SlcanAdapter;
use super::{Arrival, Arrived, LineClock, Link, LinkError, Sending};
use crate::source::DEFAULT_KBIT;

/// Serial line of a foot. The bootloader is an adapter that is open while it is spoken to; its port is that of both.
pub struct SerialLine(SlcanAdapter);

impl SerialLine {
    /// Opens a serial port, to speak with a program.
    ///
    /// # Errors
    /// The port is missing or cannot be used.
    pub fn open(port: &str, baud: u32) -> Result<Self, LinkError> {
        Ok(Self(SlcanAdapter::at(Port::open(port, baud)?)))
    }

    /// Speaks with a bootloader from now on: CAN frames as text.
    ///
    /// # Errors
    /// The line has broken, or there is no bootloader that answers.
    pub fn speak_text(&mut self) -> Result<(), LinkError> {
        // The bootloader has no bus, and takes any rate of one.
        self.0.join(DEFAULT_KBIT)
    }

    /// Speaks with a program from now on: messages.
    pub fn speak_messages(&mut self) {
        self.0.leave();
    }
}

impl Link for SerialLine {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        if self.0.is_open {
            return self.0.receive(longest);
        }
        let bytes = self.0.port.read(longest)?;
        let port = Arc::clone(&self.0.port.name);
        let at = self.0.port.clock.stamp();
        Ok((!bytes.is_empty()).then_some((at, Arrival::Bytes { port, bytes })))
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        if self.0.is_open {
            return self.0.send(sending);
        }
        match sending {
            Sending::Bytes { bytes, .. } => self.0.port.write(bytes),
            Sending::Frame(_) => {
                let device = &*self.0.port.name;
                Err(LinkError::wrong_kind(device, "bytes of the serial line"))
            }
        }
    }

    fn clock(&self) -> LineClock {
        self.0.clock()
    }

    fn as_serial_line(&mut self) -> Option<&mut SerialLine> {
        Some(self)
    }
}
