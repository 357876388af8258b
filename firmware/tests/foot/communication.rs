//! CAN and UART: requests, settings, floods, and missing receivers.

use crate::bench::{Bench, measurement};
use ::storage::{Erase, StoreFailed};
use estimator_core::{Flag, ImuSample, Phase, Timestamp, Validity};
use firmware::exchange::{Exchange, Input, Request};
use firmware::sampling::{Activity, Measurement, SensorFault, Tick};
use firmware::supervision::Worker;
use firmware::{Foot, Ports, Start, tasks};
use lsm6dsox::imu::missing_sample;
use wire::dictionary::{SIGNATURE_RESTORE, SIGNATURE_STORE, index};
use wire::node::{NmtCommand, NmtState};
use wire::uart::{Answer, Decoder, Message};
use wire::{AbortCode, Address, Counter, Fault, Faults, Settings, Value};

const WINDOW: Address = Address::new(index::WINDOW, 0);
const LOAD_SOURCE: Address = Address::new(index::LOAD_INPUT, 1);
const STORE: Address = Address::new(index::STORE, 1);

fn bench() -> Bench {
    Bench::new(Settings::default()).running()
}

/// A bench whose settings are writable.
fn open() -> Bench {
    let mut bench = bench();
    bench.command(NmtCommand::EnterPreOperational);
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
    bench.command(NmtCommand::StartRemoteNode);
    bench.still();
    let (mut contacts, mut raws) = (0, 0);
    for _ in 0..1000 {
        bench.still();
        assert_eq!(bench.contact(), None);
        for message in &bench.uart {
            contacts += usize::from(matches!(message, Message::Contact(_)));
            raws += usize::from(matches!(message, Message::Raw(_)));
        }
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
    // Per tick CAN carries 1 + 4/20 + 1/1000 + 1/100 frames, and 2 more each 500 ms. The UART carries 1 + 1/100.
    let dropped = bench.foot.counters().dropped() - dropped;
    assert!((130_000..140_000).contains(&dropped), "{dropped}");
    bench.can_listens = true;
    bench.uart_listens = true;
    bench.still();
    // The first 16 frames are of the last few ticks. Some of them are not contacts.
    let newest = bench.foot.estimate().timestamp;
    let oldest = bench.uart.iter().find_map(|message| match message {
        Message::Contact(contact) => Some(contact.timestamp),
        _ => None,
    });
    let age = newest.micros_since(oldest.expect("contacts")).expect("older");
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
    let refused = Answer::Refused(AbortCode::Hardware);
    for (result, answer) in [(Ok(()), Answer::Done), (Err(StoreFailed::Flash), refused)] {
        let mut bench = open();
        bench.set(STORE, signature);
        bench.still();
        assert_eq!(bench.answers(), []);
        let request = bench.ports.try_next_request();
        let settings = bench.foot.settings().clone();
        assert_eq!(request, Some(Request::Store(settings, Erase::Allowed)));
        assert!(bench.ports.try_put(Input::Stored(result)));
        bench.still();
        assert_eq!(bench.answers(), [answer]);
        assert_eq!(bench.foot.faults().contains(Fault::ConfigStore), result.is_err());

        bench.set(Address::new(index::RESTORE, 1), Value::U32(SIGNATURE_RESTORE));
        bench.still();
        assert_eq!(bench.ports.try_next_request(), Some(Request::Restore(Erase::Allowed)));
        assert!(bench.ports.try_put(Input::Stored(Ok(()))));
        bench.still();
        assert_eq!(bench.answers(), [Answer::Done]);
        assert!(!bench.foot.faults().contains(Fault::ConfigStore));
    }
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
        assert!(bench.foot.faults().contains(Fault::LoadSensorOpen), "{broken:?}");
        for _ in 0..101 {
            bench.still_with(Some(1100));
        }
        assert_eq!(bench.foot.faults(), Faults::NONE);
    }
}

#[test]
fn a_stopped_foot_is_silent_until_it_is_started() {
    let mut bench = bench();
    bench.command(NmtCommand::StopRemoteNode);
    bench.still();
    bench.still();
    assert_eq!((bench.contact(), bench.uart.len()), (None, 0));
    bench.command(NmtCommand::StartRemoteNode);
    bench.still();
    assert!(bench.contact().is_some() && !bench.uart.is_empty());
    assert!(bench.uart.iter().all(|message| match message {
        Message::Health(health) => health.state == NmtState::Operational,
        _ => true,
    }));
}

#[test]
fn a_tick_without_a_sample_is_alive_only_with_an_explanation() {
    let silent = SensorFault { fault: Fault::SensorSilent, detail: 0 };
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
        let tick = Tick { time, ..Tick::default() };
        let measurement =
            Measurement { activity, fault, ..measurement(missing_sample(time), None) };
        bench.tick(&tick, &measurement, None);
        assert_eq!(is_alive(&bench), alive, "{activity:?}, {fault:?}");
    }
}

#[test]
fn slow_ticks_without_can_are_no_gaps() {
    let every_10_ms = (Address::new(index::UART_STREAMS, 1), Value::U16(10));
    // Four ticks are nearest to the period.
    assert_eq!(contacts_of_ticks::<2_400>(settings(&[every_10_ms])), 250);
}

#[test]
fn window_shorter_than_a_slow_tick_holds_one_sample() {
    let half_widths = (Address::new(index::ESTIMATION, 1), Value::U8(1));
    for window_us in [1_000, 1_199, 1_201, 2_399] {
        let window = (WINDOW, Value::U32(window_us));
        assert_eq!(contacts_of_ticks::<2_400>(settings(&[half_widths, window])), 1_000);
    }
}

/// A foot that kept the estimator of its start, which takes a sample each millisecond, would see a gap before each slower
/// tick.
#[test]
fn each_period_of_ticks_takes_the_shortest_and_longest_window() {
    let half_widths = (Address::new(index::ESTIMATION, 1), Value::U8(1));
    for window_us in [1_000, 256_000] {
        let settings = settings(&[half_widths, (WINDOW, Value::U32(window_us))]);
        assert_eq!(contacts_of_ticks::<1_000>(settings.clone()), 1_000, "{window_us} µs");
        assert_eq!(contacts_of_ticks::<50_000>(settings), 1_000, "{window_us} µs");
    }
}

/// Contacts that a foot without CAN sends in 1000 ticks, none of which has a gap before it.
fn contacts_of_ticks<const TICK_US: u32>(settings: Settings) -> usize {
    let foot = Foot::new(settings, Start::default());
    let mut foot = foot.expect("allowed settings");
    foot.disable_can(TICK_US);
    let ports = Ports::new();
    let mut contacts = 0;
    for number in 0..1_000 {
        let time = Timestamp::from_micros(u64::from(TICK_US) * number);
        let tick = Tick { time, edge: Some(time), ..Tick::default() };
        let sample = ImuSample { validity: Validity::Valid, ..missing_sample(time) };
        let exchange = &mut Exchange::new();
        tasks::run_tick(&mut foot, &ports, exchange, &tick, &measurement(sample, None), None);
        assert!(!foot.estimate().flags.contains(Flag::TimeGap), "{number}");
        assert_eq!(ports.try_next_can(), None);
        let mut decoder = Decoder::new();
        while let Some(frame) = ports.try_next_uart() {
            for byte in &frame {
                if let Some(Ok(frame)) = decoder.push(*byte) {
                    contacts += usize::from(matches!(frame.message, Message::Contact(_)));
                }
            }
        }
    }
    contacts
}
