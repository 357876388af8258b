//! The `footfall` program, each command that reads from feet, on the ELF's own output.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value as Json;

use crate::server::{Server, footfall, program};

/// Runs every action on one foot, over one of its lines.
fn set_and_ask(server: &Server, source: &str) {
    let info = server.foot(source, &["info"]);
    assert!(info.starts_with("foot     R, serial line\n"), "{info}");
    assert!(info.contains("faults   none\n"), "{info}");
    let one = server.foot(source, &["get", "decision.threshold"]);
    assert!(one.starts_with("decision.threshold = 0.5   # "), "{one}");
    let set = server.foot(source, &["set", "decision.threshold=0.75"]);
    assert!(
        set.starts_with("decision.threshold: 0.5 → 0.75\nnot stored"),
        "{set}"
    );
    // A setting that is not stored is lost after a reset.
    server.foot(source, &["reset"]);
    let one = server.foot(source, &["get", "decision.threshold"]);
    assert!(one.starts_with("decision.threshold = 0.5   # "), "{one}");
    let set = server.foot(source, &["set", "decision.threshold=0.75", "--save"]);
    assert_eq!(set, "decision.threshold: 0.5 → 0.75\nstored\n");
    server.foot(source, &["reset"]);
    let changed = server.foot(source, &["diff"]);
    assert_eq!(
        changed,
        "foot: 1 → 6\ndecision.threshold: 0.5 → 0.75\nload_input.source: 0 → 2\n"
    );
    let file = "serial.txt";
    server.foot(source, &["export", file]);
    let exported = fs::read_to_string(server.path(file)).expect("a file");
    assert!(
        exported.contains("\ndecision.threshold = 0.75 # "),
        "{exported}"
    );
    let changed = exported.replace("decision.threshold = 0.75 ", "decision.threshold = 0.5 ");
    fs::write(server.path(file), changed).expect("a file");
    let imported = server.foot(source, &["import", file]);
    assert_eq!(imported, "decision.threshold: 0.75 → 0.5\nstored\n");
    server.foot(source, &["save"]);
    let same = server.foot(source, &["diff", file]);
    assert_eq!(same, "");
    let all: Json = serde_json::from_str(&server.foot(source, &["get", "--json"])).expect("JSON");
    assert!(all.as_object().expect("an object").len() > 60);
}

#[test]
fn a_foot_is_read_and_set_over_serial_line_and_bus() {
    let Some(server) = Server::start("set", &["--feet", "2", "--gait", "stand"]) else {
        return;
    };
    // Two feet are those of a biped.
    let scan = server.foot(&server.bus(), &["scan"]);
    let path = server.path("bus.slcan");
    let path = path.display();
    assert_eq!(scan, format!("{path}  node 21  L\n{path}  node 22  R\n"));
    set_and_ask(&server, &server.serial("R"));
    let bus = server.bus();
    let on_bus = |arguments: &[&str]| {
        let all: Vec<&str> = ["--node", "22"]
            .into_iter()
            .chain(arguments.iter().copied())
            .collect();
        server.foot(&bus, &all)
    };
    let info = on_bus(&["info", "--json"]);
    let info: Json = serde_json::from_str(&info).expect("JSON");
    assert_eq!((&info["foot"], &info["node"]), (&"R".into(), &22.into()));
    assert_eq!(
        on_bus(&["set", "decision.threshold=0.625", "--save"]),
        "decision.threshold: 0.5 → 0.625\nstored\n"
    );
    on_bus(&["reset"]);
    assert!(on_bus(&["diff"]).contains("decision.threshold: 0.5 → 0.625\n"));
    on_bus(&["export", "bus.txt"]);
    assert_eq!(on_bus(&["diff", "bus.txt"]), "");
    on_bus(&["set", "decision.threshold=0.5"]);
    assert_eq!(
        on_bus(&["import", "bus.txt"]),
        "decision.threshold: 0.5 → 0.625\nstored\n"
    );
    // A board that has lost its settings is FL.
    on_bus(&["restore"]);
    let info = server.foot(&server.serial("R"), &["info"]);
    assert!(info.starts_with("foot     FL, serial line\n"), "{info}");
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
    assert!(said.contains("R: reset by its program"), "{said}");
}

