//! The `footfall` program, each command that reads from feet, on the ELF's own output.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value as Json;

use host_tests::committed::assert_report;
use virtual_board::emulator::wiring::Wiring;

use super::server::{LONGEST, Server, footfall, program};
use crate::common::{build_board, is_built_here};

#[test]
fn a_foot_is_read_and_set_over_serial_line_and_bus() {
    let server = Server::start(&["--gait", "stand"]);
    let (serial, bus) = (server.serial("FL"), server.bus());
    server.foot(&serial, &["id", "R"]);
    server.foot(&serial, &["reset"]);
    let scan = server.foot(&bus, &["scan"]);
    let path = server.path("bus.slcan");
    assert_eq!(scan, format!("{}  node 22  R\n", path.display()));
    for (source, node, file) in
        [(&serial, &[][..], "serial.txt"), (&bus, &["--node", "22"], "bus.txt")]
    {
        let foot = |arguments: &[&str]| server.foot(source, &[node, arguments].concat());
        let info: Json = serde_json::from_str(&foot(&["info", "--json"])).expect("JSON");
        assert_eq!(info["foot"], "R");
        assert_eq!(info["node"].as_u64(), (!node.is_empty()).then_some(22));
        let is_default =
            || foot(&["get", "decision.threshold"]).starts_with("decision.threshold = 0.5   # ");
        assert!(is_default());
        let set = foot(&["set", "decision.threshold=0.75"]);
        assert!(set.starts_with("decision.threshold: 0.5 → 0.75\nnot stored"), "{set}");
        // A setting that is not stored is lost after a reset.
        foot(&["reset"]);
        assert!(is_default());
        let set = foot(&["set", "decision.threshold=0.75", "--save"]);
        assert_eq!(set, "decision.threshold: 0.5 → 0.75\nstored\n");
        foot(&["reset"]);
        let diff = foot(&["diff"]);
        assert!(diff.contains("decision.threshold: 0.5 → 0.75\n"), "{diff}");
        foot(&["export", file]);
        assert_eq!(foot(&["diff", file]), "");
        foot(&["set", "decision.threshold=0.5"]);
        let imported = foot(&["import", file]);
        assert_eq!(imported, "decision.threshold: 0.5 → 0.75\nstored\n");
        let all: Json = serde_json::from_str(&foot(&["get", "--json"])).expect("JSON");
        assert!(all.as_object().expect("an object").len() > 60);
        // A board that has lost its settings is FL.
        foot(&["restore"]);
        let info = server.foot(&serial, &["info"]);
        assert!(info.starts_with("foot     FL, serial line\n"), "{info}");
        assert!(info.contains("faults   none\n"), "{info}");
        server.foot(&serial, &["id", "R"]);
        server.foot(&serial, &["reset"]);
    }
    let said = server.end();
    assert!(said.contains("FL: reset by its program"), "{said}");
}

#[test]
fn report_of_a_feather_is_the_one_on_its_page() {
    if !is_built_here() {
        return;
    }
    let feather = Wiring::all().get(1).expect("the Feather");
    let server = Server::start_program(&build_board(feather), &["--gait", "stand", "--no-control"]);
    // The whole stack has been searched by then.
    server.run(7_000);
    let report = server.foot(&server.serial("FL"), &["report"]);
    for line in [
        "device   footfall, Feather STM32F405 + LSM6DSOX, serial number 0x",
        "faults   none",
        "crash    none",
        "history  none",
        "reset    power-up, or a dip of the supply",
        "clock    160000 kHz, from the crystal, measured as ",
        "options  0xFFFC",
        "sensor   WHO_AM_I 0x6C, 66",
        "bus      1250 kHz 0 errors, 2500 kHz (in use) 0 errors, 5000 kHz 0 errors",
        "supply   brown-out level 3",
        "settings none",
    ] {
        let has = report.lines().any(|other| other.starts_with(line));
        assert!(has, "no line {line:?} in\n{report}");
    }
    let number = |line: &str, after: &str| -> f64 {
        let line = report.lines().find(|other| other.starts_with(line)).expect("the line");
        let (_, rest) = line.split_once(after).expect("the name");
        rest.split([' ', ',']).next().and_then(|number| number.parse().ok()).expect("a number")
    };
    // The simulated part at rest: 4.1 codes of specific force, 1.0 of angular rate, and 1 g on z.
    assert!((3.5..4.7).contains(&number("noise", " ax ")), "{report}");
    assert!((0.8..1.2).contains(&number("noise", " wx ")), "{report}");
    assert!((2_000.0..2_100.0).contains(&number("mean", " az ")), "{report}");
    assert!((1.0..300.0).contains(&number("costs", "mailbox ")), "{report}");
    server.end();
    assert_report("docs/guide/first-board.md", &report);
}

/// Objects that the monitor prints within some seconds.
fn monitored(folder: &Path, source: &str, seconds: &str) -> Vec<Json> {
    let (printed, _) = footfall(folder, &["monitor", source, "--json", "--seconds", seconds]);
    let objects = printed.lines().map(|line| serde_json::from_str(line).expect("JSON"));
    objects.collect()
}

/// Latest line of a foot.
fn newest<'a>(objects: &'a [Json], foot: &str) -> &'a Json {
    let mut lines = objects.iter().rev();
    let found = lines.find(|object| object["foot"] == foot && object["p_stable"].is_number());
    found.unwrap_or_else(|| panic!("no {foot}: {objects:#?}"))
}

