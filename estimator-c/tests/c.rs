//! Programs in C and C++ with the static library: the example gives the bits of the Rust estimator over recorded walks, on
//! this machine and on QEMU's Cortex-M0, M4F and M33, where no panic is linked; the header has the layout of the library.

use std::env;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use estimator_c::estimator::SIZE;
use estimator_c::types::{CEstimate, CLearnt, CParams, CSample, VALIDITIES};
use estimator_core::{ContactEstimate, Load};
use host_tests::datasets::simulated;
use host_tests::qemu::stock_board;
use host_tests::requirements::unmet;
use recordings::config::default_params;
use recordings::input::{self, Format, Hints};
use recordings::replay::replay_and_learn;

const C: [&str; 2] = ["cc", "-std=c99"];
const CPP: [&str; 4] = ["c++", "-x", "c++", "-std=c++17"];
const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];
const SANITIZERS: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover"];
/// A processor: Rust's target, options of GCC, machine of QEMU, and its memory.
struct Board {
    target: &'static str,
    options: &'static [&'static str],
    machine: &'static str,
    memory: [&'static str; 3],
}

const BOARDS: [Board; 3] = [
    Board {
        target: "thumbv7em-none-eabihf",
        options: &["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
        machine: "netduinoplus2",
        memory: ["rom=0x08000000", "ram=0x20000000", "ram_size=0x20000"],
    },
    Board {
        target: "thumbv6m-none-eabi",
        options: &["-mcpu=cortex-m0"],
        machine: "microbit",
        memory: ["rom=0", "ram=0x20000000", "ram_size=0x4000"],
    },
    Board {
        target: "thumbv8m.main-none-eabihf",
        options: &["-mcpu=cortex-m33", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"],
        machine: "mps2-an505",
        memory: ["rom=0x10000000", "ram=0x38000000", "ram_size=0x20000"],
    },
];

/// Returns whether Rust's target is installed.
fn has_target(target: &str) -> bool {
    let output = run(Command::new("rustc")
        .args(["--print", "target-libdir", "--target", target])
        .current_dir(folder()));
    let found = Path::new(String::from_utf8_lossy(&output.stdout).trim()).exists();
    if !found {
        unmet(&format!(
            "Rust's target is not installed: rustup target add {target}"
        ));
    }
    found
}

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a command to its end, which must be a success.
fn run(command: &mut Command) -> Output {
    let output = command.output().expect("a program that starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    output
}

/// Builds the static library, as a user does.
fn library(target: Option<&str>) -> PathBuf {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(folder());
    cargo.args(["build", "--profile", "firmware", "--package", "estimator-c"]);
    cargo.args(target.map(|target| ["--target", target]).iter().flatten());
    let built = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .expect("a target directory");
    run(cargo.env("CARGO_TARGET_DIR", built));
    built
        .join(target.unwrap_or(""))
        .join("firmware/libestimator_c.a")
}

/// Returns whether the compiler is installed.
fn installed(compiler: &str, package: &str) -> bool {
    let found = Command::new(compiler).arg("--version").output().is_ok();
    if !found {
        unmet(&format!(
            "{compiler} is not installed (Debian: apt-get install {package})"
        ));
    }
    found
}

/// A walk as lines for the example, and its answer by the Rust estimator.
fn walk(file: &str) -> (String, String) {
    let loaded =
        input::read(&simulated(file), Format::Csv, &Hints::default()).expect("a recording");
    let recording = loaded.recording;
    let (estimates, learnt) = replay_and_learn(&recording, &default_params()).expect("the preset");
    let (mut lines, mut answer) = (format!("{}\n", recording.sample_rate), String::new());
    for (sample, estimate) in recording.samples.iter().zip(&estimates) {
        let imu = &sample.imu;
        let ([f, w], Load(load)) = (
            [imu.specific_force.0, imu.angular_rate.0],
            sample.load.unwrap_or(Load(f32::NAN)),
        );
        let validity = VALIDITIES
            .iter()
            .position(|v| *v == imu.validity)
            .expect("a constant");
        let time = imu.timestamp.as_micros();
        writeln!(
            lines,
            "{time} {} {} {} {} {} {} {load} {validity}",
            f.x, f.y, f.z, w.x, w.y, w.z
        )
        .expect("memory");
        line(estimate, &mut answer);
    }
    writeln!(answer, "learnt{}", bits(&learnt.to_array())).expect("memory");
    (lines, answer)
}

fn bits(values: &[f32]) -> String {
    values
        .iter()
        .map(|value| format!(" {:08x}", value.to_bits()))
        .collect()
}

/// The example's line of an estimate, without the conversion under test.
fn line(estimate: &ContactEstimate, to: &mut String) {
    let (p, q) = (&estimate.probabilities, estimate.orientation);
    let (a, w, b) = (
        estimate.linear_acceleration.0,
        estimate.angular_rate.0,
        estimate.gyro_bias.0,
    );
    let values = bits(&[
        p.stable,
        p.tangential,
        p.vertical,
        p.axes.ax,
        p.axes.ay,
        p.axes.az,
        p.axes.wx,
        p.axes.wy,
        p.axes.wz,
        q.w,
        q.x,
        q.y,
        q.z,
        a.x,
        a.y,
        a.z,
        w.x,
        w.y,
        w.z,
        b.x,
        b.y,
        b.z,
        estimate.velocity_sigma.0,
    ]);
    let (time, decision, phase) = (
        estimate.timestamp.as_micros(),
        estimate.decision as u8,
        estimate.phase as u8,
    );
    writeln!(
        to,
        "{time}{values} {decision} {phase} {}",
        estimate.flags.bits()
    )
    .expect("memory");
}

/// Compares the example's output with that of the Rust estimator; each walk starts `program` again.
fn assert_same_bits(folder: &Path, mut program: impl FnMut() -> Command) {
    for file in ["walk.csv", "slip.csv"] {
        let (lines, answer) = walk(file);
        let path = folder.join(file);
        fs::write(&path, lines).expect("a file");
        let output = run(program().stdin(File::open(&path).expect("a file")));
        let printed = String::from_utf8(output.stdout).expect("text");
        assert_eq!(printed.lines().count(), answer.lines().count(), "{file}");
        for (printed, expected) in printed.lines().zip(answer.lines()) {
            assert_eq!(printed, expected, "{file}");
        }
    }
}

/// Compiles a program for this machine with warnings as errors and sanitizers, and links it.
fn compile(compiler: &[&str], source: &Path, library: &Path, program: &Path) {
    let [name, options @ ..] = compiler else {
        unreachable!("a compiler")
    };
    let mut command = Command::new(name);
    command.args(options).args(WARNINGS).args(SANITIZERS);
    command.arg("-I").arg(folder().join("include")).arg(source);
    run(command
        .args(["-x", "none"])
        .arg(library)
        .args(["-lm", "-o"])
        .arg(program));
}

#[test]
fn programs_in_c_and_cpp_have_the_bits_of_rust() {
    let library = library(None);
    let temporary = tempfile::tempdir().expect("a temporary directory");
    for (compiler, package) in [(&C[..], "gcc"), (&CPP[..], "g++")] {
        if installed(compiler[0], package) {
            let program = temporary.path().join(compiler[0]);
            compile(
                compiler,
                &folder().join("examples/walk.c"),
                &library,
                &program,
            );
            assert_same_bits(temporary.path(), || Command::new(&program));
        }
    }
}

#[test]
#[ignore = "full: compiles for three processors"]
fn cortex_m_has_the_bits_of_rust_and_no_panic() {
    let compiler = "arm-none-eabi-gcc";
    let package = "gcc-arm-none-eabi libnewlib-arm-none-eabi";
    if !installed(compiler, package) || stock_board().is_none() {
        return;
    }
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let elf = temporary.path().join("walk.elf");
    let examples = folder().join("examples");
    for Board {
        target,
        options,
        machine,
        memory,
    } in BOARDS
    {
        if !has_target(target) {
            continue;
        }
        let mut command = Command::new(compiler);
        command
            .args(options)
            .args(["-mthumb", "-std=c99", "-Os"])
            .args(WARNINGS);
        command.arg("-I").arg(folder().join("include"));
        command.args(["walk.c", "board/startup.c"].map(|file| examples.join(file)));
        // A reachable panic is an undefined symbol here.
        command
            .arg(library(Some(target)))
            .arg("-T")
            .arg(examples.join("board/link.ld"));
        command.args(memory.map(|value| format!("-Wl,--defsym={value}")));
        run(command
            .args(["--specs=rdimon.specs", "-Wl,--gc-sections", "-o"])
            .arg(&elf));
        assert_same_bits(temporary.path(), || {
            let mut board = stock_board().expect("it was there");
            board.args(["-machine", machine, "-kernel"]).arg(&elf);
            board
        });
    }
}

#[test]
fn program_of_the_document_compiles_as_c_and_cpp() {
    let document = folder().join("../docs/your-own-board.md");
    let text = fs::read_to_string(document).expect("the document");
    let (_, rest) = text.split_once("```c\n").expect("a program");
    let (source, _) = rest.split_once("```").expect("its end");
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let path = temporary.path().join("foot.c");
    let main = "int main(void) {\n    footfall_sample sample = {0, {0, 0, 0}, {0, 0, 0}, 0};\n    \
                return foot_start() + foot_may_be_leant_on(&sample);\n}\n";
    fs::write(&path, format!("{source}\n{main}")).expect("a file");
    let library = library(None);
    for (compiler, package) in [(&C[..], "gcc"), (&CPP[..], "g++")] {
        if installed(compiler[0], package) {
            let program = temporary.path().join(compiler[0]);
            compile(compiler, &path, &library, &program);
            run(&mut Command::new(program));
        }
    }
}

/// A C program's line for the size of a struct or the offset of a field, and the same in Rust.
macro_rules! layout {
    ($($name:literal = $type:ty { $($field:ident),* })*) => {
        [$((format!("sizeof({})", $name), size_of::<$type>()),
            $((format!("offsetof({}, {})", $name, stringify!($field)), offset_of!($type, $field)),)*)*]
    };
}

#[test]
fn header_has_the_layout_of_the_library() {
    if !installed(C[0], "gcc") {
        return;
    }
    let expected = layout! {
        "footfall_learnt" = CLearnt { values }
        "footfall_params" = CParams {
            sample_rate_hz, decision_threshold, decision_on_delay_s, decision_off_delay_s, load_on, load_off,
            velocity_speed_m_s, velocity_lever_m, velocity_floor_m_s, learnt, has_learnt, gravity, learning
        }
        "footfall_sample" = CSample { timestamp_us, specific_force_m_s2, angular_rate_rad_s, validity }
        "footfall_estimate" = CEstimate {
            timestamp_us, stable, tangential, vertical, axes, orientation, linear_acceleration_m_s2,
            angular_rate_rad_s, gyro_bias_rad_s, velocity_sigma_m_s, decision, phase, flags
        }
        "footfall_memory" = [u8; SIZE] {}
    };
    let mut source = "#include <stddef.h>\n#include <stdio.h>\n#include \"footfall_estimator.h\"\nint main(void) {\n".to_owned();
    for (expression, _) in &expected {
        writeln!(source, "    printf(\"%zu\\n\", {expression});").expect("memory");
    }
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let (path, program) = (
        temporary.path().join("layout.c"),
        temporary.path().join("layout"),
    );
    fs::write(&path, source + "    return 0;\n}\n").expect("a file");
    compile(&C, &path, &library(None), &program);
    let printed = String::from_utf8(run(&mut Command::new(program)).stdout).expect("text");
    for (value, (expression, expected)) in printed.lines().zip(&expected) {
        assert_eq!(value.parse(), Ok(*expected), "{expression}");
    }
    assert_eq!(printed.lines().count(), expected.len());
}