/// Objects that the monitor prints within some seconds.
fn monitored(folder: &Path, source: &str, seconds: &str) -> Vec<Json> {
    let (printed, _) = footfall(folder, &["monitor", source, "--json", "--seconds", seconds]);
    let objects = printed
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"));
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
    let Some(mut server) = Server::start("monitor", &[]) else {
        return;
    };
    for source in [server.serial("FL"), server.bus()] {
        let objects = monitored(&server.folder, &source, "4");
        let foot = newest(&objects, "FL");
        assert_eq!(
            (&foot["missing"], &foot["dropped"]),
            (&0.into(), &0.into()),
            "{foot}"
        );
        assert_eq!(foot["faults"], Json::Array(Vec::new()), "{foot}");
        assert!(
            foot["rate_hz"]
                .as_f64()
                .is_some_and(|rate| (990.0..=1010.0).contains(&rate))
        );
    }
    // The controller sends the load to the foot over the bus.
    let of_bus = monitored(&server.folder, &server.bus(), "2");
    assert!(newest(&of_bus, "FL")["load_n"].is_number(), "{of_bus:#?}");

    let plain = Command::new(program())
        .args(["monitor", &server.bus(), "--plain"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut plain = plain;
    thread::sleep(Duration::from_secs(3));
    server.say("FL: fault miso-low");
    server.wait_for("FL: fault miso-low");
    thread::sleep(Duration::from_secs(2));
    server.say("fault clear");
    server.wait_for("all feet: fault clear");
    thread::sleep(Duration::from_secs(3));
    plain.kill().expect("killed");
    let output = plain.wait_with_output().expect("it ends");
    let lines = String::from_utf8(output.stdout).expect("text");
    println!("{lines}");
    let at = |words: &str| {
        lines
            .find(words)
            .unwrap_or_else(|| panic!("no {words:?} in {lines}"))
    };
    let came = at("sensor");
    assert!(lines[came..].contains("cleared"), "{lines}");
    let last = lines
        .lines()
        .rfind(|line| line.contains("  P "))
        .expect("a line");
    assert!(!last.contains("sensor"), "{last}");

    server.say("fault thawed");
    server.wait_for("error: thawed is none of");
    server.say("FL: gait trot");
    server.wait_for("FL: gait trot");
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
}

#[test]
fn the_monitor_loses_no_contact_of_four_feet_on_one_bus() {
    let Some(server) = Server::start("robot", &["--feet", "4"]) else {
        return;
    };
    let objects = monitored(&server.folder, &server.bus(), "6");
    for foot in ["FL", "FR", "RL", "RR"] {
        let foot = newest(&objects, foot);
        let counts = (&foot["missing"], &foot["dropped"]);
        assert_eq!(counts, (&0.into(), &0.into()), "{foot}");
        let rate_hz = foot["rate_hz"].as_f64();
        assert!(
            rate_hz.is_some_and(|rate| (990.0..=1010.0).contains(&rate)),
            "{foot}"
        );
    }
    let (said, status) = server.end();
    assert!(status.success() && !said.contains("lost, since"), "{said}");
}

#[test]
fn a_recording_replays_and_the_bytes_of_a_serial_line_decode() {
    let Some(server) = Server::start("record", &["--fault", "hang@2000"]) else {
        return;
    };
    let folder = &server.folder;
    footfall(
        folder,
        &["record", &server.bus(), "-o", "bus.mcap", "--seconds", "6"],
    );
    let (json, _) = footfall(folder, &["replay", "bus.mcap", "--topic", "all", "--json"]);
    let json: Json = serde_json::from_str(&json).expect("JSON");
    assert!(
        json["recordings"][0]["samples"].as_u64() > Some(100),
        "{json:#}"
    );
    server.wait_for("FL: reset by the watchdog");
    footfall(
        folder,
        &[
            "foot",
            &server.serial("FL"),
            "set",
            "uart_streams.raw_sample=1",
        ],
    );
    footfall(
        folder,
        &[
            "record",
            &server.serial("FL"),
            "-o",
            "uart.mcap",
            "--seconds",
            "4",
        ],
    );
    let (json, _) = footfall(folder, &["replay", "uart.mcap", "--topic", "all", "--json"]);
    let json: Json = serde_json::from_str(&json).expect("JSON");
    assert!(
        json["recordings"][0]["samples"].as_u64() > Some(1000),
        "{json:#}"
    );

    // As written to a file by `cat`.
    let mut cat = Command::new("sh")
        .args(["-c", "exec cat FL.uart > uart.bin"])
        .current_dir(folder)
        .spawn()
        .expect("it runs");
    thread::sleep(Duration::from_secs(3));
    cat.kill().expect("killed");
    cat.wait().expect("it ends");
    footfall(folder, &["decode", "uart.bin", "--output", "rows.csv"]);
    let rows = fs::read_to_string(server.path("rows.csv")).expect("rows");
    assert!(rows.lines().count() > 500, "{} rows", rows.lines().count());
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
}

#[test]
fn a_suspended_program_counts_all_it_has_lost() {
    let Some(server) = Server::start("stopped", &["--gait", "stand"]) else {
        return;
    };
    let recording = Command::new(program())
        .args(["record", &server.bus(), "-o", "stopped.mcap"])
        .current_dir(&server.folder)
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
    server.wait_for_file("stopped.mcap");
    let began = Instant::now();
    thread::sleep(Duration::from_secs(4));
    signal("-STOP");
    let (stopped, lost_before_s) = (Instant::now(), lost_s(&server.said()));
    // 12 s of the board. On a slow machine it falls behind, and the server reports by how much, each 5 s.
    let board_s = || match lost_s(&server.said()) - lost_before_s {
        0.0 => stopped.elapsed().as_secs_f64(),
        lost_s => stopped.elapsed().as_secs_f64() - lost_s - 5.0,
    };
    while board_s() < 12.0 && stopped.elapsed() < Duration::from_secs(120) {
        thread::sleep(Duration::from_millis(100));
    }
    signal("-CONT");
    thread::sleep(Duration::from_secs(4));
    signal("-TERM");
    let seconds = began.elapsed().as_secs_f64();
    let output = recording.wait_with_output().expect("it ends");
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
    let lost_s = lost_s(&server.end().0);
    let made_s = (contacts + missing) as f64 * 1.0e-3;
    assert!(
        (seconds - lost_s - 1.0..seconds + 0.2).contains(&made_s),
        "{contacts}, {missing} in {seconds} s: {lost_s} s lost"
    );
}

/// Real time by which a server has said that its boards are behind, s.
fn lost_s(said: &str) -> f64 {
    let mut lines = said.lines();
    let lost = lines.rfind(|line| line.starts_with("slower than real time"));
    let lost = lost.and_then(|line| line.split_whitespace().nth(4));
    lost.map_or(0.0, |seconds| seconds.parse().expect("seconds"))
}
