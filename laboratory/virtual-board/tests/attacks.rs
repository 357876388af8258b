//! Attacks on a foot: several faults at once, requests at an inconvenient moment, lines that are never quiet.

use crate::common::rig::{
    OPERATIONAL, PRE_OPERATIONAL, RESET_COMMUNICATION, RESET_NODE, Rig, STOP,
};
use crate::common::{MILLISECOND, product};
use lsm6dsox::sim::PartFault as SensorFault;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::part::can::BusFault;
use virtual_board::emulator::part::rcc::ResetCause;
use wire::dictionary::index;
use wire::uart::Message;
use wire::{Fault, Value};

/// The foot keeps one pending request, which a weaker one must not replace.
#[test]
fn a_node_reset_is_not_replaced_by_a_communication_reset() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    rig.nmt(RESET_NODE);
    rig.nmt(RESET_COMMUNICATION);
    rig.run(100);
    assert_eq!(rig.resets(), [ResetCause::Software]);
}

/// Answers that occupy the whole line must leave room for the log and for health messages.
#[test]
fn a_serial_request_flood_does_not_hide_the_fault() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(500);
    for _ in 0..5 {
        (0..75).for_each(|_| rig.uart_get(index::IDENTITY, 4));
        rig.run(10);
    }
    rig.forget();
    rig.inject(Injection::Sensor(SensorFault::MisoStuckLow));
    for _ in 0..50 {
        (0..75).for_each(|_| rig.uart_get(index::IDENTITY, 4));
        rig.run(10);
    }
    let wrong = Fault::SensorWrongId;
    let named = rig.messages.iter().any(|(_, message)| match message {
        Message::Log(line) => line.text() == wrong.name(),
        Message::Health(health) => health.faults.contains(wrong),
        _ => false,
    });
    assert!(named, "the fault has no name after 500 ms");
}

#[test]
fn a_store_is_answered_during_node_stop_and_reset() {
    let elf = product();
    for command in [RESET_COMMUNICATION, STOP, PRE_OPERATIONAL] {
        for us in [0, 1_000] {
            let mut rig = Rig::new(&elf);
            rig.run(100);
            rig.store();
            rig.run_us(us);
            rig.nmt(command);
            rig.run(50);
            assert_eq!(rig.answers().len(), 1, "{command:#x} after {us} µs");
            rig.forget();
            rig.nmt(OPERATIONAL);
            rig.store();
            rig.run(50);
            let answers = rig.answers();
            assert_eq!(answers.len(), 1, "{command:#x} after {us} µs, again");
            assert_eq!(answers[0][0], 0x60);
        }
    }
}

#[test]
#[ignore = "full: 8000 settings on both lines"]
fn continuous_settings_on_both_lines_cost_no_tick() {
    let elf = product();
    for (index, subindex, values) in [
        (index::WINDOW, 0, [Value::U32(1_000), Value::U32(256_000)]),
        (index::ESTIMATION, 1, [Value::U8(0), Value::U8(1)]),
        (index::LEARNT, 10, [Value::F32(0.0), Value::F32(1.0)]),
    ] {
        let mut rig = Rig::new(&elf);
        rig.run(100);
        rig.nmt(PRE_OPERATIONAL);
        rig.run(100);
        rig.forget();
        for _ in 0..20 {
            for value in [values; 40].into_iter().flatten() {
                rig.sdo_write(index, subindex, value.to_raw());
                rig.uart_set(index, subindex, value);
            }
            rig.run(20);
        }
        rig.run(700);
        let health = rig.health().expect("a health message");
        assert_eq!(health.counters.get(wire::Counter::LateTicks), 0);
        assert!(rig.answers().len() > 200);
        assert_eq!(rig.resets(), []);
    }
}

#[test]
#[ignore = "full: a controller that ignores aborts, 10 s of virtual time"]
fn a_controller_that_ignores_aborts_stops_only_can() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    rig.inject(Injection::Bus(BusFault::AbortIgnored));
    rig.run(100);
    rig.forget();
    rig.run(2_500);
    assert_eq!((rig.resets(), rig.contacts()), (vec![], 0));
    let is_contact = |message: &&(u64, Message)| matches!(message.1, Message::Contact(_));
    let serial = rig.messages.iter().filter(is_contact).count();
    assert!(serial > 2_490, "{serial} contacts");
    rig.inject(Injection::Clear);
    rig.run(10);
    rig.forget();
    rig.run(100);
    assert!(rig.contacts() >= 99, "{} contacts", rig.contacts());
}

