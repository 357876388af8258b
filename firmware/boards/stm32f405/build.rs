//! Links the product with the section in which defmt interns its strings, and names the commit of its sources.

use std::process::Command;

/// Sources of a program: this package, and the packages that it is built from.
const SOURCES: [&str; 11] = [
    ".",
    "../../Cargo.toml",
    "../../src",
    "../../../bootloader",
    "../../../estimator-core",
    "../../../lsm6dsox",
    "../../../storage",
    "../../../wire",
    "../../../Cargo.lock",
    "../../../Cargo.toml",
    "../../../memory.x",
];

fn main() {
    println!("cargo:rustc-env=FOOTFALL_COMMIT={}", commit());
    for source in SOURCES {
        println!("cargo:rerun-if-changed={source}");
    }
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        for program in ["foot", "foot-feather", "bring-up", "bring-up-feather"] {
            println!("cargo:rustc-link-arg-bin={program}=-Tdefmt.x");
            // Behind the bootloader: see memory.x.
            println!("cargo:rustc-link-arg-bin={program}=--defsym=_program=1");
            println!("cargo:rustc-link-arg-bin={program}=-Tfirmware/boards/stm32f405/header.x");
        }
        // Names the board for the virtual board, which assumes the reference board for a program without a name.
        for program in ["foot-feather", "bring-up-feather"] {
            println!("cargo:rustc-link-arg-bin={program}=--defsym=_board_feather=1");
        }
    }
}

/// Last commit that changed the sources, hexadecimal. A commit that changes only documents gives the same program.
/// Empty if no commit has these sources, as after a change or outside a repository.
fn commit() -> String {
    let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) else {
        return String::new();
    };
    println!("cargo:rerun-if-changed={log}");
    let changes = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat());
    match changes.as_deref() {
        Some("") => {
            git(&[&["log", "-1", "--format=%H", "--"], &SOURCES[..]].concat()).unwrap_or_default()
        }
        _ => String::new(),
    }
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
