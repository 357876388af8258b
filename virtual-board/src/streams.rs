//! Asks a board for more than it sends by itself.

use wire::dictionary::index;
use wire::node::Command;
use wire::uart::{ConfigSet, Message, NmtRequest, encode};
use wire::{Address, Value};

use crate::board::Board;
use crate::failure::Failure;
use crate::time::PER_SECOND;

/// How often each kind of message goes over the serial line with all streams on, in ticks:
/// contact, raw sample, health. Contact and raw sample take 81 of the 100 bytes that 1 Mbaud
/// carries in a millisecond, so health cannot come with each.
pub const ALL: [u16; 3] = [1, 1, 10];

/// Runs the board for a quarter of a second from power-up and has it send all that it can: all
/// kinds of message over the serial line ([`ALL`]), next to the seven process data objects and the
/// heartbeat on CAN, which it sends by itself.
///
/// # Errors
/// As [`Board::run_for`].
pub fn turn_all_on(board: &mut Board) -> Result<(), Failure> {
    const STARTED: u64 = PER_SECOND / 5;
    const ANSWERED: u64 = PER_SECOND / 20;
    board.record_sensor_bus();
    board.run_for(STARTED)?;
    let nmt = |command| Message::Nmt(NmtRequest(command));
    let every = (1..).zip(ALL).map(|(subindex, every)| {
        Message::ConfigSet(ConfigSet {
            address: Address::new(index::UART_STREAMS, subindex),
            value: Value::U16(every).into(),
        })
    });
    let requests = core::iter::once(nmt(Command::EnterPreOperational))
        .chain(every)
        .chain([nmt(Command::StartRemoteNode)]);
    for (sequence, request) in (0..).zip(requests) {
        board.push_uart(encode(sequence, &request).as_bytes());
    }
    board.run_for(ANSWERED)
}
