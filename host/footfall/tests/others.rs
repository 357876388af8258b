//! Tests of `footfall replay` on files that other programs write: comma decimals, counts, bags of ROS 1.

use std::env;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::{Bench, read, text, unmet};
use crate::packages;

const REQUIREMENTS: &str = include_str!("../../../host-tests/tests/python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/others.py");
const WHOLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/whole.py");
const WALK: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../host-tests/recordings/walk.csv"
);

/// Column `p_stable` of a table of estimates.
fn probabilities(bench: &Bench, options: &str) -> Vec<f32> {
    bench.stdout(&format!("replay {options} --output p.csv"));
    column(&read(&bench.path("p.csv")))
}

fn column(table: &str) -> Vec<f32> {
    let mut lines = table.lines();
    let header = lines.next().expect("a header");
    let at = header.split(',').position(|name| name == "p_stable");
    let at = at.expect("a column");
    let cell = |row: &str| row.split(',').nth(at).and_then(|cell| cell.parse().ok());
    lines.map(|row| cell(row).expect("a number")).collect()
}

fn assert_near(found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().zip(expected);
    let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(largest < 1.0e-3, "{largest}");
}

#[test]
fn tables_of_loggers_and_bags_of_ros_1_give_the_same() {
    let packages = match packages::install("python-roads", REQUIREMENTS) {
        Ok(packages) => packages,
        Err(missing) => return unmet(&missing),
    };
    let bench = Bench::new();
    let output = Command::new(&packages.interpreter)
        .args([Path::new(SCRIPT), Path::new(WALK), bench.directory.path()])
        .env("PYTHONPATH", &packages.folder)
        .output()
        .expect("Python runs");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let expected = probabilities(&bench, "point.csv");
    assert!(expected.iter().any(|p| *p > 0.9) && expected.iter().any(|p| *p < 0.1));

    assert_eq!(probabilities(&bench, "comma.csv --decimal ,"), expected);
    let said = bench.error("replay comma.csv");
    assert!(said.contains("--decimal ,"), "{said}");

    let of_counts = probabilities(&bench, "of_counts.csv");
    let scaled = "counts.csv --scale 0.000122,0.07 --units g,dps";
    assert_near(&probabilities(&bench, scaled), &of_counts);
    assert_near(
        &probabilities(&bench, "milli.csv --units mg,mdps"),
        &expected,
    );

    let said = bench.error("replay ros1.mcap");
    assert!(said.contains("these are messages of ROS 1"), "{said}");

    // With the program that converts, and without.
    let run = |path: &Path, arguments: &[&str]| -> Output {
        Command::new(env!("CARGO_BIN_EXE_footfall"))
            .args(arguments)
            .current_dir(&bench.directory)
            .env("PATH", path)
            .env("PYTHONPATH", &packages.folder)
            .output()
            .expect("the program that was just built")
    };
    let replay = [
        "replay",
        "walk.bag",
        "--load-topic",
        "/ft",
        "--output",
        "p.csv",
    ];
    let output = run(&packages.folder.join("bin"), &replay);
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("walk.bag is a ROS 1 bag, read as"),
        "{stderr}"
    );
    let table = read(&bench.path("p.csv"));
    assert_eq!(column(&table), expected);
    assert!(table.contains(",stance,"));
    let output = run(bench.directory.path(), &replay);
    let stderr = text(&output.stderr);
    assert!(!output.status.success(), "{stderr}");
    assert!(stderr.contains("pip install rosbags"), "{stderr}");
}

#[test]
fn cut_bag_that_others_refuse_is_made_whole() {
    let packages = match packages::install("python-roads", REQUIREMENTS) {
        Ok(packages) => packages,
        Err(missing) => return unmet(&missing),
    };
    let bench = Bench::new();
    bench.stdout(&format!("convert {WALK} walk.mcap"));
    let bytes = fs::read(bench.path("walk.mcap")).expect("a bag");
    fs::write(bench.path("cut.mcap"), &bytes[..bytes.len() / 2]).expect("a file");
    for arguments in [
        "convert cut.mcap samples.mcap",
        "replay cut.mcap --output all.mcap",
    ] {
        let said = bench.run(arguments);
        assert!(said.status.success(), "{arguments}: {}", text(&said.stderr));
        assert!(text(&said.stderr).contains("footfall convert writes a whole one"));
    }
    let output = Command::new(&packages.interpreter)
        .arg(WHOLE)
        .args(["cut.mcap", "samples.mcap", "all.mcap"])
        .current_dir(&bench.directory)
        .env("PYTHONPATH", &packages.folder)
        .output()
        .expect("Python runs");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let counts: Vec<Vec<usize>> = serde_json::from_slice(&output.stdout).expect("counts");
    let [cut, samples, all] = counts.as_slice() else {
        panic!("{counts:?}");
    };
    assert_eq!(*cut, [0, 0], "both readers refuse it");
    assert!(samples[0] > 500 && samples[0] == samples[1], "{counts:?}");
    // The contacts come in addition.
    assert!(all[0] > samples[0] && all[0] == all[1], "{counts:?}");
}
