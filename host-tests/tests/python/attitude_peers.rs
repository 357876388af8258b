//! `attitude_peers.py`, with the packages of `requirements.txt`.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::packages;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python");
const REQUIREMENTS: &str = include_str!("requirements.txt");

/// A published filter and the RMS inclination errors that it leaves, degrees.
pub struct Peer {
    pub name: String,
    pub mean_deg: f64,
    pub worst_deg: f64,
}

/// Runs the peers on recordings; an error is a single line.
pub fn run(recordings: &[PathBuf]) -> Result<Vec<Peer>, String> {
    let packages = packages::install("python-attitude", REQUIREMENTS)?;
    let output = Command::new(packages.interpreter)
        .arg(Path::new(FOLDER).join("attitude_peers.py"))
        .args(recordings)
        .env("PYTHONPATH", packages.folder)
        .output()
        .map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    // A failure after this point is not caused by missing packages.
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
