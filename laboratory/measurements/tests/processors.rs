//! The library in C on QEMU's processors: the bits of the Rust estimator, sizes, stacks, and instructions of an update.

#[path = "../../../estimator-c/tests/c/support.rs"]
mod support;

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use host_tests::datasets::recorded;
use host_tests::sets::Set;
use options::{Format, InputOptions};
use results::Measurement;
use samples::Recording;
use tempfile::TempDir;

use support::{ARCHIVE, WARNINGS, assert_same_bits, folder, input_of, run, walk};

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

/// Folder of the file of C that stands in for a library.
const GENERIC: &str = "generic";

/// Processors for which that file is compiled.
const GENERICS: [Processor; 5] = [
    cortex_m(GENERIC, "-mcpu=cortex-m0", M0),
    cortex_m(GENERIC, "-mcpu=cortex-m3", M3),
    cortex_m(GENERIC, "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard", M4),
    riscv32(GENERIC, "-march=rv32imc -mabi=ilp32"),
    Processor { folder: GENERIC, compiler: "cc", options: SANITIZED, run: "" },
];

/// Options for this machine, where each unaligned or undefined operation ends the program.
const SANITIZED: &str = "-fsanitize=address,undefined -fno-sanitize-recover";

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
    command.args(more);
    let library = archive.join("src").join(processor.folder);
    if processor.folder == GENERIC {
        command.arg("-DFOOTFALL_GENERIC").arg(library.join("footfall_estimator.c")).arg("-lm");
    } else {
        command.arg("-L").arg(library).arg("-lfootfall_estimator");
    }
    run(command.args(["-Wl,--gc-sections", "-o"]).arg(to));
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
fn generic_c_has_the_bits_of_rust() {
    let archive = ARCHIVE.as_path();
    let temporary = tempfile::tempdir().expect("a temporary directory");
    for processor in &GENERICS {
        println!("{} {}", processor.compiler, processor.options);
        let program = temporary.path().join("walk");
        assert_same_bits(temporary.path(), || program_for(processor, archive, &program, &[]));
    }
}

/// Options of the compiler for an Xtensa without floating point, the LX106 of an ESP8266, and its C library.
const XTENSA: [&str; 4] =
    ["-std=gnu99", "-mlongcalls", "-isystem", "/usr/lib/xtensa-lx106-elf/include"];
const LIBRARIES_OF_XTENSA: [&str; 6] =
    ["-nostdlib", "-L/usr/lib/xtensa-lx106-elf/lib", "-lm", "-lc", "-lgcc", "-o"];

/// The compiler takes the file without an option for it, as it takes the files of a sketch.
#[test]
#[ignore = "full: compiles for each processor"]
fn generic_c_has_the_bits_of_rust_on_an_xtensa() {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let [program, input] = ["walk", "input"].map(|name| temporary.path().join(name));
    run(Command::new("xtensa-lx106-elf-gcc")
        .args(XTENSA)
        .arg("-Os")
        .args(WARNINGS)
        .arg("-I")
        .arg(ARCHIVE.join("src"))
        .arg(ARCHIVE.join("src").join(GENERIC).join("footfall_estimator.c"))
        .arg(folder().join("examples/board/xtensa.c"))
        .args(LIBRARIES_OF_XTENSA)
        .arg(&program));
    for file in ["walk.csv", "slip.csv"] {
        let (lines, answer) = walk(file);
        let samples: Vec<u8> =
            words_of_samples(&lines).into_iter().flat_map(u32::to_le_bytes).collect();
        fs::write(&input, samples).expect("a file");
        let output = run(Command::new("qemu-xtensa")
            .args(["-cpu", "lx106"])
            .arg(&program)
            .stdin(File::open(&input).expect("a file")));
        let words = output.stdout.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes));
        let mut words = words.collect::<Vec<u32>>().into_iter();
        for (place, line) in answer.lines().enumerate() {
            let expected = words_of_answer(line);
            let printed: Vec<u32> = words.by_ref().take(expected.len()).collect();
            assert_eq!(printed, expected, "{file}: line {place}");
        }
        assert_eq!(words.next(), None, "{file}");
    }
}

