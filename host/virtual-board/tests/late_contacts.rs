//! Contact frames are never old: neither behind answers on the serial line, nor because of a load that is no
//! longer sent.

mod common;

use common::{boot_product, product};
use estimator_core::Decision;
use lsm6dsox::sim::PartFault as Sensor;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::part::usart::TimedByte;
use virtual_board::emulator::time::{PER_SECOND, to_us};
use virtual_board::product::scenario::ScenarioStep;
use wire::dictionary::index;
use wire::node::Command;
use wire::uart::{Answer, ConfigSet, Decoder, Message, NmtRequest, encode};
use wire::{AbortCode, Address, Value};

const MILLISECOND: u64 = PER_SECOND / 1000;

/// Time for which a fault of the sensor cannot be detected, µs, as in the fault matrix: one tick, and the frames
/// on their way.
const ONE_TICK_US: f64 = 1_700.0;

/// Messages in a stream of bytes, with the times at which their last bytes had left.
fn messages(bytes: &[TimedByte]) -> Vec<(u64, Message)> {
    let mut decoder = Decoder::new();
    let mut sound = Vec::new();
    for sent in bytes {
        if let Some(Ok(frame)) = decoder.push(sent.byte) {
            sound.push((sent.time, frame.message));
        }
    }
    sound
}

fn says_stable(message: &Message) -> bool {
    matches!(message, Message::Contact(contact)
        if contact.status.decision() == Decision::Stable)
}

/// Time of the last "stable" on the serial line after the sensor has failed, µs, with answers to requests sent 12
/// ms before, and the number of contacts in the meantime.
fn last_stable_us(elf: &[u8], phase_us: u64) -> (f64, usize) {
    let mut board = boot_product(elf);
    let phase = phase_us * MILLISECOND / 1000;
    board.run_for(1_000 * MILLISECOND + phase).expect("it runs");
    board.take_uart();
    ScenarioStep::Flood(1_000).act(&mut board);
    board.run_for(12 * MILLISECOND).expect("it runs");
    let at = board.now();
    board.inject(Injection::Sensor(Sensor::MisoStuckLow));
    board.run_for(20 * MILLISECOND).expect("it runs");
    let sent = messages(&board.take_uart());
    let is_answer = |message: &Message| matches!(message, Message::ConfigResponse(_));
    let answers = sent.iter().filter(|(_, sent)| is_answer(sent)).count();
    assert!(answers > 20, "{answers} answers are too few for a flood");
    let stable = sent.iter().rfind(|(_, message)| says_stable(message));
    let (time, _) = stable.expect("it was stable before");
    let contacts = sent
        .iter()
        .filter(|(_, message)| matches!(message, Message::Contact(_)))
        .count();
    (to_us(time.saturating_sub(at)), contacts)
}

#[test]
fn a_command_flood_delays_no_serial_contact() {
    let Some(elf) = product() else { return };
    for phase_us in [0, 130, 283, 566, 850] {
        let (late_us, contacts) = last_stable_us(&elf, phase_us);
        println!("{phase_us}: {late_us} µs, {contacts} contacts in 32 ms");
        assert!(late_us <= ONE_TICK_US, "{late_us} µs late at {phase_us} µs");
        assert!(contacts >= 24, "{contacts} contacts in 32 ms");
    }
}

#[test]
fn contacts_are_fresh_and_requests_answered_at_a_slow_rate() {
    const RATE: u32 = 115_200;
    let Some(elf) = product() else { return };
    let mut board = boot_product(&elf);
    board.run_for(300 * MILLISECOND).expect("it runs");
    let store = Value::U32(wire::dictionary::SIGNATURE_STORE);
    for message in [
        Message::Nmt(NmtRequest(Command::EnterPreOperational)),
        set(Address::new(index::UART_RATE, 0), Value::U32(RATE)),
        set(Address::new(index::STORE, 1), store),
    ] {
        board.push_uart(encode(0, &message).as_bytes());
        board.run_for(100 * MILLISECOND).expect("it runs");
    }
    board.run_for(3_000 * MILLISECOND).expect("it runs");
    let reset = Message::Nmt(NmtRequest(Command::ResetCommunication));
    board.push_uart(encode(0, &reset).as_bytes());
    board.run_for(500 * MILLISECOND).expect("it runs");
    board.take_uart();
    for _ in 0..5 {
        ScenarioStep::Request(Address::new(index::IDENTITY, 1)).act(&mut board);
        board.run_for(100 * MILLISECOND).expect("it runs");
    }
    let sent = messages(&board.take_uart());
    let count = |is: fn(&Message) -> bool| sent.iter().filter(|(_, sent)| is(sent)).count();
    assert_eq!(count(|sent| matches!(sent, Message::ConfigResponse(_))), 5);
    assert!(count(|sent| matches!(sent, Message::Health(_))) >= 3);
    // The oldest contact waits for a tick, a batch of other messages, and its own bytes.
    let ages: Vec<f64> = sent
        .iter()
        .filter_map(|(time, message)| match message {
            Message::Contact(contact) => Some(to_us(*time) - contact.timestamp.as_micros() as f64),
            _ => None,
        })
        .collect();
    assert!(ages.len() > 80, "{} contacts in 500 ms", ages.len());
    let youngest = ages.iter().copied().fold(f64::INFINITY, f64::min);
    let oldest = ages.iter().copied().fold(0.0, f64::max);
    println!("{} contacts, {youngest} to {oldest} µs", ages.len());
    assert!(oldest - youngest < 1_100.0, "{youngest} to {oldest} µs");
}

fn set(address: Address, value: Value) -> Message {
    Message::ConfigSet(ConfigSet {
        address,
        value: value.into(),
    })
}

#[test]
fn a_load_that_is_no_longer_sent_expires() {
    let Some(elf) = product() else { return };
    let mut board = boot_product(&elf);
    board.run_for(300 * MILLISECOND).expect("it runs");
    let timer = Address::new(index::RPDO, 5);
    let mut write = |value| {
        for message in [
            Message::Nmt(NmtRequest(Command::EnterPreOperational)),
            set(timer, Value::U16(value)),
        ] {
            board.push_uart(encode(0, &message).as_bytes());
        }
        board.run_for(50 * MILLISECOND).expect("it runs");
        let sent = messages(&board.take_uart());
        sent.iter().rev().find_map(|(_, sent)| match sent {
            Message::ConfigResponse(response) => Some(response.answer),
            _ => None,
        })
    };
    for value in [u16::MAX, 1_001] {
        let refused = Answer::Refused(AbortCode::TooHigh);
        assert_eq!(write(value), Some(refused));
    }
    assert_eq!(write(0), Some(Answer::Refused(AbortCode::TooLow)));
    assert_eq!(write(1_000), Some(Answer::Done));
}
