//! Additional traffic on the board's lines.

use wire::dictionary::index;
use wire::{Address, Foot, Pdo, Value};

use crate::emulator::board::{Board, Injection};
use crate::emulator::part::can::BusFrame;
use crate::emulator::part::usart::LineFault;
use crate::product::scenario::{BEFORE_MS, ScenarioStep};
use crate::product::streams;

/// Traffic on the lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Traffic {
    /// The board's own frames, as it sends them by default.
    #[default]
    Own,
    /// As on a robot with four feet and a master that requests settings: all streams over the serial line; on CAN
    /// three more feet that send as much as this one, and a SYNC each 10 ms; requests over both lines each 100 ms.
    Full,
    /// The same, and disturbances of the serial line, which the board reports as faults.
    FullWithFaults,
}

/// Period of SYNCs, of requests, and of disturbances, ms: a fault of the serial line lasts for a second after its event.
const SYNC_MS: u64 = 10;
const QUESTIONS_MS: u64 = 100;
const DISTURBANCE_MS: u64 = 1_103;

impl Traffic {
    /// Sends the traffic of this millisecond.
    pub fn act(self, board: &mut Board, ms: u64) {
        if self == Self::Own {
            return;
        }
        if ms == BEFORE_MS {
            for (subindex, every) in (1..).zip(streams::ALL) {
                let stream = Address::new(index::UART_STREAMS, subindex);
                ScenarioStep::Set(stream, Value::U16(every)).act(board);
            }
        }
        let others = Foot::ALL.into_iter().skip(1).take(3);
        for foot in others {
            let id = Pdo::Contact.cob_id(foot.default_node_id());
            // Arbitrary data: the bits of the time, mixed.
            let data = ms.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
            board.push_can(BusFrame::new(id, &data));
        }
        if ms.is_multiple_of(SYNC_MS) {
            board.push_can(BusFrame::new(0x080, &[]));
        }
        if ms > BEFORE_MS && ms.is_multiple_of(QUESTIONS_MS) {
            ScenarioStep::Request(Address::new(index::COUNTERS, 1)).act(board);
            board.push_can(BusFrame::new(0x611, &[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]));
        }
        if self == Self::FullWithFaults && ms > BEFORE_MS {
            match ms % DISTURBANCE_MS {
                0 => board.inject(Injection::Line(LineFault::Break)),
                1 => board.inject(Injection::Line(LineFault::None)),
                _ => {}
            }
        }
    }
}
