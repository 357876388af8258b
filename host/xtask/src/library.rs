//! Packs the estimator for programs in C: one archive for Arduino, `PlatformIO`, Zephyr, ESP-IDF, `CMake` and pkg-config.

use std::fs::{self, File};
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use ar_archive_writer::{ArchiveKind, DEFAULT_OBJECT_READER, NewArchiveMember};
use object::read::archive::ArchiveFile;
use object::{Object as _, ObjectSymbol as _};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::command::{Step, remove_folder, root};

/// Targets, each with the folders of `src` that have its library. Their names are those that the Arduino IDE looks for:
/// the processor, then FPU and calling convention.
const TARGETS: [(&str, &[&str]); 7] = [
    ("thumbv6m-none-eabi", &["cortex-m0", "cortex-m0plus", "cortex-m3"]),
    (
        "thumbv7em-none-eabi",
        &[
            "cortex-m4",
            "cortex-m4/fpv4-sp-d16-softfp",
            "cortex-m7/fpv5-d16-softfp",
            "cortex-m7/fpv5-sp-d16-softfp",
        ],
    ),
    (
        "thumbv7em-none-eabihf",
        &[
            "cortex-m4/fpv4-sp-d16-hard",
            "cortex-m7/fpv5-d16-hard",
            "cortex-m7/fpv5-sp-d16-hard",
            "imxrt1062/fpv5-d16-hard",
        ],
    ),
    ("thumbv8m.main-none-eabihf", &["cortex-m33/fpv5-sp-d16-hard"]),
    ("riscv32imc-unknown-none-elf", &["esp32c3"]),
    ("x86_64-unknown-linux-gnu", &["x86_64"]),
    ("aarch64-unknown-linux-gnu", &["aarch64"]),
];

/// Functions of C that the compiler calls by itself; those of its own library begin with `__`.
const OF_C: [&str; 5] = ["memcpy", "memmove", "memset", "memcmp", "sqrtf"];

const LIBRARY: &str = "libfootfall_estimator.a";

/// Files of the repository in the archive, and their folders there.
const FILES: [(&str, &str); 5] = [
    ("estimator-c/include/footfall_estimator.h", "src"),
    ("estimator-c/examples/walk.c", "examples"),
    ("docs/your-own-board.md", ""),
    ("LICENSE-APACHE", ""),
    ("LICENSE-MIT", ""),
];

/// Builds the archive in `dist`, and returns its path.
///
/// # Errors
/// A target cannot be installed or built, or a library has symbols that could collide with those of a program.
pub fn run(dist: &Path) -> Result<PathBuf> {
    let version = env!("CARGO_PKG_VERSION");
    let name = format!("footfall-estimator-{version}");
    let folder = root().join("target/library").join(&name);
    remove_folder(&folder)?;
    for (target, processors) in TARGETS {
        let library = build(target)?;
        for processor in processors {
            write(&folder.join("src").join(processor).join(LIBRARY), &library)?;
        }
    }
    for (file, below) in FILES {
        let name = Path::new(file).file_name().context("a file has a name")?;
        let text = fs::read_to_string(root().join(file))?;
        // Where the header and the example are in the archive.
        let text = text.replace("](../estimator-c/include/", "](src/");
        let text = text.replace("](../estimator-c/", "](");
        write(&folder.join(below).join(name), text.as_bytes())?;
    }
    let packaging = root().join("estimator-c/package");
    for path in files(&packaging)? {
        let text = fs::read_to_string(&path)?.replace("@VERSION@", version);
        write(&folder.join(path.strip_prefix(&packaging)?), text.as_bytes())?;
    }
    let packed = dist.join(format!("{name}.zip"));
    pack(&folder, &name, &packed)?;
    println!("{}", packed.display());
    Ok(packed)
}

/// Builds the library for a target: one object, in which nothing but the functions of the header can be seen.
fn build(target: &str) -> Result<Vec<u8>> {
    Step::program("rustup").with(["target", "add", target]).run()?;
    // Without floating point in hardware calls take the time, and loops that are unrolled only space.
    let level = if target.ends_with("hf") || target.contains("linux") { "3" } else { "'s'" };
    let level = format!("profile.firmware.package.footfall-estimator.opt-level={level}");
    Step::cargo(&["rustc", "--locked", "--profile", "firmware", "--lib", "--target", target])
        .with(["--package", "estimator-c", "--crate-type", "staticlib", "--features", "alone"])
        .with(["--config", "profile.firmware.panic='abort'", "--config", &level])
        .run()?;
    let built = root().join("target").join(target).join("firmware/libestimator_c.a");
    let bytes = fs::read(&built).with_context(|| built.display().to_string())?;
    let archive = ArchiveFile::parse(&*bytes)?;
    // The other members are the compiler's library, which a program in C has from its own compiler.
    for member in archive.members() {
        let member = member?;
        if member.name().starts_with(b"estimator_c-") {
            let object = member.data(&*bytes)?;
            check_symbols(object).with_context(|| target.to_owned())?;
            return archive_of(object);
        }
    }
    bail!("{}: it has no object of the estimator", built.display())
}

/// Checks that an object defines functions of the header alone, and calls nothing but C and the compiler's library: a
/// panic that can be reached would be another call.
fn check_symbols(object: &[u8]) -> Result<()> {
    for symbol in object::File::parse(object)?.symbols() {
        let name = symbol.name()?;
        let known = if symbol.is_undefined() {
            name.is_empty() || name.starts_with("__") || OF_C.contains(&name)
        } else {
            symbol.is_local() || name.starts_with("footfall_")
        };
        if !known {
            bail!("unexpected symbol {name}");
        }
    }
    Ok(())
}

/// Returns an archive with one object, and an index for the linker.
fn archive_of(object: &[u8]) -> Result<Vec<u8>> {
    let member = NewArchiveMember {
        buf: Box::new(object),
        object_reader: &DEFAULT_OBJECT_READER,
        member_name: "footfall_estimator.o".into(),
        mtime: 0,
        uid: 0,
        gid: 0,
        perms: 0o644,
    };
    let mut archive = Cursor::new(Vec::new());
    ar_archive_writer::write_archive_to_stream(
        &mut archive,
        &[member],
        ArchiveKind::Gnu,
        false,
        None,
    )?;
    Ok(archive.into_inner())
}

fn write(path: &Path, content: &[u8]) -> Result<()> {
    fs::create_dir_all(path.parent().context("a file has a folder")?)?;
    fs::write(path, content).with_context(|| path.display().to_string())
}

/// All files in a folder, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut entries: Vec<PathBuf> =
        entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        if path.is_dir() {
            found.extend(files(&path)?);
        } else {
            found.push(path);
        }
    }
    Ok(found)
}

/// Packs a folder under a name; the same files give the same bytes.
fn pack(folder: &Path, name: &str, to: &Path) -> Result<()> {
    let mut zip = ZipWriter::new(File::create(to).with_context(|| to.display().to_string())?);
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for path in files(folder)? {
        let inside = path.strip_prefix(folder)?.display().to_string();
        zip.start_file(format!("{name}/{inside}"), stored)?;
        zip.write_all(&fs::read(&path)?)?;
    }
    zip.finish()?;
    Ok(())
}
