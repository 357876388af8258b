//! The example in C: its library, its input from recorded walks, and the bits that it must print.

use std::env;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use config::default_params;
use estimator_c::types::VALIDITIES;
use estimator_core::{ContactEstimate, Load};
use host_tests::committed::workspace;
use host_tests::datasets::simulated;
use options::{Format, InputOptions};
use samples::Recording;
use samples::estimate::estimates_and_learnt;

pub const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Folder of the package `estimator-c`.
pub fn folder() -> PathBuf {
    workspace().join("estimator-c")
}

/// Runs a command, which must succeed.
pub fn run(command: &mut Command) -> Output {
    let output = command.output();
    let output = output.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    output
}

/// The unpacked archive for all processors: the folder that `FOOTFALL_ARCHIVE` names, or packed once for all tests.
pub static ARCHIVE: LazyLock<PathBuf> = LazyLock::new(|| {
    if let Some(folder) = env::var_os("FOOTFALL_ARCHIVE") {
        return folder.into();
    }
    let root = folder().join("..");
    run(Command::new(env!("CARGO")).current_dir(&root).args(["xtask", "library"]));
    let name = format!("footfall-estimator-{}.zip", env!("CARGO_PKG_VERSION"));
    let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let packed = root.join("dist").join(name);
    let folder = temporary.join("footfall_estimator");
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("no older folder");
    }
    run(Command::new("python3").args(["-m", "zipfile", "-e"]).arg(packed).arg(temporary));
    folder
});

/// A walk as lines for the example, and its answer by the Rust estimator.
pub fn walk(file: &str) -> (String, String) {
    let loaded = recordings::read(&simulated(file), Format::Csv, &InputOptions::default())
        .expect("a recording");
    let recording = loaded.recording;
    let (estimates, learnt) =
        estimates_and_learnt(&recording, &default_params(), || ()).expect("the preset");
    let mut answer = String::new();
    for estimate in &estimates {
        line(estimate, &mut answer);
    }
    writeln!(answer, "learnt{} {:08x}", bits(&learnt.to_array()), learnt.crc()).expect("memory");
    (input_of(&recording, usize::MAX), answer)
}

/// The first samples of a recording, at most `most`, as lines for the example.
pub fn input_of(recording: &Recording, most: usize) -> String {
    let mut lines = format!("{}\n", recording.sample_rate);
    for sample in recording.samples.iter().take(most) {
        let imu = &sample.imu;
        let ([f, w], Load(load)) =
            ([imu.specific_force.0, imu.angular_rate.0], sample.load.unwrap_or(Load(f32::NAN)));
        let validity = VALIDITIES.iter().position(|v| *v == imu.validity).expect("a constant");
        let time = imu.timestamp.as_micros();
        writeln!(lines, "{time} {} {} {} {} {} {} {load} {validity}", f.x, f.y, f.z, w.x, w.y, w.z)
            .expect("memory");
    }
    lines.push('\n');
    lines
}

fn bits(values: &[f32]) -> String {
    values.iter().map(|value| format!(" {:08x}", value.to_bits())).collect()
}

/// The example's line of an estimate, without the conversion under test.
fn line(estimate: &ContactEstimate, to: &mut String) {
    let (p, q) = (&estimate.probabilities, estimate.orientation);
    let (a, w, b) = (&estimate.linear_acceleration, &estimate.angular_rate, &estimate.gyro_bias);
    let values = [p.stable, p.tangential, p.vertical].into_iter();
    let values = values.chain(p.axes.to_array()).chain([q.w, q.x, q.y, q.z]);
    let values = values.chain([a.0, w.0, b.0].into_iter().flat_map(|v| [v.x, v.y, v.z]));
    let values: Vec<f32> = values.chain([estimate.velocity_sigma.0]).collect();
    let (time, values) = (estimate.timestamp.as_micros(), bits(&values));
    let (decision, phase, flags) = (estimate.decision as u8, estimate.phase as u8, estimate.flags);
    writeln!(to, "{time}{values} {decision} {phase} {}", flags.bits()).expect("memory");
}

/// Compares the example's output with that of the Rust estimator; each walk starts `program` again.
pub fn assert_same_bits(folder: &Path, mut program: impl FnMut() -> Command) {
    for file in ["walk.csv", "slip.csv"] {
        let (lines, answer) = walk(file);
        let path = folder.join("input");
        fs::write(&path, lines).expect("a file");
        let output = run(program().current_dir(folder).stdin(File::open(&path).expect("a file")));
        let printed = String::from_utf8(output.stdout).expect("text");
        assert_eq!(printed.lines().count(), answer.lines().count(), "{file}");
        for (printed, expected) in printed.lines().zip(answer.lines()) {
            assert_eq!(printed, expected, "{file}");
        }
    }
}
