//! Traffic on the board's lines beyond its default: optional messages, other nodes, requests.

use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::uart::{ConfigSet, Message, NmtRequest, encode};
use wire::{Address, Foot, Pdo, Value};

use crate::emulator::board::{Board, Injection};
use crate::emulator::failure::Failure;
use crate::emulator::part::can::BusFrame;
use crate::emulator::part::usart::LineFault;
use crate::emulator::time::PER_SECOND;
use crate::product::scenario::{BEFORE_MS, ScenarioStep};

/// Traffic on the lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Traffic {
    /// The board's own frames, as it sends them by default.
    #[default]
    Own,
    /// As on a robot with four feet and a master that requests settings: all streams over the serial line; on CAN
    /// three more feet that send as much as this one, and a SYNC each 10 ms; requests over both lines each 100 ms.
    Full,
    /// [`Full`](Self::Full) with disturbances of the serial line, which the board reports as faults.
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
            for (subindex, every) in (1..).zip(ALL_STREAMS) {
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

/// Period of each kind of message on the serial line with all streams on, in ticks: contact, raw sample, health.
/// Contact and raw sample take 81 of the 100 bytes that 1 Mbaud carries in a millisecond, so health cannot be sent
/// with each.
pub const ALL_STREAMS: [u16; 3] = [1, 1, 10];

/// Runs the board for a quarter of a second from power-up and enables all messages: all kinds over the serial line
/// ([`ALL_STREAMS`]), next to the seven process data objects and the heartbeat on CAN, which are always sent.
///
/// # Errors
/// As [`Board::run_for`].
pub fn turn_all_streams_on(board: &mut Board) -> Result<(), Failure> {
    const STARTED: u64 = PER_SECOND / 5;
    const ANSWERED: u64 = PER_SECOND / 20;
    board.record_sensor_bus();
    board.run_for(STARTED)?;
    let nmt = |command| Message::Nmt(NmtRequest(command));
    let every = (1..).zip(ALL_STREAMS).map(|(subindex, every)| {
        Message::ConfigSet(ConfigSet {
            address: Address::new(index::UART_STREAMS, subindex),
            value: Value::U16(every).into(),
        })
    });
    let requests = core::iter::once(nmt(NmtCommand::EnterPreOperational))
        .chain(every)
        .chain([nmt(NmtCommand::StartRemoteNode)]);
    for (sequence, request) in (0..).zip(requests) {
        board.push_uart(encode(sequence, &request).as_bytes());
    }
    board.run_for(ANSWERED)
}
