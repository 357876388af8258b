//! Tests of `footfall ros2` against `CycloneDDS` and third-party parsers.

use std::process::Command;

use crate::common::{Bench, assert_has, text};
use crate::domain::Domain;
use crate::packages;
use crate::packages::Packages;

const REQUIREMENTS: &str = include_str!("python/ros2.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/ros2.py");

/// `CycloneDDS` on the loopback interface only, without multicast: test machines may lack other interfaces or the
/// permission to use them.
const LOOPBACK: &str = "<CycloneDDS><Domain><General>\
    <Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"false\"/></Interfaces>\
    <AllowMulticast>false</AllowMulticast></General>\
    <Discovery><ParticipantIndex>auto</ParticipantIndex>\
    <Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";

/// Runs the script, which fails the test if it fails. No message may be rejected or missing, so it prints no error.
fn run_script(packages: &Packages, arguments: &[&str]) {
    let output = Command::new(&packages.interpreter)
        .arg(SCRIPT)
        .args(arguments)
        .env("PYTHONPATH", &packages.folder)
        .env("CYCLONEDDS_URI", LOOPBACK)
        .output()
        .expect("Python runs");
    let [stdout, stderr] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
    assert!(output.status.success(), "{arguments:?}:\n{stdout}\n{stderr}");
    assert_eq!(stderr, "", "{arguments:?}");
}

/// Runs a check of the script on feet.
fn check(check: &str, feet: &str) {
    let Some(packages) = packages::install("python-ros2", REQUIREMENTS) else { return };
    let footfall = env!("CARGO_BIN_EXE_footfall");
    let domain = Domain::take();
    let id = domain.id.to_string();
    let arguments = [check, footfall, feet, "--network", "127.0.0.1", "--domain-id", &id];
    run_script(&packages, &arguments);
}

#[test]
fn demo_with_clock_now_has_stamps_of_now() {
    check("now", "demo:clock=now");
}

#[test]
fn second_node_of_one_name_is_reported_once() {
    check("namesake", "demo");
}

#[test]
fn cyclonedds_receives_every_message_of_four_feet() {
    let Some(packages) = packages::install("python-ros2", REQUIREMENTS) else { return };
    // The walk is longer than topic discovery by the subscriber, and slow for machines that stall.
    let feet = "demo:feet=4,seconds=7";
    let slow_feet = "demo:feet=4,seconds=7,speed=0.5";
    for (compat, reliability) in [("champ", "reliable"), ("pronto", "best-effort")] {
        let bench = Bench::new();
        bench.run(&format!("record {feet} -o walk.mcap"));
        let walk = bench.path("walk.mcap");
        let domain = Domain::take();
        let id = domain.id.to_string();
        let arguments = [
            &["all", compat, reliability, env!("CARGO_BIN_EXE_footfall")],
            &[walk.to_str().expect("UTF-8"), slow_feet, "--network", "127.0.0.1"],
            &["--compat", compat, "--reliability", reliability],
            &["--domain-id", &id][..],
        ];
        run_script(&packages, &arguments.concat());
    }
}

#[test]
fn invalid_ros_options_are_rejected_by_name() {
    let bench = Bench::new();
    for (arguments, culprit) in [
        ("--namespace /robot//1", "\"/robot//1\""),
        ("--node-name foot-fall", "\"foot-fall\""),
        ("--node-name foot__fall", "\"foot__fall\""),
        // Reserved for documentation, so no interface has it.
        ("--network 192.0.2.1", "network 192.0.2.1"),
        ("--network 0.0.0.0", "network 0.0.0.0"),
        ("--network ::1", "network ::1"),
        ("--domain-id 233", "233"),
        ("--depth 0", "--depth"),
        ("--compat serow", "serow"),
    ] {
        let output = bench.run(&format!("ros2 demo:seconds=1 {arguments}"));
        assert!(!output.status.success(), "{arguments}");
        let stderr = text(&output.stderr);
        assert!(stderr.contains(culprit), "{arguments}: {stderr}");
    }
}

#[test]
fn ros_environment_variables_are_applied() {
    let bench = Bench::new();
    for (variable, value) in [
        ("ROS_DOMAIN_ID", ""),
        ("ROS_LOCALHOST_ONLY", "1"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
    ] {
        let mut command = bench.command("ros2 demo:seconds=0.1,speed=max --namespace dog");
        let output =
            command.env(variable, value).output().expect("the program that was just built");
        let [stdout, stderr] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
        assert!(output.status.success(), "{variable}: {stderr}");
        assert_has(&stdout, " /dog/footfall/FL/contact\n");
        assert!(stdout.contains(" /diagnostics\n"), "{variable}: {stdout}");
    }
}

#[test]
fn invalid_domain_is_blamed_on_the_variable() {
    let bench = Bench::new();
    let mut command = bench.command("ros2 demo:seconds=0.1");
    let output = command.env("ROS_DOMAIN_ID", "500").output();
    let output = output.expect("the program that was just built");
    let stderr = text(&output.stderr);
    assert!(!output.status.success());
    assert_eq!(stderr, "footfall: the variable ROS_DOMAIN_ID is wrong: 500 is not in 0..=232\n");
}
