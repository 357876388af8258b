//! A foot at the end of a pseudo-terminal that uses slcan (Lawicel's ASCII protocol), as a
//! CAN adapter does.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use estimator_core::{
    ContactEstimate, Decision, LinearAcceleration, Phase, Probabilities, Timestamp, Vec3,
};
use rustix::fs::{Mode, OFlags};
use rustix::{pty, termios};
use wire::{BootCause, CanFrame, Counters, Event, Node, Settings};

/// A foot that runs until the process ends.
pub struct Foot {
    tty: PathBuf,
    /// Held open so that the foot's end never gets a hang-up.
    _slave: OwnedFd,
}

impl Foot {
    /// Path to which the master connects.
    pub fn tty(&self) -> &Path {
        &self.tty
    }
}

/// Starts a foot.
pub fn start() -> io::Result<Foot> {
    let ours = pty::openpt(pty::OpenptFlags::RDWR | pty::OpenptFlags::NOCTTY)?;
    pty::grantpt(&ours)?;
    pty::unlockpt(&ours)?;
    let name = pty::ptsname(&ours, Vec::new())?;
    let tty = PathBuf::from(name.to_string_lossy().into_owned());
    let slave = rustix::fs::open(&tty, OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
    // No echo, no line editing: bytes as they are.
    let mut attributes = termios::tcgetattr(&slave)?;
    attributes.make_raw();
    termios::tcsetattr(&slave, termios::OptionalActions::Now, &attributes)?;
    let output = File::from(ours);
    let input = output.try_clone()?;
    let (sender, commands) = mpsc::channel();
    thread::spawn(move || {
        for command in Lines(input) {
            if sender.send(command).is_err() {
                break;
            }
        }
    });
    thread::spawn(move || run(output, &commands));
    Ok(Foot { tty, _slave: slave })
}

/// Commands, each ended by a carriage return.
struct Lines(File);

impl Iterator for Lines {
    type Item = String;

    fn next(&mut self) -> Option<String> {
        let (mut line, mut byte) = (String::new(), [0]);
        loop {
            self.0.read_exact(&mut byte).ok()?;
            match byte[0] {
                b'\r' => return Some(line),
                other => line.push(char::from(other)),
            }
        }
    }
}

/// Frame in a command `tIIILDD…`.
fn parse(command: &str) -> Option<CanFrame> {
    let frame = command.strip_prefix('t')?;
    let id = u16::from_str_radix(frame.get(..3)?, 16).ok()?;
    let length: usize = frame.get(3..4)?.parse().ok()?;
    let data: Option<Vec<u8>> = (0..length)
        .map(|i| u8::from_str_radix(frame.get(4 + 2 * i..6 + 2 * i)?, 16).ok())
        .collect();
    CanFrame::new(id, &data?)
}

fn print(frame: &CanFrame) -> String {
    let data: String = frame
        .data()
        .iter()
        .map(|byte| format!("{byte:02X}"))
        .collect();
    format!("t{:03X}{}{data}\r", frame.id(), frame.data().len())
}

/// Period of the foot, and its shortest duration on the clock of this machine.
const TICK: Duration = Duration::from_millis(1);

/// Runs the board's part: a clock, a store, and estimates that never change. The clock counts ticks, so it stops while
/// the machine is busy or the master does not read.
fn run(mut output: File, commands: &Receiver<String>) {
    let mut now = Timestamp::default();
    let mut stored = Settings::default();
    let mut node = Node::new(stored.clone(), 0xC0FFEE);
    let mut open = false;
    let mut next = Instant::now();
    loop {
        let wait = next.saturating_duration_since(Instant::now());
        let mut frames = Vec::new();
        match commands.recv_timeout(wait) {
            Ok(command) => match command.as_bytes().first() {
                Some(b'O') => {
                    open = true;
                    frames.extend(node.boot(BootCause::PowerUp));
                }
                Some(b'C') => open = false,
                _ => {
                    if let Some(frame) = parse(&command) {
                        let outcome = node.receive(&frame, now);
                        frames.extend(outcome.reply);
                        match outcome.event {
                            Some(Event::Store) => {
                                stored = node.settings().clone();
                                frames.extend(node.finish(Ok(())));
                            }
                            Some(Event::Restore) => {
                                stored = Settings::default();
                                frames.extend(node.finish(Ok(())));
                            }
                            Some(Event::ResetCommunication | Event::ResetNode) => {
                                node.set_settings(stored.clone());
                                frames.extend(node.boot(BootCause::Commanded));
                            }
                            _ => {}
                        }
                    }
                }
            },
            Err(RecvTimeoutError::Timeout) => {
                next = Instant::now() + TICK;
                now = Timestamp::from_micros(now.as_micros() + TICK.as_micros() as u64);
                let estimate = ContactEstimate {
                    timestamp: now,
                    probabilities: Probabilities {
                        stable: 0.75,
                        tangential: 1.0,
                        vertical: 0.75,
                        ..Default::default()
                    },
                    decision: Decision::Stable,
                    phase: Phase::Stance,
                    linear_acceleration: LinearAcceleration(Vec3::new(0.5, -1.5, 2.5)),
                    ..Default::default()
                };
                node.tick(&estimate, 25.0, &Counters::default(), |frame| {
                    frames.push(frame);
                });
            }
            Err(RecvTimeoutError::Disconnected) => return,
        }
        if open {
            let text: String = frames.iter().map(print).collect();
            if output.write_all(text.as_bytes()).is_err() {
                return;
            }
        }
    }
}
