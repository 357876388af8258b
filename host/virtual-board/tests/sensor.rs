//! A sensor that has partly failed, or lost a register's value: the ELF reports it within its bound, and never
//! reports "stable" on such data afterwards.

mod common;

use common::rig::{OPERATIONAL, PRE_OPERATIONAL, Rig};
use common::{MILLISECOND, options, product, run};
use estimator_core::Validity;
use lsm6dsox::Sensor;
use lsm6dsox::register::{self, Register};
use lsm6dsox::sim::{Axis, PartFault as SensorFault, Stimulus};
use virtual_board::emulator::board::{Board, Injection};
use virtual_board::emulator::part::can::TimedFrame;
use virtual_board::emulator::time::to_us;
use virtual_board::product::parity;
use wire::dictionary::index;
use wire::uart::{Message, RawSample};
use wire::{Emergency, Fault};

/// Function codes of `CANopen`; the node's number is added.
const EMERGENCY: u32 = 0x080;
const ESTIMATE: u32 = 0x180;

/// Time of the injection, ms: the foot stands and says "stable" by then.
const BEGIN_MS: u64 = 1_500;

/// Maximum delay of the estimate of a tick, ms: it leaves in the next tick.
const LAG_MS: u64 = 2;

fn of(frames: &[TimedFrame], function: u32) -> impl Iterator<Item = &TimedFrame> {
    let is = move |id: u32| id & !0x7F == function && id & 0x7F != 0;
    frames.iter().filter(move |sent| is(sent.frame.id))
}

/// Returns whether a frame says "stable": a probability above one half, in the first two bytes of the estimate.
fn is_stable(sent: &TimedFrame) -> bool {
    matches!(sent.frame.data[..], [_, high, ..] if high >= 0x80)
}

fn emergencies(frames: &[TimedFrame]) -> Vec<Emergency> {
    of(frames, EMERGENCY)
        .filter_map(|sent| {
            Some(Emergency::decode(
                sent.frame.data.get(..8)?.try_into().ok()?,
            ))
        })
        .collect()
}

/// Frames sent within `ms` of `faults`, while the foot moves by `moves`.
fn after(elf: &[u8], moves: Stimulus, faults: &[SensorFault], ms: u64) -> (Board, Vec<TimedFrame>) {
    let begin = BEGIN_MS as f64 / 1000.0;
    let motion = move |t: f64| if t < begin { Stimulus::REST } else { moves };
    let mut board = Board::with_motion(elf, options(), motion).expect("it fits the flash");
    run(&mut board, BEGIN_MS);
    let before = board.take_can();
    assert!(of(&before, ESTIMATE).last().is_some_and(is_stable));
    for fault in faults {
        board.inject(Injection::Sensor(*fault));
    }
    run(&mut board, ms);
    let frames = board.take_can();
    (board, frames)
}

/// A slide at 3 m/s² along x.
fn slide() -> Stimulus {
    let [x, y, z] = Stimulus::REST.specific_force;
    Stimulus {
        specific_force: [x + 3.0, y, z],
        ..Stimulus::REST
    }
}

/// A turn at 2 rad/s about z.
fn turn() -> Stimulus {
    Stimulus {
        angular_rate: [0.0, 0.0, 2.0],
        ..Stimulus::REST
    }
}

const fn stuck(sensor: Sensor, axis: Axis, code: i16) -> SensorFault {
    SensorFault::AxisStuck { sensor, axis, code }
}

#[test]
#[ignore = "full: five partial failures of the sensor"]
fn a_partly_failed_sensor_is_not_stable_and_names_its_axes() {
    let Some(elf) = product() else { return };
    // 0.2 rad/s are 164 codes of 70 m°/s.
    for (name, moves, fault, axes, within_ms) in [
        (
            "ax stuck",
            slide(),
            stuck(Sensor::Accel, Axis::X, 0),
            0b1,
            30,
        ),
        (
            "wz stuck",
            turn(),
            stuck(Sensor::Gyro, Axis::Z, 0),
            0b10_0000,
            90,
        ),
        (
            "wx stuck at 0.2 rad/s",
            Stimulus::REST,
            stuck(Sensor::Gyro, Axis::X, 164),
            0b1000,
            90,
        ),
        (
            "accelerometer frozen",
            slide(),
            SensorFault::SensorFrozen(Sensor::Accel),
            0b111,
            20,
        ),
        (
            "gyroscope frozen",
            turn(),
            SensorFault::SensorFrozen(Sensor::Gyro),
            0b11_1000,
            40,
        ),
    ] {
        let (board, frames) = after(&elf, moves, &[fault], 1_500);
        let reported = emergencies(&frames);
        let first = reported.iter().find(|emergency| emergency.code != 0);
        let first = first.map(|emergency| (emergency.fault, emergency.detail));
        assert_eq!(first, Some((Some(Fault::SensorFrozen), axes)), "{name}");
        let deadline = (BEGIN_MS + within_ms + LAG_MS) * MILLISECOND;
        let late: Vec<_> = of(&frames, ESTIMATE)
            .filter(|sent| sent.time > deadline)
            .collect();
        let stable = late.iter().filter(|sent| is_stable(sent)).count();
        assert_eq!(stable, 0, "{name}: of {} estimates", late.len());
        // It stays reported while the fault lasts.
        let gone = reported.iter().any(|emergency| emergency.code == 0);
        assert!(!gone, "{name}: {reported:?}");
        assert_eq!(board.resets(), [], "{name}");
    }
}

