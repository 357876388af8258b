//! Errors of the accelerometer, corrected on the foot over SDO and in a replay by a file.

use std::fmt::Write as _;
use std::fs;

use crate::bench::{Bench, MS, ORDINARY, Run, part, run};
use estimator_core::{ContactEstimate, ImuSample, Params, Timestamp, Validity};
use firmware::ports::Input;
use footfall::config::Overrides;
use lsm6dsox::sim::{PartOptions, SharedPart, Stimulus};
use recordings::input::{Format, Hints, read};
use recordings::replay::replay;
use wire::dictionary::index;
use wire::node::Command;
use wire::{Address, CanFrame, Settings, Value};

/// m/s².
const BIAS: [f64; 3] = [0.19, -0.12, 0.15];
/// The correction's scale: what the part makes of a force is the force over it.
const SCALE: [f64; 3] = [1.01, 0.992, 1.006];

/// The method that leaves in the acceleration what gravity's removal leaves.
const METHOD: &str = "method = 'half_widths'";

/// The same with the correction.
const ROBOT: &str = "method = 'half_widths'
[accelerometer]
bias_m_s2 = { ax = 0.19, ay = -0.12, az = 0.15 }
scale = { ax = 1.01, ay = 0.992, az = 1.006 }
";

/// When the first setting is written, and the second, and so on.
const WRITTEN_MS: u64 = 300;
/// From here on it lies still, as it did at the start; in between it is moved.
const STILL_MS: u64 = 2000;
const END_MS: u64 = 3000;

/// A foot that lies askew, is moved in all directions, and lies askew again.
fn moved() -> SharedPart {
    let options = PartOptions {
        accel_bias: BIAS,
        ..ORDINARY
    };
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

/// Writes four bytes, or one, over SDO.
fn write_over_sdo(bench: &mut Bench, address: Address, value: Value) {
    let command = if matches!(value, Value::U8(_)) {
        0x2F
    } else {
        0x23
    };
    let [i0, i1] = address.index.to_le_bytes();
    let [a, b, c, d] = value.to_raw().to_le_bytes();
    let bytes = [command, i0, i1, address.subindex, a, b, c, d];
    let frame = CanFrame::new(0x611, &bytes).expect("a frame");
    let at = bench.foot.estimate().timestamp;
    assert!(bench.ports.try_put(Input::Can(frame, at)));
}

/// The settings that are written, one after the other; the method last, so that each has to count.
fn written(corrected: bool) -> Vec<(Address, Value)> {
    let values = BIAS.into_iter().chain(SCALE).map(|value| value as f32);
    let values = (1..).zip(values).filter(|_| corrected);
    values
        .map(|(subindex, value)| {
            let address = Address::new(index::ACCELEROMETER, subindex);
            (address, Value::F32(value))
        })
        .chain([(Address::new(index::ESTIMATION, 1), Value::U8(1))])
        .collect()
}

/// The samples as the sensor gave them, and the estimates, from the tick on which the last setting
/// took effect.
fn on_the_foot(corrected: bool) -> (Vec<ImuSample>, Vec<ContactEstimate>) {
    let settings = written(corrected);
    let last = WRITTEN_MS + settings.len() as u64;
    let mut bench = Bench::new(Settings::default());
    let (mut samples, mut estimates) = (Vec::new(), Vec::new());
    let mut ticks = 0;
    run(
        Run::default(),
        &moved(),
        &mut bench,
        END_MS * MS,
        |bench, _, measurement| {
            ticks += 1;
            if ticks > WRITTEN_MS && ticks <= last {
                let answers = bench.can.iter().filter(|frame| frame.id() == 0x591);
                assert!(answers.into_iter().all(|frame| frame.data()[0] == 0x60));
            }
            if ticks == WRITTEN_MS - 1 {
                bench.command(Command::EnterPreOperational);
            } else if let Some((address, value)) = ticks
                .checked_sub(WRITTEN_MS)
                .and_then(|written| settings.get(written as usize))
            {
                write_over_sdo(bench, *address, *value);
            }
            // The last request is answered after the estimate of its tick.
            if ticks > last {
                samples.push(measurement.sample);
                estimates.push(*bench.foot.estimate());
            }
        },
    );
    assert!(estimates.len() > 2000);
    (samples, estimates)
}

/// The estimates of a replay of the samples, as `footfall replay` makes them of a file.
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
    let hints = Hints {
        correction: overrides.correction("robot.toml").expect("a sensor"),
        sample_rate: Some(Params::DEFAULT.sample_rate),
        ..Hints::default()
    };
    let loaded = read(&path, Format::Csv, &hints).expect("a recording");
    let mut params = Settings::default().params();
    overrides.apply(&mut params);
    replay(&loaded.recording, &params).expect("the foot's parameters")
}

/// All of an estimate to the bit, but for when the recording began.
fn bits(estimates: &[ContactEstimate]) -> Vec<String> {
    let start = estimates.first().map_or(0, |e| e.timestamp.as_micros());
    let relative = estimates.iter().map(|estimate| {
        let micros = estimate.timestamp.as_micros() - start;
        let timestamp = Timestamp::from_micros(micros);
        // The shortest text that is no other number, and tells −0 from 0.
        format!(
            "{:?}",
            ContactEstimate {
                timestamp,
                ..*estimate
            }
        )
    });
    relative.collect()
}

#[test]
fn the_foot_and_a_replay_put_readings_right_with_the_same_bits() {
    for (corrected, robot) in [(true, ROBOT), (false, METHOD)] {
        let (samples, on_foot) = on_the_foot(corrected);
        let on_host = bits(&on_the_host(&samples, robot));
        let on_foot = bits(&on_foot);
        assert_eq!(on_foot.len(), on_host.len());
        let difference = on_foot.iter().zip(&on_host).find(|(a, b)| a != b);
        assert_eq!(difference, None, "corrected: {corrected}");
    }
}

#[test]
fn less_of_gravity_is_left_at_rest() {
    let left = |corrected: bool| {
        let (_, estimates) = on_the_foot(corrected);
        let still = &estimates[(estimates.len() - 300)..];
        let sum: f32 = still
            .iter()
            .map(|estimate| estimate.linear_acceleration.0.length())
            .sum();
        sum / still.len() as f32
    };
    let [as_read, corrected] = [left(false), left(true)];
    println!("left of gravity: {as_read:.4} m/s², corrected {corrected:.4}");
    assert!(as_read > 0.05, "{as_read}");
    assert!(corrected < as_read / 3.0, "{corrected} of {as_read}");
}
