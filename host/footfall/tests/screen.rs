//! Tests of `footfall monitor` on a terminal.

use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_footfall");

/// Timeout for expected output, with margin for a busy machine.
const LONGEST: Duration = Duration::from_secs(60);

/// Runs a command in tmux until the terminal shows all of `words`.
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
fn terminal_shows_four_feet_and_handles_keys() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
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
fn key_starts_a_recording_and_quitting_ends_it() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    let bench = crate::common::Bench::new();
    std::fs::write(bench.path("footfall-1.mcap"), "taken").expect("a file");
    let folder = bench.path("");
    let command = format!(
        "cd {} && {PROGRAM} monitor demo:line=uart",
        folder.display()
    );
    // The third key is sent one second after the first.
    let keys = ["r", "m", "m", "m", "m"];
    let words = ["recording to footfall-2.mcap", "mark 4"];
    on_a_terminal(&command, 110, 30, &keys, &words);
    let samples = samples_in(&bench, "footfall-2.mcap");
    assert!(samples > Some(500), "{samples:?}");
}

/// Number of IMU samples of the foot FL in a recording.
fn samples_in(bench: &crate::common::Bench, file: &str) -> Option<u64> {
    let report = bench.stdout(&format!("replay {file} --topic /footfall/FL/imu --json"));
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    report["recordings"][0]["samples"].as_u64()
}

#[test]
fn monitor_ends_with_its_terminal_and_keeps_its_recording() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    // Closed terminals send SIGHUP, which `nohup` and some shells keep from their programs.
    for on_hang_up in ["-", "''"] {
        let bench = crate::common::Bench::new();
        let command = format!("exec {PROGRAM} monitor demo");
        let session = Session::begin(&bench, &format!("trap {on_hang_up} HUP"), &command);
        session.tmux(&["send-keys", "-t", "foot", "r"]);
        thread::sleep(Duration::from_secs(3));
        session.end(&["kill-server"]);
        let samples = samples_in(&bench, "footfall-1.mcap");
        assert!(samples > Some(50), "{samples:?}");
    }
}

#[test]
fn picture_on_a_closed_terminal_is_no_crash() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    let bench = crate::common::Bench::new();
    // The shell outlives the terminal, too, to note how the program ends.
    let command = format!("{PROGRAM} monitor demo; echo $? > status");
    let session = Session::begin(&bench, "trap '' HUP", &command);
    session.end(&["kill-server"]);
    assert_eq!(crate::common::read(&bench.path("status")), "0\n");
}

/// Program in a terminal of its own, named `foot`.
struct Session<'a> {
    bench: &'a crate::common::Bench,
    command: String,
}

impl<'a> Session<'a> {
    /// Runs `before` and then `command` in the folder of a bench, as the only process of a terminal; returns after three
    /// seconds.
    fn begin(bench: &'a crate::common::Bench, before: &str, command: &str) -> Self {
        let folder = bench.path("");
        let command = format!(
            "{before}; cd {} && echo $$ > pid && {command}",
            folder.display()
        );
        let session = Self { bench, command };
        session.tmux(&[
            "-f",
            "/dev/null",
            "new-session",
            "-d",
            "-s",
            "foot",
            &session.command,
        ]);
        thread::sleep(Duration::from_secs(3));
        session
    }

    fn tmux(&self, arguments: &[&str]) {
        let mut tmux = Command::new("tmux");
        tmux.arg("-S").arg(self.bench.path("tmux")).args(arguments);
        assert!(tmux.output().expect("tmux runs").status.success());
    }

    /// Closes the terminal by a command of tmux; asserts that the process runs until then, and ends.
    fn end(&self, closing: &[&str]) {
        let pid = crate::common::read(&self.bench.path("pid"));
        let process = std::path::Path::new("/proc").join(pid.trim());
        assert!(process.exists(), "{}", self.command);
        self.tmux(closing);
        let end = Instant::now() + LONGEST;
        while process.exists() && Instant::now() < end {
            thread::sleep(Duration::from_millis(100));
        }
        assert!(!process.exists(), "{}", self.command);
    }
}

/// Runs `command` in a terminal, which is closed after three seconds; asserts that the process ends.
fn end_with_a_closed_terminal(bench: &crate::common::Bench, command: &str) {
    let session = Session::begin(bench, ":", &format!("exec {command}"));
    session.end(&["kill-session", "-t", "foot"]);
}

#[test]
fn commands_without_a_picture_end_with_their_terminal() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    for arguments in [
        "monitor demo --plain",
        "monitor demo --json",
        #[cfg(feature = "foxglove")]
        "view demo --port 0",
        #[cfg(feature = "ros2")]
        "ros2 demo --network 127.0.0.1 --domain-id 231",
    ] {
        end_with_a_closed_terminal(
            &crate::common::Bench::new(),
            &format!("{PROGRAM} {arguments}"),
        );
    }
}

#[test]
fn recording_is_complete_after_its_terminal_was_closed() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    for line in ["can", "uart"] {
        let bench = crate::common::Bench::new();
        let record = format!("record demo:line={line},speed=1 -o walk.mcap");
        end_with_a_closed_terminal(&bench, &format!("{PROGRAM} {record}"));
        let output = bench.run("replay walk.mcap --topic /footfall/FL/imu --json");
        // A recording without an end would be remarked.
        let remarks = crate::common::text(&output.stderr);
        assert!(!remarks.contains("ends early"), "{remarks}");
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let samples = report["recordings"][0]["samples"].as_u64();
        assert!(samples > Some(50), "{report}");
    }
}

#[test]
fn signal_restores_the_terminal() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    let monitor = format!("timeout --foreground -s TERM 2 {PROGRAM} monitor demo");
    // In raw mode, it would have -icanon and -echo.
    let command = format!("{monitor}; stty -a; sleep 10");
    on_a_terminal(&command, 100, 24, &[], &["isig icanon", " echo "]);
}
