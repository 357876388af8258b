//! Tests of `footfall view` as a program: a third-party client, and the layouts.

use std::collections::BTreeMap;
use std::ffi::OsStr;

use crate::common::{Bench, assert_has, text};
use crate::packages;
use footfall::ros::FootTopics;
use footfall::ros::message::Definition;
use serde_json::Value;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/view.py");
const REQUIREMENTS: &str = include_str!("python/view.txt");
const PROGRAM: &str = env!("CARGO_BIN_EXE_footfall");

/// Names of the feet of a robot.
const FEET: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// Returns the output of the client; `None` if Python is unavailable for it.
fn client(arguments: &[&str]) -> Option<String> {
    let packages = packages::install("python-view", REQUIREMENTS)?;
    let arguments = arguments.iter().map(|argument| argument as &dyn AsRef<OsStr>);
    Some(packages.run(SCRIPT, &arguments.collect::<Vec<_>>()))
}

#[test]
fn viewers_stay_connected_after_the_end_of_a_file() {
    let output = Bench::new().run("view demo:seconds=0.2,speed=max --port 0 --seconds 0.5");
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert_has(&said, "; viewers stay connected until Ctrl-C\n");
}

#[test]
fn third_party_client_receives_every_recorded_message() {
    let bench = Bench::new();
    let demo = "demo:feet=4,seed=7,seconds=6";
    bench.stdout(&format!("record {demo},speed=max -o walk.mcap"));
    let recording = bench.path("walk.mcap").display().to_string();
    let Some(counts) = client(&["compare", PROGRAM, demo, &recording]) else {
        return;
    };
    let counts: BTreeMap<String, usize> = serde_json::from_str(&counts).expect("counts");
    let topics = FEET.map(FootTopics::of);
    for topics in &topics {
        for (topic, _) in topics.all() {
            assert!(counts.contains_key(topic), "{topic}: {counts:?}");
        }
        // The client connects as soon as the server is up, so it receives at least two of the six seconds.
        let contacts = counts[topics.contact.as_ref()];
        assert!((2000..=6000).contains(&contacts), "{counts:?}");
    }
}

#[test]
fn stalled_client_delays_no_other() {
    // Without an end, at full speed.
    client(&["slow", PROGRAM, "demo:feet=4,speed=max"]);
}

#[test]
fn two_hundred_slow_clients_take_bounded_memory() {
    if let Some(counts) = client(&["crowd", PROGRAM, "demo:feet=4,speed=max"]) {
        assert!(counts.starts_with("16 clients, 185 refused, "), "{counts}");
    }
}

/// A running `footfall view` of a simulated foot, with its port and its output.
struct Viewed {
    process: std::process::Child,
    said: std::io::Lines<std::io::BufReader<std::process::ChildStderr>>,
    port: u16,
}

impl Viewed {
    fn start(arguments: &str) -> Self {
        use std::io::BufRead;
        let bench = Bench::new();
        let mut command = bench.command(&format!("view demo --port 0 {arguments}"));
        let mut process = command.stderr(std::process::Stdio::piped()).spawn().expect("it starts");
        let stderr = process.stderr.take().expect("a pipe");
        let mut said = std::io::BufReader::new(stderr).lines();
        let first = said.next().expect("a line").expect("text");
        let port = first.rsplit(':').next().and_then(|port| port.parse().ok());
        Self { process, said, port: port.unwrap_or_else(|| panic!("{first}")) }
    }

    fn connect(&self) -> std::net::TcpStream {
        std::net::TcpStream::connect(("127.0.0.1", self.port)).expect("a connection")
    }

    /// Returns the status line of a handshake of a page of this origin.
    fn handshake(&self, origin: &str) -> String {
        use std::io::{BufRead, Write};
        let mut stream = self.connect();
        let request = format!(
            "GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n{origin}\r\n",
            self.port
        );
        stream.write_all(request.as_bytes()).expect("it is sent");
        let mut status = String::new();
        std::io::BufReader::new(stream).read_line(&mut status).expect("an answer");
        status
    }
}

impl Drop for Viewed {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn pages_of_other_origins_are_refused() {
    let mut viewed = Viewed::start("--allow-origin https://lab.example");
    for (origin, status) in [
        ("", "101"),
        ("Origin: https://app.foxglove.dev\r\n", "101"),
        ("Origin: https://lab.example\r\n", "101"),
        ("Origin: https://evil.example\r\n", "403"),
    ] {
        let answer = viewed.handshake(origin);
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{origin}: {answer}");
    }
    let warning = viewed.said.find_map(|line| line.ok().filter(|line| line.contains("evil")));
    assert!(warning.is_some_and(|line| line.contains("--allow-origin https://evil.example")));
}

#[test]
fn clients_are_limited_and_silent_ones_are_dropped() {
    use std::io::Read;
    let viewed = Viewed::start("");
    // None of them begins a handshake.
    let mut silent: Vec<_> = (0..40).map(|_| viewed.connect()).collect();
    let answers = silent.iter_mut().map(|stream| {
        let mut answer = String::new();
        // A connection that is refused may be reset, which is an answer, too.
        let _ = stream.read_to_string(&mut answer);
        answer
    });
    let refused = answers.filter(|answer| answer.starts_with("HTTP/1.1 503 ")).count();
    // All reads above have ended. So the server has dropped the refused connections, and there is room again.
    assert!((20..=24).contains(&refused), "{refused}");
    assert!(viewed.handshake("").starts_with("HTTP/1.1 101 "));
}

#[test]
fn used_port_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let bench = Bench::new();
    let said = bench.error(&format!("view demo --port {port}"));
    assert!(said.starts_with(&format!("footfall: port {port} of 127.0.0.1 is in use; ")), "{said}");
    assert!(said.contains("--port 0"), "{said}");
    assert_eq!(bench.run("view").status.code(), Some(2), "no source");
    let missing = bench.error("view file:absent.mcap --port 0");
    // Nothing about feet or serving is printed.
    assert!(missing.starts_with("footfall: absent.mcap "), "{missing}");
    let nowhere = bench.error("view demo --host nowhere.invalid");
    assert!(nowhere.starts_with("footfall: --host nowhere.invalid: "), "{nowhere}");
}

