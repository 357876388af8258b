//! Packs the estimator for programs in C: one archive for Arduino, `PlatformIO`, Zephyr, ESP-IDF, `CMake` and pkg-config.
//!
//! The archive depends only on commit and compiler: two clones of a commit give the same bytes.

use std::fs::{self, File};
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use ar_archive_writer::{ArchiveKind, DEFAULT_OBJECT_READER, NewArchiveMember};
use object::build::elf;
use object::read::archive::ArchiveFile;
use object::{Architecture, BinaryFormat, Object as _, ObjectSymbol as _};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::address::ADDRESS;
use crate::command::{Step, remove_folder, root};
use crate::links::with_targets;
use crate::{firmware, generic};

/// Library of the archive: a target of the compiler, and its folders in `src`.
#[derive(Clone, Copy)]
struct Library<'a> {
    target: &'a str,
    /// CPU and feature of a floating-point unit that the target does not use by default. This is `softfp`, which passes
    /// numbers in the registers of integers and computes in hardware. The compiler calls the feature unstable, because
    /// it would change how numbers are passed if the target did not fix that. The functions of the header take and
    /// return no numbers.
    fpu: Option<(&'a str, &'a str)>,
    folders: &'a [&'a str],
}

const fn library<'a>(target: &'a str, folders: &'a [&'a str]) -> Library<'a> {
    Library { target, fpu: None, folders }
}

/// The libraries. Folders of microcontrollers have the names that the Arduino IDE expects: the processor, then FPU and
/// calling convention as in the compiler's options. A core without `-mfpu` has only the convention.
const LIBRARIES: [Library<'_>; 17] = [
    // Armv8-M without its main extension runs the code of Armv6-M.
    library("thumbv6m-none-eabi", &["cortex-m0", "cortex-m0plus", "cortex-m23", "mkl26z64"]),
    library("thumbv7m-none-eabi", &["cortex-m3"]),
    library("thumbv7em-none-eabi", &["cortex-m4", "cortex-m7", "mk20dx256"]),
    Library {
        target: "thumbv7em-none-eabi",
        fpu: Some(("cortex-m4", "vfp4d16sp")),
        folders: &[
            "cortex-m4/fpv4-sp-d16-softfp",
            "cortex-m7/fpv4-sp-d16-softfp",
            "cortex-m7/fpv5-d16-softfp",
            "cortex-m7/fpv5-sp-d16-softfp",
        ],
    },
    library(
        "thumbv7em-none-eabihf",
        &[
            "cortex-m4/fpv4-sp-d16-hard",
            "mk64fx512/fpv4-sp-d16-hard",
            "mk66fx1m0/fpv4-sp-d16-hard",
            // Cores of STM32duino name the smaller unit, whose instructions the larger one has.
            "cortex-m7/fpv4-sp-d16-hard",
            "cortex-m7/fpv5-d16-hard",
            "cortex-m7/fpv5-sp-d16-hard",
            "imxrt1062/fpv5-d16-hard",
        ],
    ),
    library("thumbv8m.main-none-eabi", &["cortex-m33", "cortex-m55"]),
    Library {
        target: "thumbv8m.main-none-eabi",
        fpu: Some(("cortex-m33", "fp-armv8d16sp")),
        folders: &[
            "cortex-m33/fpv4-sp-d16-softfp",
            "cortex-m33/fpv5-sp-d16-softfp",
            "cortex-m33/softfp",
            "cortex-m55/fpv5-d16-softfp",
            "cortex-m55/softfp",
        ],
    },
    library(
        "thumbv8m.main-none-eabihf",
        &[
            "cortex-m33/fpv4-sp-d16-hard",
            "cortex-m33/fpv5-sp-d16-hard",
            "cortex-m33/hard",
            "cortex-m55/fpv5-d16-hard",
            "cortex-m55/hard",
        ],
    ),
    library(
        "riscv32imc-unknown-none-elf",
        &["riscv32", "rv32imac", "esp32c2", "esp32c3", "esp32c5", "esp32c6", "esp32c61", "esp32h2"],
    ),
    library("riscv32imafc-unknown-none-elf", &["riscv32/ilp32f", "esp32p4"]),
    library("x86_64-unknown-linux-gnu", &["x86_64"]),
    library("i686-unknown-linux-gnu", &["i386"]),
    library("aarch64-unknown-linux-gnu", &["aarch64"]),
    library("aarch64-apple-darwin", &["macos/arm64"]),
    library("x86_64-apple-darwin", &["macos/x86_64"]),
    // For Visual C++ and for MinGW: a file each.
    library("x86_64-pc-windows-msvc", &["windows/x86_64"]),
    library("x86_64-pc-windows-gnu", &["windows/x86_64"]),
];

