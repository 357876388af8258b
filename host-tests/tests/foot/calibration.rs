//! Half-widths from a walk, proposed and accepted over the UART.

use std::cell::Cell;

use crate::bench::{Bench, MS, Run, SECOND, run, standing};
use estimator_core::Calibrator;
use estimator_core::calibration::STEPS;
use footfall::calibrate::half_width::HalfWidthCalibration;
use footfall::gait::{GaitName, Ground, Motion, Plan, SensorParams};
use footfall::recording::{RecordedSample, Recording};
use wire::dictionary::index;
use wire::node::Command;
use wire::uart::{Answer, ConfigGet, Message};
use wire::{AbortCode, Address, Emergency, Fault, Settings, Value};

const COMMAND: Address = Address::new(index::CALIBRATION, 1);
const STATE: Address = Address::new(index::CALIBRATION, 2);

fn get(address: Address) -> Message {
    Message::ConfigGet(ConfigGet { address })
}

/// What is done on a tick.
type Act<'a> = (u64, &'a dyn Fn(&mut Bench));

/// Runs, and does one thing on some ticks; all answers in their order.
fn scripted(
    part: &lsm6dsox::sim::SharedPart,
    bench: &mut Bench,
    ms: u64,
    script: &[Act<'_>],
) -> (Vec<Answer>, Vec<Emergency>) {
    let mut answers = Vec::new();
    let mut emergencies = Vec::new();
    let mut ticks = 0;
    run(Run::default(), part, bench, ms * MS, |bench, _, _| {
        answers.extend(bench.answers());
        emergencies.extend(bench.emergencies());
        for (at, action) in script {
            if *at == ticks {
                action(bench);
            }
        }
        ticks += 1;
    });
    (answers, emergencies)
}

#[test]
fn a_walk_gives_half_widths_that_count_only_once_they_are_accepted() {
    let motion = Motion::new(&Plan::steady(GaitName::Walk, Ground::Hard, 30.0, 5));
    let part = SensorParams::LSM6DSOX.mounted(motion, 0.0, 5);
    let mut bench = Bench::new(Settings::default());
    let before = bench.foot.settings().params().half_width;
    let start = |bench: &mut Bench| bench.set(COMMAND, Value::U8(1));
    let ask_state = |bench: &mut Bench| bench.ask(&get(STATE));
    let (answers, _) = scripted(
        &part,
        &mut bench,
        25_000,
        &[(2000, &start), (2100, &ask_state), (24_000, &ask_state)],
    );
    let state = |state: u8| Answer::Value(Value::U8(state).into());
    assert_eq!(answers, [Answer::Done, state(1), state(2)]);
    assert_eq!(bench.foot.settings().params().half_width, before);

    let ask_proposal = |bench: &mut Bench| {
        for axis in 0..6 {
            bench.ask(&get(Address::new(index::CALIBRATION, 3 + axis)));
        }
    };
    let accept = |bench: &mut Bench| bench.set(COMMAND, Value::U8(2));
    let open = |bench: &mut Bench| bench.command(Command::EnterPreOperational);
    // An estimator made anew looks for up first.
    let doubt = Cell::new((false, false));
    let look = |bench: &mut Bench| {
        let (_, before) = doubt.get();
        doubt.set((before, bench.foot.estimate().flags.are_doubt()));
    };
    let script: [Act<'_>; 6] = [
        (7100, &ask_proposal),
        (7200, &accept),
        (7210, &open),
        (7220, &look),
        (7220, &accept),
        (7221, &look),
    ];
    let (answers, _) = scripted(&part, &mut bench, 8000, &script);
    let [proposal @ .., refused, done] = &answers[..] else {
        panic!("{answers:?}");
    };
    assert_eq!(*refused, Answer::Refused(AbortCode::DeviceState));
    assert_eq!(*done, Answer::Done);
    assert_eq!(
        doubt.get(),
        (false, true),
        "the estimator goes on with the old half-widths"
    );
    let proposal: Vec<f32> = proposal
        .iter()
        .map(|answer| match answer {
            Answer::Value(value) => {
                f32::from_le_bytes(value.as_bytes().try_into().expect("REAL32"))
            }
            other => panic!("{other:?}"),
        })
        .collect();
    println!("proposed half-widths: {proposal:.4?}");
    let params = bench.foot.settings().params();
    assert_eq!(params.half_width.to_array()[..], proposal[..]);
    for (half_width, h) in proposal.iter().zip(params.bandwidth.to_array()) {
        assert!(
            (4.0 * h..100.0 * h).contains(half_width),
            "{half_width} with h = {h}"
        );
    }
}

#[test]
fn the_host_finds_the_same_bits_in_the_same_samples() {
    let motion = Motion::new(&Plan::steady(GaitName::Walk, Ground::Hard, 30.0, 6));
    let part = SensorParams::LSM6DSOX.mounted(motion, 0.0, 6);
    let mut bench = Bench::new(Settings::default());
    let params = bench.foot.settings().params();
    // What the foot does with an estimate, to know where it has enough.
    let mut calibrator = Calibrator::new(&params);
    let mut samples = Vec::new();
    let mut answers = Vec::new();
    let mut ticks = 0;
    run(
        Run::default(),
        &part,
        &mut bench,
        20_000 * MS,
        |bench, _, measurement| {
            answers.extend(bench.answers());
            match ticks {
                2000 => bench.set(COMMAND, Value::U8(1)),
                19_000 => (0..6).for_each(|axis| {
                    bench.ask(&get(Address::new(index::CALIBRATION, 3 + axis)));
                }),
                _ => {}
            }
            ticks += 1;
            if calibrator.steps() < STEPS {
                calibrator.update(bench.foot.estimate());
                samples.push(RecordedSample {
                    imu: measurement.sample,
                    load: None,
                    label: None,
                });
            }
        },
    );
    let mut calibration = HalfWidthCalibration::new(&params);
    let recording = Recording {
        name: "what the foot measured".to_owned(),
        sample_rate: params.sample_rate,
        gravity: params.gravity,
        load_title: String::new(),
        samples,
    };
    calibration.add(&recording).expect("the foot's parameters");
    let found = calibration.finish().expect("as many steps").half_width;
    let found = found
        .to_array()
        .map(|half_width| Answer::Value(Value::F32(half_width).into()));
    assert_eq!(answers[1..], found);
}

#[test]
fn standing_about_ends_in_a_fault_that_says_how_many_steps_there_were() {
    let part = standing();
    let mut bench = Bench::new(Settings::default());
    let start = |bench: &mut Bench| bench.set(COMMAND, Value::U8(1));
    let cancel = |bench: &mut Bench| bench.set(COMMAND, Value::U8(3));
    let (answers, emergencies) = scripted(
        &part,
        &mut bench,
        63_000,
        &[(1000, &start), (62_000, &cancel)],
    );
    assert_eq!(answers, [Answer::Done, Answer::Done]);
    let codes: Vec<_> = emergencies.iter().map(|e| (e.code, e.detail)).collect();
    assert_eq!(codes, [(Fault::CalibrationFailed.code(), 0), (0, 0)]);
    assert_eq!(*bench.foot.settings(), Settings::default());
    assert!(part.now_ns() > 63 * SECOND - 2 * MS);
}
