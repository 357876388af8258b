//! Packages of Python in a folder of their own, beside the environment of the wire's tests, which has
//! others.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder, to be in `PYTHONPATH`. What stands in the way of filling it is said in one line.
pub fn install(interpreter: &Path, name: &str, requirements: &str) -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let installed = folder.join("installed.txt");
    if fs::read_to_string(&installed).is_ok_and(|installed| installed == requirements) {
        return Ok(folder);
    }
    let output = Command::new(interpreter)
        .args(["-m", "pip", "install", "--quiet", "--upgrade"])
        .args(["--disable-pip-version-check", "--target"])
        .arg(&folder)
        .args(requirements.lines())
        .output()
        .map_err(|error| error.to_string())?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let last = stderr.lines().last().unwrap_or_default();
        return Err(format!("pip cannot install the packages of {name}: {last}"));
    }
    fs::write(&installed, requirements).map_err(|error| error.to_string())?;
    Ok(folder)
}
