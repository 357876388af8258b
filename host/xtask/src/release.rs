//! Builds the files of a release in `dist`: programs, wheels, firmware, the estimator for C,
//! descriptions of the wire.
//!
//! Those of the firmware depend on commit and compiler alone: two clones of a commit give the same bytes.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;

use crate::command::{Step, remove_folder, root};
use crate::firmware::{self, Board};
use crate::{hex, image, library, uf2};

/// Machines with a program and a wheel; the program is static, so it runs on any Linux of the machine.
const MACHINES: [Machine; 2] = [
    Machine {
        name: "x86_64-linux",
        program: "x86_64-unknown-linux-musl",
        wheel: "x86_64-unknown-linux-gnu",
    },
    Machine {
        name: "aarch64-linux",
        program: "aarch64-unknown-linux-musl",
        wheel: "aarch64-unknown-linux-gnu",
    },
];

/// Tools that compile and link for other machines, from `PyPI`.
const TOOLS: [&str; 3] = ["cargo-zigbuild==0.24.0", "maturin==1.16.0", "ziglang==0.17.1"];

/// Oldest glibc that wheels run with: that of `manylinux_2_28`.
const WHEELS_FOR: &str = "manylinux_2_28";

/// Files of the repository that describe the messages of a foot.
const DESCRIPTIONS: [&str; 4] =
    ["wire/footfall.dbc", "wire/footfall.eds", "wire/c/footfall.c", "wire/c/footfall.h"];

/// Files packed with each program.
const BESIDE_PROGRAM: [&str; 4] = ["CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];

/// Version of the workspace, which this package has too.
const VERSION: &str = env!("CARGO_PKG_VERSION");

struct Machine {
    name: &'static str,
    program: &'static str,
    wheel: &'static str,
}

/// Part of a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// What needs no other compiler: the firmware, and descriptions of the wire.
    Firmware,
}

/// Builds the files of a release, or of a part of it, in `dist`, which is emptied first.
///
/// # Errors
/// A result was measured on another ELF, a tool cannot be installed, a build fails, or a file cannot be written.
pub fn run(only: Option<Part>) -> Result<()> {
    if only.is_none() {
        // As tests build them, in the folder that digests are computed from.
        firmware::build_all()?;
        results::refuse_older()?;
    }
    let dist = root().join("dist");
    if dist.exists() {
        fs::remove_dir_all(&dist).context("dist cannot be emptied")?;
    }
    fs::create_dir(&dist).context("dist cannot be made")?;
    if only.is_none() {
        let tools = install_tools()?;
        for machine in &MACHINES {
            build_program(machine, &tools, &dist)?;
            build_wheel(machine, &tools, &dist)?;
        }
        library::run(&dist)?;
        let built = uf2::run()?;
        let name = format!("foot-{VERSION}-nano-rp2040.uf2");
        fs::copy(&built, dist.join(&name)).with_context(|| name.clone())?;
    }
    build_firmware(&dist)?;
    for file in DESCRIPTIONS {
        copy(&root().join(file), &dist)?;
    }
    let names = fs::read_dir(&dist)?.map(|entry| Ok(entry?.file_name().display().to_string()));
    let mut names: Vec<String> = names.collect::<Result<_>>()?;
    names.sort();
    let sums = Step::program("sha256sum").at(&dist).with(&names).output()?;
    fs::write(dist.join("SHA256SUMS"), &sums)?;
    print!("{sums}");
    Ok(())
}

/// Installs the tools in a separate folder, and returns the folder of their programs.
fn install_tools() -> Result<PathBuf> {
    let folder = root().join("target/release-tools");
    let programs = folder.join("bin");
    if !programs.join("pip").is_file() {
        Step::program("python3")
            .with(["-m", "venv", "--clear"])
            .with([folder.display().to_string()])
            .run()?;
    }
    Step::program(&programs.join("pip").display().to_string())
        .with(["--disable-pip-version-check", "install", "--quiet"])
        .with(TOOLS)
        .run()?;
    for machine in &MACHINES {
        let add = ["target", "add", machine.program, machine.wheel];
        Step::program("rustup").with(add).run()?;
    }
    Ok(programs)
}

