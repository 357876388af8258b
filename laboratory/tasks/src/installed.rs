//! Installs each piece of a release from its folder into an empty environment, as a user does, and runs its first example:
//! the wheel, the Debian package, the programs, the library for C, a crate, and firmware. Only the emulators of the boards
//! come from the repository, the memory map of one for the programs of Arduino and `PlatformIO`, and tests of the library
//! for C, which run with the library of the release.

use std::env::consts::ARCH;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};

use xtask::address::ADDRESS;
use xtask::command::{Step, is_installed, remove_folder, root};
use xtask::library;
use xtask::test::LABORATORY;

use crate::environment::Environment;
use crate::release;

/// Version of the workspace, which this package has too.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Programs that a user of Debian has, beside Python and a compiler of C.
const DPKG: [&str; 2] = ["dpkg", "dpkg-deb"];

/// Files of the Debian package.
const PACKAGED: [&str; 7] = [
    "usr/bin/footfall",
    "usr/lib/udev/rules.d/60-footfall.rules",
    "usr/share/bash-completion/completions/footfall",
    "usr/share/fish/vendor_completions.d/footfall.fish",
    "usr/share/man/man1/footfall.1.gz",
    "usr/share/man/man1/footfall-replay.1.gz",
    "usr/share/zsh/vendor-completions/_footfall",
];

/// First program in Python: a foot at rest, and a walk.
const IN_PYTHON: &str = r#"
import footfall

foot = footfall.Estimator(rate=1000.0)
for _ in range(1000):
    now = foot.update((0.0, 0.0, 9.81), (0.0, 0.0, 0.0))
assert now.p_stable > 0.99 and now.decision, now
walk = footfall.simulate("walk", seconds=20.0)
assert footfall.score(walk.estimate(), walk.label).rmse < 0.2
print(f"P {now.p_stable:.3f}")
"#;

/// First program in Rust: a foot at rest.
const IN_RUST: &str = r#"use estimator_core::{ContactEstimator, ImuSample, Params, SpecificForce, Stream, Timestamp, Vec3};

fn main() -> Result<(), estimator_core::ParamsError> {
    let mut foot = ContactEstimator::new(&Params::DEFAULT.validate()?, Stream::KILOHERTZ);
    let mut stable = 0.0;
    for ms in 0..1_000 {
        let sample = ImuSample {
            timestamp: Timestamp::from_micros(1_000 * ms),
            specific_force: SpecificForce(Vec3::new(0.0, 0.0, 9.81)),
            ..ImuSample::default()
        };
        stable = foot.update(&sample, None).probabilities.stable;
    }
    assert!(stable > 0.99, "{stable}");
    println!("P {stable:.3}");
    Ok(())
}
"#;

/// First program in C: a foot at rest.
const IN_C: &str = r#"#include <footfall_estimator.h>
#include <stdio.h>

static footfall_memory memory;

int main(void) {
    footfall_params params;
    footfall_estimator *estimator;
    footfall_sample sample = {0, {0, 0, 9.81F}, {0, 0, 0}, 0};
    footfall_estimate estimate;
    if (footfall_default_params(&params)) return 1;
    if (footfall_estimator_init(&memory, sizeof memory, &params, &estimator)) return 1;
    for (; sample.timestamp_us < 1000000; sample.timestamp_us += 1000)
        if (footfall_estimator_update(estimator, &sample, NULL, &estimate)) return 1;
    printf("P %.3f\n", (double)estimate.stable);
    return 0;
}
"#;

/// Functions of a sketch behind this program, and the function of Arduino's core that calls them.
const IN_ARDUINO: &str = "
void setup() { estimate_rest(); }
void loop() {}
int main() { setup(); loop(); }
";

/// `PlatformIO`, and the program that it builds with, both from `PyPI`.
const PLATFORMIO: [&str; 2] = ["platformio==6.2.0", "scons==4.8.1"];

