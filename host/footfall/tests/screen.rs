//! Tests of `footfall monitor` on a terminal.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::common::{Bench, read, samples, text, unmet, wait_until};

const PROGRAM: &str = env!("CARGO_BIN_EXE_footfall");

/// Returns whether there is tmux; the test is unmet without.
fn has_tmux() -> bool {
    let has = Command::new("tmux").arg("-V").output().is_ok();
    if !has {
        unmet("tmux is not installed");
    }
    has
}

/// Runs a command until its terminal shows all of `words`, with a key at a time from the first picture on, and then ends
/// it with q.
fn watched(
    bench: &Bench,
    command: &str,
    size: &str,
    keys: &[&str],
    words: &[&str],
    then: impl FnOnce(),
) {
    let session = Session::sized(bench, size, ":", &format!("exec {command}"));
    let mut keys = keys.iter();
    wait_until(&format!("{words:?} at {size}"), || {
        thread::sleep(Duration::from_millis(300));
        let screen = session.screen();
        if screen.contains("stance")
            && let Some(key) = keys.next()
        {
            session.tmux(&["send-keys", "-t", "foot", key]);
        }
        words.iter().all(|word| screen.contains(word))
    });
    then();
    session.end(&["send-keys", "-t", "foot", "q"]);
}

#[test]
fn terminal_shows_four_feet_and_handles_keys() {
    if !has_tmux() {
        return;
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
    for size in ["80x24", "200x55"] {
        let command = format!("{PROGRAM} monitor demo:feet=4");
        watched(
            &Bench::new(),
            &command,
            size,
            &["m", "Space"],
            &words,
            || (),
        );
    }
}

#[test]
fn key_starts_a_recording_and_quitting_ends_it() {
    if !has_tmux() {
        return;
    }
    let bench = Bench::new();
    std::fs::write(bench.path("footfall-1.mcap"), "taken").expect("a file");
    let command = format!("{PROGRAM} monitor demo:line=uart");
    let words = ["recording to footfall-2.mcap", "mark 4"];
    watched(
        &bench,
        &command,
        "110x30",
        &["r", "m", "m", "m", "m"],
        &words,
        || {
            bench.wait_for_samples("footfall-2.mcap", IMU, 500);
        },
    );
    assert!(samples_in(&bench, "footfall-2.mcap") > 500);
}

/// Topic of the IMU samples of the foot FL in a recording.
const IMU: &str = "/footfall/FL/imu";

/// Number of IMU samples of the foot FL in a recording, which must be complete.
fn samples_in(bench: &Bench, file: &str) -> u64 {
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
    if !has_tmux() {
        return;
    }
    // Closed terminals send SIGHUP, which `nohup` and some shells keep from their programs.
    for on_hang_up in ["-", "''"] {
        let bench = Bench::new();
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
    if !has_tmux() {
        return;
    }
    let bench = Bench::new();
    // The shell outlives the terminal, too, to note how the program ends.
    let command = format!("{PROGRAM} monitor demo; echo $? > status");
    let session = Session::begin(&bench, "trap '' HUP", &command);
    session.wait_for("stance");
    session.end(&["kill-server"]);
    assert_eq!(read(&bench.path("status")), "0\n");
}

/// Program in a terminal of its own, named `foot`.
struct Session<'a> {
    bench: &'a Bench,
    command: String,
}

impl<'a> Session<'a> {
    /// Runs `before` and then `command` in the folder of a bench, as the only process of a terminal.
    fn begin(bench: &'a Bench, before: &str, command: &str) -> Self {
        Self::sized(bench, "80x24", before, command)
    }

    /// The same in a terminal with this number of columns and rows.
    fn sized(bench: &'a Bench, size: &str, before: &str, command: &str) -> Self {
        let folder = bench.path("");
        let command = format!(
            "{before}; cd {} && echo $$ > pid && {command}",
            folder.display()
        );
        let session = Self { bench, command };
        let (columns, rows) = size.split_once('x').expect("columns and rows");
        let start = [
            "-f",
            "/dev/null",
            "new-session",
            "-d",
            "-s",
            "foot",
            "-x",
            columns,
            "-y",
            rows,
        ];
        session.tmux(&[&start[..], &[&session.command]].concat());
        session
    }

    fn screen(&self) -> String {
        let mut tmux = Command::new("tmux");
        tmux.arg("-S").arg(self.bench.path("tmux"));
        tmux.args(["capture-pane", "-p", "-t", "foot"]);
        text(&tmux.output().expect("tmux runs").stdout)
    }

    /// Waits until the terminal shows a text.
    fn wait_for(&self, shown: &str) {
        wait_until(&format!("{shown} of {}", self.command), || {
            thread::sleep(Duration::from_millis(100));
            self.screen().contains(shown)
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
        read(&self.bench.path("pid"))
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
fn end_with_a_closed_terminal(bench: &Bench, command: &str, is_ready: impl FnOnce(&Session)) {
    let session = Session::begin(bench, ":", &format!("exec {command}"));
    is_ready(&session);
    session.end(&["kill-session", "-t", "foot"]);
}

#[test]
fn commands_without_a_picture_end_with_their_terminal() {
    if !has_tmux() {
        return;
    }
    for (arguments, shown) in [
        ("monitor demo --plain", "missing 0"),
        ("monitor demo --json", "p_stable"),
        #[cfg(feature = "foxglove")]
        ("view demo --port 0", "serving"),
    ] {
        let bench = Bench::new();
        let command = format!("{PROGRAM} {arguments}");
        end_with_a_closed_terminal(&bench, &command, |session| session.wait_for(shown));
    }
}

#[cfg(feature = "ros2")]
#[test]
fn ros_node_ends_with_its_terminal() {
    if !has_tmux() {
        return;
    }
    let bench = Bench::new();
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
    if !has_tmux() {
        return;
    }
    for line in ["can", "uart"] {
        let bench = Bench::new();
        let record = format!("record demo:line={line},speed=1 -o walk.mcap");
        end_with_a_closed_terminal(&bench, &format!("{PROGRAM} {record}"), |_| {
            bench.wait_for_samples("walk.mcap", IMU, 50);
        });
        assert!(samples_in(&bench, "walk.mcap") > 50);
    }
}

#[test]
fn signal_restores_the_terminal() {
    if !has_tmux() {
        return;
    }
    let bench = Bench::new();
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
