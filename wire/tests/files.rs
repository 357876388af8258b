//! The files generated from the tables in the code are up to date: `footfall.eds`,
//! `footfall.dbc` and the tables of `README.md`. `FOOTFALL_UPDATE=1` writes them again.

#[path = "files/dbc.rs"]
mod dbc;
#[path = "files/eds.rs"]
mod eds;
#[path = "files/tables.rs"]
mod tables;

use std::path::PathBuf;
use std::{env, fs};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn check(name: &str, expected: &str) {
    let path = path(name);
    if env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
        fs::write(&path, expected).expect("the file can be written");
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == expected,
        "{name} is out of date: run FOOTFALL_UPDATE=1 cargo test -p footfall-wire files::"
    );
}

#[test]
fn the_eds_matches_the_dictionary() {
    let eds = eds::generate();
    assert!(eds.is_ascii(), "CiA 306 wants ASCII");
    check("footfall.eds", &eds);
}

#[test]
fn the_dbc_matches_the_signals() {
    let dbc = dbc::generate();
    assert!(dbc.is_ascii(), "some readers take a DBC for CP1252");
    check("footfall.dbc", &dbc);
}

#[test]
fn the_tables_of_the_readme_match_the_code() {
    let readme = fs::read_to_string(path("README.md")).expect("wire/README.md is there");
    check("README.md", &tables::update(&readme));
}
