//! Builds the files of a release in `dist`: programs, packages for Debian, wheels, crates, firmware, the estimator for C,
//! descriptions of the wire, and bills of materials.
//!
//! The firmware's files depend only on commit and compiler: two clones of a commit give the same bytes.

use std::env::consts::{ARCH, OS};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;

use xtask::command::{Step, remove_folder, root};
use xtask::firmware::{self, Board};
use xtask::{hex, image, library, uf2};

use crate::crates;
use crate::requirements::{self, Keys, Purpose};

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

/// Tool that packs the program for Debian, from crates.io, and its version.
const DEBIAN_TOOL: [&str; 2] = ["cargo-deb", "3.8.0"];

/// Tool that checks the tag of a wheel, from `PyPI`.
pub const AUDITWHEEL: &str = "auditwheel==6.8.2";

/// Tool that writes bills of materials, from crates.io, and its version.
const BILL_TOOL: [&str; 2] = ["cargo-cyclonedx", "0.5.9"];

/// Version of the format of bills of materials.
const BILL_FORMAT: &str = "1.5";

const BILLS: [Bill; 7] = [
    Bill { product: "footfall", folder: "host/footfall", features: "all", target: "all" },
    Bill { product: "footfall-python", folder: "python", features: "all", target: "all" },
    Bill { product: "footfall-estimator", folder: "estimator-c", features: "alone", target: "all" },
    Bill {
        product: "foot-stm32f405",
        folder: "firmware/boards/stm32f405",
        features: "reference",
        target: "thumbv7em-none-eabihf",
    },
    Bill {
        product: "bootloader-stm32f405",
        folder: "firmware/boards/stm32f405/bootloader",
        features: "program",
        target: "thumbv7em-none-eabihf",
    },
    Bill {
        product: "foot-nano-rp2040",
        folder: "firmware/boards/rp",
        features: "nano-rp2040",
        target: "thumbv6m-none-eabi",
    },
    Bill {
        product: "foot-feather-rp2350",
        folder: "firmware/boards/rp",
        features: "feather-rp2350",
        target: "thumbv8m.main-none-eabihf",
    },
];

/// Oldest glibc that wheels run with, as in `manylinux_2_28`.
pub const WHEELS_FOR: &str = "manylinux_2_28";

/// Files of the repository that describe the messages of a foot, and the rule for udev.
const FROM_REPOSITORY: [&str; 5] = [
    "wire/footfall.dbc",
    "wire/footfall.eds",
    "wire/c/footfall.c",
    "wire/c/footfall.h",
    "host/footfall/60-footfall.rules",
];

/// File of a release with what is new in it.
const NOTES: &str = "RELEASE-NOTES.md";

/// Files packed with each program.
const BESIDE_PROGRAM: [&str; 4] = ["CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];

/// Version of the workspace, which this package has too.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Bill of materials of a product.
struct Bill {
    /// Name of the file.
    product: &'static str,
    /// Folder of its package.
    folder: &'static str,
    features: &'static str,
    /// Target of the product; `all` if it runs on several.
    target: &'static str,
}

struct Machine {
    name: &'static str,
    program: &'static str,
    wheel: &'static str,
}

/// Part of a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Files that need no other compiler: the firmware, and descriptions of the wire.
    Firmware,
    /// The program for the machine that runs this, such as macOS and Windows.
    Native,
    /// Bills of materials.
    Bills,
}

