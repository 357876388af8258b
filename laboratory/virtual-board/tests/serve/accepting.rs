//! Acceptance of a board. The test acts as the person, who follows the text while the foot is sound or has a fault. The
//! person also has a line of the boards open, and reads it in steps of their time, so a reaction takes no other time.

use std::fs::{self, File};
use std::process::{Command, Stdio};

use results::{Measurement, rounded};
use serde_json::Value as Json;
use virtual_board::emulator::wiring::Wiring;

use super::server::{Server, Words, program};
use crate::digest::assert_reproduced_on;

/// Time after which a person has read a new text, ms.
const READING_MS: u64 = 100;

/// Lets the program accept a foot on one of its lines, and follows its instructions. Returns its report, its text for
/// the person, and whether it has succeeded.
fn accepted(
    server: &mut Server,
    [line, other]: [&str; 2],
    options: &[&str],
    mut person: impl FnMut(&mut Server, &str),
) -> (Json, String, bool) {
    let kind = line.rsplit_once('.').map_or("uart", |(_, kind)| kind);
    let source = format!("{kind}:{}", server.path(line).display());
    let report = server.path("report.json");
    let mut holder = server.hold(other);
    let before = server.error_output().len();
    let mut child = Command::new(program())
        .args(["accept", &source, "--json", "--seconds", "60"])
        .args(options)
        .current_dir(server.folder())
        .stdin(Stdio::null())
        .stdout(File::create(&report).expect("a file"))
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut words = Words::new(child.stderr.take().expect("piped"));
    server.wait_for_new(before, &format!("{line}: opened"));
    let mut read = 0;
    while !words.has_ended() {
        let end_ms = holder.now_ms() + READING_MS;
        while holder.now_ms() < end_ms {
            holder.run(end_ms - holder.now_ms());
        }
        let said = words.all();
        let new = said[read..].rfind('\n').map_or("", |end| &said[read..=read + end]);
        read += new.len();
        new.lines().for_each(|line| person(server, line));
    }
    drop(holder);
    let said = words.all();
    let status = child.wait().expect("it ends");
    let report = fs::read_to_string(report).expect("text");
    let report = serde_json::from_str(&report).unwrap_or_else(|_| panic!("{report}{said}"));
    (report, said, status.success())
}

/// Line of the program, and line of the person.
const SERIAL: [&str; 2] = ["FL.uart", "bus.slcan"];
const BUS: [&str; 2] = ["bus.slcan", "FL.uart"];

/// Acts as a person who follows the text: the foot stands, z up, and is then turned so that each axis has a turn.
fn follow(server: &mut Server, line: &str) {
    let says = |words| line.contains(words);
    if line == "now" {
        server.order("FL: tap");
        return;
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
        server.order(&format!("FL: {order}"));
    } else if says("tap ") && !says("5 of 5") {
        server.order("FL: tap");
    }
}

/// The figures with which `footfall accept` compares the figures of a board. Times and noise depend on the program of
/// the board, so that their values are not compared: the limits judge them.
fn result(report: &Json) -> Measurement {
    let what = "Figures of a healthy foot in `footfall accept`, on the virtual board at 25 °C.";
    let mut result = Measurement::new("acceptance", what)
        .measured_by(
            "cargo test -p virtual-board healthy_foot_is_accepted_in_all_steps_on_its_serial_line -- --ignored",
        )
        .tolerance("value", f64::INFINITY);
    for figure in report["figures"].as_array().expect("figures") {
        let value = figure["value"].as_f64().unwrap_or_else(|| panic!("no value: {figure}"));
        result.row([
            ("step", figure["step"].clone()),
            ("quantity", figure["name"].clone()),
            ("value", rounded(value, 3).into()),
            ("unit", figure["unit"].clone()),
        ]);
    }
    result
}

/// Names of the figures that are out.
fn out(report: &Json) -> Vec<&str> {
    let figures = report["figures"].as_array().expect("figures");
    let out = figures.iter().filter(|figure| figure["verdict"] == "OUT");
    out.map(|figure| figure["name"].as_str().expect("a text")).collect()
}

#[test]
#[ignore = "full: all steps, two minutes of virtual time"]
fn healthy_foot_is_accepted_in_all_steps_on_its_serial_line() {
    let mut server = Server::start(&["--gait", "stand"]);
    let serial = server.serial("FL");
    let (report, said, is_accepted) = accepted(&mut server, SERIAL, &[], follow);
    assert!(is_accepted, "{said}");
    assert_eq!((&report["out"], &report["not_tested"]), (&0.into(), &0.into()), "{said}");
    assert_reproduced_on(&[Wiring::reference().program], result(&report));
    // The raw samples are off again.
    let streams = server.foot(&serial, &["diff"]);
    assert!(!streams.contains("uart"), "{streams}");
    server.end();
}

#[test]
fn healthy_foot_is_accepted_over_can() {
    let mut server = Server::start(&["--gait", "stand"]);
    let only = ["--only", "still,sides,taps,unplug"];
    let (report, said, is_accepted) = accepted(&mut server, BUS, &only, follow);
    assert!(is_accepted && report["not_tested"] == 0, "{said}");
}

#[test]
#[ignore = "full: two boards with a fault, a minute of virtual time"]
fn faults_of_a_board_are_named() {
    let mut server = Server::start(&["--gait", "stand"]);
    let only = ["--only", "board,still"];
    server.order("FL: fault gyroscope-bias-large");
    server.run(3000);
    let (report, said, is_accepted) = accepted(&mut server, SERIAL, &only, follow);
    assert!(!is_accepted, "{said}");
    let names = out(&report);
    // These figures may contain the fault, or not, because the foot may not have had the time to find it.
    for name in ["stable contacts", "bias of the gyroscope"] {
        assert!(names.contains(&name), "{name}: {said}");
    }
    let verdict = format!("not accepted: {}", names.join(", "));
    assert!(said.contains(&verdict), "{said}");
    server.order("FL: power-cycle");
    server.run(3000);
    server.order("FL: fault spi-hung");
    server.run(1000);
    let board = ["--only", "board"];
    let (report, said, _) = accepted(&mut server, SERIAL, &board, follow);
    // A sensor that does not answer has no temperature to be judged.
    assert_eq!(out(&report), ["active faults", "sensor temperature"], "{said}");
    assert!(said.contains("sensor silent"), "{said}");
}

#[test]
#[ignore = "full: a board with three defects, a minute of virtual time"]
fn defects_that_look_like_rest_or_taps_are_named() {
    let mut server = Server::start(&["--gait", "stand"]);
    // Samples are read by the timer.
    server.order("FL: fault data-ready-lost");
    server.run(3000);
    let (report, said, _) = accepted(&mut server, SERIAL, &["--only", "still"], follow);
    assert_eq!(out(&report), ["data rate of the sensor", "active faults"], "{said}");
    server.order("FL: power-cycle");
    server.run(3000);
    let taps = |server: &mut Server, tap: &str| {
        let (report, said, _) = accepted(server, SERIAL, &["--only", "taps"], |server, line| {
            if line == "now" || line.contains("tap ") && !line.contains("5 of 5") {
                server.order(&format!("FL: {tap}"));
            }
        });
        (out(&report).join(", "), said)
    };
    let (out, said) = taps(&mut server, "fault sensor-reset");
    assert!(out.contains("sensor restarts"), "{out}: {said}");
    let (_, said) = taps(&mut server, "power-cycle");
    assert!(said.contains("OUT: the foot has restarted"), "{said}");
}
