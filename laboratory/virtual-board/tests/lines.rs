//! The lines: short disturbances, frames that arrive faster than they are read, other rates.

use crate::common::rig::{RESET_COMMUNICATION, Rig, glitch};
use crate::common::{MILLISECOND, product};
use virtual_board::emulator::part::usart::TimedByte;
use virtual_board::emulator::time::to_us;
use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::uart::{ConfigGet, Message, NmtRequest, encode};
use wire::{Address, Fault, Value};

/// Sends serial requests every millisecond for half a second. Returns the number of answers.
fn request_for_half_a_second(rig: &mut Rig) -> usize {
    rig.forget();
    for _ in 0..500 {
        rig.uart_get(index::IDENTITY, 4);
        rig.run(1);
    }
    rig.uart_answers(index::IDENTITY).len()
}

/// If the receiver is not emptied while the task waits after an error, it has overrun when it is read again, which
/// is the next error: requests every 1.1 ms or faster would never be answered again.
#[test]
fn requests_are_answered_again_after_a_serial_disturbance() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(500);
    assert!(request_for_half_a_second(&mut rig) >= 495);
    glitch(&mut rig);
    rig.run_us(50);
    let meanwhile = request_for_half_a_second(&mut rig);
    let later = request_for_half_a_second(&mut rig);
    assert!(later >= 450, "{meanwhile} answers, then {later} of 500");
}

/// The same receiver overruns before its DMA is first started.
#[test]
fn a_foot_answers_if_requests_arrive_while_it_starts() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    let meanwhile = request_for_half_a_second(&mut rig);
    let later = request_for_half_a_second(&mut rig);
    assert!(later >= 450, "{meanwhile} answers, then {later} of 500");
}

/// The HAL restarts the stream of DMA at the beginning of its buffer, but continues to read at the previous
/// position: without a countermeasure the old buffer is read again in each round, and its commands are executed.
/// RM0090 does not specify where a re-enabled stream continues; the board assumes the beginning.
#[test]
fn a_serial_disturbance_repeats_no_command() {
    const BUFFER: usize = 512;
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(500);
    let address = Address::new(index::IDENTITY, 4);
    let get = Message::ConfigGet(ConfigGet { address });
    let nmt = |command| Message::Nmt(NmtRequest(command));
    let mut sent = 0;
    let mut send = |rig: &mut Rig, message: &Message, until: usize| {
        while sent < until {
            rig.send(message);
            sent += encode(0, message).as_bytes().len();
            rig.run(3);
        }
    };
    send(&mut rig, &get, 320);
    send(&mut rig, &nmt(NmtCommand::EnterPreOperational), BUFFER + 3);
    send(&mut rig, &nmt(NmtCommand::StartRemoteNode), BUFFER + 16);
    send(&mut rig, &get, BUFFER + 210);
    glitch(&mut rig);
    rig.run(50);
    rig.forget();
    for _ in 0..30 {
        rig.send(&get);
        rig.run(10);
    }
    let contacts = rig.contacts();
    let answers = rig.uart_answers(index::IDENTITY).len();
    assert!(contacts > 290, "{contacts} contacts in 300 ms");
    assert!(answers >= 29, "{answers} answers to 30 questions");
    assert!(answers <= 30, "{answers} answers to 30 questions");
}

/// Reception pauses in the interrupt of each half of its buffer. If the work of a tick interrupted that pause, bytes would
/// be lost: at 1 Mbaud it lasts as long as ten.
#[test]
fn a_tick_in_the_pause_of_reception_costs_no_byte() {
    const BUFFER: usize = 512;
    const MICROSECOND: u64 = MILLISECOND / 1000;
    const BYTE: u64 = 10 * MICROSECOND;
    // Common period of the ticks and the sensor's edges.
    const PERIOD: u64 = 3 * MILLISECOND;
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(500);
    rig.board.record_sensor_bus();
    rig.run(10);
    let samples = rig.board.take_transactions();
    let edge = samples.iter().rev().find_map(|sample| sample.edge).expect("an edge");
    // From 3 µs before the edge to 1 µs after it.
    for step in 0..40 {
        let half = edge + (4 + 3 * step) * PERIOD - 3 * MICROSECOND + step * MICROSECOND / 10;
        let start = half - BUFFER as u64 / 2 * BYTE;
        rig.board.run_until(start).expect("it runs");
        // Ends of frames without content, which need no answer.
        rig.board.push_uart(&[0; BUFFER]);
        rig.run(6);
    }
    rig.run(200);
    let health = rig.health().expect("a health message");
    assert_eq!(health.counters.get(wire::Counter::UartOverruns), 0);
}

