//! Bench that runs the `footfall` command.
#![allow(dead_code)] // Each test file uses a part of it.

pub mod feet;

use std::env;
use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Time after which a wait for a condition ends the test as hung; no condition is expected within a given time.
const HANG: Duration = Duration::from_secs(600);

/// Waits until a condition holds; `what` describes it.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let end = Instant::now() + HANG;
    while !holds() {
        assert!(Instant::now() < end, "not within {HANG:?}: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// Lines of a running program's output. Because they are read in the background, a test ends if a line never comes.
pub struct Lines(Receiver<String>);

impl Lines {
    pub fn of(output: impl Read + Send + 'static) -> Self {
        let (sender, receiver) = mpsc::channel();
        thread::spawn(move || {
            let lines = BufReader::new(output).lines().map(|line| line.expect("text"));
            lines.map_while(|line| sender.send(line).ok()).for_each(drop);
        });
        Self(receiver)
    }

    /// Waits for the next line; `None` at the end of the output.
    pub fn next(&self) -> Option<String> {
        match self.0.recv_timeout(HANG) {
            Ok(line) => Some(line),
            Err(mpsc::RecvTimeoutError::Disconnected) => None,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("no line within {HANG:?}"),
        }
    }
}

/// Sends a signal to a process; returns whether it is there.
pub fn kill(signal: &str, child: &Child) -> bool {
    let id = child.id().to_string();
    let kill = Command::new("kill").args(["-s", signal, &id]).stderr(Stdio::null()).status();
    kill.expect("kill").success()
}

/// A directory per test in which the command runs.
pub struct Bench {
    pub directory: TempDir,
}

impl Bench {
    pub fn new() -> Self {
        Self { directory: tempfile::tempdir().expect("a temporary directory") }
    }

    /// Creates a bench with one file.
    pub fn with(name: &str, content: impl AsRef<[u8]>) -> Self {
        let bench = Self::new();
        fs::write(bench.path(name), content).expect("a file in a temporary directory");
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Returns the command with these arguments, in the directory.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
        command.args(arguments.split_whitespace()).current_dir(&self.directory);
        command
    }

    pub fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().expect("the command that was just built")
    }

    /// Runs a line of a shell, in which `$0` is the program.
    pub fn shell(&self, name: &str, line: &str) -> io::Result<Output> {
        let mut shell = Command::new(name);
        shell.args(["-c", line, env!("CARGO_BIN_EXE_footfall")]).current_dir(&self.directory);
        shell.output()
    }

    /// Starts the command with its own handlers of signals, except one that is to be ignored: SIGINT is ignored if a shell
    /// without job control started the test.
    pub fn start(&self, arguments: &str, ignored: Option<&str>) -> Child {
        let mut command = self.command_with_signals(arguments, ignored);
        command.spawn().expect("the command that was just built")
    }

    /// Returns the command that [`start`](Self::start) starts.
    pub fn command_with_signals(&self, arguments: &str, ignored: Option<&str>) -> Command {
        let ignored = ignored.map(|signal| format!("--ignore-signal={signal}"));
        let mut command = Command::new("env");
        command
            .arg("--default-signal")
            .args(ignored)
            .arg(env!("CARGO_BIN_EXE_footfall"))
            .args(arguments.split_whitespace())
            .current_dir(&self.directory)
            .stdout(Stdio::piped());
        command
    }

    /// Runs the command with this standard input, which it must read to the end.
    pub fn piped(&self, arguments: &str, input: &str) -> Output {
        let mut child = self
            .command(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command that was just built");
        let mut stdin = child.stdin.take().expect("a pipe");
        let input = input.to_owned();
        let feeder = thread::spawn(move || stdin.write_all(input.as_bytes()));
        let output = child.wait_with_output().expect("it ends");
        let fed = feeder.join().expect("a thread");
        fed.expect("all of it was read");
        output
    }

    /// Runs a command that must succeed and returns its stdout.
    pub fn stdout(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{output:?}");
        text(&output.stdout)
    }

    /// Returns the report that a command prints with `--json`.
    pub fn json(&self, arguments: &str) -> serde_json::Value {
        serde_json::from_str(&self.stdout(&format!("{arguments} --json"))).expect("JSON")
    }

    /// Runs a command that must fail without writing to stdout, and returns its stderr.
    pub fn error(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(!output.status.success(), "{output:?}");
        assert!(output.stdout.is_empty(), "{output:?}");
        text(&output.stderr)
    }

    /// Runs a command that must fail with the expected text. The error must begin with a text that begins with
    /// the name of the program.
    #[track_caller]
    pub fn refuses(&self, arguments: &str, expected: &str) {
        let error = self.error(arguments);
        assert_has(&error, expected);
        let is_first = error.starts_with(expected);
        assert!(is_first || !expected.starts_with("footfall: "), "{error}");
    }

    /// Waits until a file exists.
    pub fn wait_for(&self, name: &str) {
        wait_until(name, || self.path(name).exists());
    }

    /// Waits until a recording that is being written has more than `least` samples on a topic.
    pub fn wait_for_samples(&self, name: &str, topic: &str, least: u64) {
        let what = format!("{least} samples of {topic} in {name}");
        wait_until(&what, || {
            thread::sleep(Duration::from_millis(100));
            let output = self.run(&format!("replay {name} --topic {topic} --json"));
            output.status.success() && samples(&output.stdout) > least
        });
    }

    /// Returns the names of the files.
    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.directory).expect("a directory");
        let name = |entry: io::Result<fs::DirEntry>| {
            let name = entry.expect("an entry").file_name();
            name.to_string_lossy().into_owned()
        };
        let mut names: Vec<_> = entries.map(name).collect();
        names.sort();
        names
    }
}

/// Returns the cases of a table, each `arguments => expected` on a line of its own.
pub fn cases(table: &str) -> impl Iterator<Item = (&str, &str)> {
    let rows = table.lines().filter(|row| !row.trim().is_empty());
    rows.map(|row| {
        let (arguments, expected) = row.split_once("=>").expect(row);
        (arguments.trim(), expected.trim())
    })
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Returns the number of samples in a report of `replay --json` on one recording.
pub fn samples(report: &[u8]) -> u64 {
    let report: serde_json::Value = serde_json::from_slice(report).expect("JSON");
    let samples = report["recordings"][0]["samples"].as_u64();
    samples.expect("a count")
}

pub fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("a file that was just written")
}

/// Returns the data in a page of feet.
pub fn page_data(page: &str) -> serde_json::Value {
    let data = page.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>"));
    serde_json::from_str(data.expect("a page with data").0).expect("JSON")
}

pub const AXES: &str = "ax,ay,az,wx,wy,wz";

/// Returns a foot that stands for one second at 1 kHz, gravity included.
pub fn standing() -> String {
    let row = |k: u32| format!("{:.3},0,0,9.81,0,0,0,50,1\n", f64::from(k) * 1e-3);
    let rows: String = (0..1000).map(row).collect();
    format!("t,{AXES},force,label\n{rows}")
}

/// Reports that `missing` prevents a test from checking anything; this is an error if unchecked tests are not
/// allowed.
pub fn unmet(missing: &str) {
    let required = env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value != "0");
    assert!(!required, "{missing}");
    // Bypasses the test harness, which captures the output of `eprintln!` in a passing test.
    let _ = writeln!(io::stderr(), "not checked: {missing}");
}

/// Asserts that a text has a part.
#[track_caller]
pub fn assert_has(text: &str, part: &str) {
    assert!(text.contains(part), "no {part:?} in:\n{text}");
}
