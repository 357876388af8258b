//! All tests, several programs at once: many of them wait, for boards in real time, browsers and terminals.

use std::collections::VecDeque;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use cargo_metadata::Message;

use crate::command::{cargo, root};

/// Selections of packages, each compiled with one set of features: what `cargo test` takes, the portable part of the
/// firmware, and the virtual board.
const SELECTIONS: [&[&str]; 3] = [
    &[],
    &["--package", "firmware", "--lib"],
    &["--package", "virtual-board"],
];

/// Number of test programs that run at once.
const AT_ONCE: usize = 3;

/// Test programs that take longest, which begin first, and the threads that each takes where it mostly waits.
const FIRST: [(&str, Option<&str>); 8] = [
    ("serve", Some("3")),
    ("instructions", None),
    ("ros2", Some("4")),
    ("matrix", None),
    ("update", None),
    ("updates", None),
    ("broad", None),
    ("screen", Some("4")),
];

/// A program that runs tests.
struct Program {
    name: String,
    /// Place in the order of starts.
    place: usize,
    command: Command,
}

impl Program {
    fn new(target: &str, executable: PathBuf, package: &Path) -> Self {
        let place = FIRST.iter().position(|(first, _)| *first == target);
        let mut command = Command::new(executable);
        if let Some((_, Some(threads))) = place.and_then(|place| FIRST.get(place)) {
            command.env("RUST_TEST_THREADS", threads);
        }
        command
            .current_dir(package)
            .env("CARGO_MANIFEST_DIR", package);
        let folder = package.file_name().unwrap_or_default();
        Self {
            name: format!("{} {target}", folder.display()),
            place: place.unwrap_or(FIRST.len()),
            command,
        }
    }

    /// Runs the tests, and prints their output in one piece. Returns whether all of them passed.
    fn passes(mut self) -> Result<bool> {
        let begin = Instant::now();
        let output = self.command.stdin(Stdio::null()).output();
        let output = output.with_context(|| format!("{} does not start", self.name))?;
        let seconds = begin.elapsed().as_secs_f64();
        println!(
            "== {} ({seconds:.1} s)\n{}{}",
            self.name,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
        Ok(output.status.success())
    }
}

/// Compiles all tests and runs them.
///
/// # Errors
/// A test does not compile, or fails.
pub fn run() -> Result<()> {
    let mut programs = Vec::new();
    for selection in SELECTIONS {
        programs.extend(compiled(selection)?);
    }
    let mut examples = Command::new(cargo());
    examples
        .args(["test", "--locked", "--doc"])
        .current_dir(root());
    programs.push(Program {
        name: "examples in the documentation".to_owned(),
        place: FIRST.len(),
        command: examples,
    });
    programs.sort_by_key(|program| program.place);
    let failed = all_run(programs.into())?;
    if !failed.is_empty() {
        bail!("tests failed: {}", failed.join(", "));
    }
    Ok(())
}

/// Compiles a selection of tests. Returns its programs.
fn compiled(selection: &[&str]) -> Result<Vec<Program>> {
    let mut child = Command::new(cargo())
        .args(["test", "--locked", "--no-run"])
        .arg("--message-format=json-render-diagnostics")
        .args(selection)
        .current_dir(root())
        .stdout(Stdio::piped())
        .spawn()
        .context("cargo does not start")?;
    let messages = child.stdout.take().context("cargo has no output")?;
    let mut programs = Vec::new();
    for message in Message::parse_stream(BufReader::new(messages)) {
        let Message::CompilerArtifact(artifact) = message.context("cargo prints no JSON")? else {
            continue;
        };
        let package = artifact.manifest_path.parent().context("a manifest")?;
        if let (Some(executable), true) = (artifact.executable, artifact.profile.test) {
            let name = &artifact.target.name;
            programs.push(Program::new(name, executable.into(), package.as_std_path()));
        }
    }
    let status = child.wait().context("cargo ends")?;
    if !status.success() {
        bail!("cargo test --no-run {}: {status}", selection.join(" "));
    }
    Ok(programs)
}

/// Runs test programs. Returns the names of those that failed.
fn all_run(programs: VecDeque<Program>) -> Result<Vec<String>> {
    let waiting = Mutex::new(programs);
    let next = || waiting.lock().ok()?.pop_front();
    let work = || -> Result<Vec<String>> {
        let mut failed = Vec::new();
        while let Some(program) = next() {
            let name = program.name.clone();
            if !program.passes()? {
                failed.push(name);
            }
        }
        Ok(failed)
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..AT_ONCE).map(|_| scope.spawn(work)).collect();
        let mut failed = Vec::new();
        for worker in workers {
            match worker.join() {
                Ok(of_worker) => failed.extend(of_worker?),
                Err(_) => bail!("a worker panicked"),
            }
        }
        Ok(failed)
    })
}