#[test]
fn host_may_be_a_name_or_all_addresses() {
    let bench = Bench::new();
    for (host, says) in [
        ("localhost", " at ws://127.0.0.1:"),
        ("0.0.0.0", ", and at all other addresses of this machine\n"),
    ] {
        let output = bench.run(&format!("view demo --host {host} --port 0 --seconds 0.1"));
        let said = text(&output.stderr);
        assert!(said.contains(says), "{said}");
        assert!(!said.contains("0.0.0.0:"), "a link that leads nowhere: {said}");
    }
}

#[test]
fn view_ends_after_the_given_time() {
    let bench = Bench::new();
    let output = bench.run("view demo:feet=2 --port 0 --seconds 1");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(output.stdout.is_empty());
}

/// Returns the type of a message field by its path, with nested fields separated by points.
fn type_of(definition: Definition, path: &str) -> Option<String> {
    let text = definition.text();
    let mut sections = text.split("MSG: ");
    let mut fields = sections.next()?.to_owned();
    let others: BTreeMap<&str, &str> = sections.filter_map(|part| part.split_once('\n')).collect();
    let mut found = None;
    for part in path.split('.') {
        let mut lines = fields.lines().map(|line| line.split_whitespace());
        let kind = lines.find_map(|mut words| {
            let kind = words.next()?;
            (words.next() == Some(part)).then(|| kind.to_owned())
        })?;
        fields = others.get(kind.as_str()).copied().unwrap_or("").to_owned();
        found = Some(kind);
    }
    found
}

/// Checks that a numeric field named by a layout is published.
fn assert_published(topic: &str, field: &str) {
    let published = FEET.map(FootTopics::of);
    let definition = published
        .iter()
        .flat_map(FootTopics::all)
        .find(|(name, _)| *name == topic)
        .map(|(_, definition)| definition);
    let definition = definition.unwrap_or_else(|| panic!("nothing is published on {topic}"));
    let kind = type_of(definition, field);
    assert!(
        matches!(kind.as_deref(), Some("float32" | "float64" | "uint8" | "bool")),
        "{topic} has no number {field}: {kind:?}"
    );
}

#[test]
fn foxglove_layout_uses_published_fields() {
    let printed = Bench::new().stdout("view --layout foxglove");
    let layout: Value = serde_json::from_str(&printed).expect("JSON");
    let panels = layout["configById"].as_object().expect("panels");
    let mut shown = BTreeMap::new();
    for (name, panel) in panels {
        for path in panel["paths"].as_array().into_iter().flatten() {
            let path = path["value"].as_str().expect("a path");
            let (topic, field) = path.split_once('.').expect("a field");
            assert_published(topic, field);
            *shown.entry(topic.to_owned()).or_insert(0) += 1;
        }
        let diagnostics = panel.get("topicToRender").and_then(Value::as_str);
        if name.starts_with("DiagnosticSummary!") {
            assert_eq!(diagnostics, Some(footfall::ros::topics::DIAGNOSTICS));
        }
    }
    for topics in FEET.map(FootTopics::of) {
        // P is shown three times and once with all feet, the decision once, the state once and once with all feet,
        // the load twice.
        for (topic, times) in [(topics.contact, 7), (topics.load, 2), (topics.imu, 6)] {
            assert_eq!(shown.get(topic.as_ref()), Some(&times), "{topic}");
        }
    }
}

#[test]
fn plotjuggler_layout_uses_published_fields() {
    let layout = Bench::new().stdout("view --layout plotjuggler");
    let mut curves = 0;
    for line in layout.lines() {
        let Some(name) = line.trim().strip_prefix("<curve name=\"") else {
            continue;
        };
        let name = name.split('"').next().expect("a name");
        // The longest match is used, because one topic name may be the prefix of another.
        let mut topics: Vec<String> = FEET
            .map(FootTopics::of)
            .iter()
            .flat_map(|topics| topics.all().map(|(topic, _)| format!("{topic}/")))
            .filter(|topic| name.starts_with(topic.as_str()))
            .collect();
        topics.sort_by_key(String::len);
        let topic = topics.pop().unwrap_or_else(|| panic!("no topic: {name}"));
        let field = name[topic.len()..].replace('/', ".");
        assert_published(topic.trim_end_matches('/'), &field);
        curves += 1;
    }
    assert_eq!(curves, 4 * (3 + 2 + 1 + 6) + 4 * 3);
}