#[test]
fn a_recovered_sensor_is_used_again() {
    let Some(elf) = product() else { return };
    let fault = stuck(Sensor::Gyro, Axis::Y, 0);
    let (mut board, _) = after(&elf, Stimulus::REST, &[fault], 300);
    board.inject(Injection::Clear);
    run(&mut board, 2_500);
    let frames = board.take_can();
    assert!(of(&frames, ESTIMATE).last().is_some_and(is_stable));
    assert!(
        emergencies(&frames)
            .iter()
            .any(|emergency| emergency.code == 0)
    );
}

/// Bits of registers that change by themselves.
const CHANGES: [(Register, u8); 9] = [
    (register::CTRL5_C, 0b01),
    (register::CTRL5_C, 0b0100),
    (register::CTRL7_G, 0x40),
    (register::CTRL7_G, 0x80),
    (register::FUNC_CFG_ACCESS, 0x80),
    (register::FUNC_CFG_ACCESS, 0x40),
    (register::CTRL3_C, 0x08),
    (register::PIN_CTRL, 0x40),
    (register::X_OFS_USR, 0x10),
];

#[test]
fn a_register_change_is_detected_and_corrected() {
    assert_corrected(&CHANGES[..1]);
}

#[test]
#[ignore = "full: changes of every register"]
fn every_register_change_is_detected_and_corrected() {
    assert_corrected(&CHANGES);
}

fn assert_corrected(changes: &[(Register, u8)]) {
    let Some(elf) = product() else { return };
    for &(register, bits) in changes {
        let name = format!("{} ^ {bits:#04x}", register.name);
        let flip = SensorFault::RegisterFlipped {
            address: register.address,
            bits,
        };
        let (mut board, frames) = after(&elf, Stimulus::REST, &[flip], 60);
        let reported = emergencies(&frames);
        let named = reported
            .iter()
            .filter_map(|emergency| emergency.fault)
            .next();
        assert!(
            matches!(
                named,
                Some(Fault::SensorConfigMismatch | Fault::SensorWrongId)
            ),
            "{name}: {reported:?}"
        );
        run(&mut board, 1_500);
        let frames = board.take_can();
        assert!(
            of(&frames, ESTIMATE).last().is_some_and(is_stable),
            "{name}"
        );
        assert_eq!(board.resets(), [], "{name}");
    }
}

#[test]
fn a_bias_too_large_to_learn_is_reported_with_its_value() {
    assert_bias_reported(&[15.0]);
}

#[test]
#[ignore = "full: biases to the end of the range"]
fn every_bias_too_large_to_learn_is_reported_with_its_value() {
    assert_bias_reported(&[8.0, 15.0, 30.0]);
}

fn assert_bias_reported(biases_dps: &[f64]) {
    let Some(elf) = product() else { return };
    for &dps in biases_dps {
        let mut options = options();
        let sensor = options.sensor.as_mut().expect("there is a sensor");
        sensor.gyro_bias = [0.0, dps.to_radians(), 0.0];
        let still = |_: f64| Stimulus::REST;
        let mut board = Board::with_motion(&elf, options, still).expect("it fits the flash");
        run(&mut board, 8_000);
        let frames = board.take_can();
        let mut reported = emergencies(&frames);
        // The slowest specimen begins with read errors, until its bus is slowed down.
        reported.retain(|emergency| emergency.fault == Some(Fault::GyroBias));
        let [emergency] = reported[..] else {
            panic!("{dps} °/s: {reported:?}");
        };
        let read = f64::from(emergency.detail) / 1000.0;
        assert!((read - dps).abs() < 0.1, "{dps} °/s: {read}");
    }
}

/// An LSM6DSO32 has the identity of an LSM6DSOX, and half of its codes.
#[test]
fn a_wrong_scale_is_reported_until_gravity_is_right_at_rest() {
    assert_scale_reported(&[0.5]);
}

#[test]
#[ignore = "full: scales within and beyond the limits"]
fn every_wrong_scale_is_reported_until_gravity_is_right_at_rest() {
    assert_scale_reported(&[0.5, 0.85, 1.25]);
}

