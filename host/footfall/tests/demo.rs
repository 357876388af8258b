//! Tests of `footfall demo` as a program: output, files and exit codes.

use crate::common::{Bench, read};

#[test]
fn demo_without_input_writes_all_results() {
    let bench = Bench::new();
    let summary = bench.stdout("");
    let page = include_str!("../../../README.md");
    let (_, shown) = page.split_once("```text\n").expect("a block of output");
    for line in shown.lines().take_while(|line| *line != "```") {
        assert!(summary.contains(line), "the README shows: {line}\nprinted: {summary}");
    }
    assert!(shown.starts_with("demo walk"), "{shown}");
    assert_eq!(bench.files(), ["footfall-demo"]);
    let directory = bench.path("footfall-demo");
    assert!(read(&directory.join("plot.svg")).starts_with("<svg"));
    assert!(
        read(&directory.join("samples.csv"))
            .starts_with("t,ax,ay,az,wx,wy,wz,force,label,validity,p_stable,")
    );
    let log = read(&directory.join("can.log"));
    let first = log.lines().next().expect("a frame");
    assert!(first.starts_with("(1609459200.000"), "{first}");
    assert!(first.ends_with(" can0 711#00"), "{first}");
    for file in ["samples.csv", "plot.svg", "can.log", "uart.bin"] {
        assert!(directory.join(file).is_file(), "{file}");
        assert!(summary.contains(file), "{summary}");
    }
}

#[test]
fn seed_determines_the_demo() {
    let bench = Bench::new();
    for (out, seed) in [("a", 7), ("b", 7), ("c", 8)] {
        bench.stdout(&format!("demo --output {out} --seed {seed}"));
    }
    let samples = |out: &str| read(&bench.path(out).join("samples.csv"));
    assert!(samples("a") == samples("b"));
    assert!(samples("a") != samples("c"));
}

#[test]
fn file_in_place_of_the_demo_directory_is_reported() {
    let bench = Bench::with("walk", "");
    assert_eq!(
        bench.error("demo --output walk"),
        "footfall: walk is a file, but results go into a directory\n"
    );
}
