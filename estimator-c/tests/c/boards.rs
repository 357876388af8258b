//! Boards of usual cores for Arduino, and of `PlatformIO`: each finds a library in the archive, and links it.

use std::fs;
use std::process::Command;

use xtask::library;

use super::support::{ARCHIVE, WARNINGS, run};

/// Boards by the family of their core, with `build.mcu` and the options of the compiler.
const BOARDS: [(&str, &str, &str); 33] = [
    ("STM32duino F0", "cortex-m0", "-mcpu=cortex-m0 -mthumb"),
    ("STM32duino C0, G0, L0, U0, WB0, WL3", "cortex-m0plus", "-mcpu=cortex-m0plus -mthumb"),
    ("STM32duino F1, F2, L1", "cortex-m3", "-mcpu=cortex-m3 -mthumb"),
    (
        "STM32duino F3, F4, G4, L4, WB",
        "cortex-m4",
        "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard -mthumb",
    ),
    ("STM32duino WL", "cortex-m4", "-mcpu=cortex-m4 -mthumb"),
    (
        "STM32duino F7, H7",
        "cortex-m7",
        "-mcpu=cortex-m7 -mfpu=fpv4-sp-d16 -mfloat-abi=hard -mthumb",
    ),
    (
        "STM32duino H5, L5, U3, U5, WBA",
        "cortex-m33",
        "-mcpu=cortex-m33 -mfpu=fpv4-sp-d16 -mfloat-abi=hard -mthumb",
    ),
    (
        "mbed Nano 33 BLE, Nicla Sense",
        "cortex-m4",
        "-mcpu=cortex-m4 -mfloat-abi=softfp -mfpu=fpv4-sp-d16 -mthumb",
    ),
    (
        "mbed Portenta, Giga, Opta",
        "cortex-m7",
        "-mcpu=cortex-m7 -mfloat-abi=softfp -mfpu=fpv5-d16 -mthumb",
    ),
    (
        "mbed Portenta, second core",
        "cortex-m4",
        "-mcpu=cortex-m4 -mfloat-abi=softfp -mfpu=fpv4-sp-d16 -mthumb",
    ),
    ("mbed Nano RP2040", "cortex-m0plus", "-mcpu=cortex-m0plus -mthumb"),
    ("Renesas Uno R4", "cortex-m4", "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16"),
    ("SAMD21", "cortex-m0plus", "-mcpu=cortex-m0plus -mthumb"),
    ("SAMD51", "cortex-m4", "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16"),
    ("Teensy LC", "mkl26z64", "-mthumb -mcpu=cortex-m0plus"),
    ("Teensy 3.2", "mk20dx256", "-mthumb -mcpu=cortex-m4"),
    ("Teensy 3.5", "mk64fx512", "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"),
    ("Teensy 3.6", "mk66fx1m0", "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"),
    ("Teensy 4", "imxrt1062", "-mthumb -mcpu=cortex-m7 -mfloat-abi=hard -mfpu=fpv5-d16"),
    ("arduino-pico RP2040", "cortex-m0plus", "-march=armv6-m -mcpu=cortex-m0plus -mthumb"),
    (
        "arduino-pico RP2350",
        "cortex-m33",
        "-mcpu=cortex-m33 -mthumb -march=armv8-m.main+fp+dsp -mfloat-abi=softfp -mcmse",
    ),
    ("arduino-pico RP2350, RISC-V", "rv32imac", "-march=rv32imac_zicsr_zifencei -mabi=ilp32"),
    ("ESP32-C2", "esp32c2", "-march=rv32imc -mabi=ilp32"),
    ("ESP32-C3", "esp32c3", "-march=rv32imc -mabi=ilp32"),
    ("ESP32-C5", "esp32c5", "-march=rv32imac_zicsr_zifencei -mabi=ilp32"),
    ("ESP32-C6", "esp32c6", "-march=rv32imac_zicsr_zifencei -mabi=ilp32"),
    ("ESP32-C61", "esp32c61", "-march=rv32imac_zicsr_zifencei -mabi=ilp32"),
    ("ESP32-H2", "esp32h2", "-march=rv32imac_zicsr_zifencei -mabi=ilp32"),
    ("ESP32-P4", "esp32p4", "-march=rv32imafc_zicsr_zifencei -mabi=ilp32f"),
    (
        "PlatformIO, an M4 by its CPU",
        "cortex-m4",
        "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16",
    ),
    (
        "PlatformIO, an H7 by its CPU",
        "cortex-m7",
        "-mthumb -mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard",
    ),
    (
        "PlatformIO, a U5 by its CPU",
        "cortex-m33",
        "-mthumb -mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard",
    ),
    ("PlatformIO, a Pico by its CPU", "cortex-m0plus", "-mthumb -mcpu=cortex-m0plus"),
];