fn assert_scale_reported(scales: &[f64]) {
    let Some(elf) = product() else { return };
    for &g in scales {
        let lying = move |seconds: f64| {
            let mut lying = Stimulus::REST;
            lying.specific_force[2] *= if seconds < 4.0 { g } else { 1.0 };
            lying
        };
        let mut board = Board::with_motion(&elf, options(), lying).expect("it fits the flash");
        run(&mut board, 3_500);
        let mut frames = board.take_can();
        run(&mut board, 500);
        let stable = of(&board.take_can(), ESTIMATE).any(is_stable);
        run(&mut board, 6_000);
        frames.extend(board.take_can());
        let mut reported = emergencies(&frames);
        reported.retain(|emergency| emergency.fault == Some(Fault::SensorScale));
        match reported[..] {
            [] => assert!(stable && (0.8..1.2).contains(&g), "{g} g"),
            [raised, cleared] => {
                assert!(!stable && !(0.8..1.2).contains(&g), "{g} g");
                let read = f64::from(raised.detail) / 1000.0;
                assert!((read - g).abs() < 0.01, "{g} g: {read}");
                assert_eq!(cleared.code, 0, "{g} g");
            }
            _ => panic!("{g} g: {reported:?}"),
        }
    }
}

/// An LSM6DSO32 with its setting: half of the codes of an LSM6DSOX are gravity, also beyond ±16 g, in raw samples, and
/// after a reset with the self-test.
#[test]
#[ignore = "full: 13 s with another part"]
fn other_part_is_a_setting_and_measures_twice_the_range() {
    const HALF: f64 = 0.5;
    let Some(elf) = product() else { return };
    let lying = |seconds: f64| {
        let mut lying = Stimulus::REST;
        lying.specific_force[2] *= HALF;
        if (12.0..12.01).contains(&seconds) {
            lying.specific_force[0] = 25.0 * 9.806_65 * HALF;
        }
        lying
    };
    let started = Board::with_motion(&elf, options(), lying).expect("it fits the flash");
    let mut rig = Rig::of(started);
    rig.run(3_500);
    assert!(rig.emergencies().contains(&Fault::SensorScale.code()));
    rig.nmt(PRE_OPERATIONAL);
    rig.run(3);
    for (index, subindex, command, value) in [
        (index::ACCELEROMETER, 7, 0x2F, 1),
        (index::SELF_TEST, 0, 0x2F, 1),
        (index::UART_STREAMS, 2, 0x2B, 1),
    ] {
        let [low, high] = index.to_le_bytes();
        rig.can(0x611, &[command, low, high, subindex, value, 0, 0, 0]);
        rig.run(3);
    }
    rig.store();
    rig.run(50);
    assert!(rig.answers().iter().all(|answer| answer[0] == 0x60));
    rig.nmt(OPERATIONAL);
    rig.run(6_000);
    rig.forget();
    rig.run(500);
    assert!(!rig.stable().is_empty(), "it is no fault any more");
    rig.board.inject(Injection::Reset);
    rig.run(3_000);
    assert_eq!(rig.emergencies(), Vec::<u16>::new());
    let force = |raw: &RawSample| {
        let codes = raw.acceleration.map(f32::from);
        codes.map(|code| code * raw.acceleration_scale)
    };
    let raw = rig
        .messages
        .iter()
        .filter_map(|(_, message)| match message {
            Message::Raw(raw) if raw.validity == Validity::Valid => Some(force(raw)),
            _ => None,
        });
    let raw: Vec<[f32; 3]> = raw.collect();
    let [_, _, up] = raw.last().expect("raw samples");
    assert!((up - 9.8).abs() < 0.3, "{up} m/s²");
    let most = raw.iter().map(|[x, ..]| *x).fold(0.0, f32::max);
    assert!(most > 20.0 * 9.8, "{most} m/s²");
}

/// Time from the chip select to the last bit of the latest sample, 17 bytes, µs.
fn burst_us(board: &mut Board) -> f64 {
    let read = board.take_transactions();
    let sample = read.iter().rev().find(|read| parity::is_sample(read));
    let sample = sample.expect("samples are read");
    to_us(sample.end - sample.start)
}

#[test]
fn the_bus_runs_at_5_mhz_and_at_half_for_a_late_data_line() {
    let Some(elf) = product() else { return };
    let still = |_: f64| Stimulus::REST;
    let mut board = Board::with_motion(&elf, options(), still).expect("it fits the flash");
    board.record_sensor_bus();
    run(&mut board, 1_000);
    let full = burst_us(&mut board);
    assert!((27.2..31.0).contains(&full), "5 MHz: {full} µs");
    board.inject(Injection::Sensor(SensorFault::SdoDelay { ns: 105 }));
    run(&mut board, 1_000);
    let late = burst_us(&mut board);
    assert!((54.4..60.0).contains(&late), "late data line: {late} µs");
    let frames = board.take_can();
    assert!(of(&frames, ESTIMATE).last().is_some_and(is_stable));
}

/// One bit in 3000: most registers that are read wrong are read right at once.
#[test]
fn single_misreads_are_reported_with_their_number() {
    let Some(elf) = product() else { return };
    let flips = SensorFault::BitFlips { per_million: 300 };
    let (mut board, mut frames) = after(&elf, Stimulus::REST, &[flips], 1_000);
    frames.extend(board.take_can());
    let mut reported = emergencies(&frames);
    reported.retain(|emergency| emergency.fault == Some(Fault::Misread) && emergency.code != 0);
    let [first, ..] = reported[..] else {
        panic!("no misread is reported");
    };
    assert_eq!(first.detail, 1);
}
