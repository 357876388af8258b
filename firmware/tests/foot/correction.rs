//! Corrections of the accelerometer and the sensor's axes, set on the foot over SDO and in a replay by a file.

use std::fmt::Write as _;
use std::fs;

use crate::bench::{Bench, MS, ORDINARY, Run, part, run};
use crate::storage::{Flash, load, stored};
use ::storage::Origin;
use config::Overrides;
use estimator_core::{ContactEstimate, ImuSample, Stream, Timestamp, Validity, Vec3};
use firmware::exchange::Input;
use lsm6dsox::sim::{PartOptions, SharedPart, Stimulus};
use options::{Format, InputOptions};
use recordings::read;
use samples::estimate::estimates_of;
use samples::mounting::parse_axes;
use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::{Address, CanFrame, Settings, Value};

/// Bias, m/s².
const BIAS: [f64; 3] = [0.19, -0.12, 0.15];
/// Scale of the correction: the part measures a force divided by it.
const SCALE: [f64; 3] = [1.01, 0.992, 1.006];

/// Method whose acceleration keeps the residual of gravity.
const METHOD: &str = "method = 'half_widths'";

/// [`METHOD`] with the correction.
const ROBOT: &str = "method = 'half_widths'
[accelerometer]
bias_m_s2 = { ax = 0.19, ay = -0.12, az = 0.15 }
scale = { ax = 1.01, ay = 0.992, az = 1.006 }
";

/// Mountings of the sensor, as the foot's object and in the file: none, axes along axes, and oblique.
const MOUNTINGS: [(&[(u8, Value)], &str); 3] = [
    (&[], ""),
    (&[(1, Value::U16(162))], "axes = 'x,-z,y'\n"),
    (
        &[
            (2, Value::F32(0.8)),
            (3, Value::F32(0.1)),
            (4, Value::F32(-0.5)),
            (5, Value::F32(0.31622776)),
            (1, Value::U16(0)),
        ],
        "axes = '0.8,0.1,-0.5,0.31622776'\n",
    ),
];

/// Time of the first write, ms; the other settings follow.
const WRITTEN_MS: u64 = 300;
/// Time from which the foot lies still again, as at the start, ms. It is moved before this time.
const STILL_MS: u64 = 2000;
const END_MS: u64 = 3000;

/// A foot that lies obliquely, is moved in all directions, and lies obliquely again.
fn moved() -> SharedPart {
    let options = PartOptions { accel_bias: BIAS, ..ORDINARY };
    let motion = |t: f64| {
        let moves = (0.8..0.001 * STILL_MS as f64 - 0.5).contains(&t);
        let sway = if moves { (9.0 * t).sin() } else { 0.0 };
        let truth = [2.0 + 4.0 * sway, -3.0 + 3.0 * sway, 9.117_27 + 8.0 * sway];
        Stimulus {
            specific_force: std::array::from_fn(|axis| truth[axis] / SCALE[axis]),
            angular_rate: [0.6 * sway, -0.4 * sway, 0.2 * sway],
            ..Stimulus::REST
        }
    };
    part(motion, options)
}

/// Writes a number over SDO.
fn write_over_sdo(bench: &mut Bench, address: Address, value: Value) {
    let command = match value {
        Value::U8(_) => 0x2F,
        Value::U16(_) => 0x2B,
        _ => 0x23,
    };
    let [i0, i1] = address.index.to_le_bytes();
    let [a, b, c, d] = value.to_raw().to_le_bytes();
    let bytes = [command, i0, i1, address.subindex, a, b, c, d];
    let frame = CanFrame::new(0x611, &bytes).expect("a frame");
    let at = bench.foot.estimate().timestamp;
    assert!(bench.ports.try_put(Input::Can(frame, at)));
}

/// Settings in the order in which they are written; the method is last, so that each takes effect.
fn written(corrected: bool, mounting: &[(u8, Value)]) -> Vec<(Address, Value)> {
    let values = BIAS.into_iter().chain(SCALE).map(|value| value as f32);
    let values = (1..).zip(values).filter(|_| corrected);
    values
        .map(|(subindex, value)| {
            let address = Address::new(index::ACCELEROMETER, subindex);
            (address, Value::F32(value))
        })
        .chain(mounting.iter().map(|(subindex, value)| {
            let address = Address::new(index::MOUNTING, *subindex);
            (address, *value)
        }))
        .chain([(Address::new(index::ESTIMATION, 1), Value::U8(1))])
        .collect()
}

/// Samples of the sensor and estimates from the tick on which the last setting took effect.
fn on_the_foot(
    corrected: bool,
    mounting: &[(u8, Value)],
) -> (Vec<ImuSample>, Vec<ContactEstimate>) {
    let settings = written(corrected, mounting);
    let last = WRITTEN_MS + settings.len() as u64;
    let mut bench = Bench::new(Settings::default());
    let (mut samples, mut estimates) = (Vec::new(), Vec::new());
    let mut ticks = 0;
    run(Run::default(), &moved(), &mut bench, END_MS * MS, |bench, _, measurement| {
        ticks += 1;
        if ticks > WRITTEN_MS && ticks <= last {
            let answers = bench.can.iter().filter(|frame| frame.id() == 0x591);
            assert!(answers.into_iter().all(|frame| frame.data()[0] == 0x60));
        }
        if ticks == WRITTEN_MS - 1 {
            bench.command(NmtCommand::EnterPreOperational);
        } else if let Some((address, value)) =
            ticks.checked_sub(WRITTEN_MS).and_then(|written| settings.get(written as usize))
        {
            write_over_sdo(bench, *address, *value);
        }
        // The last request is answered after the estimate of its tick.
        if ticks > last {
            samples.push(measurement.sample);
            estimates.push(*bench.foot.estimate());
        }
    });
    assert!(estimates.len() > 2000);
    (samples, estimates)
}

