//! Links the program for the RP2040, and names the commit of its sources.

use std::path::Path;
use std::process::Command;

fn main() {
    let package = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    println!("cargo:rustc-link-search={package}");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=-Tlink-rp.x");
    println!("cargo:rerun-if-changed=memory.x");
    let head = Path::new(&package).join("../../../.git/HEAD");
    println!("cargo:rerun-if-changed={}", head.display());
    let commit = Command::new("git").args(["rev-parse", "HEAD"]).output();
    let commit = commit.ok().filter(|output| output.status.success());
    let commit = commit.and_then(|output| String::from_utf8(output.stdout).ok());
    // The first four bytes, as a number.
    let first = commit.as_deref().and_then(|commit| commit.get(..8));
    println!("cargo:rustc-env=FOOTFALL_PROGRAM={}", first.unwrap_or("0"));
}
