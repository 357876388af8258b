//! Enables the optional messages of a board.

use wire::dictionary::index;
use wire::node::Command;
use wire::uart::{ConfigSet, Message, NmtRequest, encode};
use wire::{Address, Value};

use crate::emulator::board::Board;
use crate::emulator::failure::Failure;
use crate::emulator::time::PER_SECOND;

/// Period of each kind of message on the serial line with all streams on, in ticks: contact, raw sample, health.
/// Contact and raw sample take 81 of the 100 bytes that 1 Mbaud carries in a millisecond, so health cannot be sent
/// with each.
pub const ALL: [u16; 3] = [1, 1, 10];

/// Runs the board for a quarter of a second from power-up and enables all messages: all kinds over the serial line
/// ([`ALL`]), next to the seven process data objects and the heartbeat on CAN, which are always sent.
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