/// Words of the example's input: integers as they are, and the bits of the other numbers.
fn words_of_samples(lines: &str) -> Vec<u32> {
    let mut lines = lines.split_whitespace();
    let rate: f32 = lines.next().and_then(|rate| rate.parse().ok()).expect("a rate");
    let words = lines.enumerate().map(|(place, word)| match place % 9 {
        0 | 8 => word.parse().expect("an integer"),
        _ => word.parse().map(f32::to_bits).expect("a number"),
    });
    [rate.to_bits()].into_iter().chain(words).collect()
}

/// Words of a line of the example's output behind its first word: bits of numbers, and behind them short integers.
fn words_of_answer(line: &str) -> Vec<u32> {
    let words = line.split(' ').skip(1);
    let radix = |word: &str| if word.len() == 8 { 16 } else { 10 };
    words.map(|word| u32::from_str_radix(word, radix(word)).expect("an integer")).collect()
}

/// A program that prints the answers to right and wrong calls of each function.
const CALLS: &str = r#"#include <stdio.h>
#include <string.h>

#include "footfall_estimator.h"

static footfall_memory memory, moved;
static footfall_sample samples[16];

static void show(const char *name, footfall_error error) { printf("%s %d %s\n", name, (int)error, footfall_error_text(error)); }

/* A read of eight samples of a foot that stands, and a flag for each. */
static void read(footfall_estimator *estimator, uint64_t newest_us, float force) {
    int i;
    memset(samples, 0, sizeof samples);
    for (i = 0; i < 8; i++) samples[i].specific_force_m_s2[2] = force;
    samples[7].timestamp_us = newest_us;
    if (footfall_estimator_spread_timestamps(estimator, samples, 8) != FOOTFALL_OK) printf("spread\n");
    for (i = 0; i < 8; i++) {
        footfall_estimate e;
        const footfall_error error = footfall_estimator_update(estimator, &samples[i], NULL, &e);
        printf("%lu %d %.9g %lu %d\n", (unsigned long)e.timestamp_us, (int)error, (double)e.stable, (unsigned long)e.flags, e.decision);
    }
}

int main(void) {
    footfall_params params;
    footfall_estimator *estimator;
    footfall_estimate estimate;
    footfall_learnt learnt;
    float force;
    int i;
    char *bytes = (char *)&moved;
    printf("%s\n", footfall_version());
    for (i = -1; i < 14; i++) show("text", i);
    show("params", footfall_default_params(NULL));
    show("params", footfall_default_params((footfall_params *)(void *)(bytes + 1)));
    show("params", footfall_default_params(&params));
    printf("%g %g %g\n", (double)params.sample_rate_hz, (double)params.decision_threshold, (double)params.velocity_floor_m_s);
    show("init", footfall_estimator_init(NULL, sizeof memory, &params, &estimator));
    show("init", footfall_estimator_init(&memory, sizeof memory, NULL, &estimator));
    show("init", footfall_estimator_init(&memory, sizeof memory, &params, NULL));
    show("init", footfall_estimator_init(&memory, 100, &params, &estimator));
    show("init", footfall_estimator_init(bytes + 1, sizeof memory, &params, &estimator));
    printf("%d\n", estimator == NULL);
    params.sample_rate_hz = 1;
    show("init", footfall_estimator_init(&memory, sizeof memory, &params, &estimator));
    params.sample_rate_hz = 1000;
    show("update", footfall_estimator_update((footfall_estimator *)(void *)&memory, samples, NULL, &estimate));
    show("init", footfall_estimator_init(&memory, sizeof memory, &params, &estimator));
    printf("%d %d\n", (void *)estimator == (void *)&memory, footfall_estimator_size() <= sizeof memory);
    show("update", footfall_estimator_update(NULL, samples, NULL, &estimate));
    show("update", footfall_estimator_update(estimator, NULL, NULL, &estimate));
    show("update", footfall_estimator_update(estimator, samples, NULL, NULL));
    show("update", footfall_estimator_update(estimator, samples, (const float *)(const void *)(bytes + 1), &estimate));
    printf("%g %lu\n", (double)estimate.velocity_sigma_m_s, (unsigned long)estimate.flags);
    show("spread", footfall_estimator_spread_timestamps(estimator, NULL, 8));
    show("spread", footfall_estimator_spread_timestamps(estimator, samples, FOOTFALL_MOST_SAMPLES + 1));
    show("spread", footfall_estimator_spread_timestamps(estimator, samples, 0));
    show("force", footfall_estimator_force_at_rest(estimator, NULL));
    show("learnt", footfall_estimator_learnt(estimator, NULL));
    show("learnt", footfall_estimator_learnt(NULL, &learnt));
    for (i = 0; i < 200; i++) read(estimator, 7000000 + 8000 * (uint64_t)i + (i == 120 ? 100000 : 0), 7.5F);
    show("unit", footfall_estimator_check_unit(estimator));
    show("force", footfall_estimator_force_at_rest(estimator, &force));
    printf("%.9g\n", (double)force);
    show("learnt", footfall_estimator_learnt(estimator, &learnt));
    for (i = 0; i < 28; i++) printf("%02x", learnt.bytes[i]);
    moved = memory;
    memset(&memory, 0, sizeof memory);
    read((footfall_estimator *)(void *)&moved, 8608000, 9.81F);
    show("update", footfall_estimator_update((footfall_estimator *)(void *)&memory, samples, NULL, &estimate));
    return 0;
}
"#;

