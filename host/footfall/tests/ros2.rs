//! Tests of `footfall ros2` against `CycloneDDS` and third-party parsers.

use std::process::{self, Command};

#[path = "../../../wire/tests/python/environment.rs"]
mod environment;
#[path = "../../../host-tests/tests/python/packages.rs"]
mod packages;

mod common;

use common::{Bench, text, unmet};

const REQUIREMENTS: &str = include_str!("python/ros2.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/ros2.py");

/// `CycloneDDS` on the loopback interface only, without multicast: test machines may lack other interfaces or the
/// permission to use them.
const LOOPBACK: &str = "<CycloneDDS><Domain><General>\
    <Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"false\"/></Interfaces>\
    <AllowMulticast>false</AllowMulticast></General>\
    <Discovery><ParticipantIndex>auto</ParticipantIndex>\
    <Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";

#[test]
fn cyclonedds_receives_every_message_of_four_feet() {
    let packages = match packages::install("python-ros2", REQUIREMENTS) {
        Ok(packages) => packages,
        Err(missing) => return unmet(&missing),
    };
    // The walk is longer than topic discovery by the subscriber.
    let feet = "demo:feet=4,seconds=13";
    for (turn, (compat, reliability)) in [("champ", "reliable"), ("pronto", "best-effort")]
        .into_iter()
        .enumerate()
    {
        let bench = Bench::new();
        bench.run(&format!("record {feet} -o walk.mcap"));
        // Separate domains allow several of these tests to run on one machine.
        let domain = 1 + turn as u32 + process::id() % 100 * 2;
        let output = Command::new(&packages.interpreter)
            .args([SCRIPT, compat, reliability, env!("CARGO_BIN_EXE_footfall")])
            .arg(bench.path("walk.mcap"))
            .args([feet, "--network", "127.0.0.1"])
            .args(["--compat", compat, "--reliability", reliability])
            .args(["--domain-id", &domain.to_string()])
            .env("PYTHONPATH", &packages.folder)
            .env("CYCLONEDDS_URI", LOOPBACK)
            .output()
            .expect("Python runs");
        let [stdout, stderr] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
        assert!(output.status.success(), "{compat}:\n{stdout}\n{stderr}");
        // No message was rejected or is missing.
        assert_eq!(stderr, "", "{compat}");
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
        let output = Command::new(env!("CARGO_BIN_EXE_footfall"))
            .args(["ros2", "demo:seconds=0.1,speed=max", "--namespace", "dog"])
            .current_dir(bench.directory.path())
            .env(variable, value)
            .output()
            .expect("the program that was just built");
        let [stdout, stderr] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
        assert!(output.status.success(), "{variable}: {stderr}");
        assert!(
            stdout.contains(" /dog/footfall/FL/contact\n"),
            "{variable}: {stdout}"
        );
        assert!(stdout.contains(" /diagnostics\n"), "{variable}: {stdout}");
    }
}

#[test]
fn invalid_domain_is_blamed_on_the_variable() {
    let bench = Bench::new();
    let output = Command::new(env!("CARGO_BIN_EXE_footfall"))
        .args(["ros2", "demo:seconds=0.1"])
        .current_dir(bench.directory.path())
        .env("ROS_DOMAIN_ID", "500")
        .output()
        .expect("the program that was just built");
    let stderr = text(&output.stderr);
    assert!(!output.status.success());
    assert_eq!(
        stderr,
        "footfall: the variable ROS_DOMAIN_ID is wrong: 500 is not in 0..=232\n"
    );
}
