//! A recording of streaming feet, read by third-party libraries.

use crate::packages;
use clap::Parser;
use footfall::commands::Arguments;

const REQUIREMENTS: &str = include_str!("python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/record.py");

const CONSUMERS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/compat.py");

const BIPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/biped.py");

fn footfall(arguments: &[&str]) {
    let arguments = Arguments::parse_from(["footfall"].iter().chain(arguments));
    arguments.run().unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn two_foreign_readers_find_every_value_sent_by_the_foot() {
    let Some(packages) = packages::install("python-record", REQUIREMENTS) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    footfall(&["demo", "--output", &path("demo")]);
    let log = path("demo/can.log");
    footfall(&["decode", &log, "--output", &path("rows.csv")]);
    let source = format!("file:{log}");
    footfall(&["record", &source, "-o", &path("rec.mcap")]);
    let rows = packages.run(SCRIPT, &[&path("rec.mcap"), &path("rows.csv")]);
    assert_eq!(rows, "14010");
}

#[test]
fn consumers_conclude_the_decisions_of_the_feet() {
    let Some(packages) = packages::install("python-record", REQUIREMENTS) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("rec.mcap").display().to_string();
    let compat = "pronto,champ,drift,muse,bool,unitree,wrench";
    let source = "demo:feet=4,seconds=4,speed=max";
    let prefix = ["--frame-prefix", "spot/", "--wrench-force", "40"];
    footfall(&[&["record", source, "-o", &recording, "--compat", compat], &prefix[..]].concat());
    packages.run(CONSUMERS, &[&recording]);
    let source = "demo:feet=2,seconds=4,speed=max";
    footfall(&["record", source, "-o", &recording, "--overwrite", "--compat", "biped,bool"]);
    packages.run(BIPED, &[&recording]);
}
