//! Sensor input of real and simulated robots, fed to the product's ELF: every probability that it sends equals the
//! host's to the bit.

use std::path::Path;

use crate::common::product;
use crate::digest::assert_reproduced_on;
use estimator_core::Gravity;
use gait::sensor::GRAVITY;
use host_tests::datasets::recorded;
use lsm6dsox::sim::{Interpolation, Recording, Stimulus};
use options::{Format, InputOptions};
use recordings::Opened;
use results::{Measurement, rounded};
use samples::space::components;
use serde_json::Value;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::motion::TEMPERATURE;
use virtual_board::product::on_all_cores;
use virtual_board::product::report::{self, RunOptions};

/// Recordings, each with its format and the start of its playback, s: the recordings of `broad` rest for half a minute.
const RECORDINGS: &str = "\
pce/ATLAS_01ground.csv pce-atlas 0
pce/ATLAS_01ground_3steps.csv pce-atlas 0
pce/ATLAS_01ground_003slip.csv pce-atlas 0
pce/GO1_matress.csv pce-go1 0
pce/GO1_normal_surface.csv pce-go1 0
pce/GO1_slippery_surface.csv pce-go1 0
lcd/ATLAS_7k_04ground.csv lcd 0
lcd/NAO_05ground.csv lcd 0
broad/02_undisturbed_slow_rotation_B.csv csv 32
broad/07_undisturbed_fast_rotation_B.csv csv 18
broad/11_undisturbed_slow_translation_B.csv csv 24
broad/15_undisturbed_fast_translation_A.csv csv 32
broad/24_disturbed_tapping_A.csv csv 36
broad/27_disturbed_phone_vibration_B.csv csv 37
";

/// Maximum duration of a playback, s.
const LONGEST: f64 = 20.0;

/// Estimates before the first sample, while board and sensor start, are compared as well.
const START_MS: u64 = 100;

/// Plays a recording and returns the figures of its row; `None` if the file is absent.
fn play(elf: &[u8], which: &str) -> Option<Vec<(&'static str, Value)>> {
    let [name, format, skip] = which.split(' ').collect::<Vec<_>>()[..] else {
        panic!("{which}");
    };
    let (format, skip): (Format, f64) =
        (format.parse().expect("a format"), skip.parse().expect("a number"));
    let path = recorded(name)?;
    let motion = motion_of(&path, Some(format), skip).expect("a recording");
    let seconds = motion.duration().min(LONGEST);
    let run = RunOptions { milliseconds: (seconds * 1000.0) as u64, ..RunOptions::default() };
    let mut board =
        Board::with_motion(elf, BoardOptions::default(), motion).expect("it fits the flash");
    let report = report::run(&mut board, &run).expect("it runs");
    assert_eq!(report["parity_mismatches"], 0, "{name}: {report:#}");
    let [over_serial_line, over_can] = ["uart", "can"].map(|line| {
        let compared = report["parity_compared"][line].as_u64().unwrap_or(0);
        assert!(compared + START_MS > run.milliseconds, "{name}: {report:#}");
        compared
    });
    Some(vec![
        ("recording", name.into()),
        ("from_s", skip.into()),
        ("duration_s", rounded(seconds, 1).into()),
        ("compared_over_serial_line", over_serial_line.into()),
        ("compared_over_can", over_can.into()),
        ("different", report["parity_mismatches"].clone()),
    ])
}

/// Reads a recording as the input of the sensor, without its first `skip` seconds.
///
/// A sensor measures gravity. If a simulator has removed it, which loses the tilt, it is added along z, as for a
/// sole that stays level: the input is then the recorded motion of a foot that does not tilt. Samples are
/// interpolated linearly to the ticks of the sensor's clock, 6.67 kHz, and pass through the noise, filters and
/// ranges of the sensor.
fn motion_of(path: &Path, format: Option<Format>, skip: f64) -> Result<Recording, String> {
    let loaded = Opened::new(path, format)
        .and_then(|opened| opened.read(&InputOptions::default()))
        .map_err(|error| error.to_string())?;
    let recording = loaded.recording;
    let added = match recording.gravity {
        Gravity::Included => 0.0,
        Gravity::Removed => GRAVITY,
    };
    let rate = f64::from(recording.sample_rate);
    let samples = recording
        .samples
        .iter()
        .skip((skip * rate) as usize)
        .map(|sample| {
            let (force, rate) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
            let [ax, ay, az] = components(force).map(f64::from);
            Stimulus {
                specific_force: [ax, ay, az + added],
                angular_rate: components(rate).map(f64::from),
                temperature: TEMPERATURE,
            }
        })
        .collect();
    Recording::new(rate, samples, Interpolation::Linear).map_err(|error| error.to_string())
}

/// The shortest of the recordings.
#[test]
fn every_estimate_of_a_recording_has_the_bits_of_the_host() {
    let elf = product();
    play(&elf, "pce/GO1_matress.csv pce-go1 0");
}

#[test]
#[ignore = "full: 14 recordings, 4 minutes of virtual time"]
fn every_estimate_of_every_recording_has_the_bits_of_the_host() {
    let elf = product();
    let all: Vec<&str> = RECORDINGS.lines().collect();
    let rows = on_all_cores(&all, |which| play(&elf, which));
    let mut result = Measurement::new(
        "recordings",
        "Estimates that the program sends while recordings are played to its sensor, compared with those of the host to \
         the bit.",
    )
    .measured_by("cargo test -p virtual-board recordings:: -- --ignored");
    for row in rows {
        let Some(row) = row else { return };
        result.row(row);
    }
    assert_reproduced_on(&[Wiring::reference().program], result);
}
