//! Installs the tools that the checks need and this machine lacks.

use std::env;
use std::path::Path;

use anyhow::{Result, bail};

use crate::command::{Step, is_installed, root};
use crate::firmware::TARGET;

/// Tool: a program, and the packages of Debian that have it.
pub type Tool = (&'static str, &'static [&'static str]);

/// Installs the Rust target of the firmware, and the Debian packages with these tools and libclang.
///
/// # Errors
/// A package is missing that this system cannot install.
pub fn run(tools: &[Tool]) -> Result<()> {
    install_target()?;
    let missing = tools.iter().filter(|(program, _)| !is_installed(program));
    let mut missing: Vec<&str> = missing.flat_map(|(_, packages)| *packages).copied().collect();
    if !has_libclang() {
        missing.push("libclang-dev");
    }
    install_packages(&missing)
}

/// Installs packages of Debian.
///
/// # Errors
/// The system is not a Debian, or the packages cannot be installed.
pub fn install_packages(packages: &[&str]) -> Result<()> {
    if packages.is_empty() {
        return Ok(());
    }
    if !is_installed("apt-get") {
        let page = "for cmake and libclang see laboratory/virtual-board/README.md";
        bail!("please install: {} ({page})", packages.join(" "));
    }
    let is_root = Step::program("id").with(["-u"]).output()?.trim() == "0";
    let apt = || {
        if is_root { Step::program("apt-get") } else { Step::program("sudo").with(["apt-get"]) }
    };
    apt().with(["update", "-qq"]).run()?;
    apt().with(["install", "-y", "-qq", "--no-install-recommends"]).with(packages).run()
}

/// Adds the Rust target of the firmware, unless it is already usable. Rustup is asked first, then the fallback that builds
/// `core` from source where rustup has nothing to fetch.
fn install_target() -> Result<()> {
    if has_target()? {
        return Ok(());
    }
    if Step::program("rustup").with(["target", "add", TARGET]).run().is_err() {
        let fallback = root().join("../shared/toolchain/ensure-thumb-target");
        if fallback.is_file() {
            Step::program(&fallback.display().to_string()).run()?;
        }
    }
    if !has_target()? {
        bail!("the Rust target {TARGET} could not be installed");
    }
    Ok(())
}

fn has_target() -> Result<bool> {
    let folder = Step::program("rustc").with(["--print", "sysroot"]).output()?;
    let libraries = Path::new(folder.trim()).join("lib/rustlib").join(TARGET).join("lib");
    Ok(holds(&libraries, |name| name.starts_with("libcore-") && name.ends_with(".rlib")))
}

/// Returns whether the bindings to the emulator can be generated.
fn has_libclang() -> bool {
    if env::var_os("LIBCLANG_PATH").is_some() {
        return true;
    }
    // Not `libclang-cpp.so`, which has no interface of C.
    let is_libclang = |name: &str| {
        name.starts_with("libclang") && name.contains(".so") && !name.starts_with("libclang-cpp")
    };
    let holds_one = |folder: &Path| holds(folder, is_libclang);
    let below = |folder: &str| Path::new(folder).read_dir().into_iter().flatten().flatten();
    let of_llvm = below("/usr/lib")
        .filter(|entry| entry.file_name().display().to_string().starts_with("llvm-"));
    of_llvm.map(|entry| entry.path().join("lib")).any(|folder| holds_one(&folder))
        || below("/usr/lib").any(|entry| holds_one(&entry.path()))
}

/// Returns whether a folder contains a file whose name satisfies `is_one`.
fn holds(folder: &Path, is_one: impl Fn(&str) -> bool) -> bool {
    let entries = folder.read_dir().into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().display().to_string()).any(|name| is_one(&name))
}