/// Files of a project of `PlatformIO` for two platforms: the machine of the test, and a Cortex-M4F in QEMU. They replace what
/// `PlatformIO` has from its registry, compilers and descriptions of boards: a platform is one file that names a compiler.
/// `core` is the folder of its own packages, in which it looks for `SCons`.
const OF_PLATFORMIO: [(&str, &str); 8] = [
    (
        "platformio.ini",
        "[env]
platform = symlink://@FOLDER@/machines
lib_deps = file://@ARCHIVE@

[env:host]
build_src_filter = +<main.c>

[env:emulated]
board = emulated
",
    ),
    (
        "machines/platform.json",
        r#"{"name": "machines", "title": "Machines", "version": "1.0.0", "description": "Installed compilers", "packages": {}}"#,
    ),
    (
        "machines/platform.py",
        "from platformio.public import PlatformBase


class MachinesPlatform(PlatformBase):
    pass
",
    ),
    (
        "machines/boards/emulated.json",
        r#"{
  "name": "Emulated", "vendor": "QEMU", "url": "https://www.qemu.org", "frameworks": [],
  "build": {"cpu": "cortex-m4", "mcu": "stm32f405rgt6"},
  "upload": {"maximum_size": 1048576, "maximum_ram_size": 131072}
}"#,
    ),
    (
        "machines/builder/main.py",
        r#"from SCons.Script import Default, DefaultEnvironment

env = DefaultEnvironment()
if env.get("BOARD"):
    cpu = env.BoardConfig().get("build.cpu")
    options = [f"-mcpu={cpu}", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    memory = "-Wl,--defsym=rom=0x08000000,--defsym=ram=0x20000000,--defsym=ram_size=0x20000"
    env.Replace(AR="arm-none-eabi-ar", CC="arm-none-eabi-gcc", RANLIB="arm-none-eabi-ranlib")
    env.Append(CCFLAGS=options, LINKFLAGS=[*options, "--specs=rdimon.specs", "-T", "link.ld", memory])
Default(env.BuildProgram())
"#,
    ),
    (
        "core/packages/tool-scons/package.json",
        r#"{"name": "tool-scons", "version": "4.41101.0", "description": "SCons"}"#,
    ),
    (
        "core/packages/tool-scons/.piopm",
        r#"{"type": "tool", "name": "tool-scons", "version": "4.41101.0", "spec": {"owner": "platformio", "name": "tool-scons"}}"#,
    ),
    ("core/packages/tool-scons/scons.py", "import SCons.Script\n\nSCons.Script.main()\n"),
];

/// Checks and packs components of ESP-IDF, from `PyPI`.
const COMPONENT_MANAGER: &str = "idf-component-manager==3.1.2";

