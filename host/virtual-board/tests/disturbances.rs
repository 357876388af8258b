//! A short disturbance of the serial line: the foot answers again, and executes no command twice.

mod common;

use common::product;
use common::rig::{Rig, glitch, request_for_half_a_second};
use wire::Address;
use wire::dictionary::index;
use wire::node::Command;
use wire::uart::{ConfigGet, Message, NmtRequest, encode};

/// If the receiver is not emptied while the task waits after an error, it has overrun when it is read again, which
/// is the next error: requests every 1.1 ms or faster would never be answered again.
#[test]
fn requests_are_answered_again_after_a_serial_disturbance() {
    let Some(elf) = product() else { return };
    let mut rig = Rig::new(&elf);
    rig.run(500);
    assert!(request_for_half_a_second(&mut rig, 1_000) >= 495);
    glitch(&mut rig);
    rig.run_us(50);
    let meanwhile = request_for_half_a_second(&mut rig, 1_000);
    let later = request_for_half_a_second(&mut rig, 1_000);
    assert!(later >= 450, "{meanwhile} answers, then {later} of 500");
}

/// The same receiver overruns before its DMA is first started.
#[test]
fn a_foot_answers_if_requests_arrive_while_it_starts() {
    let Some(elf) = product() else { return };
    let mut rig = Rig::new(&elf);
    let meanwhile = request_for_half_a_second(&mut rig, 1_000);
    let later = request_for_half_a_second(&mut rig, 1_000);
    assert!(later >= 450, "{meanwhile} answers, then {later} of 500");
}

/// The HAL restarts the stream of DMA at the beginning of its buffer, but continues to read at the previous
/// position: without a countermeasure the old buffer is read again in each round, and its commands are executed.
/// RM0090 does not specify where a re-enabled stream continues; the board assumes the beginning.
#[test]
fn a_serial_disturbance_repeats_no_command() {
    const BUFFER: usize = 512;
    let Some(elf) = product() else { return };
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
    send(&mut rig, &nmt(Command::EnterPreOperational), BUFFER + 3);
    send(&mut rig, &nmt(Command::StartRemoteNode), BUFFER + 16);
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
