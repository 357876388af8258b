//! The server with its feet, the `footfall` program, and folders for both.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use host_tests::committed::workspace;

use crate::common::{directory, product_file};

/// Timeout for expected output.
const LONGEST: Duration = Duration::from_secs(60);

/// A running server.
pub struct Server {
    child: Child,
    typed: ChildStdin,
    said: Arc<Mutex<String>>,
    pub folder: PathBuf,
}

impl Server {
    /// Starts the server in a folder of this name, and waits until all sources are announced; `None` if there is
    /// no product.
    pub fn start(name: &str, arguments: &[&str]) -> Option<Self> {
        let elf = product_file()?;
        let folder = directory("serve").join(name);
        // Left over from another run.
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        let mut child = Command::new(env!("CARGO_BIN_EXE_virtual-board"))
            .args(["serve", "--links", ".", "--elf"])
            .arg(elf)
            .args(arguments)
            .current_dir(&folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program that was just built");
        let said = Arc::new(Mutex::new(String::new()));
        let (mut stderr, to) = (child.stderr.take().expect("piped"), Arc::clone(&said));
        thread::spawn(move || {
            let mut piece = [0; 1024];
            while let Ok(count @ 1..) = stderr.read(&mut piece) {
                let text = String::from_utf8_lossy(&piece[..count]);
                to.lock().expect("no panic").push_str(&text);
            }
        });
        let typed = child.stdin.take().expect("piped");
        let mut sources = BufReader::new(child.stdout.take().expect("piped")).lines();
        let bus = sources.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("bus")));
        let server = Self {
            child,
            typed,
            said,
            folder,
        };
        assert!(bus.is_some(), "no bus: {}", server.said());
        Some(server)
    }

    /// The serial line of a foot, as a source.
    pub fn serial(&self, foot: &str) -> String {
        format!("uart:{}", self.path(&format!("{foot}.uart")).display())
    }

    /// The bus, as a source.
    pub fn bus(&self) -> String {
        format!("slcan:{}", self.path("bus.slcan").display())
    }

    /// Output of `footfall foot SOURCE`.
    pub fn foot(&self, source: &str, arguments: &[&str]) -> String {
        let all = [&["foot", source], arguments].concat();
        footfall(&self.folder, &all).0
    }

    /// Path of a file in its folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Types a line.
    pub fn say(&mut self, line: &str) {
        writeln!(self.typed, "{line}").expect("it reads what is typed");
    }

    /// All text so far.
    pub fn said(&self) -> String {
        self.said.lock().expect("no panic").clone()
    }

    /// Waits for a text.
    pub fn wait_for(&self, words: &str) {
        self.wait_until(words, || self.said().contains(words));
    }

    /// Waits for a file in its folder.
    pub fn wait_for_file(&self, name: &str) {
        self.wait_until(name, || self.path(name).exists());
    }

    fn wait_until(&self, wanted: &str, is_there: impl Fn() -> bool) {
        let end = Instant::now() + LONGEST;
        while !is_there() {
            assert!(Instant::now() < end, "no {wanted:?} in {}", self.said());
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Ends the server. Returns all of its output and its exit status.
    pub fn end(mut self) -> (String, ExitStatus) {
        self.say("quit");
        let status = self.child.wait().expect("it ends");
        self.wait_for("times real time");
        (self.said(), status)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Path of the `footfall` program: the one that `FOOTFALL_PROGRAM` names, or a fresh build.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        if let Some(path) = std::env::var_os("FOOTFALL_PROGRAM") {
            return PathBuf::from(path);
        }
        let status = Command::new(env!("CARGO"))
            .current_dir(workspace())
            .args(["build", "--quiet", "--locked", "--package", "footfall"])
            .args(["--features", "all"])
            .status();
        assert!(status.expect("cargo starts").success());
        workspace().join("target/debug/footfall")
    })
}

/// Runs `footfall` in a folder. Returns its standard output and its messages.
pub fn footfall(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = Command::new(program())
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    let (printed, words) = (text(output.stdout), text(output.stderr));
    assert!(output.status.success(), "{arguments:?}: {printed}{words}");
    (printed, words)
}