/// Builds the files of a release, or of a part of it, in `dist`, which is emptied first.
///
/// # Errors
/// The project has no address, no notes of this version, no key for users, or a result that was measured on another ELF,
/// unless the files are a draft. A tool cannot be installed, a build fails, or a file cannot be written.
pub fn run(only: Option<Part>, purpose: Purpose) -> Result<()> {
    let keys = if purpose == Purpose::Users {
        requirements::check_address()?;
        // Only firmware is signed.
        let has_firmware = matches!(only, Some(Part::Firmware) | None);
        has_firmware.then(Keys::from_environment).transpose()?
    } else {
        None
    };
    let changes = fs::read_to_string(root().join("CHANGELOG.md")).context("CHANGELOG.md")?;
    let notes = notes(&changes, purpose)?;
    if only.is_none() {
        // As tests build them, in the folder that digests are computed from: with the development key.
        let key = root().join("bootloader/keys/development.pub");
        Step::cargo(&["xtask", "programs"]).env("FOOTFALL_KEY", key).run()?;
        // Results take hours to measure again, which a draft need not wait for.
        match purpose {
            Purpose::Users => results::refuse_older()?,
            Purpose::Draft => results::print_older()?,
        }
    }
    let dist = root().join("dist");
    remove_folder(&dist)?;
    fs::create_dir(&dist).context("dist cannot be made")?;
    match only {
        Some(Part::Native) => return build_native_program(&dist),
        Some(Part::Bills) => return write_bills(&dist),
        Some(Part::Firmware) | None => {}
    }
    if only.is_none() {
        let tools = install_tools()?;
        for machine in &MACHINES {
            build_program(machine, &tools, &dist)?;
            build_wheel(machine, &tools, &dist)?;
        }
        build_debian_packages(&dist)?;
        pack_crates(&dist)?;
        library::run(&dist)?;
        for board in uf2::Board::ALL {
            let built = uf2::run(board)?;
            let name = format!("foot-{VERSION}-{}.uf2", board.name());
            fs::copy(&built, dist.join(&name)).with_context(|| name.clone())?;
        }
        write_bills(&dist)?;
        fs::write(dist.join(NOTES), notes).context(NOTES)?;
    }
    build_firmware(&dist, keys.as_ref())?;
    for file in FROM_REPOSITORY {
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

/// Returns the section of this version in `CHANGELOG.md`. A draft may have the section of what is not released yet.
fn notes(changes: &str, purpose: Purpose) -> Result<String> {
    let section = |name: &str| {
        let (_, behind) = changes.split_once(&format!("\n## [{name}]"))?;
        // The heading may have a date.
        let (_, text) = behind.split_once('\n')?;
        Some(text.split("\n## ").next().unwrap_or_default().trim().to_owned() + "\n")
    };
    let notes = match purpose {
        Purpose::Users => section(VERSION),
        Purpose::Draft => section(VERSION).or_else(|| section("Unreleased")),
    };
    notes.with_context(|| {
        format!(
            "CHANGELOG.md has no section \"## [{VERSION}]\": give \"## [Unreleased]\" this name, and the date"
        )
    })
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

/// Optimises the program itself as well. A user who builds it only to try it does not wait for that.
const OPTIMISED: [&str; 2] = ["--config", "profile.release.package.footfall-program.opt-level=2"];

/// Builds the program with all features, packs it, and checks that it needs no shared library.
fn build_program(machine: &Machine, tools: &Path, dist: &Path) -> Result<()> {
    Step::cargo(&["zigbuild", "--locked", "--release"])
        .with(OPTIMISED)
        .with(["--package", "footfall-program", "--features", "all"])
        .with(["--target", machine.program])
        .with_path(tools)
        .run()?;
    let name = format!("footfall-{VERSION}-{}", machine.name);
    let program = root().join("target").join(machine.program);
    let program = program.join("release/footfall");
    if has_interpreter(&fs::read(&program)?) {
        bail!("{}: it is not static", program.display());
    }
    let folder = folder_of(&name, &program)?;
    Step::program("tar")
        .at(folder.parent().unwrap_or(&folder))
        .with(["--create", "--gzip", "--owner=0", "--group=0", "--file"])
        .with([dist.join(format!("{name}.tar.gz")).display().to_string()])
        .with([&name])
        .run()
}

/// Packs the programs for Debian, with the manual pages and completions that the program for this machine writes.
fn build_debian_packages(dist: &Path) -> Result<()> {
    let tools = root().join("target/release-tools");
    install_from_registry(DEBIAN_TOOL, &tools)?;
    let this = MACHINES.iter().find(|machine| machine.name.starts_with(ARCH));
    let this = this.with_context(|| format!("there is no program for {ARCH}"))?;
    let program = root().join("target").join(this.program).join("release/footfall");
    let program = program.display().to_string();
    let folder = root().join("target/deb");
    remove_folder(&folder)?;
    fs::create_dir_all(&folder)?;
    let pages = folder.join("man").display().to_string();
    Step::program(&program).with(["man", &pages]).run()?;
    for shell in ["bash", "fish", "zsh"] {
        let script = Step::program(&program).with(["completions", shell]).output()?;
        fs::write(folder.join(format!("footfall.{shell}")), script)?;
    }
    for machine in &MACHINES {
        Step::program(&tools.join("bin/cargo-deb").display().to_string())
            .with(["--no-build", "--no-strip", "--package", "footfall-program"])
            .with(["--target", machine.program, "--output", &dist.display().to_string()])
            .run()?;
    }
    Ok(())
}

/// Packs the crates, and lists them in the order in which they are published.
fn pack_crates(dist: &Path) -> Result<()> {
    let mut list = String::new();
    for file in crates::pack()? {
        copy(&file, dist)?;
        let name = file.file_name().unwrap_or_default().display().to_string();
        list += &format!("{name}\n");
    }
    fs::write(dist.join("crates-in-order.txt"), list)?;
    Ok(())
}

/// Installs a tool from crates.io.
fn install_from_registry([name, version]: [&str; 2], folder: &Path) -> Result<()> {
    Step::cargo(&["install", "--locked", "--root", &folder.display().to_string()])
        .with(["--version", version, name])
        .run()
}

/// Builds the program with all features for the machine that runs this, checks that it starts, and packs it.
fn build_native_program(dist: &Path) -> Result<()> {
    Step::cargo(&["build", "--locked", "--release"])
        .with(OPTIMISED)
        .with(["--package", "footfall-program", "--features", "all"])
        .run()?;
    let program = root().join("target/release");
    let program = program.join(format!("footfall{}", std::env::consts::EXE_SUFFIX));
    Step::program(&program.display().to_string()).with(["--version"]).run()?;
    let name = format!("footfall-{VERSION}-{ARCH}-{OS}");
    let folder = folder_of(&name, &program)?;
    if cfg!(windows) {
        return library::pack(&folder, &name, &dist.join(format!("{name}.zip")));
    }
    Step::program("tar")
        .at(folder.parent().unwrap_or(&folder))
        .with(["-czf", &dist.join(format!("{name}.tar.gz")).display().to_string(), &name])
        .run()
}

/// Folder of this name with a program and its accompanying files.
fn folder_of(name: &str, program: &Path) -> Result<PathBuf> {
    let folder = root().join("target/dist-packed").join(name);
    remove_folder(&folder)?;
    fs::create_dir_all(&folder)?;
    copy(program, &folder)?;
    for file in BESIDE_PROGRAM {
        copy(&root().join(file), &folder)?;
    }
    Ok(folder)
}

/// Writes a bill of materials of each product, in the format of `CycloneDX`. The tool writes one beside each manifest of a
/// workspace, in a copy of the repository.
fn write_bills(dist: &Path) -> Result<()> {
    let tools = root().join("target/release-tools");
    install_from_registry(BILL_TOOL, &tools)?;
    let tool = tools.join("bin").join(BILL_TOOL[0]).display().to_string();
    let clone = root().join("target/bills");
    remove_folder(&clone)?;
    Step::program("git")
        .with(["clone", "--quiet", "--no-hardlinks", ".", &clone.display().to_string()])
        .run()?;
    for Bill { product, folder, features, target } in BILLS {
        let manifest = clone.join(folder).join("Cargo.toml");
        Step::program(&tool)
            .with(["cyclonedx", "--quiet", "--manifest-path", &manifest.display().to_string()])
            .with(["--features", features, "--target", target, "--no-build-deps"])
            .with(["--format", "json", "--spec-version", BILL_FORMAT])
            .with(["--override-filename", "bill"])
            .run()?;
        let bill = fs::read_to_string(clone.join(folder).join("bill.json"))?;
        // Names of packages contain the folder.
        let bill = bill.replace(&clone.display().to_string(), "");
        fs::write(dist.join(format!("{product}-{VERSION}.cdx.json")), bill)?;
    }
    Ok(())
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
fn build_firmware(dist: &Path, keys: Option<&Keys>) -> Result<()> {
    let folders = firmware::folders()?;
    let arguments = firmware::remap(&folders);
    for board in Board::all()? {
        let elf = firmware::build(&board, &arguments)?;
        let bootloader = firmware::build_bootloader(&board, &arguments)?;
        for built in [&elf, &bootloader] {
            let name = || built.display().to_string();
            firmware::check_names(&fs::read(built)?, &folders).with_context(name)?;
        }
        if let Some(keys) = keys {
            keys.check_bootloader(&bootloader)?;
        }
        let private = keys.map(|keys| keys.private.as_path());
        image::write(&elf, private, None, &elf.with_extension("img"))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_the_section_of_the_version() {
        let released =
            format!("# Changelog\n\n## [{VERSION}] - 2026-12-01\n\nNew.\n\n## [0.0.9]\n\nOld.\n");
        assert_eq!(notes(&released, Purpose::Users).expect("a section"), "New.\n");
        let unreleased = "# Changelog\n\n## [Unreleased]\n\nNew.\n";
        assert_eq!(notes(unreleased, Purpose::Draft).expect("a section"), "New.\n");
        let refused = notes(unreleased, Purpose::Users).expect_err("no section").to_string();
        assert!(refused.contains(&format!("## [{VERSION}]")), "{refused}");
    }
}