/// Builds the program with all features, packs it, and checks that it needs no shared library.
fn build_program(machine: &Machine, tools: &Path, dist: &Path) -> Result<()> {
    Step::cargo(&["zigbuild", "--locked", "--release"])
        .with(["--package", "footfall-program", "--features", "all"])
        .with(["--target", machine.program])
        .with_path(tools)
        .run()?;
    let name = format!("footfall-{VERSION}-{}", machine.name);
    let folder = root().join("target/dist-packed").join(&name);
    remove_folder(&folder)?;
    fs::create_dir_all(&folder)?;
    let program = root().join("target").join(machine.program);
    let program = program.join("release/footfall");
    if has_interpreter(&fs::read(&program)?) {
        bail!("{}: it is not static", program.display());
    }
    copy(&program, &folder)?;
    for file in BESIDE_PROGRAM {
        copy(&root().join(file), &folder)?;
    }
    Step::program("tar")
        .at(folder.parent().unwrap_or(&folder))
        .with(["--create", "--gzip", "--owner=0", "--group=0", "--file"])
        .with([dist.join(format!("{name}.tar.gz")).display().to_string()])
        .with([&name])
        .run()
}

/// Returns whether a 64-bit ELF has a segment `PT_INTERP`, which names a dynamic linker.
fn has_interpreter(elf: &[u8]) -> bool {
    const PT_INTERP: u32 = 3;
    let at = |offset: usize, size: usize| -> usize {
        let bytes = elf.get(offset..offset + size).unwrap_or_default();
        let sum = |sum, byte: &u8| sum << 8 | usize::from(*byte);
        bytes.iter().rev().fold(0, sum)
    };
    let (table, size, count) = (at(0x20, 8), at(0x36, 2), at(0x38, 2));
    (0..count).any(|k| at(table + k * size, 4) == PT_INTERP as usize)
}

fn build_wheel(machine: &Machine, tools: &Path, dist: &Path) -> Result<()> {
    Step::program(&tools.join("maturin").display().to_string())
        .with(["build", "--locked", "--zig", "--release"])
        .with(["--features", "all", "--target", machine.wheel])
        .with(["--compatibility", WHEELS_FOR])
        .with(["--manifest-path", "python/Cargo.toml", "--out"])
        .with([dist.display().to_string()])
        .with_path(tools)
        .run()
}

/// Builds the firmware of each board and writes its ELF, which the debug probe and the log need; its image, for updates;
/// HEX and `DfuSe` of bootloader and program, for an empty chip.
fn build_firmware(dist: &Path) -> Result<()> {
    let folders = firmware::folders()?;
    let arguments = firmware::remap(&folders);
    for board in Board::all()? {
        let elf = firmware::build(&board, &arguments)?;
        let bootloader = firmware::build_bootloader(&board, &arguments)?;
        for built in [&elf, &bootloader] {
            let name = || built.display().to_string();
            firmware::check_names(&fs::read(built)?, &folders).with_context(name)?;
        }
        image::write(&elf, None, None, &elf.with_extension("img"))?;
        fs::copy(&elf, elf.with_extension("elf"))?;
        hex::run(&elf, Some(&bootloader))?;
        for extension in ["elf", "img", "hex", "dfu"] {
            let built = elf.with_extension(extension);
            let name = format!("foot-{VERSION}-{}.{extension}", board.name);
            fs::copy(&built, dist.join(&name)).with_context(|| name.clone())?;
        }
    }
    Ok(())
}

fn copy(file: &Path, folder: &Path) -> Result<()> {
    let name = file.file_name().context("a file has a name")?;
    fs::copy(file, folder.join(name)).with_context(|| file.display().to_string())?;
    Ok(())
}
