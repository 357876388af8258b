//! Programs in C and C++ with the static library: the example gives the bits of the Rust estimator over recorded walks, on
//! this machine and on QEMU's processors; the header has the layout of the library.

mod packages;

use std::env;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use estimator_c::error::Error;
use estimator_c::estimator::{MOST_SAMPLES, SIZE};
use estimator_c::types::{CEstimate, CLearnt, CParams, CSample, VALIDITIES};
use estimator_core::{
    ContactEstimate, Decision, Flag, Flags, Gravity, Learning, Load, Phase, Saturation, Validity,
};
use host_tests::datasets::{recorded, simulated};
use host_tests::requirements::unmet;
use host_tests::sets::Set;
use recordings::config::default_params;
use recordings::estimate::estimates_and_learnt;
use recordings::input::{self, Format, InputOptions};
use recordings::samples::Recording;
use results::Measurement;
use tempfile::TempDir;

const C: [&str; 2] = ["cc", "-std=c99"];
const CPP: [&str; 4] = ["c++", "-x", "c++", "-std=c++17"];
const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];
const SANITIZERS: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover"];

/// A processor: folder of its library, compiler with its options, command that runs a program.
struct Processor {
    folder: &'static str,
    compiler: &'static str,
    options: &'static str,
    run: &'static str,
}

const ARM: &str = "-mthumb --specs=rdimon.specs";
const QEMU_ARM: &str = "qemu-system-arm -nographic -monitor none -serial none -semihosting-config enable=on,target=native";

const fn cortex_m(folder: &'static str, options: &'static str, run: &'static str) -> Processor {
    Processor { folder, compiler: "arm-none-eabi-gcc", options, run }
}

const fn riscv32(folder: &'static str, options: &'static str) -> Processor {
    let run = "qemu-system-riscv32 -machine virt -bios none -nographic -monitor none -serial none \
               -chardev stdio,id=console -semihosting-config enable=on,chardev=console -kernel";
    Processor { folder, compiler: "riscv64-unknown-elf-gcc", options, run }
}

/// Options for a RISC-V in QEMU.
const RISCV: &str = "--specs=picolibc.specs --oslib=semihost --crt0=semihost -Wl,--wrap=fgets \
    -Wl,--defsym=__flash=0x80000000,--defsym=__flash_size=0x200000,--defsym=__ram=0x80200000,--defsym=__ram_size=0x200000";

/// Largest size of a library's object, bytes of code and constants. RISC-V has the largest: a call takes 8 bytes there, and
/// floating point is 1,400 calls. A linker that relaxes them leaves less than 30 KiB.
const LARGEST_LIBRARY: u32 = 36 * 1024;

/// Largest stack of `init` and of `update`, bytes, on any processor; a Pico's program has 2 KiB.
const MOST_INIT_STACK: u32 = 2048;
const MOST_UPDATE_STACK: u32 = 1280;

const M0: &str = "-machine microbit";
const M3: &str = "-machine mps2-an385";
const M4: &str = "-machine netduinoplus2";
const M7: &str = "-machine mps2-an500";
const M33: &str = "-machine mps2-an505";
const M55: &str = "-machine mps3-an547";

/// Memory of these machines, as options of the linker.
fn memory(machine: &str) -> &'static str {
    match machine {
        M0 => "-Wl,--defsym=rom=0,--defsym=ram=0x20000000,--defsym=ram_size=0x4000",
        M4 => "-Wl,--defsym=rom=0x08000000,--defsym=ram=0x20000000,--defsym=ram_size=0x20000",
        M3 | M7 | M55 => "-Wl,--defsym=rom=0,--defsym=ram=0x20000000,--defsym=ram_size=0x20000",
        _ => "-Wl,--defsym=rom=0x10000000,--defsym=ram=0x38000000,--defsym=ram_size=0x20000",
    }
}

