//! `footfall monitor` on a terminal.

mod common;

use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_footfall");

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
