//! The CAN controller bxCAN, and a bus with a second node.
//!
//! | step | where |
//! |---|---|
//! | the program puts a frame into a mailbox | `registers` |
//! | mailboxes and other nodes compete for the bus, the frame ends | `bus` |
//! | errors are counted | `errors` |
//! | a frame of another node passes the filters | `receive` |
//! | the program reads it from its FIFO | `registers` |

mod bus;
mod errors;
mod frame;
mod receive;
mod registers;

use std::collections::VecDeque;

use crate::emulator::time::{NEVER, cycle};
pub use frame::{BusFrame, TimedFrame};
use registers::{INAK, Mailbox, RESET_TIMING, SLAK};

/// A fault of the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BusFault {
    /// No fault.
    #[default]
    None,
    /// No other node: frames are not acknowledged.
    NoAcknowledge,
    /// The same, and the controller does not abort a frame.
    AbortIgnored,
    /// The lines are shorted: every transmitted bit reads back wrong, and the bus is never idle.
    Shorted,
    /// Another node sends frames of the highest priority without a pause.
    Saturated,
}

/// Sender of the frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sender {
    Mailbox(usize),
    Peer,
    /// The node that saturates the bus.
    Flood,
}

/// The controller and its bus.
#[derive(Clone, Debug, Default)]
pub struct Can {
    control: u32,
    status: u32,
    transmit: u32,
    fifo: [VecDeque<[u32; 4]>; 2],
    fifo_flags: [u32; 2],
    interrupts: u32,
    last_error: u32,
    transmit_errors: u32,
    receive_errors: u32,
    /// Whether the controller is off the bus.
    pub off: bool,
    timing: u32,
    mailboxes: [Mailbox; 3],
    order: u64,
    filter_master: u32,
    filter_mode: u32,
    filter_scale: u32,
    filter_fifo: u32,
    filter_active: u32,
    filters: [[u32; 2]; 28],
    /// Clock of the peripheral, Hz.
    pub(crate) pclk: u32,
    now: u64,
    busy: Option<(Sender, u64)>,
    /// Time at which the bus was idle long enough to join, or to recover from bus-off.
    joined_at: u64,
    /// Fault of the bus.
    pub fault: BusFault,
    /// Frames that the controller has sent.
    pub sent: Vec<TimedFrame>,
    /// Time at which each frame was put into a mailbox, and its identifier; kept until taken.
    pub requested: Vec<(u64, u32)>,
    /// Frames of the other node with their earliest times.
    incoming: VecDeque<TimedFrame>,
    /// Frames that arrived while a FIFO was full.
    pub overruns: u64,
}

impl Can {
    /// Creates a controller after reset.
    #[must_use]
    pub fn new(pclk: u32) -> Self {
        Self {
            control: 0x0001_0002,
            status: SLAK,
            timing: RESET_TIMING,
            filter_master: 0x2A1C_0E01,
            pclk,
            joined_at: NEVER,
            ..Self::default()
        }
    }

    /// Resets the controller; the bus stays.
    pub fn reset(&mut self, pclk: u32, now: u64) {
        *self = Self {
            now,
            fault: self.fault,
            sent: core::mem::take(&mut self.sent),
            requested: core::mem::take(&mut self.requested),
            incoming: core::mem::take(&mut self.incoming),
            overruns: self.overruns,
            ..Self::new(pclk)
        };
    }

    /// The bit rate, hertz.
    #[must_use]
    pub const fn bit_rate(&self) -> u32 {
        let quanta = 3 + (self.timing >> 16 & 0xF) + (self.timing >> 20 & 7);
        self.pclk / ((self.timing & 0x3FF) + 1) / quanta
    }

    const fn bit(&self) -> u64 {
        cycle(self.bit_rate())
    }

    /// Queues a frame of the other node, to be sent no earlier than `time`.
    pub fn push(&mut self, frame: BusFrame, time: u64) {
        self.incoming.push_back(TimedFrame { time, frame });
    }

    /// Discards frames of the other node that should have begun before `time`.
    pub fn withdraw(&mut self, time: u64) {
        // The first frame may already be on the bus, and completes.
        let on_bus = usize::from(matches!(self.busy, Some((Sender::Peer, _))));
        let waiting = self.incoming.iter().skip(on_bus);
        let late = waiting.take_while(|timed| timed.time < time).count();
        self.incoming.drain(on_bus..on_bus + late);
    }

    const fn is_normal(&self) -> bool {
        self.status & (INAK | SLAK) == 0
    }

    /// Returns whether the controller takes part in bus traffic: it is initialised, and not off the bus.
    #[must_use]
    pub const fn takes_part(&self) -> bool {
        self.is_normal() && !self.off
    }
}

#[cfg(test)]
mod tests {
    use super::registers::{INAK, INRQ, LOOPBACK, SILENT};
    use super::*;

    #[test]
    fn initialisation_is_acknowledged_once_the_bus_is_idle() {
        const MILLISECOND: u64 = crate::emulator::time::PER_SECOND / 1000;
        let acknowledged =
            |can: &mut Can, now: u64| can.read(0x04, now).expect("a register") & INAK != 0;
        let mut can = Can::new(40_000_000);
        can.write(0x00, INRQ, 0).expect("a register");
        assert!(acknowledged(&mut can, 0));
        assert!(can.write(0x00, 0, 0).is_err(), "the timing of the reset");
        for (offset, value) in [(0x00, INRQ), (0x1C, 0x0123_0001), (0x00, 0)] {
            can.write(offset, value, 0).expect("a register");
        }
        assert!(!acknowledged(&mut can, MILLISECOND), "it takes part");
        can.set_fault(BusFault::Shorted);
        can.write(0x00, INRQ, MILLISECOND).expect("a register");
        assert!(!acknowledged(&mut can, 100 * MILLISECOND));
        can.set_fault(BusFault::None);
        assert!(acknowledged(&mut can, 100 * MILLISECOND));
    }

    #[test]
    fn silent_loop_back_works_on_a_shorted_bus_and_is_not_seen() {
        const MILLISECOND: u64 = crate::emulator::time::PER_SECOND / 1000;
        let mut can = Can::new(40_000_000);
        can.set_fault(BusFault::Shorted);
        let timing = LOOPBACK | SILENT | 0x0123_0001;
        for (offset, value) in [(0x00, INRQ), (0x1C, timing), (0x00, 0)] {
            can.write(offset, value, 0).expect("a register");
        }
        // A filter that accepts all.
        for (offset, value) in [(0x200, 0xE01), (0x20C, 1), (0x21C, 1), (0x200, 0xE00)] {
            can.write(offset, value, 0).expect("a register");
        }
        assert_eq!(can.read(0x04, MILLISECOND).expect("a register") & INAK, 0);
        let request = 0x123 << 21 | 1;
        can.write(0x180, request, MILLISECOND).expect("a register");
        let waiting = |can: &mut Can, now| can.read(0x0C, now).expect("a register") & 3;
        assert_eq!(waiting(&mut can, 2 * MILLISECOND), 1);
        assert!(can.sent.is_empty());
        can.write(0x00, INRQ, 2 * MILLISECOND).expect("a register");
        let status = can.read(0x04, 2 * MILLISECOND).expect("a register");
        assert_ne!(status & INAK, 0);
    }
}
