//! Tests of `footfall monitor` on a terminal.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::common::{samples, text, wait_until};

const PROGRAM: &str = env!("CARGO_BIN_EXE_footfall");

/// Runs a command in tmux until the terminal shows all of `words` and `then` has returned.
fn on_a_terminal(
    command: &str,
    (columns, rows): (u16, u16),
    keys: &[&str],
    words: &[&str],
    then: impl FnOnce(),
) {
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
    let mut keys = keys.iter();
    wait_until(&format!("{words:?} at {columns}x{rows}"), || {
        thread::sleep(Duration::from_millis(300));
        let screen = text(&tmux(&["capture-pane", "-p", "-t", &session]).stdout);
        if screen.contains("stance")
            && let Some(key) = keys.next()
        {
            tmux(&["send-keys", "-t", &session, key]);
        }
        words.iter().all(|word| screen.contains(word))
    });
    then();
    tmux(&["send-keys", "-t", &session, "q"]);
    wait_until("the end by q", || {
        !tmux(&["has-session", "-t", &session]).status.success()
    });
    tmux(&["kill-server"]);
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
    for size in [(80, 24), (200, 55)] {
        on_a_terminal(&command, size, &["m", "Space"], &words, || ());
    }
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
    let keys = ["r", "m", "m", "m", "m"];
    let words = ["recording to footfall-2.mcap", "mark 4"];
    on_a_terminal(&command, (110, 30), &keys, &words, || {
        bench.wait_for_samples("footfall-2.mcap", IMU, 500);
    });
    assert!(samples_in(&bench, "footfall-2.mcap") > 500);
}

/// Topic of the IMU samples of the foot FL in a recording.
const IMU: &str = "/footfall/FL/imu";

/// Number of IMU samples of the foot FL in a recording, which must be complete.
fn samples_in(bench: &crate::common::Bench, file: &str) -> u64 {
    let output = bench.run(&format!("replay {file} --topic {IMU} --json"));
    // A recording without an end would be remarked.
    let remarks = text(&output.stderr);
    assert!(
        output.status.success() && !remarks.contains("ends early"),
        "{remarks}"
    );
    samples(&output.stdout)
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
        session.wait_for("stance");
        session.tmux(&["send-keys", "-t", "foot", "r"]);
        bench.wait_for_samples("footfall-1.mcap", IMU, 50);
        session.end(&["kill-server"]);
        assert!(samples_in(&bench, "footfall-1.mcap") > 50);
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
    session.wait_for("stance");
    session.end(&["kill-server"]);
    assert_eq!(crate::common::read(&bench.path("status")), "0\n");
}

/// Program in a terminal of its own, named `foot`.
struct Session<'a> {
    bench: &'a crate::common::Bench,
    command: String,
}

impl<'a> Session<'a> {
    /// Runs `before` and then `command` in the folder of a bench, as the only process of a terminal.
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
        session
    }

    /// Waits until the terminal shows a text.
    fn wait_for(&self, text: &str) {
        let mut tmux = Command::new("tmux");
        tmux.arg("-S").arg(self.bench.path("tmux"));
        tmux.args(["capture-pane", "-p", "-t", "foot"]);
        wait_until(&format!("{text} of {}", self.command), || {
            thread::sleep(Duration::from_millis(100));
            let screen = tmux.output().expect("tmux runs").stdout;
            crate::common::text(&screen).contains(text)
        });
    }

    fn tmux(&self, arguments: &[&str]) {
        let mut tmux = Command::new("tmux");
        tmux.arg("-S").arg(self.bench.path("tmux")).args(arguments);
        assert!(tmux.output().expect("tmux runs").status.success());
    }

    /// Process id, which a shell writes before the program is shown.
    fn pid(&self) -> String {
        wait_until("a process id", || {
            std::fs::read(self.bench.path("pid")).is_ok_and(|pid| pid.ends_with(b"\n"))
        });
        crate::common::read(&self.bench.path("pid"))
    }

    fn process(&self) -> PathBuf {
        Path::new("/proc").join(self.pid().trim())
    }

    /// Closes the terminal by a command of tmux; asserts that the process runs until then, and ends.
    fn end(&self, closing: &[&str]) {
        let process = self.process();
        assert!(process.exists(), "{}", self.command);
        self.tmux(closing);
        wait_until(&format!("the end of {}", self.command), || {
            !process.exists()
        });
    }
}

/// Runs `command` in a terminal, which is closed when `is_ready` returns; asserts that the process ends.
fn end_with_a_closed_terminal(
    bench: &crate::common::Bench,
    command: &str,
    is_ready: impl FnOnce(&Session),
) {
    let session = Session::begin(bench, ":", &format!("exec {command}"));
    is_ready(&session);
    session.end(&["kill-session", "-t", "foot"]);
}

#[test]
fn commands_without_a_picture_end_with_their_terminal() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    for (arguments, shown) in [
        ("monitor demo --plain", "missing 0"),
        ("monitor demo --json", "p_stable"),
        #[cfg(feature = "foxglove")]
        ("view demo --port 0", "serving"),
    ] {
        let bench = crate::common::Bench::new();
        let command = format!("{PROGRAM} {arguments}");
        end_with_a_closed_terminal(&bench, &command, |session| session.wait_for(shown));
    }
}

#[cfg(feature = "ros2")]
#[test]
fn ros_node_ends_with_its_terminal() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    let bench = crate::common::Bench::new();
    let domain = crate::domain::Domain::take();
    let command = format!(
        "{PROGRAM} ros2 demo --network 127.0.0.1 --domain-id {}",
        domain.id
    );
    end_with_a_closed_terminal(&bench, &command, |session| {
        // The node has sockets once it takes part in its domain.
        wait_until("sockets of the node", || {
            let folder = session.process().join("fd");
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let targets = entries.filter_map(|entry| std::fs::read_link(entry.path()).ok());
            let is_socket = |target: &PathBuf| target.to_string_lossy().starts_with("socket:");
            targets.filter(is_socket).count() > 3
        });
    });
}

#[test]
fn recording_is_complete_after_its_terminal_was_closed() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    for line in ["can", "uart"] {
        let bench = crate::common::Bench::new();
        let record = format!("record demo:line={line},speed=1 -o walk.mcap");
        end_with_a_closed_terminal(&bench, &format!("{PROGRAM} {record}"), |_| {
            bench.wait_for_samples("walk.mcap", IMU, 50);
        });
        assert!(samples_in(&bench, "walk.mcap") > 50);
    }
}

#[test]
fn signal_restores_the_terminal() {
    if Command::new("tmux").arg("-V").output().is_err() {
        return crate::common::unmet("tmux is not installed");
    }
    let bench = crate::common::Bench::new();
    let monitor = format!("sh -c 'echo $$ > pid; exec {PROGRAM} monitor demo'");
    let command = format!("{monitor}; stty -a; read answer");
    let session = Session::begin(&bench, ":", &command);
    session.wait_for("stance");
    let status = Command::new("kill")
        .args(["-s", "TERM", session.pid().trim()])
        .status();
    assert!(status.expect("kill runs").success());
    // In raw mode, it would have -icanon and -echo.
    session.wait_for("isig icanon");
    session.wait_for(" echo ");
    session.tmux(&["kill-server"]);
}
