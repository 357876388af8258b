//! Output of `footfall convert`: any samples are restored, and third-party libraries read them.

use std::fs::{self, File};
use std::path::Path;

use crate::packages;
use estimator_core::{AngularRate, ImuSample, Load, SpecificForce, Timestamp, Validity, Vec3};
use footfall::commands::convert::{Bag, ConvertFormat, ConvertedFoot, samples, write_table};
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, simulate};
use options::{BagOptions, InputOptions};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use recordings::Opened;
use replay::Span;
use samples::{Label, RecordedSample, VALIDITIES};
use tables::output::{write_recording, write_recording_header, write_recording_row};

const REQUIREMENTS: &str = include_str!("python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/convert.py");

/// Targets of the conversion of a walk.
const TARGETS: [(&str, ConvertFormat); 3] = [
    ("walk.parquet", ConvertFormat::Parquet),
    ("walk.mcap", ConvertFormat::Mcap),
    ("again.csv", ConvertFormat::Csv),
];

/// Converts as the command does, without its messages.
fn convert(folder: &Path, target: &str, form: ConvertFormat) {
    let opened = Opened::new(&folder.join("walk.csv"), None);
    let stored = opened.and_then(|opened| opened.store(&InputOptions::default()));
    let stored = stored.unwrap_or_else(|error| panic!("{error}"));
    let [name, file] = ["walk", "walk.csv"].map(str::to_owned);
    let mut feet = [ConvertedFoot { name, file, stored }];
    let [foot] = &mut feet;
    let span = Span::default();
    let mut read = samples(&mut foot.stored, span).expect("samples");
    let has_load = read.any(|sample| sample.expect("a sample").load.is_some());
    drop(read);
    let path = folder.join(target);
    let written = match form {
        ConvertFormat::Csv | ConvertFormat::Parquet => {
            let mut file = File::create(&path).expect("a file");
            write_table(form, &mut foot.stored, span, &mut file)
        }
        ConvertFormat::Mcap => {
            let bag = Bag::new(&feet, has_load).expect("before 2038");
            let mut file = File::create(&path).expect("a file");
            bag.write(&mut feet, span, &mut file)
        }
    };
    written.unwrap_or_else(|error| panic!("{target}: {error}"));
}

/// Reads a file, with the start of its clock, µs.
fn read(path: &Path, has_load: bool) -> (i64, Vec<RecordedSample>) {
    let is_bag = path.extension().is_none_or(|extension| extension == "mcap");
    let load = "/footfall/walk/load".parse().expect("a topic");
    let input_options = InputOptions {
        bag: BagOptions {
            loads: if is_bag && has_load { vec![load] } else { Vec::new() },
            ..BagOptions::default()
        },
        ..InputOptions::default()
    };
    let opened = Opened::new(path, None).unwrap_or_else(|error| panic!("{error}"));
    let loaded = opened.read(&input_options).unwrap_or_else(|error| panic!("{error}"));
    (loaded.start_us, loaded.recording.samples)
}

/// Bits of a sample; all NaNs are equal.
fn bits(sample: &RecordedSample) -> impl PartialEq + std::fmt::Debug + use<> {
    let number = |value: f32| {
        if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() }
    };
    let of = |Vec3 { x, y, z }: Vec3| [x, y, z].map(number);
    (
        sample.imu.timestamp.as_micros(),
        of(sample.imu.specific_force.0),
        of(sample.imu.angular_rate.0),
        sample.imu.validity,
        sample.load.map(|Load(load)| number(load)),
        sample.label,
    )
}

/// Any number that a sensor can be read as.
fn reading() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -200.0_f32..200.0,
        1 => any::<f32>(),
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1.0e-45]),
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    (reading(), reading(), reading()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Any sample, and the time since the previous one, µs.
fn step() -> impl Strategy<Value = (u64, RecordedSample)> {
    let validity = prop_oneof![
        3 => Just(Validity::Valid),
        1 => prop::sample::select(VALIDITIES.map(|(_, validity)| validity).to_vec()),
    ];
    let label = prop::option::of(any::<bool>());
    let load = prop::option::of(-1.0e4_f32..1.0e4);
    let sample = (vector(), vector(), validity, load, label);
    let sample = sample.prop_map(|(force, rate, validity, load, label)| RecordedSample {
        imu: ImuSample {
            timestamp: Timestamp::default(),
            specific_force: SpecificForce(force),
            angular_rate: AngularRate(rate),
            validity,
        },
        load: load.map(Load),
        label: label.map(|is_stable| if is_stable { Label::Stable } else { Label::NotStable }),
    });
    // Includes gaps that exceed the lifetime of a load.
    (prop_oneof![9 => 500_u64..3000, 1 => 1_u64..400_000], sample)
}

#[test]
fn any_samples_are_restored_from_every_format() {
    let starts = prop_oneof![
        Just(0_i64),
        -5_000_000_i64..5_000_000,
        1_600_000_000_000_000_i64..1_900_000_000_000_000,
    ];
    let walks = (starts, prop::collection::vec(step(), 2..60));
    let mut runner = TestRunner::new(Config::with_cases(40));
    let result = runner.run(&walks, |(start_us, steps)| {
        let folder = tempfile::tempdir().expect("a folder");
        let mut time_us = 0;
        let mut table = Vec::new();
        write_recording_header(&mut table).expect("memory");
        let mut samples = Vec::new();
        for (number, (step_us, mut sample)) in steps.into_iter().enumerate() {
            time_us += if number == 0 { 0 } else { step_us };
            sample.imu.timestamp = Timestamp::from_micros(time_us);
            write_recording_row(&sample, start_us, &mut table).expect("memory");
            samples.push(sample);
        }
        fs::write(folder.path().join("walk.csv"), table).expect("a file");
        let has_load = samples.iter().any(|sample| sample.load.is_some());
        let expected: Vec<_> = samples.iter().map(bits).collect();
        for (target, form) in TARGETS {
            convert(folder.path(), target, form);
            let (found_us, found) = read(&folder.path().join(target), has_load);
            let shift_us = found_us - start_us;
            prop_assert!(
                shift_us == 0 || (start_us <= 0 && shift_us > 0 && shift_us % 1_000_000 == 0),
                "{target}: {shift_us}"
            );
            let found: Vec<_> = found.iter().map(bits).collect();
            prop_assert_eq!(&found, &expected, "{}", target);
        }
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn third_party_libraries_find_every_value() {
    let Some(packages) = packages::install("python-roads", REQUIREMENTS) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let simulation = simulate(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    let mut samples = simulation.recording.samples;
    for (number, sample) in samples.iter_mut().enumerate() {
        // All cases of a table: gaps in loads and labels, samples that are not numbers.
        if number % 700 >= 600 {
            sample.load = None;
        }
        if number % 900 >= 500 {
            sample.label = None;
        }
        if number % 1013 == 7 {
            sample.imu.specific_force.0.y = f32::NAN;
            sample.imu.validity = Validity::Stale;
        }
    }
    let mut table = Vec::new();
    write_recording(&samples, &mut table).expect("memory");
    let walk = folder.path().join("walk.csv");
    fs::write(&walk, table).expect("a file");
    for (target, form) in TARGETS {
        convert(folder.path(), target, form);
    }
    let same = |name: &str| fs::read(folder.path().join(name)).expect("a file");
    assert!(same("again.csv") == same("walk.csv"));
    let count = packages.run(SCRIPT, &[&walk, &folder.path()]);
    assert_eq!(count, samples.len().to_string());
}
