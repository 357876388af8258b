//! A virtual environment under `target` with the packages of `requirements.txt`, for the
//! Python tests of this crate, footfall, virtual-board and host-tests.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

const REQUIREMENTS: &str = include_str!("requirements.txt");

/// Creates the environment if it is missing or outdated, and returns its interpreter; an
/// error is reported in one line.
#[allow(clippy::incompatible_msrv, reason = "tests are built with the workspace's own compiler")]
pub fn make() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python");
    let interpreter = folder.join("bin/python");
    let installed = folder.join("installed.txt");
    // The tests of several crates share it, and may start at the same time.
    let lock = File::create(folder.with_extension("lock")).map_err(|error| error.to_string())?;
    lock.lock().map_err(|error| error.to_string())?;
    if fs::read_to_string(&installed).is_ok_and(|installed| installed == REQUIREMENTS) {
        return Ok(interpreter);
    }
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    run(Command::new(&interpreter)
        .args(["-m", "pip", "install", "--quiet"])
        .arg("--disable-pip-version-check")
        .args(REQUIREMENTS.lines()))?;
    fs::write(&installed, REQUIREMENTS).map_err(|error| error.to_string())?;
    Ok(interpreter)
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        Ok(())
    } else {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let last = stderr.lines().last().unwrap_or_default();
        Err(format!("{command:?} failed: {last}"))
    }
}