#[test]
fn the_monitor_shows_a_walk_its_load_and_a_fault() {
    let mut server = Server::start(&[]);
    for source in [server.serial("FL"), server.bus()] {
        let objects = monitored(server.folder(), &source, "3");
        let foot = newest(&objects, "FL");
        assert_eq!((&foot["missing"], &foot["dropped"]), (&0.into(), &0.into()), "{foot}");
        assert_eq!(foot["faults"], Json::Array(Vec::new()), "{foot}");
        assert!(foot["rate_hz"].as_f64().is_some_and(|rate| (990.0..=1010.0).contains(&rate)));
    }
    // The controller sends the load to the foot over the bus.
    let of_bus = monitored(server.folder(), &server.bus(), "2");
    assert!(newest(&of_bus, "FL")["load_n"].is_number(), "{of_bus:#?}");

    server.plan(1000, "FL: fault miso-low");
    server.plan(2500, "FL: fault clear");
    let plain = ["monitor", &server.bus(), "--seconds", "5"];
    let (lines, _) = footfall(server.folder(), &plain);
    let at = |words: &str| lines.find(words).unwrap_or_else(|| panic!("no {words:?} in {lines}"));
    let came = at("sensor");
    assert!(lines[came..].contains("cleared"), "{lines}");
    let last = lines.lines().rfind(|line| line.contains("  P ")).expect("a line");
    assert!(!last.contains("sensor"), "{last}");

    server.type_line("fault thawed");
    server.wait_for("error: thawed is not one of");
    server.type_line("FL: gait trot");
    server.wait_for("FL: gait trot");
    server.end();
}

/// Waits in real time until a condition holds.
fn wait_until(what: &str, is_met: impl Fn() -> bool) {
    let end = Instant::now() + LONGEST;
    while !is_met() {
        assert!(Instant::now() < end, "no {what} within {LONGEST:?}");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
#[ignore = "real time"]
fn serial_line_is_a_port_that_cat_reads() {
    let server = Server::start_in_real_time(&[]);
    let mut cat = Command::new("sh")
        .args(["-c", "exec cat FL.uart > uart.bin"])
        .current_dir(server.folder())
        .spawn()
        .expect("it runs");
    let size = || fs::metadata(server.path("uart.bin")).map_or(0, |file| file.len());
    wait_until("60,000 bytes", || size() >= 60_000);
    cat.kill().expect("killed");
    cat.wait().expect("it ends");
    let decode = ["decode", "uart.bin", "--output", "rows.csv"];
    footfall(server.folder(), &decode);
    let rows = fs::read_to_string(server.path("rows.csv")).expect("rows");
    assert!(rows.lines().count() > 500, "{} rows", rows.lines().count());
}

#[test]
#[ignore = "real time"]
fn a_suspended_program_counts_all_it_has_lost() {
    let mut server = Server::start_in_real_time(&["--gait", "stand"]);
    let before_s = server.order(ANY_ORDER);
    let recording = Command::new(program())
        .args(["record", &server.bus(), "-o", "stopped.mcap"])
        .current_dir(server.folder())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let signal = |name: &str| {
        let id = recording.id().to_string();
        let sent = Command::new("kill").args([name, &id]).status();
        assert!(sent.expect("kill runs").success());
    };
    // The file is made once the bus is open.
    wait_until("a recording", || server.path("stopped.mcap").exists());
    let began_s = server.order(ANY_ORDER);
    wait_in_real_time(&mut server, 4.0);
    signal("-STOP");
    wait_in_real_time(&mut server, 12.0);
    signal("-CONT");
    wait_in_real_time(&mut server, 4.0);
    let ended_s = server.order(ANY_ORDER);
    signal("-TERM");
    let output = recording.wait_with_output().expect("it ends");
    let after_s = server.order(ANY_ORDER);
    let [printed, words] =
        [output.stdout, output.stderr].map(|b| String::from_utf8(b).expect("text"));
    let number = |text: &str, of: &str| -> i64 {
        let line = text.lines().find(|line| line.ends_with(of));
        let line = line.unwrap_or_else(|| panic!("no {of} in {text}"));
        let mut words = line.trim_start_matches("footfall:").split_whitespace();
        let first = words.next().and_then(|word| word.parse().ok());
        first.expect("a number")
    };
    let contacts = number(&printed, "/footfall/FL/contact");
    let missing = number(&words, " frames are missing, by their numbers");
    assert!(missing > 1000, "{words}");
    let made_s = (contacts + missing) as f64 * 1.0e-3;
    // Some contacts of the last second may have waited for the program.
    assert!(
        (ended_s - began_s - 1.0..after_s - before_s).contains(&made_s),
        "{contacts}, {missing} from {began_s} to {ended_s} s"
    );
}

/// An order without effect on a standing foot. Its report has the time of the boards.
const ANY_ORDER: &str = "FL: gait stand";

/// Waits for a time of the boards that run in real time, s.
fn wait_in_real_time(server: &mut Server, seconds: f64) {
    let end_s = server.order(ANY_ORDER) + seconds;
    while server.order(ANY_ORDER) < end_s {
        thread::sleep(Duration::from_millis(100));
    }
}