/// Twelve drives beside the foot receive their process data each millisecond, which leaves the bus little room.
#[test]
fn frames_for_other_nodes_displace_no_command() {
    const MILLISECONDS: u64 = 5;
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    let beside_drives = |rig: &mut Rig, command: &dyn Fn(&mut Rig)| {
        for ms in 0..MILLISECONDS {
            for drive in 0x21..0x2D {
                rig.can(0x200 + drive, &[0; 2]);
                if ms == 1 && drive == 0x26 {
                    command(rig);
                }
            }
            rig.run(1);
        }
    };
    let state = |rig: &mut Rig, command| {
        beside_drives(rig, &|rig| rig.nmt(command));
        rig.forget();
        beside_drives(rig, &|_| {});
        rig.contacts()
    };
    let mut obeyed = 0;
    for _ in 0..20 {
        let stopped = state(&mut rig, STOP) == 0;
        obeyed += usize::from(stopped && state(&mut rig, OPERATIONAL) > 0);
    }
    let request = |rig: &mut Rig| rig.sdo_read(index::IDENTITY, 4);
    rig.forget();
    (0..50).for_each(|_| beside_drives(&mut rig, &request));
    rig.run(10);
    assert_eq!((obeyed, rig.answers().len()), (20, 50));
}

#[test]
fn a_node_id_from_lss_replaces_the_old_one() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(100);
    let answering = |rig: &mut Rig| {
        [0x11, 0x2A].map(|node| {
            rig.forget();
            rig.can(0x600 + node, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]);
            rig.run(10);
            rig.count(0x580 + u32::from(node))
        })
    };
    assert_eq!(answering(&mut rig), [1, 0]);
    // Configuration state, node id, waiting state.
    for request in [[0x04, 1], [0x11, 0x2A], [0x04, 0]] {
        rig.can(0x7E5, &[request[0], request[1], 0, 0, 0, 0, 0, 0]);
        rig.run(5);
    }
    rig.nmt(RESET_COMMUNICATION);
    rig.run(100);
    assert_eq!(answering(&mut rig), [0, 1]);
    // The controller is restarted, and the id stays.
    rig.can(0x000, &[RESET_COMMUNICATION, 0]);
    rig.run(100);
    assert_eq!(answering(&mut rig), [0, 1]);
}

/// More frames than the foot can process, on both lines, for longer than the watchdog's timeout: each task that
/// waits for room wakes the other.
#[test]
#[ignore = "full: 5 s of frames without a pause"]
fn continuous_frames_on_both_lines_do_not_trip_the_watchdog() {
    let elf = product();
    for id in [0x611, 0x080] {
        let mut rig = Rig::new(&elf);
        rig.run(100);
        for _ in 0..125 {
            (0..420).for_each(|_| rig.can(id, &[]));
            (0..150).for_each(|_| rig.uart_get(index::IDENTITY, 4));
            rig.run(20);
        }
        assert_eq!(rig.resets(), [], "{id:#x}");
        let health = rig.health().expect("a health message");
        assert_eq!(health.counters.get(wire::Counter::LateTicks), 0);
    }
}

