//! CAN and UART: requests, settings, floods, and missing receivers.

use crate::bench::Bench;
use ::storage::{Erase, Origin, StoreFailed};
use estimator_core::{Flag, ImuSample, Phase, Timestamp, Validity};
use firmware::ports::{Input, Reloaded, Request};
use firmware::sampling::{Activity, Measurement, ReadAt, SensorFault, Tick};
use firmware::supervision::{CrashReason, CrashRecord, Worker};
use firmware::{Foot, Ports, Start};
use lsm6dsox::imu::missing_sample;
use wire::dictionary::{SIGNATURE_RESTORE, SIGNATURE_STORE, index};
use wire::node::{BootCause, Command, State};
use wire::uart::{Answer, Decoder, Message};
use wire::{AbortCode, Address, CanFrame, Counter, Fault, Faults, Settings, Value};

const WINDOW: Address = Address::new(index::WINDOW, 0);
const LOAD_SOURCE: Address = Address::new(index::LOAD_INPUT, 1);
const STORE: Address = Address::new(index::STORE, 1);

fn bench() -> Bench {
    Bench::new(Settings::default()).running()
}

/// A bench whose settings are writable.
fn open() -> Bench {
    let mut bench = bench();
    bench.command(Command::EnterPreOperational);
    bench.still();
    bench
}

fn settings(changes: &[(Address, Value)]) -> Settings {
    let mut settings = Settings::default();
    for (address, value) in changes {
        settings.set(*address, *value).expect("allowed");
    }
    settings
}

/// SDO download of at most four bytes.
fn sdo_write(address: Address, value: Value, size: u8) -> CanFrame {
    let [i0, i1] = address.index.to_le_bytes();
    let [a, b, c, d] = value.to_raw().to_le_bytes();
    let command = 0x23 | (4 - size) << 2;
    let bytes = [command, i0, i1, address.subindex, a, b, c, d];
    CanFrame::new(0x611, &bytes).expect("a frame")
}

fn receive(bench: &mut Bench, frame: CanFrame) {
    let at = bench.foot.estimate().timestamp;
    assert!(bench.ports.try_put(Input::Can(frame, at)));
    bench.still();
}

/// Answer of the SDO server in the last tick.
fn sdo_answer(bench: &Bench) -> [u8; 8] {
    let mut answers = bench.can.iter().filter(|frame| frame.id() == 0x591);
    let answer = answers.next().expect("an answer");
    *answer.data8().expect("eight bytes")
}

#[test]
fn a_rejected_value_changes_nothing_and_is_reported_twice() {
    let too_long = Value::U32(1_000_000);
    let mut bench = open();
    let before = bench.foot.settings().clone();
    let estimate = *bench.foot.estimate();
    bench.set(WINDOW, too_long);
    bench.still();
    assert_eq!(bench.answers(), [Answer::Refused(AbortCode::TooHigh)]);
    receive(&mut bench, sdo_write(WINDOW, too_long, 4));
    assert_eq!(sdo_answer(&bench), [0x80, 0x10, 0x20, 0, 0x31, 0, 9, 6]);
    // A value within its own limits that does not fit the other settings.
    bench.set(Address::new(index::LOAD_INPUT, 5), Value::F32(1.0e6));
    bench.still();
    assert_eq!(bench.answers(), [Answer::Refused(AbortCode::Incompatible)]);
    assert_eq!(*bench.foot.settings(), before);
    // The estimator was not replaced.
    assert_eq!(bench.foot.estimate().flags, estimate.flags);
    bench.command(Command::StartRemoteNode);
    bench.set(WINDOW, Value::U32(10_000));
    bench.still();
    assert_eq!(bench.answers(), [Answer::Refused(AbortCode::DeviceState)]);
    assert_eq!(*bench.foot.settings(), before);
}

/// Number of samples from the moment up is known until the window is full.
fn ticks_to_full_window(bench: &mut Bench) -> u32 {
    use estimator_core::Flag;
    let mut ticks = 0;
    let mut filled = 0;
    for _ in 0..2000 {
        bench.still();
        let flags = bench.foot.estimate().flags;
        if flags.contains(Flag::AttitudeNotInitialised) {
            continue;
        }
        ticks += 1;
        if flags.contains(Flag::WindowNotFull) {
            filled = ticks;
        }
    }
    filled + 1
}