/// Estimates of a replay of the samples, as `footfall replay` estimates a file.
fn on_the_host(samples: &[ImuSample], robot: &str) -> Vec<ContactEstimate> {
    let mut table = String::from("t,ax,ay,az,wx,wy,wz\n");
    for sample in samples {
        assert_eq!(sample.validity, Validity::Valid);
        let micros = sample.timestamp.as_micros();
        let (f, w) = (sample.specific_force.0, sample.angular_rate.0);
        write!(table, "{}.{:06}", micros / 1_000_000, micros % 1_000_000).expect("memory");
        for value in [f.x, f.y, f.z, w.x, w.y, w.z] {
            write!(table, ",{value}").expect("memory");
        }
        table.push('\n');
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("walk.csv");
    fs::write(&path, table).expect("a file");
    let overrides = Overrides::parse(robot, "robot.toml").expect("a configuration");
    let input_options = InputOptions {
        correction: overrides.correction(),
        sample_rate: Some(Stream::KILOHERTZ.sample_rate()),
        ..InputOptions::default()
    };
    let loaded = read(&path, Format::Csv, &input_options).expect("a recording");
    let mut params = Settings::default().params();
    overrides.apply(&mut params);
    estimates_of(&loaded.recording, &params).expect("the foot's parameters")
}

/// All fields of an estimate to the bit, except for the start of the recording.
fn bits(estimates: &[ContactEstimate]) -> Vec<String> {
    let start = estimates.first().map_or(0, |e| e.timestamp.as_micros());
    let relative = estimates.iter().map(|estimate| {
        let micros = estimate.timestamp.as_micros() - start;
        let timestamp = Timestamp::from_micros(micros);
        // `{:?}` writes the shortest unambiguous text, which distinguishes −0 from 0.
        format!("{:?}", ContactEstimate { timestamp, ..*estimate })
    });
    relative.collect()
}

#[test]
fn the_foot_and_a_replay_correct_readings_identically() {
    for (corrected, robot) in [(true, ROBOT), (false, METHOD)] {
        let mut all = Vec::new();
        for (mounting, axes) in MOUNTINGS {
            let (samples, on_foot) = on_the_foot(corrected, mounting);
            let on_host = bits(&on_the_host(&samples, &format!("{axes}{robot}")));
            let on_foot = bits(&on_foot);
            assert_eq!(on_foot.len(), on_host.len());
            let difference = on_foot.iter().zip(&on_host).find(|(a, b)| a != b);
            assert_eq!(difference, None, "corrected: {corrected}, {axes}");
            all.push(on_foot);
        }
        // Each correction has an effect.
        let last = |estimates: &Vec<String>| estimates.last().cloned();
        assert!(last(&all[0]) != last(&all[1]) && last(&all[1]) != last(&all[2]));
    }
}

/// Up in the frame of the foot, in tenths.
fn up(bench: &Bench) -> [f32; 3] {
    let Vec3 { x, y, z } = bench.foot.estimate().orientation.up();
    [x, y, z].map(|part| (10.0 * part).round() / 10.0)
}

#[test]
fn a_mounting_set_over_uart_applies_at_once_and_after_restart() {
    let mut bench = Bench::new(Settings::default()).running();
    assert_eq!(up(&bench), [0.0, 0.0, 1.0]);
    bench.command(NmtCommand::EnterPreOperational);
    bench.still();
    bench.set(Address::new(index::MOUNTING, 1), Value::U16(162));
    // The estimator restarts with samples in the new frame, and finds up in it.
    let bench = bench.running();
    assert_eq!(up(&bench), [0.0, -1.0, 0.0]);

    let flash = stored(Flash::blank(), bench.foot.settings());
    let (settings, origin) = load(flash);
    assert_eq!(origin, Origin::Stored);
    assert_eq!(Ok(settings.mounting()), parse_axes("x,-z,y"));
    let bench = Bench::new(settings).running();
    assert_eq!(up(&bench), [0.0, -1.0, 0.0]);
}

#[test]
fn the_gyroscope_bias_is_relearnt_along_remounted_axes() {
    let options = PartOptions { gyro_bias: [0.01, -0.02, 0.04], ..ORDINARY };
    let mut bench = Bench::new(Settings::default());
    let mut ticks = 0;
    let mut biases = Vec::new();
    run(
        Run::default(),
        &part(|_: f64| Stimulus::REST, options),
        &mut bench,
        6000 * MS,
        |bench, _, _| {
            ticks += 1;
            if ticks == 2990 {
                bench.command(NmtCommand::EnterPreOperational);
            } else if ticks == 3000 {
                bench.set(Address::new(index::MOUNTING, 1), Value::U16(162));
            }
            if [3000, 3002, 5990].contains(&ticks) {
                biases.push(bench.foot.estimate().gyro_bias.0);
            }
        },
    );
    let [found, forgotten, again] = biases[..] else {
        panic!("{biases:?}");
    };
    assert!(found.length() > 0.02, "{found:?}");
    assert_eq!(forgotten, Vec3::ZERO);
    let turned = Vec3::new(found.x, -found.z, found.y);
    assert!((again - turned).length() < 2e-3, "{again:?} for {turned:?}");
}
