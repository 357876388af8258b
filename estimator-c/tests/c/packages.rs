//! The archive in other build systems: projects in `CMake`, `pkg-config`, Zephyr, ESP-IDF, Arduino and `PlatformIO`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use xtask::library;

use super::support::{ARCHIVE, WARNINGS, assert_same_bits, folder, run};
use super::{CPP, installed};

/// The folder that the archive would have for this machine alone.
static HOST: LazyLock<PathBuf> = LazyLock::new(|| {
    let told = run(Command::new("rustc").arg("-vV"));
    let told = String::from_utf8(told.stdout).expect("text");
    let host = told.lines().find_map(|line| line.strip_prefix("host: ")).expect("the host");
    let dist = folder().join("../dist");
    fs::create_dir_all(&dist).expect("a folder");
    // `cargo xtask` is not used, because it would compile the dependencies of that package once more, with its features
    // alone.
    library::run_for(host, &dist).expect("it builds")
});

/// A project in `CMake` that lies in a temporary folder.
struct Project {
    folder: tempfile::TempDir,
}

impl Project {
    /// Project with these languages and this text after `project()`.
    fn new(languages: &str, text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary directory");
        let text =
            format!("cmake_minimum_required(VERSION 3.18)\nproject(foot {languages})\n{text}\n");
        fs::write(folder.path().join("CMakeLists.txt"), text).expect("a file");
        Self { folder }
    }

    fn build_folder(&self) -> PathBuf {
        self.folder.path().join("build")
    }

    /// Runs `CMake`, which finds packages in `prefix`.
    fn configure(&self, prefix: &Path, options: &[&str]) -> Output {
        let mut command = Command::new("cmake");
        command.arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())).args(options);
        command.arg("-S").arg(self.folder.path()).arg("-B").arg(self.build_folder());
        command.output().expect("cmake starts")
    }

    /// Runs `CMake`, which must succeed, and returns its output.
    fn configured(&self, prefix: &Path, options: &[&str]) -> String {
        let output = self.configure(prefix, options);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{options:?}: {errors}");
        String::from_utf8_lossy(&output.stdout).into_owned() + &errors
    }

    fn build(&self) {
        run(Command::new("cmake").arg("--build").arg(self.build_folder()));
    }
}

/// A user's program, which needs nothing but the header.
const PROGRAM: &str = r#"#include <cstdio>
#include <cstring>

#include <footfall_estimator.h>

static_assert(FOOTFALL_VERSION_MAJOR * 10000 + FOOTFALL_VERSION_MINOR * 100 + FOOTFALL_VERSION_PATCH >= 100, "0.1.0");

int main() {
    footfall_memory memory;
    footfall_estimator *estimator = nullptr;
    footfall_params params;
    footfall_default_params(&params);
    if (footfall_estimator_init(&memory, sizeof memory, &params, &estimator) != FOOTFALL_OK) return 1;
    std::puts(footfall_version());
    return std::strcmp(footfall_version(), FOOTFALL_VERSION);
}
"#;

#[test]
fn cpp_project_in_cmake_links_the_library() {
    if !installed("cmake", "cmake") || !installed(CPP[0], "g++") {
        return;
    }
    let project = Project::new(
        "CXX",
        "find_package(footfall_estimator 0.1 REQUIRED)\nadd_executable(foot main.cpp)\n\
         target_link_libraries(foot PRIVATE footfall::estimator)",
    );
    fs::write(project.folder.path().join("main.cpp"), PROGRAM).expect("a file");
    project.configured(&HOST, &[]);
    project.build();
    let printed = run(&mut Command::new(project.build_folder().join("foot"))).stdout;
    assert_eq!(printed, format!("{}\n", env!("CARGO_PKG_VERSION")).into_bytes());
}

#[test]
fn folder_of_the_archive_is_a_part_of_another_project() {
    if !installed("cmake", "cmake") || !installed(CPP[0], "g++") {
        return;
    }
    let text = format!(
        "add_subdirectory(\"{}\" footfall)\nadd_executable(foot main.cpp)\n\
         target_link_libraries(foot PRIVATE footfall::estimator)",
        HOST.display()
    );
    let project = Project::new("CXX", &text);
    fs::write(project.folder.path().join("main.cpp"), PROGRAM).expect("a file");
    project.configured(Path::new(""), &[]);
    project.build();
    let unknown = project.configure(Path::new(""), &["-DFOOTFALL_PROCESSOR=z80"]);
    assert!(!unknown.status.success());
}