#[test]
fn a_new_window_takes_effect_with_the_next_tick() {
    let mut bench = open();
    bench.set(Address::new(index::ESTIMATION, 1), Value::U8(1));
    bench.still();
    for (micros, samples) in [(10_000, 10), (200_000, 200)] {
        bench.set(WINDOW, Value::U32(micros));
        bench.still();
        assert_eq!(bench.answers(), [Answer::Done]);
        bench.still();
        // A new estimator first determines up.
        assert!(bench.foot.estimate().flags.are_doubt());
        assert_eq!(ticks_to_full_window(&mut bench), samples);
    }
}

#[test]
fn streams_can_be_switched_off_and_thinned_out() {
    let mut bench = open();
    let contact = Address::new(index::TPDO, 1);
    bench.set(contact, Value::U32(0xC000_0180 + 0x11));
    bench.set(Address::new(index::UART_STREAMS, 1), Value::U16(10));
    bench.set(Address::new(index::UART_STREAMS, 2), Value::U16(4));
    bench.command(Command::StartRemoteNode);
    bench.still();
    let (mut contacts, mut raws) = (0, 0);
    for _ in 0..1000 {
        bench.still();
        assert_eq!(bench.contact(), None);
        contacts += bench
            .uart
            .iter()
            .filter(|m| matches!(m, Message::Contact(_)))
            .count();
        raws += bench
            .uart
            .iter()
            .filter(|m| matches!(m, Message::Raw(_)))
            .count();
    }
    assert_eq!((contacts, raws), (100, 250));
}

#[test]
fn a_minute_without_a_receiver_costs_frames_but_no_tick() {
    let mut bench = bench();
    bench.can_listens = false;
    bench.uart_listens = false;
    let dropped = bench.foot.counters().dropped();
    let mut valid = 0_u32;
    for tick in 0..60_000 {
        if tick == 30_000 {
            // An answer that is read later.
            bench.set(WINDOW, Value::U32(10_000));
        }
        bench.still();
        valid += u32::from(!bench.foot.estimate().flags.are_doubt());
    }
    assert_eq!(valid, 60_000);
    // 1 + 4/20 + 1/1000 + 1/100 frames per tick on CAN and 2 in 500 ms; 1 + 1/100 on the UART.
    let dropped = bench.foot.counters().dropped() - dropped;
    assert!((130_000..140_000).contains(&dropped), "{dropped}");
    bench.can_listens = true;
    bench.uart_listens = true;
    bench.still();
    // The first frames are of the last few ticks: 16 frames, some of which are not contacts.
    let newest = bench.foot.estimate().timestamp;
    let oldest = bench.uart.iter().find_map(|message| match message {
        Message::Contact(contact) => Some(contact.timestamp),
        _ => None,
    });
    let age = newest
        .micros_since(oldest.expect("contacts"))
        .expect("older");
    assert!(age <= 10_000, "{age} µs");
    assert_eq!(bench.answers(), [Answer::Refused(AbortCode::DeviceState)]);
    let mut contacts = bench.can.iter().filter(|frame| frame.id() == 0x191);
    let last = contacts.next_back().expect("contacts");
    let now = (newest.as_micros() / 10) as u16;
    assert_eq!(last.data()[4..6], now.to_le_bytes());
    // The next health frames report the loss.
    let reported = (0..200).find_map(|_| {
        bench.still();
        let health = bench.can.iter().find(|frame| frame.id() == 0x511)?;
        Some(health.data()[2])
    });
    assert_eq!(reported, Some(bench.foot.counters().dropped() as u8));
}

#[test]
fn frames_withdrawn_by_the_board_are_counted() {
    let mut bench = bench();
    let before = bench.foot.counters().get(Counter::CanDropped);
    assert!(bench.ports.try_put(Input::CanWithdrawn(3)));
    bench.still();
    let dropped = bench.foot.counters().get(Counter::CanDropped) - before;
    assert_eq!(dropped, 3);
}

