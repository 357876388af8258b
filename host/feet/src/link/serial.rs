//! Lines over a serial port: the line of a foot, and a slcan adapter.
//!
//! A foot's program sends messages, but its bootloader sends CAN frames as text. [`SerialLine`] is a [`SlcanAdapter`]
//! while it communicates with the bootloader. Lines of slcan:
//!
//! | line, ended by CR | meaning |
//! |---|---|
//! | `t1118AABBCCDDEEFF0011` | a data frame with an 11-bit identifier: three digits, its length, its bytes |
//! | `T`, `r`, `R`, `d`, `D`, `b`, `B` … | a frame with a 29-bit identifier, a remote frame or a CAN FD frame; feet send none of these |
//! | `C`, `S0` … `S8`, `O` | close, the rate of the bus, open |
//!
//! The adapter acknowledges each with CR, or with BEL if it fails. Source: the protocol of Lawicel's CAN232,
//! as implemented by can-utils' `slcand` and python-can's `slcan`.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use wire::CanFrame;
use wire::slcan::{self, BEL, CR};

use super::port::Port;
use super::{Arrival, Arrived, LineClock, Link, LinkError, Sending};
use crate::source::{DEFAULT_KBIT, SLCAN_RATES_KBIT};

/// Serial line of a foot. The adapter is open while the line is switched to the bootloader; otherwise its port carries
/// messages of the program.
pub struct SerialLine(SlcanAdapter);

impl SerialLine {
    /// Opens a serial port, switched to the program.
    ///
    /// # Errors
    /// The port is missing or cannot be used.
    pub fn open(port: &str, baud: u32) -> Result<Self, LinkError> {
        Ok(Self(SlcanAdapter::at(Port::open(port, baud)?)))
    }

    /// Switches to the bootloader, which sends CAN frames as text.
    ///
    /// # Errors
    /// The line has broken, or no bootloader responds.
    pub fn switch_to_bootloader(&mut self) -> Result<(), LinkError> {
        // The bootloader has no bus: it accepts any rate.
        self.0.join(DEFAULT_KBIT)
    }

    /// Switches to the program, which sends messages.
    pub fn switch_to_program(&mut self) {
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

    fn park(&mut self) -> Result<(), LinkError> {
        self.0.port.park()
    }

    fn as_serial_line(&mut self) -> Option<&mut SerialLine> {
        Some(self)
    }
}

/// Rate of the serial port, Bd; USB adapters, which most are, ignore it.
const BAUD: u32 = 921_600;

/// Maximum length of a line: an extended CAN FD frame with a time stamp.
const LONGEST_LINE: usize = 256;

/// Response timeout of an adapter.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Command to an adapter, or response from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SlcanWord {
    /// A frame.
    Frame(CanFrame),
    /// A frame of a kind that feet do not send.
    OtherFrame,
    /// A command has succeeded.
    Done,
    /// A command has failed.
    Failed,
    /// Any other line, such as a command or a version.
    Line(String),
}

/// Parser of the byte stream of an adapter.
#[derive(Clone, Debug, Default)]
pub struct SlcanParser {
    line: Vec<u8>,
    is_too_long: bool,
}

impl SlcanParser {
    /// Parses a byte; returns a word when it is complete.
    pub fn push(&mut self, byte: u8) -> Option<SlcanWord> {
        match byte {
            CR => {
                let line = std::mem::take(&mut self.line);
                let is_too_long = std::mem::take(&mut self.is_too_long);
                Some(if is_too_long { other_line(&line) } else { word(&line) })
            }
            BEL => {
                *self = Self::default();
                Some(SlcanWord::Failed)
            }
            b'\n' => None,
            _ if self.line.len() == LONGEST_LINE => {
                self.is_too_long = true;
                None
            }
            _ => {
                self.line.push(byte);
                None
            }
        }
    }
}

fn word(line: &[u8]) -> SlcanWord {
    match line {
        // z and Z acknowledge a sent frame, Z an extended one.
        [] | [b'z' | b'Z'] => SlcanWord::Done,
        [b't', ..] => slcan::decode(line).map_or_else(|| other_line(line), SlcanWord::Frame),
        [b'T' | b'r' | b'R' | b'd' | b'D' | b'b' | b'B', _, ..] => SlcanWord::OtherFrame,
        _ => other_line(line),
    }
}

fn other_line(line: &[u8]) -> SlcanWord {
    SlcanWord::Line(String::from_utf8_lossy(line).into_owned())
}

/// Adapter.
pub struct SlcanAdapter {
    port: Port,
    interface: Arc<str>,
    parser: SlcanParser,
    waiting: VecDeque<Arrived>,
    is_open: bool,
}

impl SlcanAdapter {
    /// Opens the adapter at `port`, and the bus at `kbit` kbit/s.
    ///
    /// # Errors
    /// The port cannot be used, or the device does not respond as an adapter.
    pub fn open(port: &str, kbit: u32) -> Result<Self, LinkError> {
        let mut adapter = Self::at(Port::open(port, BAUD)?);
        adapter.join(kbit)?;
        Ok(adapter)
    }

    /// Creates the adapter at a port, with its bus closed.
    fn at(port: Port) -> Self {
        Self {
            interface: Arc::clone(&port.name),
            port,
            parser: SlcanParser::default(),
            waiting: VecDeque::new(),
            is_open: false,
        }
    }