#[test]
#[ignore = "full: compiles for each processor"]
fn generic_c_answers_each_call_as_the_library() {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let source = temporary.path().join("calls.c");
    fs::write(&source, CALLS).expect("a file");
    let [library, generic] = ["x86_64", GENERIC].map(|folder| {
        let program = temporary.path().join(folder);
        let folder = ARCHIVE.join("src").join(folder);
        let mut command = Command::new("cc");
        command.args(["-std=c99", "-O2"]).args(WARNINGS).arg("-I").arg(ARCHIVE.join("src"));
        command.arg(&source).arg("-o").arg(&program);
        let generic = folder.join("footfall_estimator.c");
        if generic.is_file() {
            command.arg("-DFOOTFALL_GENERIC").args(SANITIZED.split(' ')).arg(generic);
        } else {
            command.arg(folder.join("libfootfall_estimator.a"));
        }
        run(command.arg("-lm"));
        String::from_utf8(run(&mut Command::new(program)).stdout).expect("text")
    });
    assert!(library.lines().count() > 1_600, "{library}");
    for (line, (generic, library)) in generic.lines().zip(library.lines()).enumerate() {
        assert_eq!(generic, library, "line {line}");
    }
    assert_eq!(generic.len(), library.len());
}

#[test]
#[ignore = "full: compiles for each processor"]
fn no_library_of_arm_has_an_unaligned_access() {
    let archive = ARCHIVE.as_path();
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let program = temporary.path().join("walk");
    let trap = folder().join("examples/board/trap.c");
    let wrapped = "-Wl,--wrap=footfall_estimator_init,--wrap=footfall_estimator_update,--wrap=footfall_estimator_learnt,--wrap=memcpy";
    let more = [trap.to_str().expect("text"), wrapped];
    for processor in PROCESSORS.iter().filter(|other| other.compiler.starts_with("arm")) {
        assert_same_bits(temporary.path(), || program_for(processor, archive, &program, &more));
        let with_access = [&more[..], &["-DUNALIGNED"]].concat();
        let mut command = program_for(processor, archive, &program, &with_access);
        let trapped = command.stdin(Stdio::null()).status().expect("QEMU starts");
        assert!(!trapped.success(), "{}: the trap is off", processor.folder);
    }
}

/// A program that has no C library, and defines what GCC calls in any case.
const WITHOUT_A_C_LIBRARY: &str = r#"#include "footfall_estimator.h"

void *memcpy(void *to, const void *from, size_t count) {
    unsigned char *byte = to;
    const unsigned char *source = from;
    while (count-- > 0) *byte++ = *source++;
    return to;
}

void *memmove(void *to, const void *from, size_t count) {
    unsigned char *byte = to;
    const unsigned char *source = from;
    if (byte <= source) return memcpy(to, from, count);
    while (count-- > 0) byte[count] = source[count];
    return to;
}

void *memset(void *to, int value, size_t count) {
    unsigned char *byte = to;
    while (count-- > 0) *byte++ = (unsigned char)value;
    return to;
}