#[test]
fn a_store_is_answered_when_done_and_its_failure_is_a_fault() {
    let signature = Value::U32(SIGNATURE_STORE);
    for (result, by_uart, by_sdo) in [
        (Ok(()), Answer::Done, 0x60),
        (
            Err(StoreFailed::Flash),
            Answer::Refused(AbortCode::Hardware),
            0x80,
        ),
    ] {
        let mut bench = open();
        bench.set(STORE, signature);
        bench.still();
        assert_eq!(bench.answers(), []);
        let request = bench.ports.try_next_request();
        let settings = bench.foot.settings().clone();
        assert_eq!(request, Some(Request::Store(settings, Erase::Allowed)));
        // A second store is rejected meanwhile.
        bench.set(STORE, signature);
        bench.still();
        assert_eq!(bench.answers(), [Answer::Refused(AbortCode::Hardware)]);
        assert!(bench.ports.try_put(Input::Stored(result)));
        bench.still();
        assert_eq!(bench.answers(), [by_uart]);
        assert_eq!(
            bench.foot.faults().contains(Fault::ConfigStore),
            result.is_err()
        );

        receive(&mut bench, sdo_write(STORE, signature, 4));
        assert!(matches!(
            bench.ports.try_next_request(),
            Some(Request::Store(..))
        ));
        assert!(!bench.can.iter().any(|frame| frame.id() == 0x591));
        assert!(bench.ports.try_put(Input::Stored(result)));
        bench.still();
        assert_eq!(sdo_answer(&bench)[0], by_sdo);

        bench.set(
            Address::new(index::RESTORE, 1),
            Value::U32(SIGNATURE_RESTORE),
        );
        bench.still();
        assert_eq!(
            bench.ports.try_next_request(),
            Some(Request::Restore(Erase::Allowed))
        );
        assert!(bench.ports.try_put(Input::Stored(Ok(()))));
        bench.still();
        assert_eq!(bench.answers(), [Answer::Done]);
        assert!(!bench.foot.faults().contains(Fault::ConfigStore));
    }
}

#[test]
fn a_communication_reset_loads_stored_settings_and_reboots() {
    let mut bench = bench();
    bench.command(Command::ResetCommunication);
    bench.still();
    assert_eq!(bench.ports.try_next_request(), Some(Request::Reload));
    assert_eq!(bench.contact(), None);
    let stored = settings(&[(Address::new(index::NODE_ID, 0), Value::U8(0x20))]);
    bench.ports.reload(Reloaded {
        settings: stored.clone(),
        origin: Origin::Stored,
    });
    bench.still();
    assert_eq!(bench.can[0], CanFrame::new(0x720, &[0]).expect("boot-up"));
    assert_eq!(*bench.foot.settings(), stored);
    // The master that requested the reset configures and starts the foot.
    assert_eq!(bench.contact(), None);
    bench.command(Command::StartRemoteNode);
    bench.still();
    assert!(bench.contact().is_some());
    bench.command(Command::ResetNode);
    bench.still();
    assert_eq!(bench.ports.try_next_request(), Some(Request::Reset));
}

#[test]
fn old_faults_are_reported_at_start_and_the_crash_is_cleared() {
    let crash = CrashRecord {
        reason: CrashReason::HardFault,
        program_counter: 0x0800_1234,
    };
    let start = Start {
        serial: 7,
        cause: BootCause::PowerUp,
        crash: Some(crash.into()),
        origin: Origin::Corrupted,
        unused_crystal_khz: None,
        brown_out_level: 3,
        program: wire::node::Program::default(),
    };
    let mut bench = Bench::with_start(Settings::default(), start);
    bench.still();
    assert_eq!(bench.can[0].id(), 0x711);
    let reported: Vec<_> = bench
        .emergencies()
        .iter()
        .map(|e| (e.code, e.detail))
        .collect();
    assert_eq!(reported, [(0x6300, 0), (0x6102, 0x0800_1234)]);
    let mut bench = bench.running();
    for _ in 0..10_000 {
        bench.still();
    }
    assert_eq!(
        bench.foot.faults(),
        Faults::NONE.with(Fault::ConfigCorrupted)
    );
    // The crash reason itself can still be read.
    let last_crash = Address::new(index::LAST_CRASH, 2);
    bench.ask(&Message::ConfigGet(wire::uart::ConfigGet {
        address: last_crash,
    }));
    bench.still();
    assert_eq!(
        bench.answers(),
        [Answer::Value(Value::U32(0x0800_1234).into())]
    );
}

