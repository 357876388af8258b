//! Sensor input of real and simulated robots, fed to the product's ELF: every probability that it sends equals the
//! host's to the bit.

use crate::common::digest::assert_reproduced_on;
use crate::common::product;
use host_tests::datasets::recorded;
use options::Format;
use results::{Measurement, rounded};
use serde_json::Value;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::motion;
use virtual_board::product::on_all_cores;
use virtual_board::product::report::{self, RunOptions};

/// Recordings, each with its format and the start of its playback, s: those of `broad` rest for half a minute.
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
    let motion = motion::recorded(&path, Some(format), skip).expect("a recording");
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

/// The shortest of the recordings.
#[test]
fn every_estimate_of_a_recording_has_the_bits_of_the_host() {
    let Some(elf) = product() else { return };
    play(&elf, "pce/GO1_matress.csv pce-go1 0");
}

#[test]
#[ignore = "full: 14 recordings, 4 minutes of virtual time"]
fn every_estimate_of_every_recording_has_the_bits_of_the_host() {
    let Some(elf) = product() else { return };
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
