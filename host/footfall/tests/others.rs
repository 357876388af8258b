//! Tests of `footfall replay` on files that other programs write: comma decimals, counts, bags of ROS 1.

use std::fs;

use crate::common::{Bench, assert_has, read, text};
use crate::packages;
use crate::record::{column, count};

const REQUIREMENTS: &str = include_str!("../../../host-tests/tests/python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/others.py");
const WHOLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/whole.py");
const ROBOT_BAG: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../host-tests/tests/python/robot_bag.py");
const WALK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../host-tests/recordings/walk.csv");

/// Column `p_stable` of a table of estimates.
fn probabilities(bench: &Bench, options: &str) -> Vec<f32> {
    bench.stdout(&format!("replay {options} --output p.csv --overwrite"));
    let cells = column(&read(&bench.path("p.csv")), "p_stable");
    cells.iter().map(|cell| cell.parse().expect("a number")).collect()
}

fn assert_near(found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().zip(expected);
    let largest = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(largest < 1.0e-3, "{largest}");
}

#[test]
fn tables_of_loggers_and_bags_of_ros_1_give_the_same() {
    let Some(packages) = packages::install("python-roads", REQUIREMENTS) else { return };
    let bench = Bench::new();
    packages.run(SCRIPT, &[&WALK, &bench.directory.path()]);
    let expected = probabilities(&bench, "point.csv");
    assert!(expected.iter().any(|p| *p > 0.9) && expected.iter().any(|p| *p < 0.1));

    assert_eq!(probabilities(&bench, "comma.csv --decimal ,"), expected);
    bench.refuses("replay comma.csv", "--decimal ,");

    let of_counts = probabilities(&bench, "of_counts.csv");
    let scaled = "counts.csv --scale 0.000122,0.07 --units g,dps";
    assert_near(&probabilities(&bench, scaled), &of_counts);
    assert_near(&probabilities(&bench, "milli.csv --units mg,mdps"), &expected);

    for bag in ["walk.bag", "bz2.bag", "lz4.bag", "ros1.mcap"] {
        assert_eq!(probabilities(&bench, &format!("{bag} --load-topic /ft")), expected, "{bag}");
    }
    // The copy is a bag of ROS 2 that others read.
    bench.stdout("replay bz2.bag --load-topic /ft --output copy.mcap");
    let counts = packages.run(WHOLE, &[&bench.path("copy.mcap")]);
    let counts: Vec<Vec<usize>> = serde_json::from_str(&counts).expect("counts");
    assert!(counts[0][0] > 2 * expected.len() && counts[0][0] == counts[0][1], "{counts:?}");
}

#[test]
fn feet_of_a_bag_with_other_imus_stream_with_their_loads() {
    const FEET: &str = "--topic all --not-topic /trunk* --load-topic /ft/{foot}";
    let Some(packages) = packages::install("python-roads", REQUIREMENTS) else { return };
    let bench = Bench::new();
    packages.run(ROBOT_BAG, &[&WALK, &bench.path("bag")]);
    let rows = |arguments: &str| {
        bench.stdout(&format!("replay bag {arguments} --output out.csv --overwrite"));
        read(&bench.path("out.csv"))
    };
    let of_foot = |table: &str, foot: &str| -> Vec<String> {
        let rows = table.lines().filter_map(|row| row.strip_prefix(foot));
        rows.map(str::to_owned).collect()
    };
    let table = rows(&format!("{FEET} --axes fr=-x,-y,z"));
    let left = of_foot(&table, "fl,");
    assert_eq!(left.len(), 3000);
    assert_eq!(left, of_foot(&table, "fr,"));
    assert!(left.iter().any(|row| row.contains(",stance,")));
    // One foot, whose name is a part of its topic.
    let one = rows("--topic /fl/imu --load-topic /ft/{foot}");
    assert!(one.lines().skip(1).eq(left.iter().map(String::as_str)));
    // The bag as a source of a live command.
    let report = bench.stdout(&format!("record file:bag {FEET} --axes fr=-x,-y,z -o rec.mcap"));
    for foot in ["fl", "fr"] {
        assert_eq!(count(&report, &format!("/footfall/{foot}/contact")), 3000);
    }
    assert!(!report.contains("trunk"), "{report}");
    let report = bench.stdout("record file:bag --topic /fl/imu --compat bool -o alone.mcap");
    assert_eq!(count(&report, "/footfall/fl/contact"), 3000);
    assert!(count(&report, "/footfall/FL/contact/decision") > 100, "{report}");
    assert!(!report.contains("/bag"), "{report}");
    for (arguments, expected) in [
        ("monitor demo:seconds=1 --topic all", "apply only to file:"),
        ("replay bag --topic all --not-topic * --load-topic /ft/{foot}", "/trunk/imu"),
    ] {
        bench.refuses(arguments, expected);
    }
}

#[test]
fn cut_bag_that_others_refuse_is_made_whole() {
    let Some(packages) = packages::install("python-roads", REQUIREMENTS) else { return };
    let bench = Bench::new();
    bench.stdout(&format!("convert {WALK} walk.mcap"));
    let bytes = fs::read(bench.path("walk.mcap")).expect("a bag");
    fs::write(bench.path("cut.mcap"), &bytes[..bytes.len() / 2]).expect("a file");
    for arguments in ["convert cut.mcap samples.mcap", "replay cut.mcap --output all.mcap"] {
        let said = bench.run(arguments);
        assert!(said.status.success(), "{arguments}: {}", text(&said.stderr));
        assert_has(&text(&said.stderr), "footfall convert writes a whole one");
    }
    let [cut, samples, all] = ["cut.mcap", "samples.mcap", "all.mcap"].map(|file| bench.path(file));
    let counts = packages.run(WHOLE, &[&cut, &samples, &all]);
    let counts: Vec<Vec<usize>> = serde_json::from_str(&counts).expect("counts");
    let [cut, samples, all] = counts.as_slice() else {
        panic!("{counts:?}");
    };
    assert_eq!(*cut, [0, 0], "both readers refuse it");
    assert!(samples[0] > 500 && samples[0] == samples[1], "{counts:?}");
    // The contacts come in addition.
    assert!(all[0] > samples[0] && all[0] == all[1], "{counts:?}");
}
