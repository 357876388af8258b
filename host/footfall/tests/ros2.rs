//! Tests of `footfall ros2` against `CycloneDDS`, `ros2-client` and third-party parsers.

use std::fs::{self, File};
use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;
use std::{env, process, thread};

use footfall::ros::node::{FootNode, FootNodeOptions, Reliability};
use futures::executor::block_on;
use ros2_client::parameters::raw;
use ros2_client::qos::History;
use ros2_client::rcl_interfaces::{
    ListParametersRequest, ListParametersResponse, SetParametersRequest, SetParametersResponse,
};
use ros2_client::{
    Context, ContextOptions, Message, Name, Node, NodeName, NodeOptions, Parameter, ParameterValue,
    QosProfile, ServiceMapping, ServiceTypeName,
};

use crate::common::{Bench, assert_has, text};
use crate::packages::{self, Packages};

pub const REQUIREMENTS: &str = include_str!("python/ros2.txt");
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
    run(packages, SCRIPT, arguments);
}

/// Runs a script beside `CycloneDDS`, which fails the test if it fails or prints an error.
pub fn run(packages: &Packages, script: &str, arguments: &[&str]) {
    let mut command = packages.command(script);
    let output = command.args(arguments).env("CYCLONEDDS_URI", LOOPBACK).output();
    let output = output.expect("Python runs");
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
fn second_node_of_one_name_or_foot_is_reported_once() {
    check("namesake", "demo");
}

#[test]
fn messages_for_a_stopped_subscriber_are_counted() {
    check("slow", "demo:speed=10");
}

#[test]
fn cyclonedds_receives_every_message_of_four_feet() {
    let Some(packages) = packages::install("python-ros2", REQUIREMENTS) else { return };
    // The walk is longer than topic discovery by the subscriber, and slow for machines that stall.
    let feet = "demo:feet=4,seconds=7";
    let slow_feet = "demo:feet=4,seconds=7,speed=0.5";
    for (compat, reliability) in [("champ", "reliable"), ("pronto", "best-effort")] {
        let bench = Bench::new();
        bench.run(&format!("record {feet},speed=max -o walk.mcap"));
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
    assert_eq!(stderr, "footfall: environment variable ROS_DOMAIN_ID: 500 is not in 0..=232\n");
}

/// Requests after which a service that does not answer ends the test as hung.
const REQUESTS: u32 = 600;

fn options(domain_id: u16) -> FootNodeOptions {
    FootNodeOptions {
        domain_id,
        networks: vec![IpAddr::V4(Ipv4Addr::LOCALHOST)],
        namespace: "/robot".to_owned(),
        name: "feet".to_owned(),
        reliability: Reliability::Reliable,
        depth: 10,
        source: "demo:feet=4".to_owned(),
        frame_id: "{foot}_foot".to_owned(),
        compat: Vec::new(),
    }
}

/// Calls a service of the node until it answers, because a request is lost if it is sent before both
/// participants have found each other's readers. Answers to requests of an earlier client are skipped.
fn ask<Req, Resp>(node: &mut Node, service: &str, kind: &str, request: &Req) -> Resp
where
    Req: Message + Clone + 'static,
    Resp: Message + Clone + 'static,
{
    let qos = QosProfile::publisher_default().history(History::KeepLast { depth: 1 });
    let name = Name::new("/robot/feet", service).expect("a name");
    let kind = ServiceTypeName::new("rcl_interfaces", kind);
    let client = node
        .create_client::<Req, Resp>(ServiceMapping::Enhanced, &name, &kind, qos.clone(), qos)
        .expect("a client");
    let mut sent = Vec::new();
    for _ in 0..REQUESTS {
        sent.push(client.send_request(request.clone()).expect("it is sent"));
        for _ in 0..20 {
            thread::sleep(Duration::from_millis(50));
            if let Some((id, response)) = client.receive_response().expect("a response")
                && sent.contains(&id)
            {
                return response;
            }
        }
    }
    panic!("{service} has not answered {REQUESTS} requests, one a second");
}

#[test]
fn parameters_are_listed_and_read_only() {
    let domain = Domain::take();
    let feet = FootNode::new(options(domain.id)).expect("a node");
    let context = Context::with_options(ContextOptions::new().domain_id(domain.id));
    let name = NodeName::new("/", "asks").expect("a name");
    let node = context.expect("a context").new_node(name, NodeOptions::new());
    let mut node = node.expect("a node");
    let spinner = node.spinner().expect("a spinner");
    thread::spawn(|| block_on(spinner.spin()));
    let request = ListParametersRequest { prefixes: Vec::new(), depth: 0 };
    let listed: ListParametersResponse =
        ask(&mut node, "list_parameters", "ListParameters", &request);
    let set = |value: &str| SetParametersRequest {
        parameter: vec![raw::Parameter::from(Parameter {
            name: "frame_id".to_owned(),
            value: ParameterValue::String(value.to_owned()),
        })],
    };
    let mut results = Vec::new();
    for value in ["{foot}_foot", "other"] {
        let answer: SetParametersResponse =
            ask(&mut node, "set_parameters", "SetParameters", &set(value));
        results.extend(answer.results);
    }
    let expected = ["compat", "frame_id", "qos.depth", "qos.reliability", "source", "use_sim_time"];
    assert_eq!(listed.result.names, expected);
    let successful: Vec<_> = results.iter().map(|result| result.successful).collect();
    assert_eq!(successful, [true, false], "{results:?}");
    assert!(results[1].reason.contains("read-only"), "{results:?}");
    feet.finish();
}

/// Domains whose ports are below those that the system gives to others: 7400 + 250 per domain.
const DOMAINS: u32 = 100;

/// A domain that no other test of this machine uses until this is dropped.
pub struct Domain {
    pub id: u16,
    _lock: File,
}

impl Domain {
    /// Takes a domain that is free.
    pub fn take() -> Self {
        let folder = env::temp_dir().join("footfall-dds-domains");
        fs::create_dir_all(&folder).expect("a folder");
        let ids = (0..DOMAINS).map(|turn| 1 + (process::id() + turn) % DOMAINS);
        let mut free = ids.filter_map(|id| {
            // A file of another user counts as taken.
            let lock = File::create(folder.join(id.to_string())).ok()?;
            lock.try_lock().ok()?;
            Some(Self { id: id as u16, _lock: lock })
        });
        free.next().expect("a free domain")
    }
}
