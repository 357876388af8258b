//! Sensor input of real and simulated robots, fed to the product's ELF: every probability that it sends equals the
//! host's to the bit.

use crate::common::digest::assert_block_of;
use crate::common::product;
use host_tests::datasets::recorded;
use recordings::input::Format;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::cores::on_all_cores;
use virtual_board::product::recorded;
use virtual_board::product::report::{self, RunOptions};

/// A recording, and the start of its playback, s: those of `broad` rest for half a minute.
struct Recorded {
    file: &'static str,
    format: Format,
    skip: f64,
}

const fn all_of(file: &'static str, format: Format) -> Recorded {
    from(file, format, 0.0)
}

const fn from(file: &'static str, format: Format, skip: f64) -> Recorded {
    Recorded { file, format, skip }
}

const RECORDINGS: [Recorded; 14] = [
    all_of("pce/ATLAS_01ground.csv", Format::PceAtlas),
    all_of("pce/ATLAS_01ground_3steps.csv", Format::PceAtlas),
    all_of("pce/ATLAS_01ground_003slip.csv", Format::PceAtlas),
    all_of("pce/GO1_matress.csv", Format::PceGo1),
    all_of("pce/GO1_normal_surface.csv", Format::PceGo1),
    all_of("pce/GO1_slippery_surface.csv", Format::PceGo1),
    all_of("lcd/ATLAS_7k_04ground.csv", Format::Lcd),
    all_of("lcd/NAO_05ground.csv", Format::Lcd),
    from(
        "broad/02_undisturbed_slow_rotation_B.csv",
        Format::Csv,
        32.0,
    ),
    from(
        "broad/07_undisturbed_fast_rotation_B.csv",
        Format::Csv,
        18.0,
    ),
    from(
        "broad/11_undisturbed_slow_translation_B.csv",
        Format::Csv,
        24.0,
    ),
    from(
        "broad/15_undisturbed_fast_translation_A.csv",
        Format::Csv,
        32.0,
    ),
    from("broad/24_disturbed_tapping_A.csv", Format::Csv, 36.0),
    from(
        "broad/27_disturbed_phone_vibration_B.csv",
        Format::Csv,
        37.0,
    ),
];

/// Maximum duration of each recording in the table, s.
const LONGEST: f64 = 20.0;

/// Estimates before the first sample, while board and sensor start, are compared as well.
const START_MS: u64 = 100;

/// Part of a recording that is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// [`LONGEST`], from the recording's own start of its playback on.
    Excerpt,
    /// All of it.
    Whole,
}

/// Plays a recording and returns a row of the table; `None` if the file is absent.
fn play(elf: &[u8], which: &Recorded, part: Part) -> Option<String> {
    let path = recorded(which.file)?;
    let skip = if part == Part::Whole { 0.0 } else { which.skip };
    let motion = recorded::read(&path, Some(which.format), skip).expect("a recording");
    let whole = motion.duration();
    let seconds = match part {
        Part::Whole => whole,
        Part::Excerpt => whole.min(LONGEST),
    };
    let run = RunOptions {
        milliseconds: (seconds * 1000.0) as u64,
        ..RunOptions::default()
    };
    let mut board =
        Board::with_motion(elf, BoardOptions::default(), motion).expect("it fits the flash");
    let report = report::run(&mut board, &run).expect("it runs");
    let name = which.file;
    assert_eq!(report["parity_mismatches"], 0, "{name}: {report:#}");
    let compared = ["uart", "can"].map(|line| {
        let compared = report["parity_compared"][line].as_u64().unwrap_or(0);
        assert!(compared + START_MS > run.milliseconds, "{name}: {report:#}");
        compared
    });
    Some(format!(
        "| `{name}` | {skip:.0} s | {seconds:.1} s | {} | {} | {} |\n",
        compared[0], compared[1], report["parity_mismatches"]
    ))
}

/// The shortest of the recordings.
#[test]
fn every_estimate_of_a_recording_has_the_bits_of_the_host() {
    let Some(elf) = product() else { return };
    let which = all_of("pce/GO1_matress.csv", Format::PceGo1);
    play(&elf, &which, Part::Excerpt);
}

#[test]
#[ignore = "full: 14 recordings, 4 minutes of virtual time"]
fn every_estimate_of_every_recording_has_the_bits_of_the_host() {
    let Some(elf) = product() else { return };
    let rows = on_all_cores(&RECORDINGS, |which| play(&elf, which, Part::Excerpt));
    let Some(rows) = rows.into_iter().collect::<Option<String>>() else {
        return;
    };
    let head = "\
| recording | from | for | compared over the serial line | over CAN | that differ in a bit |
|---|---|---|---|---|---|
";
    let table = format!("{head}{rows}");
    assert_block_of(&[Wiring::reference().program], "recordings", &table);
}

#[test]
#[ignore = "full: all of each recording, many minutes of virtual time"]
fn every_estimate_of_whole_recordings_has_the_bits_of_the_host() {
    let Some(elf) = product() else { return };
    on_all_cores(&RECORDINGS, |which| play(&elf, which, Part::Whole));
}
