//! Serial line of a foot, whose program and bootloader speak differently.

use std::time::Duration;

use super::serial::Port;
use super::slcan::SlcanAdapter;
use super::{Arrival, Arrived, Link, LinkError, Sending, now};
use crate::source::DEFAULT_KBIT;

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
    adapter: SlcanAdapter,
    language: Language,
}

impl SerialLine {
    /// Opens a serial port, to speak with a program.
    ///
    /// # Errors
    /// The port is missing or cannot be used.
    pub fn open(port: &str, baud: u32) -> Result<Self, LinkError> {
        Ok(Self {
            adapter: SlcanAdapter::at(Port::open(port, baud)?),
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
            (Sending::Frame(_), Language::Messages) => {
                let device = &*self.adapter.port.name();
                Err(LinkError::wrong_kind(device, "bytes of the serial line"))
            }
        }
    }

    fn as_serial_line(&mut self) -> Option<&mut SerialLine> {
        Some(self)
    }
}