/// A piece of a release, and its test.
type Piece = (&'static str, fn(&Release) -> Result<()>);

const PIECES: [Piece; 13] = [
    ("checksums", check_sums),
    ("wheel", install_wheel),
    ("Debian package", install_debian_package),
    ("programs by the names of cargo binstall", run_programs),
    ("library for C", install_library),
    ("library for Arduino", build_sketch),
    ("package for PlatformIO", build_with_platformio),
    ("component of ESP-IDF", pack_component),
    ("build files of the archive, and its libraries", link_boards),
    ("crate", add_crate),
    ("firmware", boot_firmware),
    ("UF2 of the Nano RP2040", boot_uf2),
    ("UF2 of the Feather RP2350", boot_rp2350),
];

/// Folder of a release, and an empty folder into which the pieces are installed.
struct Release {
    dist: PathBuf,
    empty: PathBuf,
}

impl Release {
    /// Path of the only file with this beginning and end.
    fn file(&self, begin: &str, end: &str) -> Result<PathBuf> {
        let names = fs::read_dir(&self.dist).with_context(|| self.dist.display().to_string())?;
        let names = names.map(|entry| Ok(entry?.file_name().display().to_string()));
        let names: Vec<String> = names.collect::<Result<_>>()?;
        let found: Vec<&String> =
            names.iter().filter(|name| name.starts_with(begin) && name.ends_with(end)).collect();
        match found[..] {
            [name] => Ok(self.dist.join(name)),
            _ => bail!("{}: one {begin}…{end} is expected, not {found:?}", self.dist.display()),
        }
    }

    /// An empty folder of this name.
    fn folder(&self, name: &str) -> Result<PathBuf> {
        let folder = self.empty.join(name);
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(folder)
    }
}

/// Installs each piece of the release in a folder, and prints how long it takes to its first result.
///
/// # Errors
/// A piece is missing, cannot be installed, or does not give its result. The others are still tried.
pub fn run(dist: &Path) -> Result<()> {
    let empty = root().join("target/installed");
    remove_folder(&empty)?;
    let dist = dist.canonicalize().with_context(|| dist.display().to_string())?;
    let release = Release { dist, empty };
    let mut failed = Vec::new();
    for (name, install) in PIECES {
        println!("\n== {name}");
        let start = Instant::now();
        match install(&release) {
            Ok(()) => println!("{name}: {:.1} s", start.elapsed().as_secs_f64()),
            Err(error) => {
                eprintln!("error: {name}: {error:#}");
                failed.push(name);
            }
        }
    }
    if !failed.is_empty() {
        bail!("cannot be used from {}: {}", release.dist.display(), failed.join(", "));
    }
    Ok(())
}

/// Prints the last line of a program, which has to be a probability above 0.9.
fn expect_stable(printed: &str) -> Result<()> {
    let last = printed.lines().last().unwrap_or_default();
    let mut words = last.split_whitespace().skip_while(|word| *word != "P");
    let probability = words.nth(1).and_then(|word| word.parse::<f32>().ok());
    if probability.is_none_or(|probability| probability <= 0.9) {
        bail!("the probability of a foot at rest is expected in {last:?}");
    }
    println!("{last}");
    Ok(())
}

fn check_sums(release: &Release) -> Result<()> {
    let check = ["--check", "--quiet", "--strict", "SHA256SUMS"];
    Step::program("sha256sum").at(&release.dist).with(check).run()
}

/// Installs the wheel with its dependencies, and lets auditwheel check its tag: the wheel needs no newer glibc and no other
/// library. Its metadata have the project's address.
fn install_wheel(release: &Release) -> Result<()> {
    let wheel = release.file(&format!("footfall-{VERSION}-cp310-abi3-"), &format!("{ARCH}.whl"))?;
    let environment = Environment::create("release")?;
    environment.install([wheel.display().to_string()])?;
    let printed = environment.python().at(&release.folder("wheel")?).with(["-c", IN_PYTHON]);
    expect_stable(&printed.output()?)?;
    let metadata = ["-c", "import importlib.metadata as m; print(m.metadata('footfall'))"];
    let metadata = environment.python().with(metadata).output()?;
    let mut urls = metadata.lines().filter(|line| line.starts_with("Project-URL: "));
    if !urls.any(|line| line.ends_with(&format!(", {ADDRESS}"))) {
        bail!("{}: it has no Project-URL {ADDRESS}:\n{metadata}", wheel.display());
    }
    let auditor = Environment::create("auditwheel")?;
    auditor.install([release::AUDITWHEEL])?;
    let show = ["-m", "auditwheel", "show"];
    let shown = auditor.python().with(show).with([wheel.display().to_string()]).output()?;
    let shown = shown.split_whitespace().collect::<Vec<_>>().join(" ");
    let tag = format!("\"{}_{ARCH}\"", release::WHEELS_FOR);
    if !shown.contains(&format!("is consistent with the following platform tag: {tag}")) {
        bail!("{}: {tag} is expected: {shown}", wheel.display());
    }
    Ok(())
}

/// Installs the Debian package into an empty root, by dpkg as apt does, and runs the program there.
fn install_debian_package(release: &Release) -> Result<()> {
    for program in DPKG {
        if !is_installed(program) {
            bail!("{program} is not installed, which Debian and its derivatives have");
        }
    }
    let machine = Step::program("dpkg").with(["--print-architecture"]).output()?;
    let package = release.file("footfall_", &format!("_{}.deb", machine.trim()))?;
    let package_name = package.display().to_string();
    let depends = ["--field", &package_name, "Depends"];
    let depends = Step::program("dpkg-deb").with(depends).output()?;
    if !depends.trim().is_empty() {
        bail!("{package_name}: a static program needs no package, not {depends}");
    }
    let homepage = ["--field", &package_name, "Homepage"];
    let homepage = Step::program("dpkg-deb").with(homepage).output()?;
    if homepage.trim() != ADDRESS {
        bail!("{package_name}: its homepage is {homepage:?}, not {ADDRESS}");
    }
    let system = release.folder("system")?;
    for folder in ["var/lib/dpkg/info", "var/lib/dpkg/updates", "var/lib/dpkg/triggers"] {
        fs::create_dir_all(system.join(folder))?;
    }
    fs::write(system.join("var/lib/dpkg/status"), "")?;
    Step::program("dpkg")
        .with([&format!("--root={}", system.display()), "--log=/dev/null"])
        .with(["--force-not-root", "--force-bad-path", "--install", &package_name])
        .run()?;
    for file in PACKAGED {
        if !system.join(file).is_file() {
            bail!("{package_name}: {file} is missing");
        }
    }
    let program = Step::program(&system.join("usr/bin/footfall").display().to_string());
    replay_rest(program, &release.folder("debian")?)
}

/// Replays a foot at rest with a program, in an empty folder.
fn replay_rest(program: Step, folder: &Path) -> Result<()> {
    let mut walk = String::from("t,ax,ay,az,gx,gy,gz\n");
    for ms in 0..1_000 {
        let _ = writeln!(walk, "{:.3},0,0,9.81,0,0,0", f64::from(ms) / 1.0e3);
    }
    fs::write(folder.join("rest.csv"), walk)?;
    program.at(folder).with(["replay", "rest.csv", "--output", "estimates.csv"]).run()?;
    expect_stable_at_end(&folder.join("estimates.csv"))
}

/// Prints the probability in the last row of a table, which has to be above 0.9.
fn expect_stable_at_end(table: &Path) -> Result<()> {
    let table = fs::read_to_string(table).with_context(|| table.display().to_string())?;
    let mut rows = table.lines();
    let place = rows.next().and_then(|header| header.split(',').position(|c| c == "p_stable"));
    let last = rows.last().and_then(|row| row.split(',').nth(place?));
    expect_stable(&format!("P {}", last.unwrap_or_default()))
}

/// Unpacks the archive of the library, and returns its folder.
fn unpack_library(release: &Release, to: &Path) -> Result<PathBuf> {
    let archive = release.file(&format!("footfall-estimator-{VERSION}"), ".zip")?;
    let (archive, path) = (archive.display().to_string(), to.display().to_string());
    Step::program("python3").with(["-m", "zipfile", "-e", &archive, &path]).run()?;
    Ok(to.join("footfall_estimator"))
}

/// Builds the example of the archive with `CMake`, and runs it over a foot at rest.
fn install_library(release: &Release) -> Result<()> {
    let folder = release.folder("library")?;
    let unpacked = unpack_library(release, &folder)?;
    Step::program("cmake")
        .at(&folder)
        .with(["-S", &unpacked.join("examples").display().to_string(), "-B", "build"])
        .with([format!("-DCMAKE_PREFIX_PATH={}", unpacked.display())])
        .run()?;
    Step::program("cmake").at(&folder).with(["--build", "build"]).run()?;
    let mut lines = "1000\n".to_owned();
    for ms in 0..1_000 {
        let _ = writeln!(lines, "{} 0 0 9.81 0 0 0 nan 0", 1_000 * ms);
    }
    fs::write(folder.join("input"), lines)?;
    let walk = Step::program("sh").at(&folder).with(["-c", "build/walk <input"]);
    let printed = walk.output()?;
    // The decision stands behind the probability.
    expect_stable(printed.trim_end().trim_end_matches("stable"))
}

/// Checks that there is a compiler for a Cortex-M4F, and its emulator.
fn check_emulation() -> Result<()> {
    for (program, packages) in [
        ("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
        ("qemu-system-arm", "qemu-system-arm"),
    ] {
        if !is_installed(program) {
            bail!("{program} is not installed (Debian: apt-get install {packages})");
        }
    }
    Ok(())
}

/// Runs a program for a Cortex-M4F in QEMU, whose output has to end with the probability of a foot at rest.
fn emulate(program: &Path) -> Result<()> {
    let emulated = Step::program("qemu-system-arm")
        .with(["-machine", "netduinoplus2", "-nographic", "-monitor", "none", "-serial", "none"])
        .with(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .with([program.display().to_string()]);
    expect_stable(&emulated.output()?)
}

/// Start and memory map of the emulated Cortex-M4F, from the repository.
fn of_emulator(name: &str) -> Result<String> {
    let board = root().join("estimator-c/examples/board");
    fs::read_to_string(board.join(name)).with_context(|| name.to_owned())
}

/// Unpacks the archive into a folder of libraries, as the Arduino IDE does, compiles a sketch as the IDE does for a board
/// with a Cortex-M4F, and runs it. The IDE takes the folder of a precompiled library from the processor and the options of
/// the board, and the name of the library from its properties.
fn build_sketch(release: &Release) -> Result<()> {
    check_emulation()?;
    let folder = release.folder("arduino")?;
    let library = unpack_library(release, &folder.join("libraries"))?;
    let properties = fs::read_to_string(library.join("library.properties"))?;
    let value = |key: &str| {
        let mut fields = properties.lines().filter_map(|line| line.split_once('='));
        let field = fields.find(|(name, _)| *name == key);
        field.map(|(_, value)| value).with_context(|| format!("library.properties has no {key}"))
    };
    if value("precompiled")? != "full" {
        bail!("library.properties: the library is not precompiled");
    }
    let sketch = IN_C.replace("footfall_estimator.h", value("includes")?);
    let sketch = sketch.replace("int main(void)", "static int estimate_rest()");
    fs::write(folder.join("sketch.cpp"), sketch + IN_ARDUINO)?;
    for name in ["startup.c", "link.ld"] {
        fs::write(folder.join(name), of_emulator(name)?)?;
    }
    let source = library.join("src");
    let compile = |program: &str, file: &str| {
        Step::program(program)
            .at(&folder)
            .with(["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-I"])
            .with([source.display().to_string()])
            .with(["-Os", "-c", file])
            .run()
    };
    compile("arm-none-eabi-g++", "sketch.cpp")?;
    compile("arm-none-eabi-gcc", "startup.c")?;
    Step::program("arm-none-eabi-gcc")
        .at(&folder)
        .with(["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"])
        .with(["--specs=rdimon.specs", "-T", "link.ld", "-Wl,--defsym=rom=0x08000000"])
        .with(["-Wl,--defsym=ram=0x20000000,--defsym=ram_size=0x20000"])
        .with(["sketch.o", "startup.o", "-o", "program", "-L"])
        .with([source.join("cortex-m4/fpv4-sp-d16-hard").display().to_string()])
        .with(value("ldflags")?.split(' '))
        .run()?;
    emulate(&folder.join("program"))
}

/// Runs the tests of the library for C with this archive instead of one of their own: each row of the table of boards links,
/// `CMake`, pkg-config and the files for Zephyr, ESP-IDF and `PlatformIO` choose the right library, and programs for macOS and
/// Windows link.
fn link_boards(release: &Release) -> Result<()> {
    let unpacked = unpack_library(release, &release.folder("boards")?)?;
    Step::cargo(&["test", "--locked", "--quiet", "--package", "estimator-c", "--test", "c"])
        .with(["--", "--ignored"])
        // They build from source, or need no archive.
        .with(["--skip", "module_of_zephyr", "--skip", "kconfig_offers"])
        .env("FOOTFALL_ARCHIVE", unpacked)
        .run()
}

/// Lets `PlatformIO` install the archive into a project and build it for this machine and for a Cortex-M4F, and runs both
/// programs.
fn build_with_platformio(release: &Release) -> Result<()> {
    check_emulation()?;
    let environment = Environment::create("platformio")?;
    environment.install(PLATFORMIO)?;
    let archive = release.file(&format!("footfall-estimator-{VERSION}"), ".zip")?;
    let folder = release.folder("platformio")?;
    let (at, archive) = (folder.display().to_string(), archive.display().to_string());
    let (start, map) = (of_emulator("startup.c")?, of_emulator("link.ld")?);
    let files = [("src/main.c", IN_C), ("src/startup.c", &start), ("link.ld", &map)];
    for (name, text) in OF_PLATFORMIO.into_iter().chain(files) {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().context("a file has a folder")?)?;
        fs::write(path, text.replace("@FOLDER@", &at).replace("@ARCHIVE@", &archive))?;
    }
    environment
        .python()
        .at(&folder)
        .env("PLATFORMIO_CORE_DIR", folder.join("core"))
        .env("PLATFORMIO_SETTING_ENABLE_TELEMETRY", "no")
        .with(["-m", "platformio", "run"])
        .run()?;
    let program = |platform: &str| folder.join(".pio/build").join(platform).join("program");
    expect_stable(&Step::program(&program("host").display().to_string()).output()?)?;
    emulate(&program("emulated"))
}

/// Lets the component manager of ESP-IDF check the archive's folder and pack it, with the library of each chip and the file
/// of C. A build would need ESP-IDF and its compilers.
fn pack_component(release: &Release) -> Result<()> {
    let environment = Environment::create("esp-idf")?;
    environment.install([COMPONENT_MANAGER])?;
    let folder = release.folder("esp-idf")?;
    let component = unpack_library(release, &folder.join("components"))?;
    let packed = folder.join("packed");
    let pack = ["component", "pack", "--name", "footfall_estimator", "--dest-dir"];
    let compote =
        "import sys; from idf_component_manager.cli import safe_cli; sys.exit(safe_cli())";
    environment
        .python()
        .at(&component)
        .with(["-c", compote])
        .with(pack)
        .with([packed.display().to_string()])
        .run()?;
    let archive = packed.join(format!("footfall_estimator_{VERSION}.tgz")).display().to_string();
    let list = ["--list", "--gzip", "--file", &archive];
    let listed = Step::program("tar").with(list).output()?;
    for chip in library::folders().filter(|folder| folder.starts_with("esp32")) {
        let file = format!("./src/{chip}/libfootfall_estimator.a");
        if !listed.lines().any(|line| line == file) {
            bail!("the component lacks {file}");
        }
    }
    if !listed.lines().any(|line| line == "./src/generic/footfall_estimator.c") {
        bail!("the component lacks the file of C");
    }
    println!("{archive}");
    Ok(())
}

/// Adds the packed estimator to a new package, and runs a program with it.
fn add_crate(release: &Release) -> Result<()> {
    let folder = release.folder("crate")?;
    let packed = release.file(&format!("footfall-estimator-{VERSION}"), ".crate")?;
    let extract = ["--extract", "--gzip", "--file", &packed.display().to_string()];
    Step::program("tar").at(&folder).with(extract).run()?;
    let app = folder.join("app");
    fs::create_dir_all(app.join("src"))?;
    let manifest = "[package]\nname = \"app\"\nedition = \"2024\"\n\n[workspace]\n";
    fs::write(app.join("Cargo.toml"), manifest)?;
    fs::write(app.join("src/main.rs"), IN_RUST)?;
    let path = format!("../footfall-estimator-{VERSION}");
    Step::program("cargo").at(&app).with(["add", "--quiet", "--path", &path]).run()?;
    let run = ["run", "--quiet", "--target-dir", "target"];
    expect_stable(&Step::program("cargo").at(&app).with(run).output()?)
}

/// Boots the program of the reference board on an emulated one, where a walk has the bits of a host.
fn boot_firmware(release: &Release) -> Result<()> {
    let elf = release.file(&format!("foot-{VERSION}-reference"), ".elf")?;
    Step::cargo(&["test", "--locked", "--quiet"])
        .with(LABORATORY)
        .with(["--package", "boot", "foot_in_a_walk_sends_the_bits_of_the_host"])
        .env("FOOTFALL_ELF", elf)
        .run()
}

/// Boots the program of a Nano RP2040 on an emulated one at rest, and decodes the bytes at its USB port.
fn boot_uf2(release: &Release) -> Result<()> {
    let uf2 = release.file(&format!("foot-{VERSION}-nano-rp2040"), ".uf2")?;
    Step::cargo(&["build", "--locked", "--quiet", "--package", "gait", "--example", "part"])
        .run()?;
    let part = root().join("target/debug/examples/part").display().to_string();
    let emulator = root().join("laboratory/nano");
    Step::program("npm").at(&emulator).with(["ci", "--silent"]).run()?;
    let folder = release.folder("uf2")?;
    let bytes = folder.join("uart.bin").display().to_string();
    Step::program("node")
        .at(&emulator)
        .with(["run.mjs", "--uf2", &uf2.display().to_string(), "--part", &part])
        .with(["--motion", "rest", "--seconds", "4", "--output", &bytes])
        .output()?;
    let name = format!("footfall-{VERSION}-{ARCH}-linux");
    let extract = ["--extract", "--gzip", "--file"];
    let packed = release.dist.join(format!("{name}.tar.gz")).display().to_string();
    Step::program("tar").at(&folder).with(extract).with([packed]).run()?;
    Step::program(&folder.join(&name).join("footfall").display().to_string())
        .at(&folder)
        .with(["decode", "uart.bin", "--output", "rows.csv"])
        .run()?;
    expect_stable_at_end(&folder.join("rows.csv"))
}

/// Boots the program of a Feather RP2350 on an emulated one, where a walk has the bits of a host.
fn boot_rp2350(release: &Release) -> Result<()> {
    let uf2 = release.file(&format!("foot-{VERSION}-feather-rp2350"), ".uf2")?;
    Step::cargo(&["test", "--locked", "--quiet", "--manifest-path", "laboratory/rp2350/Cargo.toml"])
        .with(["estimate_has_the_bits_of_the_host"])
        .env("FOOTFALL_UF2", uf2)
        .run()
}

/// Reads the names that `cargo binstall` would download, unpacks these files, and runs the program in them.
fn run_programs(release: &Release) -> Result<()> {
    let manifest = fs::read_to_string(root().join("host/footfall/Cargo.toml"))?;
    let (_, metadata) = manifest
        .split_once("[package.metadata.binstall]\n")
        .context("host/footfall/Cargo.toml has no metadata for cargo binstall")?;
    let value = |key: &str| {
        let mut lines = metadata.lines();
        let line = lines.find_map(|line| line.strip_prefix(&format!("{key} = \"")));
        let value = line.and_then(|line| line.strip_suffix('"'));
        value.with_context(|| format!("host/footfall/Cargo.toml has no {key} for cargo binstall"))
    };
    for machine in ["x86_64", "aarch64"] {
        let filled = |template: &str| {
            [
                ("{ repo }", ADDRESS),
                ("{ version }", VERSION),
                ("{ target-arch }", machine),
                ("{ target-family }", "linux"),
                ("{ bin }", "footfall"),
                ("{ binary-ext }", ""),
            ]
            .into_iter()
            .fold(template.to_owned(), |text, (name, value)| text.replace(name, value))
        };
        let url = filled(value("pkg-url")?);
        let address = format!("{ADDRESS}/releases/download/v{VERSION}/");
        let file = url.strip_prefix(&address).with_context(|| format!("{url}: {address}…"))?;
        let inside = filled(value("bin-dir")?);
        let folder = release.folder(&format!("program-{machine}"))?;
        let extract = ["--extract", "--gzip", "--file"];
        let path = release.dist.join(file).display().to_string();
        Step::program("tar").at(&folder).with(extract).with([path]).run()?;
        let program = folder.join(&inside);
        if !program.is_file() {
            bail!("{file} lacks {inside}");
        }
        let program = program.display().to_string();
        let program = if machine == ARCH {
            Step::program(&program)
        } else {
            let emulator = format!("qemu-{machine}");
            if !is_installed(&emulator) {
                bail!("{emulator} is not installed (Debian: apt-get install qemu-user)");
            }
            Step::program(&emulator).with([program])
        };
        replay_rest(program, &folder)?;
    }
    Ok(())
}
