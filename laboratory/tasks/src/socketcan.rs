//! Runs `footfall` on `SocketCAN`, in an emulated machine with Debian's kernel: kernels of containers often have no virtual CAN
//! interfaces. can-utils play a log of the demo onto one. `footfall record` must receive each contact, `footfall monitor`
//! show P and then a silent foot, and a request must reach the bus and its response the program. Takes about a minute.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use xtask::command::{Step, find, is_installed, remove_folder, root};
use xtask::install::install_packages;

/// First program of the emulated machine.
const INIT: &str = include_str!("socketcan.init");

/// Frames of the demo's log that are played.
const FRAMES: usize = 8_000;

/// Modules of the kernel, in the order in which they are loaded.
const MODULES: [&str; 4] =
    ["net/can/can", "net/can/can-raw", "drivers/net/can/dev/can-dev", "drivers/net/can/vcan"];

/// Programs, each with its package.
const TOOLS: [(&str, &str); 4] = [
    ("qemu-system-x86_64", "qemu-system-x86"),
    ("busybox", "busybox-static"),
    ("cpio", "cpio"),
    ("canplayer", "can-utils"),
];

/// Runs the programs in the emulated machine, and checks what they print.
///
/// # Errors
/// A tool cannot be installed, or an output is not as expected.
pub fn run() -> Result<()> {
    let missing = TOOLS.iter().filter(|(program, _)| !is_installed(program));
    install_packages(&missing.map(|(_, package)| *package).collect::<Vec<_>>())?;
    // The program has the features of the tests' build, so that it is there already.
    Step::cargo(&["build", "--locked", "--package", "footfall-program", "--features", "all"])
        .with(["--target-dir", "target/full"])
        .run()?;
    let work = root().join("target/socketcan");
    fs::create_dir_all(&work)?;
    let Some(kernel) = kernel(&work)? else {
        let message = "linux-image-amd64 is not known here: this needs Debian's packages";
        if env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value == "0") {
            println!("SocketCAN was not run: {message}");
            return Ok(());
        }
        bail!("{message}");
    };
    let contacts = build_root(&work, &kernel)?;
    let log = boot(&work, &kernel)?;
    let expect = |part: &str, parts: &[&str]| expect(&log, part, parts, &work);
    expect("missing", &["can:can0: No such device"])?;
    expect("record", &[&format!("{contacts} /footfall/FL/contact")])?;
    expect("record", &["wrote walk.mcap"])?;
    let shown = |digit: u8| format!(r#""foot":"FL","line":"can0","node":17,"p_stable":{digit}."#);
    expect("monitor", &[&shown(0)]).or_else(|_| expect("monitor", &[&shown(1)]))?;
    let silent = [
        r#""p_stable":null"#,
        r#""rate_hz":1000.0"#,
        r#""missing":0,"dropped":0"#,
        r#""silent":true"#,
    ];
    expect("monitor", &silent)?;
    expect("request", &["foot = 1 "])?;
    expect("request", &["611 ", "40 00 20 00"])?;
    if !log.lines().any(|line| line == "== end") {
        bail!("socketcan: the machine has not come to its end");
    }
    println!("SocketCAN: {contacts} contacts recorded, none missing; a request was answered");
    Ok(())
}

/// Folder of Debian's newest kernel, unpacked; `None` if its package is unknown.
fn kernel(work: &Path) -> Result<Option<PathBuf>> {
    // This package depends on the package of the newest kernel, and so has its name.
    let depends = Step::program("apt-cache").with(["depends", "linux-image-amd64"]).output();
    let depends = depends.unwrap_or_default();
    let Some(name) = depends.lines().find_map(|line| line.trim().strip_prefix("Depends: ")) else {
        return Ok(None);
    };
    let folder = work.join(name);
    if folder.is_dir() {
        return Ok(Some(folder));
    }
    let download = work.join("download");
    remove_folder(&download)?;
    fs::create_dir(&download)?;
    Step::program("apt-get").at(&download).with(["download", "-qq", name]).run()?;
    let package = fs::read_dir(&download)?.next().context("the kernel was not downloaded")??;
    let unpacked = work.join(format!("{name}.part"));
    let paths = [package.path(), unpacked.clone()].map(|path| path.display().to_string());
    Step::program("dpkg").with(["-x"]).with(paths).run()?;
    fs::rename(unpacked, &folder)?;
    fs::remove_dir_all(&download)?;
    Ok(Some(folder))
}

