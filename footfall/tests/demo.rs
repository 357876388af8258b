//! `footfall demo` from outside: what it prints, writes and returns.

mod common;

use common::{Bench, read};

#[test]
fn the_demo_needs_nothing_and_writes_samples_a_picture_and_what_the_foot_sends() {
    let bench = Bench::new();
    let summary = bench.stdout("");
    assert!(summary.contains("labels   RMSE "), "{summary}");
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
fn what_the_demo_wrote_can_be_replayed() {
    let bench = Bench::new();
    bench.stdout("demo --out walk --seed 3");
    let summary = bench.stdout("replay walk/samples.csv");
    assert!(summary.starts_with("samples: "), "{summary}");
}

#[test]
fn the_same_seed_gives_the_same_demo_and_another_one_another() {
    let bench = Bench::new();
    for (out, seed) in [("a", 7), ("b", 7), ("c", 8)] {
        bench.stdout(&format!("demo --out {out} --seed {seed}"));
    }
    let samples = |out: &str| read(&bench.path(out).join("samples.csv"));
    assert!(samples("a") == samples("b"));
    assert!(samples("a") != samples("c"));
}

#[test]
fn a_file_where_the_demos_directory_should_be_is_called_one() {
    let bench = Bench::with("walk", "");
    assert_eq!(
        bench.error("demo --out walk"),
        "footfall: walk is a file, but results go into a directory\n"
    );
}
