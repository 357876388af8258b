//! Acceptance of a board whose person is this test: it does what it is told, or something is wrong with the foot.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Command, Stdio};

use host_tests::committed::{assert_current, workspace};
use serde_json::Value as Json;

use crate::server::{Server, program};

/// File with the figures of a healthy foot, to which those of a board are compared.
const PREDICTIONS: &str = "host/footfall/src/commands/accept/virtual-board.csv";

/// Lets the program accept a foot, and does what it says. Returns its report, its text for the person, and whether
/// it has succeeded.
fn accepted(
    server: &mut Server,
    source: &str,
    options: &[&str],
    mut person: impl FnMut(&mut Server, &str),
) -> (Json, String, bool) {
    let mut child = Command::new(program())
        .args(["accept", source, "--json", "--seconds", "60"])
        .args(options)
        .current_dir(&server.folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut said = String::new();
    for line in BufReader::new(child.stderr.take().expect("piped")).lines() {
        let line = line.expect("text");
        person(server, &line);
        said.push_str(&line);
        said.push('\n');
    }
    let mut report = String::new();
    let mut stdout = child.stdout.take().expect("piped");
    stdout.read_to_string(&mut report).expect("text");
    let status = child.wait().expect("it ends");
    let report = serde_json::from_str(&report).unwrap_or_else(|_| panic!("{report}{said}"));
    (report, said, status.success())
}

/// What a person does who follows the text: the foot stands, z up, and then is turned so that each axis has a turn.
fn follow(server: &mut Server, line: &str) {
    let says = |words| line.contains(words);
    if line == "now" {
        return server.say("tap");
    }
    let next = [
        ("z up:", "hold x"),
        ("x up:", "hold y"),
        ("y up:", "hold -x"),
        ("x down:", "hold -z"),
        ("z down:", "hold -y"),
        ("tap its sole", "hold z"),
        ("ten steps", "gait walk"),
        ("unplug the sensor", "fault miso-high"),
        ("plug it in", "fault clear"),
    ];
    if let Some((_, order)) = next.iter().find(|(words, _)| line.contains(words)) {
        server.say(order);
    } else if says("tap ") && !says("5 of 5") {
        server.say("tap");
    }
}

/// Values by step and name, as the file of predictions has them.
fn table(report: &Json) -> String {
    let figures = report["figures"].as_array().expect("figures");
    let row = |figure: &Json| {
        let [step, name] = ["step", "name"].map(|key| figure[key].as_str().expect("a text"));
        let value = figure["value"].as_f64();
        let value = value.unwrap_or_else(|| panic!("{name}: {figure}"));
        format!("{step},{name},{value:.3}\n")
    };
    let rows: String = figures.iter().map(row).collect();
    format!("step,name,value\n{rows}")
}

/// Names of the figures that are out.
fn out(report: &Json) -> Vec<&str> {
    let figures = report["figures"].as_array().expect("figures");
    let out = figures.iter().filter(|figure| figure["verdict"] == "OUT");
    out.map(|figure| figure["name"].as_str().expect("a text"))
        .collect()
}

#[test]
fn healthy_foot_is_accepted_in_all_steps_on_its_serial_line() {
    let Some(mut server) = Server::start("accepted", &["--gait", "stand"]) else {
        return;
    };
    let serial = server.serial("FL");
    let page = ["--page", "foot.html"];
    let (report, said, is_accepted) = accepted(&mut server, &serial, &page, follow);
    assert!(is_accepted, "{said}");
    assert_eq!(
        (&report["out"], &report["not_tested"]),
        (&0.into(), &0.into()),
        "{said}"
    );
    let measured = table(&report);
    let path = workspace().join(PREDICTIONS);
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let names = |table: &str| -> Vec<String> {
        let names = table.lines().filter_map(|line| line.rsplit_once(','));
        names.map(|(name, _)| name.to_owned()).collect()
    };
    // Times and noise differ from run to run; the limits judge them.
    if names(&measured) != names(&committed) {
        assert_current(&path, &measured);
    }
    let html = std::fs::read_to_string(server.path("foot.html")).expect("a page");
    assert!(
        html.contains("accepted") && html.contains("error of a turn about z"),
        "{html}"
    );
    // The raw samples are off again.
    let streams = server.foot(&serial, &["diff"]);
    assert!(!streams.contains("uart"), "{streams}");
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
}

#[test]
fn healthy_foot_is_accepted_over_can() {
    let Some(mut server) = Server::start("accepted-can", &["--gait", "stand"]) else {
        return;
    };
    let bus = server.bus();
    let only = ["--only", "still,sides,taps,unplug"];
    let (report, said, is_accepted) = accepted(&mut server, &bus, &only, follow);
    assert!(is_accepted && report["not_tested"] == 0, "{said}");
}

#[test]
fn faults_of_a_board_are_named() {
    let Some(mut server) = Server::start("not-accepted", &["--gait", "stand"]) else {
        return;
    };
    let serial = server.serial("FL");
    let only = ["--only", "board,still"];
    server.say("fault gyroscope-bias-large");
    server.wait_for("fault gyroscope-bias-large");
    std::thread::sleep(std::time::Duration::from_secs(3));
    let (report, said, is_accepted) = accepted(&mut server, &serial, &only, follow);
    assert!(!is_accepted, "{said}");
    let names = out(&report);
    // Whether the fault is among them depends on the time that the foot had to find it.
    for name in ["stable contacts", "bias of the gyroscope"] {
        assert!(names.contains(&name), "{name}: {said}");
    }
    let verdict = format!("not accepted: {}", names.join(", "));
    assert!(said.contains(&verdict), "{said}");
    server.say("power-cycle");
    server.wait_for("power-cycle");
    std::thread::sleep(std::time::Duration::from_secs(3));
    server.say("fault spi-hung");
    server.wait_for("fault spi-hung");
    std::thread::sleep(std::time::Duration::from_secs(1));
    let board = ["--only", "board"];
    let (report, said, _) = accepted(&mut server, &serial, &board, follow);
    // A sensor that does not answer has no temperature to be judged.
    assert_eq!(
        out(&report),
        ["active faults", "sensor temperature"],
        "{said}"
    );
    assert!(said.contains("sensor silent"), "{said}");
}