#[test]
fn an_analog_load_gives_a_stance_and_an_open_input_a_fault() {
    let settings = settings(&[
        (LOAD_SOURCE, Value::U8(1)),
        (Address::new(index::LOAD_INPUT, 2), Value::F32(0.5)),
        (Address::new(index::LOAD_INPUT, 3), Value::F32(1000.0)),
    ]);
    let mut bench = Bench::new(settings).running();
    let phase = |bench: &mut Bench, reading: Option<u16>| {
        for _ in 0..120 {
            bench.still_with(reading);
        }
        bench.contact().expect("a contact frame").status.phase()
    };
    // 0.5 N per step from 1000 on: 50 N and 1 N; loaded from 12 N on.
    assert_eq!(phase(&mut bench, Some(1100)), Phase::Stance);
    assert_eq!(phase(&mut bench, Some(1002)), Phase::QuietSwing);
    for broken in [Some(0), Some(4095), None] {
        assert_eq!(phase(&mut bench, broken), Phase::Unknown, "{broken:?}");
        assert!(
            bench.foot.faults().contains(Fault::LoadSensorOpen),
            "{broken:?}"
        );
        for _ in 0..101 {
            bench.still_with(Some(1100));
        }
        assert_eq!(bench.foot.faults(), Faults::NONE);
    }
}

#[test]
fn a_stopped_foot_is_silent_until_it_is_started() {
    let mut bench = bench();
    bench.command(Command::StopRemoteNode);
    bench.still();
    bench.still();
    assert_eq!((bench.contact(), bench.uart.len()), (None, 0));
    bench.command(Command::StartRemoteNode);
    bench.still();
    assert!(bench.contact().is_some() && !bench.uart.is_empty());
    assert!(bench.uart.iter().all(|message| match message {
        Message::Health(health) => health.state == State::Operational,
        _ => true,
    }));
}

#[test]
fn a_tick_without_a_sample_is_alive_only_with_an_explanation() {
    let silent = SensorFault {
        fault: Fault::SensorSilent,
        detail: 0,
    };
    for (activity, fault, alive) in [
        (Activity::Measuring, None, false),
        (Activity::Measuring, Some(silent), true),
        (Activity::Recovering, None, true),
        (Activity::Starting, None, true),
    ] {
        let mut bench = bench();
        let is_alive = |bench: &Bench| {
            bench.ports.liveness.report(Worker::Can);
            bench.ports.liveness.report(Worker::Uart);
            bench.ports.liveness.all_alive()
        };
        assert!(is_alive(&bench));
        let time = Timestamp::from_micros(2_000_000);
        let tick = Tick {
            time,
            ..Tick::default()
        };
        let measurement = Measurement {
            sample: missing_sample(time),
            raw: None,
            activity,
            fault,
            read_at: ReadAt::Edge,
            saturated_for_long: false,
            restarts: 0,
            misreads: 0,
        };
        bench.tick(&tick, &measurement, None);
        assert_eq!(is_alive(&bench), alive, "{activity:?}, {fault:?}");
    }
}

#[test]
fn slow_ticks_without_can_are_no_gaps() {
    let every_10_ms = (Address::new(index::UART_STREAMS, 1), Value::U16(10));
    let foot = Foot::new(settings(&[every_10_ms]), Start::default());
    let mut foot = foot.expect("the defaults").without_can(2_400);
    let ports = Ports::new();
    let mut contacts = 0;
    for number in 0..1_000 {
        let time = Timestamp::from_micros(2_400 * number);
        let tick = Tick {
            time,
            edge: Some(time),
            ..Tick::default()
        };
        let measurement = Measurement {
            sample: ImuSample {
                validity: Validity::Valid,
                ..missing_sample(time)
            },
            raw: None,
            activity: Activity::Measuring,
            fault: None,
            saturated_for_long: false,
            read_at: ReadAt::Edge,
            restarts: 0,
            misreads: 0,
        };
        foot.tick(&tick, &measurement, None, &ports);
        assert!(!foot.estimate().flags.contains(Flag::TimeGap), "{number}");
        assert_eq!(ports.try_next_can(), None);
        let mut decoder = Decoder::new();
        while let Some(frame) = ports.try_next_uart() {
            for byte in frame.as_bytes() {
                if let Some(Ok(frame)) = decoder.push(*byte) {
                    contacts += usize::from(matches!(frame.message, Message::Contact(_)));
                }
            }
        }
    }
    // Four ticks are nearest to the period.
    assert_eq!(contacts, 250);
}
