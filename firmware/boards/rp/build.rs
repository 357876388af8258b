//! Links the program for the memory of its board, and names the commit that is checked out.

use std::path::Path;
use std::process::Command;

/// Programs, and the folders below `src` with their memories.
const PROGRAMS: [(&str, &str); 3] = [
    ("foot-nano-rp2040", "nano_rp2040"),
    ("foot-feather-rp2350", "feather_rp2350"),
    ("self-check", "self_check"),
];

fn main() {
    let package = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    for (program, folder) in PROGRAMS {
        // The folder with the program's `memory.x`.
        let folder = Path::new(&package).join("src").join(folder);
        println!("cargo:rustc-link-arg-bin={program}=-L{}", folder.display());
        println!("cargo:rerun-if-changed={}", folder.join("memory.x").display());
    }
    println!("cargo:rustc-link-arg-bin=foot-nano-rp2040=-Tlink-rp.x");
    // A commit appends to this file, and changes no other file that this script could watch.
    let log = Command::new("git").args(["rev-parse", "--git-path", "logs/HEAD"]).output();
    let log = log.ok().filter(|output| output.status.success());
    if let Some(log) = log.and_then(|output| String::from_utf8(output.stdout).ok()) {
        println!("cargo:rerun-if-changed={}", log.trim());
    }
    let commit = Command::new("git").args(["rev-parse", "HEAD"]).output();
    let commit = commit.ok().filter(|output| output.status.success());
    let commit = commit.and_then(|output| String::from_utf8(output.stdout).ok());
    // The first four bytes, as a number.
    let first = commit.as_deref().and_then(|commit| commit.get(..8));
    println!("cargo:rustc-env=FOOTFALL_PROGRAM={}", first.unwrap_or("0"));
}