int main(void) {
    static footfall_memory memory;
    footfall_estimator *estimator;
    footfall_params params;
    footfall_sample sample = {0, {0, 0, 0}, {0, 0, 0}, 0};
    footfall_estimate estimate;
    footfall_learnt learnt;
    float force;
    return footfall_default_params(&params) ||
           footfall_estimator_init(&memory, sizeof memory, &params, &estimator) ||
           footfall_estimator_spread_timestamps(estimator, &sample, 1) ||
           footfall_estimator_update(estimator, &sample, NULL, &estimate) ||
           footfall_estimator_check_unit(estimator) || footfall_estimator_force_at_rest(estimator, &force) ||
           footfall_estimator_learnt(estimator, &learnt) || *footfall_error_text(0) == 0;
}
"#;

#[test]
#[ignore = "full: compiles for each processor"]
fn every_library_links_without_a_c_library() {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let source = temporary.path().join("main.c");
    fs::write(&source, WITHOUT_A_C_LIBRARY).expect("a file");
    for processor in PROCESSORS.iter().filter(|other| other.run.contains("-machine")) {
        let mut command = Command::new(processor.compiler);
        command.args(processor.options.split_whitespace()).args(WARNINGS);
        if processor.compiler.starts_with("arm") {
            command.arg("-mthumb");
        }
        command.args(["-Os", "-ffreestanding", "-nostdlib", "-Wl,--entry=main", "-I"]);
        command.arg(ARCHIVE.join("src")).arg(&source);
        command.arg("-L").arg(ARCHIVE.join("src").join(processor.folder));
        command.args(["-lfootfall_estimator", "-lgcc", "-o"]).arg(temporary.path().join("main"));
        run(&mut command);
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
    .measured_by("cargo test -p measurements instructions_of_an_update_are_in_the_results -- --ignored");
    let mut measured = Vec::new();
    for processor in PROCESSORS.iter().filter(|other| other.run.contains("-machine")) {
        let size =
            code_size(&archive.join("src").join(processor.folder).join("libfootfall_estimator.a"));
        assert!(size <= LARGEST_LIBRARY, "{}: {size} bytes", processor.folder);
        measured.push((processor.folder.to_owned(), processor, size));
    }
    // Arm stands for the others, for which a library is better, too.
    for processor in GENERICS.iter().filter(|other| other.compiler.starts_with("arm")) {
        let cpu = processor.options.split(' ').next().and_then(|cpu| cpu.strip_prefix("-mcpu="));
        let name = format!("{GENERIC}, {}", cpu.expect("a processor"));
        measured.push((name, processor, generic_size(processor)));
    }
    for (name, processor, size) in measured {
        let [init, update, _] = stack(processor);
        let counted = Counter::new(processor).count(&walk("walk.csv").0);
        let rounded = |count: u32| (count + 50) / 100 * 100;
        result.row([
            ("processor", name.into()),
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
    /// Upper bound of the instructions of an update, in hundreds, derived from the count over the walk.
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

/// The recordings are of robots, shoes and sensors in a hand, with other motions, sensors and rates than the walk.
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
                let loaded = recordings::read(&path, Format::Csv, &InputOptions::default());
                check(file, &loaded.expect("a recording").recording);
            }
        }
    }
}

/// Stack of `init`, `update` and `learnt` over two walks, bytes: the words below the caller's stack that a call has
/// changed.
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

/// Bytes of code and constants of the file of C for a processor.
fn generic_size(processor: &Processor) -> u32 {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let object = temporary.path().join("generic.o");
    run(Command::new(processor.compiler)
        .args(["-std=gnu99", "-Os", "-mthumb", "-DFOOTFALL_GENERIC"])
        .args(processor.options.split(' '))
        .arg("-I")
        .arg(ARCHIVE.join("src"))
        .arg("-c")
        .arg(ARCHIVE.join("src").join(GENERIC).join("footfall_estimator.c"))
        .arg("-o")
        .arg(&object));
    code_size(&object)
}

/// Bytes of code and constants in a library.
fn code_size(library: &Path) -> u32 {
    let output = run(Command::new("size").arg("-B").arg(library));
    let text = String::from_utf8(output.stdout).expect("text");
    let row = text.lines().nth(1).expect("a row");
    let size = row.split_whitespace().next().expect("a column");
    size.parse().expect("a number")
}