    /// Opens the bus at `kbit` kbit/s.
    fn join(&mut self, kbit: u32) -> Result<(), LinkError> {
        let rate = SLCAN_RATES_KBIT.iter().position(|known| *known == kbit);
        // The leading CRs end partial lines. The command C fails if the bus is closed already, so its response is
        // discarded.
        self.port.write(b"\r\r\rC\r")?;
        self.drain(Duration::from_millis(50))?;
        self.command(&format!("S{}", rate.unwrap_or(SLCAN_RATES_KBIT.len() - 1)))?;
        self.command("O")?;
        self.is_open = true;
        Ok(())
    }

    /// Closes the bus, if it is open.
    fn leave(&mut self) {
        if std::mem::take(&mut self.is_open) {
            // The adapter may be unplugged already.
            let _ = self.port.write(b"C\r");
        }
    }

    /// Discards received bytes until none arrive for `quiet`.
    fn drain(&mut self, quiet: Duration) -> Result<(), LinkError> {
        let end = self.port.clock.now() + ANSWER_TIMEOUT;
        while self.port.clock.now() < end && !self.port.read(quiet)?.is_empty() {}
        self.parser = SlcanParser::default();
        Ok(())
    }

    /// Sends a command and waits for its response.
    fn command(&mut self, command: &str) -> Result<(), LinkError> {
        self.port.write(format!("{command}\r").as_bytes())?;
        let error = |what| LinkError::Adapter { device: self.interface.to_string(), what };
        let end = self.port.clock.now() + ANSWER_TIMEOUT;
        loop {
            let left = self.port.clock.until(end);
            if left.is_zero() {
                return Err(error("no answer within a second"));
            }
            for byte in self.port.read(left)? {
                match self.parser.push(byte) {
                    Some(SlcanWord::Done) => return Ok(()),
                    Some(SlcanWord::Failed) => return Err(error("it refused a command")),
                    Some(SlcanWord::Frame(frame)) => self.waiting.push_back(self.arrived(frame)),
                    Some(SlcanWord::OtherFrame | SlcanWord::Line(_)) | None => {}
                }
            }
        }
    }

    fn arrived(&self, frame: CanFrame) -> Arrived {
        let interface = Arc::clone(&self.interface);
        let at = self.port.clock.stamp();
        (at, Arrival::Frame { interface, frame })
    }
}

impl Link for SlcanAdapter {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let end = self.port.clock.now() + longest;
        while self.waiting.is_empty() {
            let left = self.port.clock.until(end);
            let bytes = self.port.read(left)?;
            for byte in &bytes {
                match self.parser.push(*byte) {
                    Some(SlcanWord::Frame(frame)) => self.waiting.push_back(self.arrived(frame)),
                    Some(SlcanWord::Line(line)) => {
                        let at = self.port.clock.stamp();
                        self.waiting.push_back((at, Arrival::Unreadable(line)));
                    }
                    Some(SlcanWord::Done | SlcanWord::Failed | SlcanWord::OtherFrame) | None => {}
                }
            }
            if bytes.is_empty() || left.is_zero() {
                break;
            }
        }
        Ok(self.waiting.pop_front())
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        match sending {
            Sending::Frame(frame) => self.port.write(&slcan::encode(frame)),
            Sending::Bytes { .. } => Err(LinkError::wrong_kind(&*self.interface, "CAN frames")),
        }
    }

    fn clock(&self) -> LineClock {
        self.port.clock.clone()
    }

    fn park(&mut self) -> Result<(), LinkError> {
        self.port.park()
    }
}

impl Drop for SlcanAdapter {
    fn drop(&mut self) {
        self.leave();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(bytes: &[u8]) -> Vec<SlcanWord> {
        let mut words = SlcanParser::default();
        bytes.iter().filter_map(|byte| words.push(*byte)).collect()
    }

    #[test]
    fn other_lines_are_not_parsed_as_data_frames() {
        let line = |text: &str| SlcanWord::Line(text.to_owned());
        for (text, word) in [
            ("t19\r", line("t19")),
            ("t1919\r", line("t1919")),
            ("t0800\r", SlcanWord::Frame(CanFrame::new(0x080, &[]).expect("a frame"))),
            ("t19\u{e4}1AB\r", line("t19\u{e4}1AB")),
            ("T000001911AB\r", SlcanWord::OtherFrame),
            ("r1910\r", SlcanWord::OtherFrame),
            ("V1013\r", line("V1013")),
            ("\r", SlcanWord::Done),
            ("z\r", SlcanWord::Done),
            ("garbage\u{7}", SlcanWord::Failed),
        ] {
            assert_eq!(words(text.as_bytes()), [word], "{text:?}");
        }
    }

    #[test]
    fn endless_line_is_cut_off() {
        let mut parser = SlcanParser::default();
        for _ in 0..100_000 {
            assert_eq!(parser.push(b't'), None);
        }
        let Some(SlcanWord::Line(line)) = parser.push(CR) else {
            panic!("the line is not a frame");
        };
        assert_eq!(line.len(), LONGEST_LINE);
        assert_eq!(parser.push(CR), Some(SlcanWord::Done));
    }
}