#[test]
fn unknown_processor_is_an_optional_package_not_found() {
    if !installed("cmake", "cmake") {
        return;
    }
    let project = Project::new(
        "C",
        "find_package(footfall_estimator QUIET)\nmessage(STATUS \"found: ${footfall_estimator_FOUND}\")",
    );
    let printed = project.configured(&HOST, &["-DFOOTFALL_PROCESSOR=z80"]);
    assert!(printed.contains("found: 0"), "{printed}");
    assert!(!printed.contains("z80"), "{printed}");
    let required = Project::new("C", "find_package(footfall_estimator REQUIRED)");
    let output = required.configure(&HOST, &["-DFOOTFALL_PROCESSOR=z80"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(errors.contains("src/z80") && errors.contains("FOOTFALL_PROCESSOR"), "{errors}");
}

#[test]
fn package_is_found_by_compatible_versions() {
    if !installed("cmake", "cmake") {
        return;
    }
    let asked = [
        ("", true),
        ("0", true),
        ("0.1", true),
        ("0.1.0", true),
        ("0.1.0 EXACT", true),
        ("0.1.99", false),
        ("0.0.9", false),
        ("0.2", false),
        ("1.0", false),
        ("0.1...0.3", true),
        ("0.0.1...<0.1", false),
        ("0.2...0.3", false),
    ];
    let mut text = String::new();
    for (version, _) in asked {
        text += &format!(
            "find_package(footfall_estimator {version} QUIET)\n\
             message(STATUS \"'{version}' found: ${{footfall_estimator_FOUND}}\")\n\
             unset(footfall_estimator_DIR CACHE)\n"
        );
    }
    let printed = Project::new("C", &text).configured(&HOST, &[]);
    for (version, is_found) in asked {
        let truth = if is_found { "1" } else { "0" };
        let expected = format!("'{version}' found: {truth}");
        assert!(printed.contains(&expected), "{expected}: {printed}");
    }
}

/// Compilers with the options that SDKs give them, and the folders of their libraries.
const COMPILERS: [(&str, &str, &str); 17] = [
    ("arm-none-eabi", "-mcpu=cortex-m0", "cortex-m0"),
    ("arm-none-eabi", "-mcpu=cortex-m0plus -mthumb", "cortex-m0"),
    ("arm-none-eabi", "-mcpu=cortex-m23 -mthumb", "cortex-m23"),
    ("arm-none-eabi", "-mcpu=cortex-m3 -mthumb", "cortex-m3"),
    ("arm-none-eabi", "-mcpu=cortex-m4 -mthumb -mfloat-abi=soft", "cortex-m4"),
    ("arm-none-eabi", "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard", "cortex-m4/fpv4-sp-d16-hard"),
    (
        "arm-none-eabi",
        "-march=armv7e-m+fp -mthumb -mfloat-abi=softfp",
        "cortex-m4/fpv4-sp-d16-softfp",
    ),
    (
        "arm-none-eabi",
        "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard",
        "cortex-m4/fpv4-sp-d16-hard",
    ),
    ("arm-none-eabi", "-mcpu=cortex-m33 -mthumb", "cortex-m33"),
    // The Pico SDK's options for the RP2350 of a Pico 2.
    (
        "arm-none-eabi",
        "-mcpu=cortex-m33 -mthumb -march=armv8-m.main+fp+dsp -mfloat-abi=softfp -mcmse",
        "cortex-m33/fpv5-sp-d16-softfp",
    ),
    ("arm-none-eabi", "-mcpu=cortex-m33 -mthumb -mfloat-abi=hard", "cortex-m33/fpv5-sp-d16-hard"),
    ("arm-none-eabi", "-mcpu=cortex-m55 -mthumb -mfloat-abi=hard", "cortex-m33/fpv5-sp-d16-hard"),
    ("riscv64-unknown-elf", "-march=rv32imac -mabi=ilp32", "riscv32"),
    ("riscv64-unknown-elf", "-march=rv32imafc -mabi=ilp32f", "riscv32/ilp32f"),
    ("aarch64-linux-gnu", "", "aarch64"),
    ("i686-linux-gnu", "", "i386"),
    ("x86_64-w64-mingw32", "", "windows/x86_64"),
];

#[test]
#[ignore = "full: packs for each processor"]
fn compiler_chooses_the_library_it_can_link() {
    let text = "find_package(footfall_estimator REQUIRED)\n\
                message(STATUS \"folder: ${FOOTFALL_PROCESSOR}\")\n\
                add_executable(foot main.c)\n\
                target_link_options(foot PRIVATE ${LINK})\n\
                target_link_libraries(foot footfall::estimator)";
    let program = "#include <footfall_estimator.h>\n\
                   float pass(float value);\n\
                   float pass(float value) { return value + 1; }\n\
                   int main(void) { return footfall_estimator_update(NULL, NULL, NULL, NULL); }\n";
    for (prefix, options, expected) in COMPILERS {
        let project = Project::new("C", text);
        fs::write(project.folder.path().join("main.c"), program).expect("a file");
        let compiler = format!("-DCMAKE_C_COMPILER={prefix}-gcc");
        let options = format!("-DCMAKE_C_FLAGS={options}");
        let system = match prefix {
            "aarch64-linux-gnu" | "i686-linux-gnu" => "Linux",
            "x86_64-w64-mingw32" => "Windows",
            _ => "Generic",
        };
        let system = format!("-DCMAKE_SYSTEM_NAME={system}");
        let (options, link) = match prefix {
            "arm-none-eabi" => (options, "-DLINK=--specs=nosys.specs"),
            "riscv64-unknown-elf" => (options + " --specs=picolibc.specs", "-DLINK="),
            _ => (options, "-DLINK=-static"),
        };
        let no_program = "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY";
        let printed =
            project.configured(&ARCHIVE, &[&system, &compiler, &options, link, no_program]);
        assert!(printed.contains(&format!("folder: {expected}\n")), "{options}: {printed}");
        project.build();
    }
    let of_arm7 = Project::new("C", text).configure(
        &ARCHIVE,
        &[
            "-DCMAKE_SYSTEM_NAME=Generic",
            "-DCMAKE_C_COMPILER=arm-none-eabi-gcc",
            "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY",
        ],
    );
    let errors = String::from_utf8_lossy(&of_arm7.stderr);
    assert!(errors.contains("no library for the processor"), "{errors}");
}

/// Compiler of C for other systems, from `PyPI`, with these systems' libraries.
const ZIG: &str = "ziglang==0.17.1";

#[test]
#[ignore = "full: installs another compiler"]
fn programs_for_macos_and_windows_link() {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let python = temporary.path().join("venv/bin/python");
    run(Command::new("python3").args(["-m", "venv"]).arg(temporary.path().join("venv")));
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet", ZIG]));
    for (target, library) in [
        ("aarch64-macos", "macos/arm64/libfootfall_estimator.a"),
        ("x86_64-macos", "macos/x86_64/libfootfall_estimator.a"),
        ("x86_64-windows-gnu", "windows/x86_64/libfootfall_estimator.a"),
    ] {
        let program = temporary.path().join(target);
        run(Command::new(&python)
            .args(["-m", "ziglang", "cc", "-target", target, "-I"])
            .arg(ARCHIVE.join("src"))
            .arg(ARCHIVE.join("examples/walk.c"))
            .arg(ARCHIVE.join("src").join(library))
            .arg("-o")
            .arg(&program)
            .env("ZIG_GLOBAL_CACHE_DIR", temporary.path().join("cache")));
        assert!(program.is_file(), "{target}");
    }
}

#[test]
#[ignore = "full: packs for each processor"]
fn options_added_before_the_package_count() {
    let project = Project::new(
        "C",
        "add_compile_options(-mcpu=cortex-m4 \"SHELL:-mthumb -mfloat-abi=hard\" $<$<CONFIG:Debug>:-g3>)\n\
         find_package(footfall_estimator REQUIRED)\nmessage(STATUS \"folder: ${FOOTFALL_PROCESSOR}\")",
    );
    let printed = project.configured(
        &ARCHIVE,
        &[
            "-DCMAKE_SYSTEM_NAME=Generic",
            "-DCMAKE_C_COMPILER=arm-none-eabi-gcc",
            "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY",
        ],
    );
    assert!(printed.contains("folder: cortex-m4/fpv4-sp-d16-hard\n"), "{printed}");
}

#[test]
#[ignore = "full: packs for each processor"]
fn cmake_and_pkg_config_find_the_archive() {
    let archive = ARCHIVE.as_path();
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let (source, build) = (temporary.path(), temporary.path().join("build"));
    let mut cmake = Command::new("cmake");
    cmake.arg("-S").arg(archive.join("examples")).arg("-B").arg(&build);
    cmake.arg(format!("-DCMAKE_PREFIX_PATH={}", archive.display()));
    run(cmake.arg("-DCMAKE_C_FLAGS=-DBITS"));
    run(Command::new("cmake").arg("--build").arg(&build));
    assert_same_bits(source, || Command::new(build.join("walk")));
    let flags = run(Command::new("pkg-config").env("PKG_CONFIG_PATH", archive).args([
        "--cflags",
        "--libs",
        "footfall-estimator",
    ]));
    let flags = String::from_utf8(flags.stdout).expect("text");
    let program = source.join("walk");
    run(Command::new("cc")
        .arg("-DBITS")
        .arg(archive.join("examples/walk.c"))
        .args(flags.split_whitespace())
        .arg("-o")
        .arg(&program));
    assert_same_bits(source, || Command::new(&program));
}

/// The functions of Zephyr and ESP-IDF that the archive calls.
const BUILD_SYSTEMS: &str = r#"
function(check library)
  if(NOT EXISTS "${library}")
    message(FATAL_ERROR "${library} does not exist")
  endif()
endfunction()
function(zephyr_include_directories folder)
  check("${folder}/footfall_estimator.h")
endfunction()
function(zephyr_library_import name library)
  check("${library}")
  message(STATUS "linked: ${library}")
endfunction()
function(zephyr_library_named name)
endfunction()
function(zephyr_library_compile_definitions)
endfunction()
function(zephyr_library_compile_options)
endfunction()
function(zephyr_library_sources file)
  check("${file}")
  message(STATUS "compiled: ${file}")
endfunction()
function(idf_component_register)
  cmake_parse_arguments(registered "" "SRCS;INCLUDE_DIRS" "" ${ARGN})
  if(registered_SRCS)
    check("${CMAKE_CURRENT_LIST_DIR}/${registered_SRCS}")
  endif()
endfunction()
function(target_compile_options)
endfunction()
function(add_prebuilt_library name library)
  check("${library}")
  message(STATUS "linked: ${library}")
endfunction()
function(target_link_libraries)
endfunction()
"#;

/// Boards of Zephyr: name, symbols of Kconfig that a program for them may set, folder of the library.
const BOARDS: [(&str, &str, &str); 14] = [
    ("rpi_pico", "CPU_CORTEX_M CPU_CORTEX_M0PLUS", "cortex-m0"),
    ("qemu_cortex_m3", "CPU_CORTEX_M CPU_CORTEX_M3", "cortex-m3"),
    ("nrf52840dk", "CPU_CORTEX_M CPU_CORTEX_M4", "cortex-m4"),
    ("nucleo_f446re", "CPU_CORTEX_M CPU_CORTEX_M4 FPU FP_HARDABI", "cortex-m4/fpv4-sp-d16-hard"),
    (
        "teensy41",
        "CPU_CORTEX_M CPU_CORTEX_M7 FPU FP_SOFTABI CPU_HAS_FPU_DOUBLE_PRECISION",
        "cortex-m4/fpv4-sp-d16-softfp",
    ),
    ("nrf5340dk", "CPU_CORTEX_M CPU_CORTEX_M33", "cortex-m33"),
    ("rpi_pico2", "CPU_CORTEX_M CPU_CORTEX_M33 FPU FP_SOFTABI", "cortex-m33/fpv5-sp-d16-softfp"),
    ("nrf9160dk", "CPU_CORTEX_M CPU_CORTEX_M33 FPU FP_HARDABI", "cortex-m33/fpv5-sp-d16-hard"),
    ("mps3_an547", "CPU_CORTEX_M CPU_CORTEX_M55 FPU FP_HARDABI", "cortex-m33/fpv5-sp-d16-hard"),
    ("esp32c6_devkitc", "RISCV SOC_SERIES_ESP32C6 RISCV_ISA_EXT_M RISCV_ISA_EXT_C", "riscv32"),
    ("qemu_riscv32", "RISCV RISCV_ISA_EXT_M RISCV_ISA_EXT_C", "riscv32"),
    ("hard_riscv32", "RISCV RISCV_ISA_EXT_M RISCV_ISA_EXT_C FPU FLOAT_HARD", "riscv32/ilp32f"),
    ("native_sim", "ARCH_POSIX", "i386"),
    ("native_sim/native/64", "ARCH_POSIX 64BIT", "x86_64"),
];

/// Runs a file of the archive in `CMake` with the functions of build systems, and returns its output.
fn script(file: &Path, settings: &[String]) -> Output {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let script = temporary.path().join("script.cmake");
    let include = format!("{BUILD_SYSTEMS}include(\"{}\")\n", file.display());
    fs::write(&script, include).expect("a file");
    let mut command = Command::new("cmake");
    command.args(settings.iter().map(|setting| format!("-D{setting}")));
    command.arg("-P").arg(&script).output().expect("cmake starts")
}

/// Settings of Zephyr for a board.
fn board(name: &str, symbols: &str) -> Vec<String> {
    let symbols = symbols.split(' ').map(|symbol| format!("CONFIG_{symbol}=y"));
    let more = [format!("BOARD={name}"), "CMAKE_HOST_SYSTEM_PROCESSOR=x86_64".to_owned()];
    more.into_iter().chain(["CONFIG_FOOTFALL_ESTIMATOR=y".to_owned()]).chain(symbols).collect()
}

#[test]
#[ignore = "full: packs for each processor"]
fn boards_of_zephyr_link_their_libraries() {
    let file = ARCHIVE.join("zephyr/CMakeLists.txt");
    for (name, symbols, expected) in BOARDS {
        let output = script(&file, &board(name, symbols));
        let printed = String::from_utf8_lossy(&output.stdout);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {errors}");
        let expected = format!("/src/{expected}/libfootfall_estimator.a");
        assert!(printed.trim().ends_with(&expected), "{name}: {printed}");
    }
    let xtensa = script(&file, &board("qemu_xtensa", "XTENSA"));
    let printed = String::from_utf8_lossy(&xtensa.stdout);
    assert!(printed.trim().ends_with("/src/generic/footfall_estimator.c"), "{printed}");
    let other = script(&file, &board("qemu_arc_em", "ARC"));
    let errors = String::from_utf8_lossy(&other.stderr);
    assert!(errors.contains("no library for the processor of qemu_arc_em"), "{errors}");
}

#[test]
#[ignore = "full: packs for each processor"]
fn chips_of_esp_idf_link_their_libraries() {
    let component = fs::read_to_string(ARCHIVE.join("idf_component.yml")).expect("a component");
    let (_, targets) = component.split_once("targets:\n").expect("its chips");
    let chips = targets.lines().filter_map(|line| line.trim().strip_prefix("- "));
    let chips: Vec<&str> = chips.collect();
    let mut expected: Vec<&str> =
        library::folders().filter(|folder| folder.starts_with("esp32")).collect();
    // Those with an Xtensa compile the file of C.
    expected.extend(["esp32", "esp32s2", "esp32s3"]);
    expected.sort_unstable();
    assert_eq!(chips, expected);
    for (chip, is_supported) in
        chips.into_iter().map(|chip| (chip, true)).chain([("esp8684", false)])
    {
        let settings = ["ESP_PLATFORM=1".to_owned(), format!("IDF_TARGET={chip}")];
        let output = script(&ARCHIVE.join("CMakeLists.txt"), &settings);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.success(), is_supported, "{chip}: {errors}");
        assert!(is_supported || errors.contains("there is no library for esp8684"), "{errors}");
    }
}

/// Zephyr's functions for a module that is built, with a program that is linked as Zephyr links one.
const BUILT_MODULE: &str = r#"
add_library(zephyr_interface INTERFACE)
function(zephyr_include_directories folder)
  target_include_directories(zephyr_interface INTERFACE "${folder}")
endfunction()
function(zephyr_link_libraries library)
  target_link_libraries(zephyr_interface INTERFACE ${library})
endfunction()
set(CONFIG_FOOTFALL_ESTIMATOR y)
set(CONFIG_ARCH_POSIX y)
set(CONFIG_64BIT y)
"#;

#[test]
#[ignore = "full: compiles the library from source"]
fn module_of_zephyr_builds_from_source() {
    let repository = folder().join("..").canonicalize().expect("the repository");
    let module = fs::read_to_string(repository.join("zephyr/module.yml")).expect("the module");
    let mut lines = module.lines().map(str::trim);
    let cmake = lines.find_map(|line| line.strip_prefix("cmake: ")).expect("its folder");
    let text = format!(
        "{BUILT_MODULE}add_subdirectory(\"{}\" module)\nadd_executable(foot main.cpp)\n\
         target_link_libraries(foot zephyr_interface)",
        repository.join(cmake).display()
    );
    let project = Project::new("CXX", &text);
    fs::write(project.folder.path().join("main.cpp"), PROGRAM).expect("a file");
    project.configured(Path::new(""), &[]);
    project.build();
    run(&mut Command::new(project.build_folder().join("foot")));
}

/// The part of Zephyr's Kconfig that the module depends on.
const KCONFIG: &str = "mainmenu \"test\"
config CPU_CORTEX_M
\tbool \"m\"
config XTENSA
\tbool \"xtensa\"
config ARCH_POSIX
\tbool \"posix\"
config RISCV
\tbool \"riscv\"
config 64BIT
\tbool \"64\"
config RISCV_ISA_EXT_M
\tbool \"M\"
config RISCV_ISA_EXT_C
\tbool \"C\"
";

/// Reads the module's Kconfig with kconfiglib, Zephyr's own reader, and prints on which processors it can be set.
const READ_KCONFIG: &str = r#"
import sys, kconfiglib
kconfig = kconfiglib.Kconfig(sys.argv[1], warn_to_stderr=False)
kconfig.warn = True
ours = kconfig.syms["FOOTFALL_ESTIMATOR"]
assert any(node.help for node in ours.nodes), "it has no help"
for symbols in ("", "CPU_CORTEX_M", "XTENSA", "ARCH_POSIX", "RISCV", "RISCV RISCV_ISA_EXT_M RISCV_ISA_EXT_C",
                "RISCV RISCV_ISA_EXT_M RISCV_ISA_EXT_C 64BIT"):
    kconfig.unset_values()
    for symbol in symbols.split():
        kconfig.syms[symbol].set_value(2)
    ours.set_value(2)
    print(symbols + ":", ours.str_value)
assert not kconfig.warnings, kconfig.warnings
"#;

#[test]
#[ignore = "full: installs kconfiglib"]
fn kconfig_offers_the_module_to_supported_processors() {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let python = temporary.path().join("venv");
    run(Command::new("python3").args(["-m", "venv"]).arg(&python));
    let install = ["-m", "pip", "install", "--quiet", "kconfiglib==14.1.0"];
    run(Command::new(python.join("bin/python")).args(install));
    let root = temporary.path().join("Kconfig");
    let ours = folder().join("package/zephyr/Kconfig");
    fs::write(&root, format!("{KCONFIG}source \"{}\"\n", ours.display())).expect("a file");
    let mut read = Command::new(python.join("bin/python"));
    let printed = run(read.args(["-c", READ_KCONFIG]).arg(&root)).stdout;
    let printed = String::from_utf8(printed).expect("text");
    let expected = ": n\nCPU_CORTEX_M: y\nXTENSA: y\nARCH_POSIX: y\nRISCV: n\n\
                    RISCV RISCV_ISA_EXT_M RISCV_ISA_EXT_C: y\n\
                    RISCV RISCV_ISA_EXT_M RISCV_ISA_EXT_C 64BIT: n\n";
    assert_eq!(printed, expected);
}

/// What the sketch calls of Arduino and of its sensor's library.
const ARDUINO: &str = "#include <math.h>
#include <stdint.h>
struct Printer { void begin(long); void println(const char *); void println(float); };
extern Printer Serial;
unsigned long micros();
struct Sensor {
    int begin(), accelerationAvailable(), gyroscopeAvailable();
    float accelerationSampleRate();
    int readAcceleration(float &, float &, float &), readGyroscope(float &, float &, float &);
};
extern Sensor IMU;
";
const WIRE: &str = "#include <stddef.h>
#include <stdint.h>
struct Bus { void beginTransmission(uint8_t); size_t write(uint8_t); uint8_t endTransmission(); };
extern Bus Wire;
";

/// Test double for both libraries: a sensor on its bus that scales by its register, as the part does, while its library
/// scales by ±4 g; and an estimator that prints its samples.
const STAND_IN: &str = "#include <stdio.h>
#include \"Arduino_LSM6DSOX.h\"
#include \"Wire.h\"
#include \"footfall_estimator.h\"
Printer Serial;
Sensor IMU;
Bus Wire;
static uint8_t sent[3], count, ctrl1_xl = 0x4A;
static float force_g;
void Bus::beginTransmission(uint8_t address) { sent[0] = address; count = 1; }
size_t Bus::write(uint8_t byte) { sent[count++ % 3] = byte; return 1; }
uint8_t Bus::endTransmission() { if (sent[0] == 0x6A && sent[1] == 0x10) ctrl1_xl = sent[2]; return 0; }
int Sensor::begin() { return 1; }
int Sensor::accelerationAvailable() { return 1; }
int Sensor::gyroscopeAvailable() { return 1; }
float Sensor::accelerationSampleRate() { return 104; }
int Sensor::readAcceleration(float &x, float &y, float &z) {
    static const float ranges[] = {2, 16, 4, 8};
    const float range = ranges[ctrl1_xl >> 2 & 3];
    const float read = force_g > range ? range : force_g;
    x = y = 0;
    z = read / range * 4;
    return 1;
}
int Sensor::readGyroscope(float &x, float &y, float &z) { x = y = z = 0; return 1; }
void Printer::begin(long) {}
void Printer::println(const char *) {}
void Printer::println(float) {}
unsigned long micros() { return 0; }
footfall_error footfall_default_params(footfall_params *) { return FOOTFALL_OK; }
footfall_error footfall_estimator_init(void *, size_t, const footfall_params *, footfall_estimator **) { return FOOTFALL_OK; }
const char *footfall_error_text(footfall_error) { return \"\"; }
footfall_error footfall_estimator_update(footfall_estimator *, const footfall_sample *sample, const float *, footfall_estimate *) {
    printf(\"%.2f %d\\n\", sample->specific_force_m_s2[2] / 9.80665, sample->validity);
    return FOOTFALL_OK;
}
void setup(), loop();
int main() {
    setup();
    const float forces[] = {1, 12, 40};
    for (float force : forces) { force_g = force; loop(); }
}
";

#[test]
fn sketch_for_arduino_measures_a_heel_strike() {
    if !installed(CPP[0], "g++") {
        return;
    }
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| temporary.path().join(name);
    for (name, text) in
        [("Arduino_LSM6DSOX.h", ARDUINO), ("Wire.h", WIRE), ("stand_in.cpp", STAND_IN)]
    {
        fs::write(path(name), text).expect("a file");
    }
    run(Command::new(CPP[0])
        .args(&CPP[1..])
        .args(WARNINGS)
        .arg("-I")
        .arg(temporary.path())
        .arg("-I")
        .arg(folder().join("include"))
        .arg(folder().join("package/examples/Contact/Contact.ino"))
        .arg(path("stand_in.cpp"))
        .arg("-o")
        .arg(path("sketch")));
    let printed = String::from_utf8(run(&mut Command::new(path("sketch"))).stdout).expect("text");
    // The sensor is at rest, then has a strike within the range, and then one beyond it, which is marked.
    assert_eq!(printed, "1.00 0\n12.00 0\n16.00 1\n");
}

/// Rules of arduino-lint for a library, by their numbers in its documentation.
#[test]
fn library_for_arduino_follows_its_rules() {
    let text = fs::read_to_string(HOST.join("library.properties")).expect("the properties");
    let value = |name: &str| {
        let mut lines = text.lines().filter_map(|line| line.split_once('='));
        let found = lines.find(|(field, _)| *field == name);
        found.unwrap_or_else(|| panic!("no {name}")).1
    };
    let name = value("name");
    assert!(name.len() <= 16, "LP010: the name is longer than recommended");
    assert!(!name.contains(' '), "LP015: the name has spaces");
    assert!(HOST.join(format!("src/{name}.h")).is_file(), "LS008: no header has its name");
    assert!(HOST.join("README.md").is_file(), "LD001: it has no readme");
    assert!(HOST.join("LICENSE.txt").is_file(), "LD002: it has no licence");
    assert!(value("url").starts_with("https://"), "LP056: the URL is too short");
    assert_ne!(value("architectures"), "*", "the libraries are for some processors alone");
    assert!(HOST.join("src").join(value("includes")).is_file());
    assert!(!text.contains('@'), "a mark was not replaced");
}

/// Runs the script for `PlatformIO` with an environment as `SCons` gives it, and prints the folder that it links from.
const PLATFORMIO: &str = r#"
import pathlib, sys
class Node:
    def __init__(self, path): self.abspath = path
    def srcnode(self): return self
class Environment(dict):
    linked = None
    def Dir(self, name): return Node(sys.argv[1])
    def BoardConfig(self): return self["BOARD"]
    def Append(self, LIBPATH=None, LIBS=None, CPPDEFINES=None, CCFLAGS=None):
        self.linked = LIBPATH[0] if LIBPATH else pathlib.Path(sys.argv[1]) / "src" / CPPDEFINES[0]
script = compile((pathlib.Path(sys.argv[1]) / "platformio.py").read_text(), "platformio.py", "exec")
for board, flags in [
    ({"build.cpu": "cortex-m4"}, ["-Os", ("-include", "file.h"), "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]),
    ({"build.mcu": "esp32c3"}, ["-march=rv32imc"]),
    ({"build.cpu": "cortex-m0plus"}, [["-mthumb", ("-isystem", pathlib.Path("x"))]]),
    ({"build.cpu": "cortex-m33"}, ["-mthumb -march=armv8-m.main+fp+dsp -mfloat-abi=softfp"]),
    ({"build.cpu": "cortex-m7"}, ["-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]),
    ({"build.cpu": "cortex-m33"}, ["-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]),
    ({"build.mcu": "imxrt1062"}, ["-mfloat-abi=hard", "-mfpu=fpv5-d16"]),
    (None, []),
    ({"build.mcu": "esp32s3"}, ["-mlongcalls"]),
    ({"build.mcu": "atmega328p"}, []),
]:
    env = Environment(CCFLAGS=flags, **({"BOARD": board} if board else {}))
    try:
        exec(script, {"env": env, "Import": lambda name: None})
        print(pathlib.Path(env.linked).relative_to(pathlib.Path(sys.argv[1]) / "src"))
    except SystemExit as refused:
        print(str(refused).split(":")[0])
"#;

#[test]
#[ignore = "full: packs for each processor"]
fn platformio_links_the_library_of_the_board() {
    let mut python = Command::new("python3");
    let printed = run(python.args(["-c", PLATFORMIO]).arg(ARCHIVE.as_path())).stdout;
    let printed = String::from_utf8(printed).expect("text");
    let expected = "cortex-m4/fpv4-sp-d16-hard\nesp32c3\ncortex-m0plus\ncortex-m33/softfp\n\
         cortex-m7/fpv4-sp-d16-hard\ncortex-m33/fpv4-sp-d16-hard\nimxrt1062/fpv5-d16-hard\nx86_64\nFOOTFALL_GENERIC\nfootfall\n";
    assert_eq!(printed, expected);
}
