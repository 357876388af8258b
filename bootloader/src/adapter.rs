//! The serial line. On it the bootloader acts as a slcan adapter, and as the only node of its bus. So a master with
//! support for such adapters updates a foot without a CAN bus.
//!
//! | line, ended by CR | meaning |
//! |---|---|
//! | `C`, `S0` … `S8`, `O` | close; set the bit rate, without effect because there is no bus; open |
//! | `t6118…` | a frame for the node |
//!
//! The adapter answers each line with CR. It answers with BEL if the line is unknown, or if it is a frame before the
//! line was opened. It does not answer empty lines, which masters send to end an incomplete line. Frames of the node
//! are sent while the line is open.

use heapless::Vec;
use wire::CanFrame;
use wire::slcan::{CR, LONGEST, decode};

/// Request of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// A frame for the node.
    Frame(CanFrame),
    /// A command, already executed.
    Done,
    /// An unknown request.
    Unknown,
}

/// State of the line.
#[derive(Debug, Default)]
pub struct Adapter {
    line: Vec<u8, LONGEST>,
    is_too_long: bool,
    is_open: bool,
}

impl Adapter {
    /// Returns whether a master has opened the line.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.is_open
    }

    /// Takes a byte. Returns the request of a line at the line's end.
    pub fn push(&mut self, byte: u8) -> Option<Request> {
        if byte != CR {
            self.is_too_long |= self.line.push(byte).is_err();
            return None;
        }
        let line = core::mem::take(&mut self.line);
        if core::mem::take(&mut self.is_too_long) {
            return Some(Request::Unknown);
        }
        let (command, rest) = line.split_first()?;
        match (command, rest, self.is_open) {
            (b'C', [], _) => self.is_open = false,
            (b'O', [], false) => self.is_open = true,
            (b'S', [b'0'..=b'8'], false) => {}
            (b't', _, true) => return Some(decode(&line).map_or(Request::Unknown, Request::Frame)),
            _ => return Some(Request::Unknown),
        }
        Some(Request::Done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(adapter: &mut Adapter, bytes: &[u8]) -> std::vec::Vec<Request> {
        let pushed = bytes.iter().filter_map(|byte| adapter.push(*byte));
        pushed.collect()
    }

    #[test]
    fn line_is_opened_as_masters_do_and_takes_frames() {
        let mut adapter = Adapter::default();
        // footfall, python-can, slcand.
        for opening in ["\r\r\rC\rS8\rO\r", "C\rS8\rO\r", "C\rS6\rO\r"] {
            let answers = words(&mut adapter, opening.as_bytes());
            assert_eq!(answers, [Request::Done; 3], "{opening:?}");
            assert!(adapter.is_open());
        }
        let frame = CanFrame::new(0x611, &[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]).expect("a frame");
        let asked = words(&mut adapter, b"t61184008100000000000\r");
        assert_eq!(asked, [Request::Frame(frame)]);
        assert_eq!(words(&mut adapter, b"C\r"), [Request::Done]);
        assert!(!adapter.is_open());
    }

    #[test]
    fn unknown_lines_change_nothing() {
        let mut adapter = Adapter::default();
        for line in ["t0800\r", "S9\r", "S\r", "Ox\r", "V\r", "N\r", "\0\x07\r"] {
            assert_eq!(words(&mut adapter, line.as_bytes()), [Request::Unknown]);
        }
        assert!(!adapter.is_open());
        words(&mut adapter, b"O\r");
        for line in ["O\r", "S8\r", "t08\r", "T000001110\r", "r1110\r"] {
            assert_eq!(words(&mut adapter, line.as_bytes()), [Request::Unknown]);
        }
        assert!(adapter.is_open());
    }

    #[test]
    fn line_that_is_too_long_is_refused_once() {
        let mut adapter = Adapter::default();
        assert_eq!(words(&mut adapter, &[b't'; 100_000]), []);
        assert_eq!(words(&mut adapter, b"\r"), [Request::Unknown]);
        assert_eq!(words(&mut adapter, b"O\r"), [Request::Done]);
    }
}