/// Sends `syncs` SYNCs without a pause, `after_tick_us` after a tick. Returns the number lost, and whether the loss
/// was reported.
fn flood(elf: &[u8], syncs: usize, after_tick_us: u64) -> (u64, bool) {
    let mut rig = Rig::new(elf);
    rig.run(500);
    rig.run_us(after_tick_us);
    (0..syncs).for_each(|_| rig.can(0x080, &[]));
    let (codes, _) = rig.watch(100);
    let overruns = rig.board.cpu().machine().chip.can.overruns;
    (overruns, codes.contains(&Fault::CanOverrun.code()))
}

#[test]
fn every_frame_loss_and_nothing_else_is_reported() {
    let elf = product();
    let mut losses = 0;
    for syncs in [16, 22, 26, 30] {
        for after_tick_us in [0, 200, 600] {
            let (lost, reported) = flood(&elf, syncs, after_tick_us);
            assert_eq!(reported, lost > 0, "{lost} lost of {syncs}");
            losses += usize::from(lost > 0);
        }
    }
    assert!(losses > 2, "{losses} floods lost frames: too few for a test");
}

/// Shortest time from one byte to the next, µs.
fn micros_a_byte(bytes: &[TimedByte]) -> f64 {
    let gaps = bytes.windows(2).map(|pair| pair[1].time - pair[0].time);
    to_us(gaps.min().expect("bytes"))
}

/// Frames are sent until the last moment before the change, and each arrives whole.
#[test]
fn change_of_rate_cuts_no_byte() {
    const RATES: [u32; 4] = [115_200, 2_000_000, 9_600, 1_000_000];
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    for rate in RATES {
        rig.pre_operational();
        rig.uart_set(index::UART_RATE, 0, Value::U32(rate));
        rig.run(50);
        rig.store();
        rig.run(100);
        rig.operational();
        rig.run(200);
        rig.nmt(RESET_COMMUNICATION);
        rig.run(500);
    }
    assert_eq!((rig.resets(), rig.damaged), (vec![], 0));
}

/// A stored rate applies after a reset of the communication. At a slow rate contacts are still fresh.
#[test]
fn contacts_are_fresh_and_requests_answered_at_a_slow_rate() {
    const RATE: u32 = 115_200;
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    rig.pre_operational();
    rig.uart_set(index::UART_RATE, 0, Value::U32(RATE));
    rig.run(100);
    rig.store();
    rig.board.run_for(100 * MILLISECOND).expect("it runs");
    let before = micros_a_byte(&rig.board.take_uart());
    assert!((before - 10.0).abs() < 0.2, "{before} µs");
    rig.run(3_000);
    rig.nmt(RESET_COMMUNICATION);
    rig.run(500);
    rig.board.run_for(100 * MILLISECOND).expect("it runs");
    let after = micros_a_byte(&rig.board.take_uart());
    assert!((after - 1.0e7 / f64::from(RATE)).abs() < 2.0, "{after} µs");
    rig.forget();
    for _ in 0..5 {
        rig.uart_get(index::IDENTITY, 1);
        rig.run(100);
    }
    assert_eq!(rig.uart_answers(index::IDENTITY).len(), 5);
    let health = rig.messages.iter();
    let health = health.filter(|(_, sent)| matches!(sent, Message::Health(_)));
    assert!(health.count() >= 3);
    // The oldest contact waits for a tick, a batch of other messages, and its own bytes.
    let ages = rig.messages.iter().filter_map(|(time, sent)| match sent {
        Message::Contact(contact) => Some(to_us(*time) - contact.timestamp.as_micros() as f64),
        _ => None,
    });
    let ages: Vec<f64> = ages.collect();
    assert!(ages.len() > 80, "{} contacts in 500 ms", ages.len());
    let youngest = ages.iter().copied().fold(f64::INFINITY, f64::min);
    let oldest = ages.iter().copied().fold(0.0, f64::max);
    assert!(oldest - youngest < 1_100.0, "{youngest} to {oldest} µs");
}
