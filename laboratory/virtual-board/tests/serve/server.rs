//! The server with its feet, the `footfall` program, and folders for both.
//!
//! Time of the boards passes only while all programs wait, or while [`Server::run`] or a [`Holder`] lets it.

use std::cell::RefCell;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, Command, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use host_tests::committed::workspace;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

use crate::common::product_file;

/// Timeout of a wait, which ends a hang.
pub const LONGEST: Duration = Duration::from_secs(120);

/// Lifetime of a server, which ends a hang of a program that waits for it.
const LIFETIME: Duration = Duration::from_secs(1800);

/// Error output of a program, read only on demand. A read returns everything that the program has written by then.
pub struct Words {
    pipe: ChildStderr,
    bytes: Vec<u8>,
    has_ended: bool,
}

impl Words {
    pub fn new(pipe: ChildStderr) -> Self {
        let flags = fcntl_getfl(&pipe).expect("a pipe");
        fcntl_setfl(&pipe, flags | OFlags::NONBLOCK).expect("a pipe");
        Self { pipe, bytes: Vec::new(), has_ended: false }
    }

    /// All text so far.
    pub fn all(&mut self) -> String {
        let mut piece = [0; 4096];
        while !self.has_ended {
            match self.pipe.read(&mut piece) {
                Ok(0) => self.has_ended = true,
                Ok(count) => self.bytes.extend_from_slice(&piece[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => panic!("{error}"),
            }
        }
        String::from_utf8_lossy(&self.bytes).into_owned()
    }

    /// Returns whether the program has closed its output.
    pub const fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// Waits until `is_there` holds for all text so far. Returns the text.
    fn wait_until(&mut self, wanted: &str, is_there: impl Fn(&str) -> bool) -> String {
        loop {
            let said = self.all();
            if is_there(&said) {
                return said;
            }
            assert!(!self.has_ended, "no {wanted:?} in {said}");
            let longest = Timespec::try_from(LONGEST).expect("seconds");
            let ready = poll(&mut [PollFd::new(&self.pipe, PollFlags::IN)], Some(&longest));
            assert_ne!(ready, Ok(0), "no {wanted:?} in {said}");
        }
    }
}

/// A running server.
pub struct Server {
    child: Child,
    typed: ChildStdin,
    words: RefCell<Words>,
    /// Ends the thread that limits the lifetime.
    _alive: Sender<()>,
    /// Not below the target folder: the path of a socket has at most 107 bytes.
    folder: TempDir,
}

impl Server {
    /// Starts the server in lock step in a folder of its own, and waits until all sources are announced.
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_program(&product_file(), arguments)
    }

    /// Starts the server in real time.
    pub fn start_in_real_time(arguments: &[&str]) -> Self {
        Self::launch(&product_file(), arguments)
    }

    /// Starts the server in lock step with another program than the product.
    pub fn start_program(elf: &Path, arguments: &[&str]) -> Self {
        Self::launch(elf, &[&["--lock-step"], arguments].concat())
    }

    fn launch(elf: &Path, arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
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
        let (alive, is_alive) = channel();
        let pid = Pid::from_child(&child);
        thread::spawn(move || {
            if is_alive.recv_timeout(LIFETIME) == Err(RecvTimeoutError::Timeout) {
                // An error is ignored, because the server may just have ended.
                let _ = kill_process(pid, Signal::KILL);
            }
        });
        let words = Words::new(child.stderr.take().expect("piped"));
        let typed = child.stdin.take().expect("piped");
        let mut sources = BufReader::new(child.stdout.take().expect("piped")).lines();
        let bus = sources.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("bus")));
        let server = Self { child, typed, words: words.into(), _alive: alive, folder };
        assert!(bus.is_some(), "no bus: {}", server.error_output());
        server
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
        footfall(self.folder(), &all).0
    }

    /// Folder of the server.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Path of a file in its folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    /// Types a line.
    pub fn type_line(&mut self, line: &str) {
        writeln!(self.typed, "{line}").expect("it reads what is typed");
    }

    /// Types an order to a foot, such as `FL: tap`, and waits until it is obeyed. Returns the time of the boards, s.
    pub fn order(&mut self, order: &str) -> f64 {
        let before = self.error_output().len();
        self.type_line(order);
        let said = self.wait_for_new(before, order);
        let line = said[before..].lines().find(|line| line.ends_with(order));
        let seconds = line.and_then(|line| line.split_whitespace().next());
        seconds.and_then(|s| s.parse().ok()).expect("a time")
    }

    /// Types an order to a foot for a time from now, ms, and waits until it is planned.
    pub fn plan(&mut self, from_now_ms: u64, order: &str) {
        let ms = self.now_ms() + from_now_ms;
        let before = self.error_output().len();
        self.type_line(&format!("@{ms} {order}"));
        self.wait_for_new(before, &format!("planned for {:.3} s  {order}", ms as f64 * 1e-3));
    }

    /// The time of the boards, which no other program may let pass, ms.
    pub fn now_ms(&self) -> u64 {
        self.hold("bus.slcan").now_ms()
    }

    /// Lets time pass while no other program has a line open, ms.
    pub fn run(&self, ms: u64) {
        let mut holder = self.hold("bus.slcan");
        let end_ms = holder.now_ms() + ms;
        while holder.now_ms() < end_ms {
            holder.run(end_ms - holder.now_ms());
        }
    }

    /// Opens a line, so that no time passes except in [`Holder::run`].
    pub fn hold(&self, line: &str) -> Holder {
        let stream = UnixStream::connect(self.path(line)).expect("a socket");
        let mut holder = Holder { stream, us: 0 };
        holder.run(0);
        holder
    }

    /// All text so far.
    pub fn error_output(&self) -> String {
        self.words.borrow_mut().all()
    }

    /// Waits for a text.
    pub fn wait_for(&self, words: &str) {
        self.wait_for_new(0, words);
    }

    /// Waits for a text after the first `before` bytes. Returns all text.
    pub fn wait_for_new(&self, before: usize, words: &str) -> String {
        let mut all = self.words.borrow_mut();
        all.wait_until(words, |said| said[before..].contains(words))
    }

    /// Ends the server, which has to succeed. Returns all of its output.
    pub fn end(mut self) -> String {
        self.type_line("quit");
        let status = self.child.wait().expect("it ends");
        let said = self.error_output();
        assert!(status.success(), "{said}");
        said
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A line in lock step that a test has open.
pub struct Holder {
    stream: UnixStream,
    us: u64,
}

impl Holder {
    /// Lets time pass until there is output on the line, at most `ms`. Returns the output.
    pub fn run(&mut self, ms: u64) -> Vec<u8> {
        let us = u32::try_from(ms * 1000).expect("an hour at most");
        let request = [&b"R"[..], &us.to_le_bytes()].concat();
        self.stream.write_all(&request).expect("sent");
        let (mut time, mut length) = ([0; 8], [0; 4]);
        self.stream.read_exact(&mut time).expect("an answer");
        self.stream.read_exact(&mut length).expect("an answer");
        let mut output = vec![0; u32::from_le_bytes(length) as usize];
        self.stream.read_exact(&mut output).expect("the output");
        self.us = u64::from_le_bytes(time);
        output
    }

    /// The time of the boards, ms.
    pub const fn now_ms(&self) -> u64 {
        self.us / 1000
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
            .args(["build", "--quiet", "--locked", "--package", "footfall-program"])
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
