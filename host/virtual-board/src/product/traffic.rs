//! Additional traffic on the board's lines.

use wire::dictionary::index;
use wire::{Address, Foot, Pdo, Value};

use crate::emulator::board::Board;
use crate::emulator::part::can::BusFrame;
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
}

/// Period of SYNCs, and of requests, ms.
const SYNC_MS: u64 = 10;
const QUESTIONS_MS: u64 = 100;

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
    }
}
