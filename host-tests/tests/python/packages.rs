//! Python packages for one test, besides the environment of the wire's tests, which has others.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{environment, unmet};

/// An interpreter, and the folder with the packages, which goes into `PYTHONPATH`.
pub struct Packages {
    interpreter: PathBuf,
    folder: PathBuf,
}

impl Packages {
    /// Command that runs a script with the packages.
    pub fn command(&self, script: &str) -> Command {
        let mut command = Command::new(&self.interpreter);
        command.arg(script).env("PYTHONPATH", &self.folder);
        command
    }

    /// Runs a script, and returns its trimmed output.
    #[allow(dead_code, reason = "the tests of ROS 2 alone change the command")]
    pub fn run(&self, script: &str, arguments: &[&dyn AsRef<OsStr>]) -> String {
        let output = self.command(script).args(arguments).output().expect("Python runs");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{script}: {error}");
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }
}

/// Installs `requirements`, one per line, in a folder of this name; `None`, reported as unmet, if they cannot be.
pub fn install(folder: &str, requirements: &str) -> Option<Packages> {
    try_install(folder, requirements).map_err(|missing| unmet(&missing)).ok()
}

fn try_install(folder: &str, requirements: &str) -> Result<Packages, String> {
    let interpreter = environment::make()?;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let installed = folder.join("installed.txt");
    // Tests that share a folder start at the same time. Without the lock, one could remove the packages while
    // another loads them.
    let lock = File::create(folder.join("lock")).map_err(|error| error.to_string())?;
    lock.lock().map_err(|error| error.to_string())?;
    let packages = Packages { interpreter, folder };
    if fs::read_to_string(&installed).is_ok_and(|installed| installed == requirements) {
        return Ok(packages);
    }
    let output = Command::new(&packages.interpreter)
        .args(["-m", "pip", "install", "--quiet", "--upgrade"])
        .args(["--disable-pip-version-check", "--target"])
        .arg(&packages.folder)
        .args(requirements.lines())
        .output()
        .map_err(|error| error.to_string())?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let last = stderr.lines().last().unwrap_or_default();
        return Err(format!("pip cannot install {requirements:?}: {last}"));
    }
    fs::write(&installed, requirements).map_err(|error| error.to_string())?;
    Ok(packages)
}