const PROCESSORS: [Processor; 16] = [
    cortex_m("cortex-m0", "-mcpu=cortex-m0", M0),
    cortex_m("cortex-m3", "-mcpu=cortex-m3", M3),
    cortex_m("cortex-m4", "-mcpu=cortex-m4 -mfloat-abi=soft", M4),
    cortex_m(
        "cortex-m4/fpv4-sp-d16-softfp",
        "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=softfp",
        M4,
    ),
    cortex_m(
        "cortex-m4/fpv4-sp-d16-hard",
        "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard",
        M4,
    ),
    cortex_m("cortex-m7/fpv5-d16-softfp", "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=softfp", M7),
    cortex_m("cortex-m7/fpv5-d16-hard", "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard", M7),
    cortex_m("cortex-m33", "-mcpu=cortex-m33 -mfloat-abi=soft", M33),
    cortex_m("cortex-m33/softfp", "-mcpu=cortex-m33 -mfloat-abi=softfp", M33),
    cortex_m(
        "cortex-m33/fpv5-sp-d16-hard",
        "-mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard",
        M33,
    ),
    cortex_m("cortex-m55/hard", "-mcpu=cortex-m55 -mfloat-abi=hard", M55),
    riscv32("esp32c3", "-march=rv32imc -mabi=ilp32"),
    riscv32("esp32p4", "-march=rv32imafc -mabi=ilp32f"),
    Processor {
        folder: "aarch64",
        compiler: "aarch64-linux-gnu-gcc",
        options: "-static",
        run: "qemu-aarch64",
    },
    Processor { folder: "i386", compiler: "i686-linux-gnu-gcc", options: "-static", run: "" },
    Processor { folder: "x86_64", compiler: "cc", options: "", run: "" },
];

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a command, which must succeed.
fn run(command: &mut Command) -> Output {
    let output = command.output();
    let output = output.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    output
}

/// Builds the static library for this machine as the archive has it.
fn library() -> PathBuf {
    let mut cargo = Command::new(env!("CARGO"));
    let arguments =
        "rustc --lib --profile firmware --crate-type staticlib --features alone --config";
    cargo.current_dir(folder()).args(arguments.split(' '));
    cargo.arg("profile.firmware.panic='abort'");
    let built = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a target directory");
    run(cargo.env("CARGO_TARGET_DIR", built));
    built.join("firmware/libestimator_c.a")
}

