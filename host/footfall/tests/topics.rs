//! Tests of topics of ROS 2 as sources: `CycloneDDS` publishes IMUs as drivers do, and receives the contacts.

use std::fs;

use crate::common::{Bench, assert_has, read};
use crate::packages;
use crate::ros2::{Domain, REQUIREMENTS, run};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/live.py");

const FOUR: &str =
    "ros2:FL=/lf_foot/imu ros2:FR=/rf_foot/imu ros2:RL=/lh_foot/imu ros2:RR=/rh_foot/imu";

/// Duration of the samples that are published, s, and their rate, Hz.
const SECONDS: usize = 9;
const RATE: usize = 200;

/// Returns a bench with `walk.csv`: samples of a simulated walk.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.stdout("demo --output demo");
    let samples = read(&bench.path("demo/samples.csv"));
    // Messages have no validity, and no label.
    let columns = |line: &str| line.split(',').take(8).collect::<Vec<_>>().join(",");
    let mut lines = samples.lines().map(columns);
    let header = lines.next().expect("a header");
    assert_eq!(header, "t,ax,ay,az,wx,wy,wz,force");
    let rows = lines.step_by(1000 / RATE).take(SECONDS * RATE);
    let table: Vec<String> = std::iter::once(header).chain(rows).collect();
    fs::write(bench.path("walk.csv"), table.join("\n") + "\n").expect("a file");
    bench
}

/// Runs a check of the script: its name and arguments, and those of `footfall ros2`.
fn check(arguments: &[&str], of_ros2: &str) {
    let Some(packages) = packages::install("python-ros2", REQUIREMENTS) else { return };
    let domain = Domain::take();
    let id = domain.id.to_string();
    let [check, rest @ ..] = arguments else { panic!("a check") };
    let of_ros2: Vec<&str> = of_ros2.split(' ').collect();
    let network = ["--network", "127.0.0.1", "--domain-id", &id];
    let arguments = [&[*check, env!("CARGO_BIN_EXE_footfall")][..], rest, &of_ros2, &network];
    run(&packages, SCRIPT, &arguments.concat());
}

/// Runs a check of the script that needs only the samples of a walk.
fn check_walk(check_name: &str, of_ros2: &str) {
    let bench = bench();
    check(&[check_name, &path(&bench, "walk.csv")], of_ros2);
}

/// Replays the walk of the bench, and returns the paths of its samples and its estimates.
fn replayed(bench: &Bench) -> [String; 2] {
    bench.stdout("replay walk.csv --output estimates.csv");
    ["walk.csv", "estimates.csv"].map(|name| path(bench, name))
}

fn path(bench: &Bench, name: &str) -> String {
    bench.path(name).display().to_string()
}

#[test]
fn topics_have_the_estimates_of_a_replay() {
    let bench = bench();
    let [samples, estimates] = replayed(&bench);
    for reliability in ["reliable", "best_effort"] {
        let arguments = ["estimates", reliability, &samples, &estimates];
        check(&arguments, &format!("{FOUR} --compat muse"));
    }
}

#[cfg(feature = "foxglove")]
#[test]
fn page_of_foxglove_shows_the_estimates_of_a_replay() {
    let bench = bench();
    let [samples, estimates] = replayed(&bench);
    check(&["view", "reliable", &samples, &estimates], FOUR);
}

#[test]
fn pattern_and_loads_of_topics_are_found() {
    check_walk("pattern", "ros2:/*/imu");
}

#[test]
fn topics_are_calibrated_recorded_and_monitored() {
    let bench = bench();
    check(&["others", &path(&bench, "walk.csv"), &path(&bench, "")], FOUR);
    if bench.path("walk.mcap").exists() {
        let replayed = bench.json("replay walk.mcap --topic all");
        assert_eq!(replayed["recordings"].as_array().map(Vec::len), Some(4));
        bench.json("replay walk.mcap --topic all --estimate-again --config robot.toml");
    }
}

#[test]
fn publisher_may_be_killed_and_started_again() {
    check_walk("restart", FOUR);
}

#[test]
fn mismatch_and_missing_topic_are_named() {
    check_walk("mismatch", FOUR);
}

#[test]
fn wrong_unit_is_a_warning_in_diagnostics() {
    check_walk("units", FOUR);
}

#[test]
fn states_of_a_go2_have_our_forces_and_its_joint_angles() {
    check_walk("merge", &format!("{FOUR} --compat unitree"));
}

#[test]
fn feet_of_a_pattern_may_start_later() {
    check_walk("late", "ros2:/*/imu");
}

#[test]
fn imu_of_the_trunk_alone_is_named() {
    check_walk("trunk", "--depth 10");
}

#[test]
fn states_that_are_not_of_a_unitree_are_not_merged() {
    check_walk("unreadable", &format!("{FOUR} --compat unitree"));
}

#[test]
fn invalid_topics_and_loads_are_refused_by_name() {
    let bench = Bench::new();
    for (arguments, culprit) in [
        ("monitor ros2:", "\"ros2:\""),
        ("monitor ros2:FL=/a/*", "ros2:FL=/a/*"),
        ("monitor demo:seconds=1,speed=max --load FL=/wrench", "--load"),
        ("monitor ros2:FL=/imu --load /wrench", "/wrench"),
        ("monitor ros2:FL=/imu --axes FR=x,y,z --seconds 1", "FR"),
    ] {
        let error = bench.error(arguments);
        assert_has(&error, culprit);
    }
}