/// Functions of C to which the compiler generates calls, the last one on macOS. The functions of its own library begin
/// with `__`.
const C_FUNCTIONS: [&str; 6] =
    ["memcpy", "memmove", "memset", "memcmp", "sqrtf", "memset_pattern16"];

/// Prefixes of the compiler's functions of double precision, and of their callers. They take kilobytes on a processor
/// without floating point.
const DOUBLE_PRECISION_PREFIXES: [&str; 6] =
    ["__aeabi_d", "__aeabi_f2d", "__aeabi_l2f", "__aeabi_ul2f", "__floatdisf", "__floatundisf"];

/// Prefix of the functions of Arm's C library for memory, which the library defines weakly by those of C.
const ARM_MEMORY: &str = "__aeabi_mem";

/// Symbols that are not functions: of the linker, for position-independent code on an i386; of Visual C++, for a
/// program with floating point.
const DATA_SYMBOLS: [&str; 2] = ["_GLOBAL_OFFSET_TABLE_", "_fltused"];

/// Files of the repository, and where they are in the archive.
const FILES: [(&str, &str); 6] = [
    ("estimator-c/include/footfall_estimator.h", "src/footfall_estimator.h"),
    ("estimator-c/examples/CMakeLists.txt", "examples/CMakeLists.txt"),
    ("estimator-c/examples/walk.c", "examples/walk.c"),
    (PAGE, "README.md"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
    ("LICENSE-MIT", "LICENSE-MIT"),
];

/// Documentation of the archive, whose links lead into the repository.
const PAGE: &str = "docs/guide/your-own-board.md";

/// Name of the folder in the archive. It has no version, because it is the name of a component of ESP-IDF.
const NAME: &str = "footfall_estimator";

/// Folder of the file of C in `src`, and name of a target for it.
const GENERIC: &str = "generic";

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Folders of the libraries in `src` of the archive.
pub fn folders() -> impl Iterator<Item = &'static str> {
    LIBRARIES.into_iter().flat_map(|library| library.folders).copied()
}

/// Builds the archive for all processors in `dist`, with a file of its SHA-256, and returns its path.
///
/// # Errors
/// A target cannot be installed or built, or a library has symbols that could collide with the symbols of a program.
pub fn run(dist: &Path) -> Result<PathBuf> {
    let folder = root().join("target/library").join(NAME);
    fill(&folder, &LIBRARIES)?;
    write_generic(&folder)?;
    let name = format!("footfall-estimator-{VERSION}.zip");
    let packed = dist.join(&name);
    pack(&folder, NAME, &packed)?;
    let sum = Step::program("sha256sum").at(dist).with([name]).output()?;
    fs::write(packed.with_extension("zip.sha256"), &sum)?;
    println!("{}\n{}", packed.display(), sum.trim());
    Ok(packed)
}

/// Builds the folder of the archive in `dist`, with the library for only one target of the compiler, or with the file of C
/// for the target `generic`. Returns its path. A target that the archive lacks has a folder of its own name in `src`.
///
/// # Errors
/// As [`run`].
pub fn run_for(target: &str, dist: &Path) -> Result<PathBuf> {
    let folder = dist.join(format!("{NAME}-{target}"));
    if target == GENERIC {
        fill(&folder, &[])?;
        write_generic(&folder)?;
        println!("{}", folder.display());
        return Ok(folder);
    }
    let folders = [target];
    let mut libraries: Vec<Library<'_>> =
        LIBRARIES.into_iter().filter(|library| library.target == target).collect();
    if libraries.is_empty() {
        libraries.push(library(target, &folders));
    }
    fill(&folder, &libraries)?;
    println!("{}", folder.display());
    for library in libraries.iter().flat_map(|library| library.folders) {
        println!("  src/{library}");
    }
    Ok(folder)
}

