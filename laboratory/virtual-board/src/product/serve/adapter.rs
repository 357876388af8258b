//! The slcan adapter: commands in, responses and frames out, as in Lawicel's CAN232 and CANUSB, and as `slcand` and
//! python-can expect.
//!
//! | line, ended by CR | effect | state of the channel |
//! |---|---|---|
//! | `S0` … `S8` | the rate of the bus: 10 … 1000 kbit/s | closed |
//! | `O`, `L`, `C` | open, open without sending, close | closed, closed, open |
//! | `t` | send a frame: all frames here have identifiers of 11 bits, and carry data | open |
//! | `F` | status: bit 3 where frames were lost | open |
//! | `V`, `N` | version, serial number | anywhere |
//!
//! Each command is answered with CR; a sent frame with `z` before it. A command that is invalid, or not possible in the
//! present state, is answered with BEL. Frames are received while the channel is open, except those that the host
//! sends.

use super::robot::BusTransfer;
use crate::emulator::part::can::BusFrame;
use wire::slcan::{self, BEL, CR};

/// Bit rates of `S0` to `S8`, bit/s.
const RATES: [u32; 9] =
    [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

/// Length of the longest line, without CR.
const LONGEST_LINE: usize = slcan::LONGEST - 1;

/// State of the channel to the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Channel {
    #[default]
    Closed,
    Open,
    Listening,
}

/// An adapter.
#[derive(Clone, Debug, Default)]
pub struct EmulatedAdapter {
    channel: Channel,
    /// Bit rate; `None` until configured.
    bit_rate: Option<u32>,
    /// Whether a line was lost because it was not read in time, since the last status.
    pub(crate) has_lost: bool,
    line: Vec<u8>,
    is_too_long: bool,
}

/// Result of a received byte.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reaction {
    /// Answer to a command.
    pub answer: Vec<u8>,
    /// Frame for the bus, with its bit rate, bit/s.
    pub frame: Option<(BusFrame, u32)>,
}

impl EmulatedAdapter {
    /// Processes a byte of the host.
    pub fn push(&mut self, byte: u8) -> Reaction {
        match byte {
            CR => {
                let line = core::mem::take(&mut self.line);
                let is_too_long = core::mem::take(&mut self.is_too_long);
                let line = String::from_utf8(line).ok().filter(|_| !is_too_long);
                let reaction = line.and_then(|line| self.command(&line));
                let (answer, frame) = (vec![BEL], None);
                return reaction.unwrap_or(Reaction { answer, frame });
            }
            b'\n' => {}
            _ if self.line.len() == LONGEST_LINE => self.is_too_long = true,
            _ => self.line.push(byte),
        }
        Reaction::default()
    }

    /// Executes a command; `None` if it is rejected.
    fn command(&mut self, line: &str) -> Option<Reaction> {
        let is_closed = self.channel == Channel::Closed;
        let mut answer = Vec::new();
        let mut frame = None;
        match (line.as_bytes(), is_closed) {
            // An empty line: hosts send some to terminate earlier input.
            ([], _) => {}
            ([b'S', digit @ b'0'..=b'8'], true) => {
                self.bit_rate = RATES.get(usize::from(digit - b'0')).copied();
            }
            ([b'O'], true) if self.bit_rate.is_some() => self.channel = Channel::Open,
            ([b'L'], true) if self.bit_rate.is_some() => self.channel = Channel::Listening,
            ([b'C'], false) => self.channel = Channel::Closed,
            ([b'F'], false) => {
                let lost = core::mem::take(&mut self.has_lost);
                answer.extend(if lost { b"F08" } else { b"F00" });
            }
            ([b'V'], _) => answer.extend(b"V1013"),
            ([b'N'], _) => answer.extend(b"NF405"),
            (text @ [b't', ..], _) if self.channel == Channel::Open => {
                frame = Some((BusFrame::of(&slcan::decode(text)?), self.bit_rate?));
                answer.push(b'z');
            }
            _ => return None,
        }
        answer.push(CR);
        Some(Reaction { answer, frame })
    }

    /// Line of a frame on the bus, if the adapter receives it.
    #[must_use]
    pub fn line_for(&self, carried: &BusTransfer) -> Option<Vec<u8>> {
        let is_open = self.channel != Channel::Closed;
        (is_open && self.bit_rate == Some(carried.bit_rate)).then(|| carried.frame.line())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exchange(adapter: &mut EmulatedAdapter, text: &str) -> String {
        let answers = text.bytes().flat_map(|byte| adapter.push(byte).answer);
        answers.map(char::from).collect()
    }

    fn carried(id: u16) -> BusTransfer {
        BusTransfer { node: 0, start: 0, bit_rate: 1_000_000, frame: BusFrame::new(id, &[0xAB]) }
    }

    #[test]
    fn hosts_open_and_close_the_channel() {
        let mut adapter = EmulatedAdapter::default();
        // First commands of slcand, python-can and this workspace.
        for (said, answer) in [
            ("\r\r\rC\r", "\r\r\r\x07"),
            ("O\r", "\x07"),
            ("S8\r", "\r"),
            ("\r", "\r"),
            ("O\r", "\r"),
            ("O\r", "\x07"),
            ("S6\r", "\x07"),
            ("V\rN\rF\r", "V1013\rNF405\rF00\r"),
            ("C\r", "\r"),
            ("L\r", "\r"),
            ("t1910\r", "\x07"),
            ("S9\rs0014\rZ1\r", "\x07\x07\x07"),
        ] {
            assert_eq!(exchange(&mut adapter, said), answer, "{said:?}");
        }
    }

    #[test]
    fn frames_pass_only_while_open_and_at_the_bit_rate_of_the_bus() {
        let mut adapter = EmulatedAdapter::default();
        assert_eq!(adapter.line_for(&carried(0x191)), None);
        exchange(&mut adapter, "S8\rO\r");
        assert_eq!(adapter.line_for(&carried(0x191)).as_deref(), Some(&b"t1911AB\r"[..]));
        exchange(&mut adapter, "t1911A");
        adapter.push(b'B');
        let sent = adapter.push(b'\r');
        assert_eq!(sent.answer, b"z\r");
        assert_eq!(sent.frame, Some((BusFrame::new(0x191, &[0xAB]), 1_000_000)));
        for bad in ["T000001911AB\r", "r1910\r", "t191\r", "t1919\r", &"t".repeat(1000), "\r"] {
            let answer = exchange(&mut adapter, bad);
            assert!(answer == "\x07" || !bad.ends_with('\r'), "{bad}: {answer:?}");
        }
        exchange(&mut adapter, "C\rS6\rO\r");
        assert_eq!(adapter.line_for(&carried(0x191)), None, "another rate");
    }

    #[test]
    fn lost_frames_are_reported_once_in_the_status() {
        let mut adapter = EmulatedAdapter::default();
        exchange(&mut adapter, "S8\rO\r");
        adapter.has_lost = true;
        assert_eq!(exchange(&mut adapter, "F\rF\r"), "F08\rF00\r");
    }
}