/// The unpacked archive for all processors, packed once for all tests.
static ARCHIVE: LazyLock<PathBuf> = LazyLock::new(|| {
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

/// Returns whether the compiler is installed.
fn installed(compiler: &str, package: &str) -> bool {
    let found = Command::new(compiler).arg("--version").output().is_ok();
    if !found {
        unmet(&format!("{compiler} is not installed (Debian: apt-get install {package})"));
    }
    found
}

/// A walk as lines for the example, and its answer by the Rust estimator.
fn walk(file: &str) -> (String, String) {
    let loaded =
        input::read(&simulated(file), Format::Csv, &InputOptions::default()).expect("a recording");
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
fn input_of(recording: &Recording, most: usize) -> String {
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
fn assert_same_bits(folder: &Path, mut program: impl FnMut() -> Command) {
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

/// Compiles a program for this machine with warnings as errors and sanitizers, and links it.
fn compile(compiler: &[&str], source: &Path, library: &Path, program: &Path) {
    let [name, options @ ..] = compiler else { unreachable!("a compiler") };
    let mut command = Command::new(name);
    command.args(options).args(WARNINGS).args(SANITIZERS);
    command.arg("-I").arg(folder().join("include")).arg(source);
    run(command.args(["-x", "none"]).arg(library).args(["-lm", "-o"]).arg(program));
}

#[test]
fn programs_in_c_and_cpp_have_the_bits_of_rust() {
    let library = library();
    let temporary = tempfile::tempdir().expect("a temporary directory");
    for (compiler, package) in [(&C[..], "gcc"), (&CPP[..], "g++")] {
        if installed(compiler[0], package) {
            let program = temporary.path().join(compiler[0]);
            let source = folder().join("examples/walk.c");
            compile(compiler, &source, &library, &program);
            let (lines, _) = walk("walk.csv");
            let input = temporary.path().join("input");
            fs::write(&input, &lines).expect("a file");
            let mut shown = Command::new(&program);
            let shown = run(shown.stdin(File::open(&input).expect("a file")));
            let shown = String::from_utf8(shown.stdout).expect("text");
            assert_eq!(shown.lines().count(), lines.lines().count() - 2);
            assert!(shown.lines().any(|line| line.ends_with("  stable")));
            let with_bits = [compiler, &["-DBITS"]].concat();
            compile(&with_bits, &source, &library, &program);
            assert_same_bits(temporary.path(), || Command::new(&program));
        }
    }
}

/// Compiles the example for a processor, with more files, and returns the command that runs it.
fn program_for(processor: &Processor, archive: &Path, to: &Path, more: &[&str]) -> Command {
    let board = folder().join("examples/board");
    let is_arm = processor.compiler.starts_with("arm");
    let mut command = Command::new(processor.compiler);
    command.args(["-std=gnu99", "-Os", "-DBITS"]).args(WARNINGS);
    command.args(processor.options.split_whitespace());
    command.arg("-I").arg(archive.join("src"));
    command.arg(archive.join("examples/walk.c"));
    if is_arm {
        command.args(ARM.split(' ')).arg(board.join("startup.c"));
        command.arg("-T").arg(board.join("link.ld"));
        command.arg(memory(processor.run));
    }
    if processor.compiler.starts_with("riscv") {
        command.args(RISCV.split_whitespace()).arg(board.join("input.c"));
    }
    command.args(more).arg("-L").arg(archive.join("src").join(processor.folder));
    run(command.args(["-lfootfall_estimator", "-Wl,--gc-sections", "-o"]).arg(to));
    let line = if is_arm {
        format!("{QEMU_ARM} {} -kernel", processor.run)
    } else {
        processor.run.to_owned()
    };
    let program = to.display().to_string();
    let mut words = line.split_whitespace().chain([program.as_str()]);
    let mut command = Command::new(words.next().expect("a program"));
    command.args(words);
    command
}

#[test]
#[ignore = "full: compiles for each processor"]
fn every_library_of_the_archive_has_the_bits_of_rust() {
    let archive = ARCHIVE.as_path();
    let temporary = tempfile::tempdir().expect("a temporary directory");
    for processor in &PROCESSORS {
        let program = temporary.path().join("walk");
        assert_same_bits(temporary.path(), || program_for(processor, archive, &program, &[]));
    }
}

#[test]
#[ignore = "full: compiles for each processor"]
fn instructions_of_an_update_are_in_the_results() {
    let archive = ARCHIVE.as_path();
    let mut result = Measurement::new(
        "processors",
        "Size of the C library's object for each processor, stack of its calls by painting over two walks, and instructions of \
         an update in QEMU over a walk at 1 kHz, to hundreds. The bound is 15 % above the largest count.",
    )
    .measured_by("cargo test -p estimator-c instructions_of_an_update_are_in_the_results -- --ignored");
    for processor in PROCESSORS.iter().filter(|other| other.run.contains("-machine")) {
        let [init, update, _] = stack(processor);
        let counted = Counter::new(processor).count(&walk("walk.csv").0);
        let size =
            code_size(&archive.join("src").join(processor.folder).join("libfootfall_estimator.a"));
        assert!(size <= LARGEST_LIBRARY, "{}: {size} bytes", processor.folder);
        let rounded = |count: u32| (count + 50) / 100 * 100;
        result.row([
            ("processor", processor.folder.into()),
            ("library_bytes", size.into()),
            ("init_stack_bytes", init.into()),
            ("update_stack_bytes", update.into()),
            ("mean_instructions", rounded(counted.mean).into()),
            ("largest_instructions", rounded(counted.largest).into()),
            ("bound_instructions", counted.bound().into()),
        ]);
    }
    result.assert_current();
}

/// Instructions of an update over a recording.
struct Counted {
    mean: u32,
    largest: u32,
}

impl Counted {
    /// Number of instructions that no update exceeds, from the count over the walk, in hundreds.
    fn bound(&self) -> u32 {
        (self.largest * 115 / 100).next_multiple_of(100)
    }
}

/// The example for a processor, with a count of the instructions of each update.
struct Counter {
    temporary: TempDir,
    command: Command,
}

impl Counter {
    fn new(processor: &Processor) -> Self {
        let temporary = tempfile::tempdir().expect("a temporary directory");
        let counter = folder().join("examples/board/count.c");
        let wrapped = "-Wl,--wrap=footfall_estimator_update,--wrap=footfall_estimator_learnt";
        let more = [counter.to_str().expect("text"), wrapped];
        let program = temporary.path().join("walk");
        let mut command = program_for(processor, ARCHIVE.as_path(), &program, &more);
        command.args(["-icount", "shift=0"]).current_dir(temporary.path());
        Self { temporary, command }
    }

    /// Runs the example over these lines.
    fn count(&mut self, lines: &str) -> Counted {
        let input = self.temporary.path().join("input");
        fs::write(&input, lines).expect("a file");
        let output = run(self.command.stdin(File::open(&input).expect("a file")));
        let printed = String::from_utf8(output.stdout).expect("text");
        let counts = printed.lines().find_map(|line| line.strip_prefix("instructions "));
        let (mean, largest) = counts.and_then(|both| both.split_once(' ')).expect("two counts");
        let [mean, largest] = [mean, largest].map(|count| count.parse().expect("a count"));
        Counted { mean, largest }
    }
}

/// Robots, shoes and sensors in a hand, with other motions, sensors and rates than the walk.
#[test]
#[ignore = "full: compiles for each processor"]
fn instructions_of_other_recordings_are_within_the_bound() {
    // With hardware floating point each operation takes the same time; without, it depends on the numbers.
    for (processor, most) in [("cortex-m4/fpv4-sp-d16-hard", 20_000), ("cortex-m4", 2_500)] {
        let processor = PROCESSORS.iter().find(|other| other.folder == processor);
        let mut counter = Counter::new(processor.expect("a processor"));
        let bound = counter.count(&walk("walk.csv").0).bound();
        let mut check = |name: &str, recording: &Recording| {
            let largest = counter.count(&input_of(recording, most)).largest;
            println!("{name}: {largest} of {bound}");
            assert!(largest <= bound, "{name}: {largest}, bound {bound}");
        };
        for set in [Set::Shoe, Set::Talos, Set::RealNao, Set::Go1, Set::PushedNao] {
            for labelled in set.read().into_iter().flatten() {
                check(&format!("{set:?}"), &labelled.recording);
            }
        }
        for file in ["walkers/strides/16-1_rf.csv", "broad/24_disturbed_tapping_A.csv"] {
            if let Some(path) = recorded(file) {
                let loaded = input::read(&path, Format::Csv, &InputOptions::default());
                check(file, &loaded.expect("a recording").recording);
            }
        }
    }
}

/// Stack of `init`, `update` and `learnt` over two walks, bytes: those below the caller's that a call has changed.
fn stack(processor: &Processor) -> [u32; 3] {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let painter = folder().join("examples/board/paint.c");
    let wrapped = "-Wl,--wrap=footfall_estimator_init,--wrap=footfall_estimator_update,--wrap=footfall_estimator_learnt";
    let more = [painter.to_str().expect("text"), wrapped];
    let program = temporary.path().join("walk");
    let mut command = program_for(processor, ARCHIVE.as_path(), &program, &more);
    command.current_dir(temporary.path());
    let mut largest = [0; 3];
    for file in ["walk.csv", "slip.csv"] {
        let input = temporary.path().join("input");
        fs::write(&input, walk(file).0).expect("a file");
        let output = run(command.stdin(File::open(&input).expect("a file")));
        let printed = String::from_utf8(output.stdout).expect("text");
        let sizes = printed.lines().find_map(|line| line.strip_prefix("stack "));
        let sizes = sizes.expect("sizes").split(' ');
        let sizes = sizes.map(|size| size.parse::<u32>().expect("a number"));
        for (most, size) in largest.iter_mut().zip(sizes) {
            *most = size.max(*most);
        }
    }
    largest
}

#[test]
#[ignore = "full: compiles for each processor"]
fn stack_of_each_library_is_within_the_bounds() {
    for processor in PROCESSORS.iter().filter(|other| other.run.contains("-machine")) {
        let sizes @ [init, update, _] = stack(processor);
        println!("{}: {sizes:?}", processor.folder);
        assert!(init > 0 && init <= MOST_INIT_STACK, "{}: init {init}", processor.folder);
        assert!(update > 0 && update <= MOST_UPDATE_STACK, "{}: update {update}", processor.folder);
    }
}

/// Bytes of code and constants in a library.
fn code_size(library: &Path) -> u32 {
    let output = run(Command::new("size").arg("-B").arg(library));
    let text = String::from_utf8(output.stdout).expect("text");
    let row = text.lines().nth(1).expect("a row");
    let size = row.split_whitespace().next().expect("a column");
    size.parse().expect("a number")
}

#[test]
fn programs_of_the_document_compile_as_c_and_cpp() {
    let document = folder().join("../docs/guide/your-own-board.md");
    let text = fs::read_to_string(document).expect("the document");
    let mut programs = text.split("```c\n").skip(1).map(|rest| rest.split("```").next());
    let mut program = || programs.next().flatten().expect("a program");
    let (source, batch) = (program(), program());
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let path = temporary.path().join("foot.c");
    let yours = "#include <string.h>\n\
                 static uint64_t now_us(void) { return 16000; }\n\
                 static size_t fifo_read(footfall_sample *samples, size_t most) {\n    \
                 memset(samples, 0, most * sizeof *samples);\n    return most;\n}\n";
    let read = format!(
        "static int foot_read(void) {{\n    footfall_estimate estimate;\n{batch}\n    \
         return samples[0].timestamp_us != 2000 || estimate.timestamp_us != 16000;\n}}\n"
    );
    let main = "int main(void) {\n    footfall_sample sample = {0, {0, 0, 0}, {0, 0, 0}, 0};\n    \
                return foot_start() + foot_may_be_leant_on(&sample) + foot_read();\n}\n";
    fs::write(&path, format!("{source}\n{yours}{read}{main}")).expect("a file");
    let library = library();
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
        "footfall_learnt" = CLearnt { version, values, crc }
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
    assert_same_in_c(&expected);
}

/// Constants of the header, and their values in the library.
fn constants() -> Vec<(String, usize)> {
    let mut constants = vec![
        ("FOOTFALL_OK".to_owned(), 0),
        ("FOOTFALL_MOST_SAMPLES".to_owned(), MOST_SAMPLES),
        ("FOOTFALL_ESTIMATOR_SIZE".to_owned(), SIZE),
    ];
    let mut add = |kind: &str, name: &str, value: usize| {
        constants.push((format!("FOOTFALL_{kind}{}", name.to_uppercase()), value));
    };
    for (name, error) in [
        ("null", Error::Null),
        ("misaligned", Error::Misaligned),
        ("too_small", Error::TooSmall),
        ("not_initialised", Error::NotInitialised),
        ("choice", Error::Choice),
        ("sample_rate", Error::SampleRate),
        ("decision", Error::Decision),
        ("load", Error::Load),
        ("velocity", Error::Velocity),
        ("learnt", Error::Learnt),
        ("count", Error::Count),
        ("unit", Error::Unit),
    ] {
        add("ERROR_", name, error as usize);
    }
    for (name, validity) in [
        ("valid", Validity::Valid),
        ("accelerometer_saturated", Validity::Saturated(Saturation::Accelerometer)),
        ("gyroscope_saturated", Validity::Saturated(Saturation::Gyroscope)),
        ("saturated", Validity::Saturated(Saturation::Both)),
        ("stale", Validity::Stale),
        ("invalid", Validity::Invalid),
    ] {
        let checked = |validity| CSample { validity, ..CSample::default() }.checked();
        add("SAMPLE_", name, number(|n| checked(n).is_ok_and(|read| read.validity == validity)));
    }
    let checked = |params: CParams| params.checked().expect("a constant");
    for (name, gravity) in [("included", Gravity::Included), ("removed", Gravity::Removed)] {
        let read = |gravity| checked(CParams { gravity, ..CParams::default() }).gravity;
        add("GRAVITY_", name, number(|n| read(n) == gravity));
    }
    for (name, learning) in [("on", Learning::On), ("frozen", Learning::Frozen)] {
        let read = |learning| checked(CParams { learning, ..CParams::default() }).learning;
        add("LEARNING_", name, number(|n| read(n) == learning));
    }
    let doubtful = ContactEstimate::DOUBTFUL;
    let converted = |estimate: ContactEstimate| CEstimate::from(&estimate);
    for flag in Flag::ALL {
        let flags = Flags::NONE.with(flag);
        let estimate = converted(ContactEstimate { flags, ..doubtful });
        add("FLAG_", flag.name(), estimate.flags.into());
    }
    for phase in Phase::ALL {
        let estimate = converted(ContactEstimate { phase, ..doubtful });
        add("PHASE_", phase.name(), estimate.phase.into());
    }
    for (name, decision) in [("not_stable", Decision::NotStable), ("stable", Decision::Stable)] {
        let estimate = converted(ContactEstimate { decision, ..doubtful });
        add("", name, estimate.decision.into());
    }
    constants
}

/// First number of C that the library takes for a value.
fn number(is_taken: impl Fn(u8) -> bool) -> usize {
    (0..=u8::MAX).position(is_taken).expect("a number of each value")
}

#[test]
fn header_has_the_constants_of_the_library() {
    if !installed(C[0], "gcc") {
        return;
    }
    let expected = constants();
    // The version has tests of its own.
    let header = include_str!("../../include/footfall_estimator.h");
    let parts = header.lines().flat_map(|line| line.split(['{', ',']));
    let enumerated = parts.filter_map(|part| Some(part.split_once(" = ")?.0.trim()));
    let enumerated: Vec<&str> = enumerated.filter(|name| name.starts_with("FOOTFALL_")).collect();
    assert!(enumerated.len() > 30, "{enumerated:?}");
    for name in enumerated {
        assert!(expected.iter().any(|(known, _)| known == name), "{name} is not compared");
    }
    assert_same_in_c(&expected);
}

/// Compares expressions of C with values of the library.
fn assert_same_in_c(expected: &[(String, usize)]) {
    let mut source = "#include <stddef.h>\n#include <stdio.h>\n#include \"footfall_estimator.h\"\nint main(void) {\n".to_owned();
    for (expression, _) in expected {
        writeln!(source, "    printf(\"%zu\\n\", (size_t)({expression}));").expect("memory");
    }
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let (path, program) = (temporary.path().join("layout.c"), temporary.path().join("layout"));
    fs::write(&path, source + "    return 0;\n}\n").expect("a file");
    compile(&C, &path, &library(), &program);
    let printed = String::from_utf8(run(&mut Command::new(program)).stdout).expect("text");
    for (value, (expression, expected)) in printed.lines().zip(expected) {
        assert_eq!(value.parse(), Ok(*expected), "{expression}");
    }
    assert_eq!(printed.lines().count(), expected.len());
}