/// A byte each 3.3 µs for longer than the watchdog's timeout: the receiver always finds the next one.
#[test]
#[ignore = "full: 8 s of bytes without a pause"]
fn an_unbroken_serial_stream_stops_no_sender() {
    const BYTES_PER_MS: usize = 300;
    let elf = product();
    for length in [201, 1, 0] {
        let mut rig = Rig::new(&elf);
        rig.run(100);
        set_rate(&mut rig, index::UART_RATE, 3_000_000);
        rig.forget();
        let mut state = 1_u32;
        for _ in 0..250 {
            let bytes: Vec<u8> = (1..=10 * BYTES_PER_MS)
                .map(|at| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    match length {
                        0 => (state >> 24) as u8,
                        _ if at.is_multiple_of(length) => 0,
                        _ => 0x55,
                    }
                })
                .collect();
            rig.board.push_uart(&bytes);
            rig.run(10);
        }
        assert_eq!(rig.resets(), [], "frames of {length}");
        let is_contact = |message: &&(u64, Message)| matches!(message.1, Message::Contact(_));
        let serial = rig.messages.iter().filter(is_contact).count();
        let contacts = [rig.contacts(), serial];
        assert!(contacts.iter().all(|count| *count > 2_490), "frames of {length}: {contacts:?}");
        let health = rig.health().expect("a health message");
        assert_eq!(health.counters.get(wire::Counter::UartOverruns), 0, "frames of {length}");
    }
}

fn set_rate(rig: &mut Rig, index: u16, rate: u32) {
    rig.nmt(PRE_OPERATIONAL);
    rig.run(3);
    rig.sdo_write(index, 0, rate);
    rig.run(3);
    rig.store();
    rig.run(20);
    rig.nmt(OPERATIONAL);
    rig.run(10);
    rig.nmt(RESET_COMMUNICATION);
    rig.run(300);
    rig.nmt(OPERATIONAL);
    rig.run(50);
}

#[test]
fn the_lines_change_rates_and_back_while_in_use() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(100);
    for (index, rate) in [
        (index::UART_RATE, 9_600),
        (index::UART_RATE, 3_000_000),
        (index::CAN_BIT_RATE, 500),
        (index::UART_RATE, 1_000_000),
        (index::CAN_BIT_RATE, 1_000),
    ] {
        set_rate(&mut rig, index, rate);
        rig.forget();
        rig.uart_get(index::IDENTITY, 4);
        rig.sdo_read(index::IDENTITY, 4);
        rig.run(200);
        assert_eq!(rig.answers().len(), 1, "{index:#x} {rate}");
        let answers = rig.uart_answers(index::IDENTITY).len();
        assert_eq!(answers, 1, "{index:#x} {rate}");
        assert!(rig.contacts() > 195, "{index:#x} {rate}");
    }
    assert_eq!(rig.resets(), []);
    assert_eq!(rig.emergencies(), [0_u16; 0]);
}

#[test]
fn a_three_second_debugger_halt_leaves_nothing_stable() {
    let elf = product();
    for us in [0, 700] {
        let mut rig = Rig::new(&elf);
        rig.run(600);
        rig.run_us(us);
        rig.forget();
        let at = rig.board.now();
        rig.inject(Injection::DebuggerHalt(3_000));
        rig.inject(Injection::Sensor(SensorFault::MisoStuckLow));
        rig.run(3_200);
        let last = rig.stable().into_iter().map(|(time, _)| time - at).max();
        assert!(last < Some(MILLISECOND), "{last:?}");
        assert_eq!(rig.resets(), []);
        let late = Fault::LateTick.code();
        let codes = rig.emergencies();
        assert!(!codes.is_empty() && !codes.contains(&late), "{codes:x?}");
        rig.inject(Injection::Clear);
        rig.run(500);
        let (_, contacts) = rig.watch(500);
        assert!((499..=501).contains(&contacts), "{contacts}");
    }
}

/// Largest number of emergencies of a flickering bus in [`FLICKER_S`]: each fault on it is reported once.
const FLICKER_EMERGENCIES: usize = 4;
const FLICKER_S: u32 = 4;

#[test]
#[ignore = "full: 4 s of a flickering bus"]
fn a_flickering_bus_gets_few_emergencies() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(500);
    rig.forget();
    for _ in 0..FLICKER_S * 250 {
        rig.inject(Injection::Bus(BusFault::NoAcknowledge));
        rig.run(2);
        rig.inject(Injection::Bus(BusFault::None));
        rig.run(2);
    }
    let emergencies = rig.emergencies();
    let passive = Fault::CanErrorPassive.code();
    assert!(emergencies.contains(&passive), "{emergencies:#x?}");
    assert!(emergencies.len() <= FLICKER_EMERGENCIES, "{emergencies:#x?}");
    assert_eq!(rig.resets(), []);
}
