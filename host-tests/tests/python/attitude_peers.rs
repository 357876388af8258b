//! `attitude_peers.py`, with the packages of `requirements.txt`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::environment;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python");
const REQUIREMENTS: &str = include_str!("requirements.txt");

/// A published filter and the RMS inclination errors that it leaves, degrees.
pub struct Peer {
    pub name: String,
    pub mean_deg: f64,
    pub worst_deg: f64,
}

/// The peers on recordings; what stands in the way of running them is said in one line.
pub fn run(recordings: &[PathBuf]) -> Result<Vec<Peer>, String> {
    let interpreter = environment::make()?;
    let packages = install(&interpreter)?;
    let output = Command::new(interpreter)
        .arg(Path::new(FOLDER).join("attitude_peers.py"))
        .args(recordings)
        .env("PYTHONPATH", packages)
        .output()
        .map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    // From here on a failure is no lack of packages.
    assert!(output.status.success(), "{said}{stderr}");
    Ok(said.lines().map(peer).collect())
}

fn peer(line: &str) -> Peer {
    let cells: Vec<&str> = line.split('\t').collect();
    let [name, mean, worst] = cells[..] else {
        panic!("{line}");
    };
    let degrees = |cell: &str| cell.parse().expect("a number");
    Peer {
        name: name.to_owned(),
        mean_deg: degrees(mean),
        worst_deg: degrees(worst),
    }
}

/// A folder with the packages beside the environment of the wire's tests, which has others.
fn install(interpreter: &Path) -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python-attitude");
    let installed = folder.join("installed.txt");
    if fs::read_to_string(&installed).is_ok_and(|installed| installed == REQUIREMENTS) {
        return Ok(folder);
    }
    let output = Command::new(interpreter)
        .args(["-m", "pip", "install", "--quiet", "--upgrade"])
        .args(["--disable-pip-version-check", "--target"])
        .arg(&folder)
        .args(REQUIREMENTS.lines())
        .output()
        .map_err(|error| error.to_string())?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let last = stderr.lines().last().unwrap_or_default();
        return Err(format!("pip cannot install the filters: {last}"));
    }
    fs::write(&installed, REQUIREMENTS).map_err(|error| error.to_string())?;
    Ok(folder)
}