/// Packs the files of the emulated machine, and returns the number of contacts in the log that is played.
fn build_root(work: &Path, kernel: &Path) -> Result<usize> {
    let root_folder = work.join("root");
    remove_folder(&root_folder)?;
    for folder in ["bin", "lib", "proc", "sys", "dev", "tmp", "data"] {
        fs::create_dir_all(root_folder.join(folder))?;
    }
    let modules =
        fs::read_dir(kernel.join("lib/modules"))?.next().context("a kernel has modules")??;
    for module in MODULES {
        let file = modules.path().join("kernel").join(format!("{module}.ko"));
        let name = file.file_name().context("a module has a name")?;
        fs::copy(&file, root_folder.join("lib").join(name))
            .with_context(|| file.display().to_string())?;
    }
    let footfall = root().join("target/full/debug/footfall");
    let demo = work.join("demo").display().to_string();
    Step::program(&footfall.display().to_string())
        .with(["demo", "--overwrite", "--output", &demo])
        .output()?;
    let log = fs::read_to_string(work.join("demo/can.log"))?;
    let lines: Vec<&str> = log.lines().take(FRAMES).collect();
    fs::write(root_folder.join("data/can.log"), lines.join("\n") + "\n")?;
    for program in ["busybox", "canplayer", "candump", "cansend"] {
        let path = find(program).with_context(|| format!("{program} is not installed"))?;
        add_program(&path, &root_folder)?;
    }
    add_program(&footfall, &root_folder)?;
    Step::program("strip").with([root_folder.join("bin/footfall").display().to_string()]).run()?;
    let init = root_folder.join("init");
    fs::write(&init, INIT)?;
    Step::program("chmod").with(["+x", &init.display().to_string()]).run()?;
    let pack = "find . | cpio -o -H newc 2>/dev/null | gzip -1 >../initrd.gz";
    Step::program("sh").at(&root_folder).with(["-c", pack]).run()?;
    Ok(lines.iter().filter(|line| line.contains(" 191#")).count())
}

/// Copies a program and the libraries that it is linked to.
fn add_program(program: &Path, root_folder: &Path) -> Result<()> {
    let name = program.file_name().context("a program has a name")?;
    fs::copy(program, root_folder.join("bin").join(name))?;
    // For a static program `ldd` fails, because it has no libraries.
    let libraries = Step::program("ldd").with([program.display().to_string()]).output();
    for word in libraries.unwrap_or_default().split_whitespace() {
        let Some(path) = word.strip_prefix('/') else { continue };
        let copy = root_folder.join(path);
        if let Some(folder) = copy.parent() {
            fs::create_dir_all(folder)?;
        }
        if !copy.exists() {
            fs::copy(word, &copy).with_context(|| word.to_owned())?;
        }
    }
    Ok(())
}

/// Boots the machine, which switches itself off, and returns its output. The machine's clock counts its instructions, 1 ns
/// each, and skips the time in which it waits. On a busy host all of it is slower, so that no program in it is late.
fn boot(work: &Path, kernel: &Path) -> Result<String> {
    let folder = fs::read_dir(kernel.join("boot"))?;
    let image = folder.flatten().map(|entry| entry.path());
    let is_kernel = |path: &PathBuf| path.display().to_string().contains("/vmlinuz-");
    let image = image.into_iter().find(is_kernel).context("the package has no kernel")?;
    let log = work.join("output.log");
    Step::program("timeout")
        .at(work)
        .with(["600", "qemu-system-x86_64", "-accel", "tcg,thread=single", "-cpu", "max"])
        .with(["-icount", "shift=0,sleep=off", "-rtc", "clock=vm"])
        .with(["-smp", "1", "-m", "1500", "-nic", "none", "-initrd", "initrd.gz"])
        .with(["-kernel", &image.display().to_string()])
        .with(["-append", "console=ttyS0 quiet panic=-1", "-nographic", "-no-reboot"])
        .run_into(&log)?;
    let text = fs::read(&log)?;
    Ok(String::from_utf8_lossy(&text).replace('\r', ""))
}

/// Checks that a line under a heading of the log contains all of these parts.
fn expect(log: &str, heading: &str, parts: &[&str], work: &Path) -> Result<()> {
    let section = log.split_once(&format!("== {heading}\n")).map_or("", |(_, rest)| rest);
    let section = section.split("\n== ").next().unwrap_or_default();
    let mut lines = section.lines();
    if lines.any(|line| parts.iter().all(|part| line.contains(part))) {
        return Ok(());
    }
    let file = work.join("output.log");
    bail!("nothing like {parts:?} under {heading} of {}:\n{section}", file.display());
}