/// Folder in which the Arduino CLI looks for a library: `findExpectedPrecompiledLibFolder` of its `builder`.
fn folder(mcu: &str, options: &str) -> String {
    let value = |option: &str| {
        options.split(' ').find_map(|word| word.strip_prefix(option)).unwrap_or_default()
    };
    match (value("-mfpu="), value("-mfloat-abi=")) {
        ("", "") => mcu.to_owned(),
        ("", abi) => format!("{mcu}/{abi}"),
        (fpu, abi) => format!("{mcu}/{fpu}-{abi}"),
    }
}

#[test]
fn each_board_of_the_table_has_a_library() {
    let folders: Vec<&str> = library::folders().collect();
    for (board, mcu, options) in BOARDS {
        let wanted = folder(mcu, options);
        assert!(folders.contains(&wanted.as_str()), "{board}: there is no src/{wanted}");
    }
}

/// A program that passes a number, so that the linker compares the conventions of both.
const PROGRAM: &str = "#include <footfall_estimator.h>
float pass(float value);
float pass(float value) { return value + 1; }
int main(void) { return footfall_estimator_update(NULL, NULL, NULL, NULL); }
";

#[test]
#[ignore = "full: packs for each processor"]
fn each_board_of_the_table_links_its_library() {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let source = temporary.path().join("main.c");
    fs::write(&source, PROGRAM).expect("a file");
    for (board, mcu, options) in BOARDS {
        let (compiler, specs) = if options.contains("-march=rv32") {
            ("riscv64-unknown-elf-gcc", "--specs=picolibc.specs")
        } else {
            ("arm-none-eabi-gcc", "--specs=nosys.specs")
        };
        // Debian's compiler has no C library for these extensions, which change no call.
        let options = options.replace("_zicsr_zifencei", "");
        println!("{board}");
        let library = ARCHIVE.join("src").join(folder(mcu, &options));
        let bytes = fs::read(library.join("libfootfall_estimator.a")).expect("a library");
        let has_debug_frame = bytes.windows(12).any(|name| name == b".debug_frame");
        assert!(!has_debug_frame, "{board}: a debugger would look for sources");
        run(Command::new(compiler)
            .args(options.split(' '))
            .args(WARNINGS)
            .arg(specs)
            .arg("-I")
            .arg(ARCHIVE.join("src"))
            .arg(&source)
            .arg("-L")
            .arg(library)
            .args(["-lfootfall_estimator", "-o"])
            .arg(temporary.path().join("main")));
    }
}

/// Runs the script for `PlatformIO` with the options of a board, and prints the folder that it links from.
const PLATFORMIO: &str = r#"
import pathlib, sys
root, mcu, *options = sys.argv[1:]
class Node:
    def srcnode(self): return self
    abspath = root
class Environment(dict):
    def Dir(self, name): return Node()
    def BoardConfig(self): return {"build.mcu": mcu}
    def Append(self, LIBPATH, LIBS): print(pathlib.Path(LIBPATH[0]).relative_to(pathlib.Path(root) / "src"))
script = compile((pathlib.Path(root) / "platformio.py").read_text(), "platformio.py", "exec")
exec(script, {"env": Environment(CCFLAGS=options, BOARD="board"), "Import": lambda name: None})
"#;

#[test]
#[ignore = "full: packs for each processor"]
fn platformio_finds_the_library_of_each_board() {
    for (board, mcu, options) in BOARDS {
        let mut python = Command::new("python3");
        python.args(["-c", PLATFORMIO]).arg(ARCHIVE.as_path()).arg(mcu).args(options.split(' '));
        let printed = String::from_utf8(run(&mut python).stdout).expect("text");
        assert_eq!(printed.trim(), folder(mcu, options), "{board}");
    }
}