/// Writes the file of C that stands in for a library.
fn write_generic(folder: &Path) -> Result<()> {
    let file = folder.join("src").join(GENERIC).join("footfall_estimator.c");
    write(&file, generic::source()?.as_bytes())
}

/// Writes header, libraries, and the files of each build system to a folder, which is emptied first.
fn fill(folder: &Path, libraries: &[Library<'_>]) -> Result<()> {
    remove_folder(folder)?;
    for library in libraries {
        let (name, bytes) = build(library)?;
        for processor in library.folders {
            write(&folder.join("src").join(processor).join(name), &bytes)?;
        }
    }
    for (file, inside) in FILES {
        let text = fs::read_to_string(root().join(file))?;
        let text = if file == PAGE { with_links_inside(&text) } else { text };
        write(&folder.join(inside), text.as_bytes())?;
    }
    let compiler = Step::program("rustc").with(["--version"]).output()?;
    let packaging = root().join("estimator-c/package");
    for path in files(&packaging)? {
        let text = fs::read_to_string(&path)?.replace("@VERSION@", VERSION);
        let text = text.replace("@COMPILER@", compiler.trim());
        let text = text.replace("@REPOSITORY@", ADDRESS);
        write(&folder.join(path.strip_prefix(&packaging)?), text.as_bytes())?;
    }
    Ok(())
}

/// Returns the page with links to files of the archive. A link that leads outside is replaced by its text.
fn with_links_inside(page: &str) -> String {
    with_targets(page, |target| {
        let mut files = FILES.iter().map(|(file, inside)| (format!("../../{file}"), *inside));
        let inside = files.find(|(file, _)| file == target).map(|(_, inside)| inside.to_owned());
        let is_kept = target.starts_with("http") || target.starts_with('#');
        inside.or_else(|| is_kept.then(|| target.to_owned()))
    })
}

/// Builds a library: one object, which exports only the functions of the header. Returns the name of its file, and its
/// bytes.
fn build(library: &Library<'_>) -> Result<(&'static str, Vec<u8>)> {
    let target = library.target;
    Step::program("rustup").with(["target", "add", target]).run().with_context(|| {
        format!("{target}: `rustc --print target-list` lists the targets; rustup has the core library of most")
    })?;
    // Without hardware for floating point, calls take most of the time, so unrolled loops would only take space.
    let has_hardware = library.fpu.is_some()
        || target.ends_with("hf")
        || target.contains("imafc")
        || !target.contains("-none");
    let level = if has_hardware { "3" } else { "'s'" };
    let level = format!("profile.firmware.package.footfall-estimator.opt-level={level}");
    let folders = firmware::folders()?;
    let mut flags: Vec<String> = folders
        .iter()
        .map(|(folder, name)| format!("--remap-path-prefix={}={name}", folder.display()))
        .collect();
    if let Some((cpu, feature)) = library.fpu {
        flags.extend([format!("-Ctarget-cpu={cpu}"), format!("-Ctarget-feature=+{feature}")]);
    }
    if target.starts_with("thumbv7") || target.starts_with("thumbv8m.main") {
        // A program may trap unaligned access, by CCR.UNALIGN_TRP.
        flags.push("-Ctarget-feature=+strict-align".to_owned());
    }
    if target.starts_with("riscv") {
        // Lets the program's linker shorten each call from 8 bytes to 4 or 2. Floating point is some 1,400 calls.
        flags.push("-Ctarget-feature=+relax".to_owned());
    }
    if flags.iter().any(|flag| flag.starts_with("-Ctarget-feature")) {
        // The compiler warns of each feature that it calls unstable. It shows the warnings of the code for other targets.
        flags.push("-Awarnings".to_owned());
    }
    Step::cargo(&["rustc", "--locked", "--profile", "firmware", "--lib", "--target", target])
        .with(["--package", "estimator-c", "--crate-type", "staticlib", "--features", "alone"])
        .with(["--config", "profile.firmware.panic='abort'", "--config", &level])
        .with(["--config", "profile.firmware.debug=0"])
        // The name is not quoted, because Cargo splits the key at dots, and looks for a target with a dot in its name in
        // the same way.
        .with(["--config", &format!("target.{target}.rustflags={flags:?}")])
        .run()?;
    let folder = root().join("target").join(target).join("firmware");
    let is_msvc = target.ends_with("msvc");
    let built = folder.join(if is_msvc { "estimator_c.lib" } else { "libestimator_c.a" });
    let bytes = fs::read(&built).with_context(|| built.display().to_string())?;
    let archive = ArchiveFile::parse(&*bytes)?;
    // The other members are the compiler's library, which a program in C has from its own compiler.
    for member in archive.members() {
        let member = member?;
        if member.name().starts_with(b"estimator_c-") {
            let object = without_debug_frame(member.data(&*bytes)?)?;
            check_symbols(&object).with_context(|| target.to_owned())?;
            firmware::check_names(&object, &folders).with_context(|| target.to_owned())?;
            let name = if is_msvc { "footfall_estimator.lib" } else { "libfootfall_estimator.a" };
            return Ok((name, archive_of(&object)?));
        }
    }
    bail!("{}: it has no object of the estimator", built.display())
}

/// Returns the object without `.debug_frame`. The compiler writes it for Arm and RISC-V even without debugging information,
/// and with it a debugger would look for sources that a user does not have.
fn without_debug_frame(object: &[u8]) -> Result<Vec<u8>> {
    let architecture = object::File::parse(object)?.architecture();
    if !matches!(architecture, Architecture::Arm | Architecture::Riscv32) {
        return Ok(object.to_vec());
    }
    let mut builder = elf::Builder::read(object)?;
    for section in &mut builder.sections {
        section.delete = section.name.ends_with(b".debug_frame");
    }
    builder.delete_orphans();
    // The compiler keeps names of sections and of symbols in one table, the builder in two.
    let names = builder.sections.add();
    names.name = ".shstrtab".into();
    names.sh_type = object::elf::SHT_STRTAB;
    names.sh_addralign = 1;
    names.data = elf::SectionData::SectionString;
    let mut stripped = Vec::new();
    builder.write(&mut stripped)?;
    Ok(stripped)
}

/// Checks that an object defines only functions of the header, and calls only C and the compiler's library. A reachable
/// panic would be another call. Functions of double precision are rejected as well, and so are the functions of Arm's C
/// library for memory, which a program without a C library lacks.
fn check_symbols(object: &[u8]) -> Result<()> {
    let file = object::File::parse(object)?;
    for symbol in file.symbols() {
        let name = symbol.name()?;
        // Names of C begin with an underscore on macOS.
        let name = match file.format() {
            BinaryFormat::MachO => name.strip_prefix('_').unwrap_or(name),
            _ => name,
        };
        let known = if symbol.is_undefined() {
            let is_of_compiler = name.starts_with("__") && !name.starts_with(ARM_MEMORY);
            name.is_empty() || is_of_compiler || C_FUNCTIONS.contains(&name)
        } else {
            // On Windows a constant has its value as its name, and the linker keeps one of each name.
            let is_constant = name.starts_with("__real@") || name.starts_with("__xmm@");
            let is_memory = symbol.is_weak() && name.starts_with(ARM_MEMORY);
            !symbol.is_global() || name.starts_with("footfall_") || is_constant || is_memory
        };
        if !known && !DATA_SYMBOLS.contains(&name) {
            bail!("unexpected symbol {name}");
        }
        if DOUBLE_PRECISION_PREFIXES.iter().any(|beginning| name.starts_with(beginning)) {
            bail!("{name} brings functions of double precision");
        }
    }
    Ok(())
}

/// Returns an archive with one object, and an index for the linker.
fn archive_of(object: &[u8]) -> Result<Vec<u8>> {
    let kind = match object::File::parse(object)?.format() {
        BinaryFormat::MachO => ArchiveKind::Darwin,
        BinaryFormat::Coff => ArchiveKind::Coff,
        _ => ArchiveKind::Gnu,
    };
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
    ar_archive_writer::write_archive_to_stream(&mut archive, &[member], kind, false, None)?;
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
///
/// # Errors
/// A file cannot be read or written.
pub fn pack(folder: &Path, name: &str, to: &Path) -> Result<()> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_leave_the_archive_become_text() {
        let page = "[`a`](../../estimator-c/examples/walk.c) [b](choosing.md) [c](https://rustup.rs) (d) [e](#f)";
        let expected = "[`a`](examples/walk.c) b [c](https://rustup.rs) (d) [e](#f)";
        assert_eq!(with_links_inside(page), expected);
    }
}
