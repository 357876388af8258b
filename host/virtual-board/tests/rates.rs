//! New rates take effect with the next reset of the communication.

mod common;

use common::{boot_product, product};
use virtual_board::emulator::board::Board;
use virtual_board::emulator::part::usart::TimedByte;
use virtual_board::emulator::time::PER_SECOND;
use wire::dictionary::{SIGNATURE_STORE, index};
use wire::node::Command;
use wire::uart::{ConfigSet, Decoder, Message, NmtRequest, encode};
use wire::{Address, Value};

const MILLISECOND: u64 = PER_SECOND / 1000;

/// Sends a request over the serial line. Returns the bytes of the next 100 ms.
fn ask(board: &mut Board, message: &Message) -> Vec<TimedByte> {
    board.take_uart();
    board.push_uart(encode(0, message).as_bytes());
    board.run_for(100 * MILLISECOND).expect("it runs");
    board.take_uart()
}

fn set(object: u16, subindex: u8, value: Value) -> Message {
    Message::ConfigSet(ConfigSet {
        address: Address::new(object, subindex),
        value: value.into(),
    })
}

/// Shortest time from one byte to the next, µs.
fn micros_a_byte(bytes: &[TimedByte]) -> f64 {
    let gaps = bytes.windows(2).map(|pair| pair[1].time - pair[0].time);
    virtual_board::emulator::time::to_us(gaps.min().expect("bytes"))
}

#[test]
fn a_stored_serial_rate_applies_after_a_communication_reset() {
    let Some(elf) = product() else { return };
    let mut board = boot_product(&elf);
    board.run_for(300 * MILLISECOND).expect("it runs");
    let nmt = |command| Message::Nmt(NmtRequest(command));
    ask(&mut board, &nmt(Command::EnterPreOperational));
    ask(&mut board, &set(index::UART_RATE, 0, Value::U32(500_000)));
    let before = ask(
        &mut board,
        &set(index::STORE, 1, Value::U32(SIGNATURE_STORE)),
    );
    assert!((micros_a_byte(&before) - 10.0).abs() < 0.2);
    board.run_for(3_000 * MILLISECOND).expect("it runs");
    ask(&mut board, &nmt(Command::ResetCommunication));
    board.run_for(100 * MILLISECOND).expect("it runs");
    let after = board.take_uart();
    assert!((micros_a_byte(&after) - 20.0).abs() < 0.2);
    // Asserts that the output at the new rate is valid.
    let mut decoder = Decoder::default();
    let frames = after
        .iter()
        .filter_map(|sent| decoder.push(sent.byte))
        .filter(Result::is_ok)
        .count();
    assert!(frames >= 98, "{frames} frames in 100 ms");
}
