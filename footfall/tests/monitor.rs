//! `footfall monitor` and `footfall explain`, as whole programs.

mod common;

use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_footfall");

fn monitor(arguments: &[&str]) -> (String, String, Option<i32>) {
    let output = Command::new(PROGRAM)
        .arg("monitor")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (
        text(output.stdout),
        text(output.stderr),
        output.status.code(),
    )
}

#[test]
fn where_there_is_no_terminal_each_foot_is_a_line_a_second() {
    let (lines, warnings, code) = monitor(&["demo:feet=4,seconds=2.5"]);
    assert_eq!((warnings.as_str(), code), ("", Some(0)));
    for foot in ["FL", "FR", "RL", "RR"] {
        let of_foot = lines
            .lines()
            .filter(|line| line.contains(&format!("s  {foot}  ")));
        let with_p = of_foot.filter(|line| line.contains("  P ")).count();
        assert_eq!(with_p, 3, "{foot}:\n{lines}");
    }
    assert!(lines.contains("missing 0, dropped 0"), "{lines}");
    assert!(lines.contains("the demo has ended"), "{lines}");
}

#[test]
fn as_json_every_line_is_an_object() {
    let (lines, _, code) = monitor(&["demo:feet=2,speed=max,seconds=3", "--json"]);
    assert_eq!(code, Some(0));
    let objects: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}")))
        .collect();
    let feet: Vec<_> = objects
        .iter()
        .filter(|o| o["p_stable"].is_number())
        .collect();
    assert_eq!(feet.len(), 2);
    assert_eq!(
        (&feet[0]["foot"], &feet[1]["foot"]),
        (&"L".into(), &"R".into())
    );
    assert_eq!(feet[0]["missing"], 0);
    assert!(
        objects
            .iter()
            .any(|object| object["event"] == "has started")
    );
}

#[test]
fn what_is_no_source_is_an_error_of_the_command_line() {
    let (_, error, code) = monitor(&["ttyACM0"]);
    assert_eq!(code, Some(2));
    assert!(error.contains("sources are uart:PORT[@BAUD]"), "{error}");
}

#[test]
fn a_log_and_a_recording_of_the_demo_are_played() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = Command::new(PROGRAM)
        .args(["demo", "--out"])
        .arg(folder.path())
        .output()
        .expect("the program runs");
    assert!(demo.status.success());
    for file in ["can.log", "uart.bin", "samples.csv"] {
        let path = folder.path().join(file);
        let source = format!("file:{}@max", path.display());
        let (lines, warnings, code) = monitor(&[&source]);
        assert_eq!((warnings.as_str(), code), ("", Some(0)), "{file}: {lines}");
        assert!(lines.contains("  P "), "{file}: {lines}");
    }
}

#[test]
fn what_cannot_be_played_is_an_error() {
    let (lines, error, code) = monitor(&["file:there-is-none.log"]);
    assert_eq!(code, Some(1), "{lines}");
    assert!(error.contains("there-is-none.log"), "{error}");
}

/// How long is waited for what comes: a busy machine takes its time.
const LONGEST: Duration = Duration::from_secs(60);

/// Runs a command in tmux, and looks at what is on the terminal until it has all of `words`.
fn on_a_terminal(command: &str, columns: u16, rows: u16, keys: &[&str], words: &[&str]) {
    let session = format!("footfall-{columns}x{rows}-{}", std::process::id());
    let folder = tempfile::tempdir().expect("a folder");
    let socket = folder.path().join("tmux");
    let tmux = |arguments: &[&str]| {
        let run = Command::new("tmux")
            .arg("-S")
            .arg(&socket)
            .args(arguments)
            .output();
        run.expect("tmux runs")
    };
    let (x, y) = (columns.to_string(), rows.to_string());
    let started = tmux(&[
        "-f",
        "/dev/null",
        "new-session",
        "-d",
        "-s",
        &session,
        "-x",
        &x,
        "-y",
        &y,
        command,
    ]);
    assert!(started.status.success(), "{started:?}");
    let mut screen = String::new();
    let end = Instant::now() + LONGEST;
    let mut keys = keys.iter();
    while !words.iter().all(|word| screen.contains(word)) && Instant::now() < end {
        thread::sleep(Duration::from_millis(300));
        screen = String::from_utf8_lossy(&tmux(&["capture-pane", "-p", "-t", &session]).stdout)
            .into_owned();
        if screen.contains("stance")
            && let Some(key) = keys.next()
        {
            tmux(&["send-keys", "-t", &session, key]);
        }
    }
    for word in words {
        assert!(
            screen.contains(word),
            "{word} at {columns}x{rows}:\n{screen}"
        );
    }
    tmux(&["send-keys", "-t", &session, "q"]);
    let end = Instant::now() + LONGEST;
    while tmux(&["has-session", "-t", &session]).status.success() && Instant::now() < end {
        thread::sleep(Duration::from_millis(100));
    }
    let is_over = !tmux(&["has-session", "-t", &session]).status.success();
    tmux(&["kill-server"]);
    assert!(is_over, "q did not end it");
}

#[test]
fn on_a_real_terminal_four_feet_walk_and_keys_work() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return common::unmet("tmux is not installed");
    }
    let words = [
        "FL",
        "FR",
        "RL",
        "RR",
        "1000 Hz",
        "missing 0 dropped 0",
        "mark 1",
        "paused",
    ];
    let command = format!("{PROGRAM} monitor demo:feet=4");
    on_a_terminal(&command, 80, 24, &["m", "Space"], &words);
    on_a_terminal(&command, 200, 55, &["m", "Space"], &words);
}

#[test]
fn a_key_begins_a_recording_that_quitting_ends() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return common::unmet("tmux is not installed");
    }
    let bench = common::Bench::new();
    std::fs::write(bench.path("footfall-1.mcap"), "taken").expect("a file");
    let folder = bench.path("");
    let command = format!(
        "cd {} && {PROGRAM} monitor demo:line=uart",
        folder.display()
    );
    // The third key comes a second after the first.
    let keys = ["r", "m", "m", "m", "m"];
    let words = ["recording to footfall-2.mcap", "mark 4"];
    on_a_terminal(&command, 110, 30, &keys, &words);
    let report = bench.stdout("replay footfall-2.mcap --topic /footfall/FL/imu --json");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let samples = report["recordings"][0]["samples"].as_u64();
    assert!(samples > Some(500), "{report}");
}

#[test]
fn a_signal_gives_the_terminal_back() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return common::unmet("tmux is not installed");
    }
    let monitor = format!("timeout --foreground -s TERM 2 {PROGRAM} monitor demo");
    // Raw, it would have -icanon and -echo.
    let command = format!("{monitor}; stty -a; sleep 10");
    on_a_terminal(&command, 100, 24, &[], &["isig icanon", " echo "]);
}

#[test]
fn faults_flags_and_refusals_are_explained() {
    let explain = |arguments: &[&str]| {
        let output = Command::new(PROGRAM)
            .arg("explain")
            .args(arguments)
            .output();
        let output = output.expect("the program runs");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (
            text(&output.stdout),
            text(&output.stderr),
            output.status.code(),
        )
    };
    let (text, _, code) = explain(&["0x7007"]);
    assert_eq!(code, Some(0));
    assert!(
        text.starts_with("fault 0x7007 sensor out of step\n"),
        "{text}"
    );
    assert!(text.contains("what to do: "), "{text}");
    assert!(explain(&["sensor", "frozen"]).0.starts_with("fault 0x7002"));
    assert!(explain(&["settling"]).0.contains("walk four or five steps"));
    assert!(explain(&["0x06090031"]).0.contains("value too high"));
    assert!(explain(&[]).0.lines().count() > 40);
    let (_, error, code) = explain(&["0x1234"]);
    assert_eq!(code, Some(1));
    assert!(error.contains("footfall explain lists all"), "{error}");
}
