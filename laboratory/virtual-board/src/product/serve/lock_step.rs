//! A line in lock step: a Unix socket in the place of a terminal. The boards' time passes only while each program that
//! has a line open waits for an answer, so that no program is too slow.
//!
//! A program sends a request, and waits for its answer before the next:
//!
//! | request | bytes |
//! |---|---|
//! | write: bytes to the line, at most 65536 | `W`, their number, the bytes |
//! | run: let time pass until there is output on the line, at most for a duration in µs | `R`, the duration |
//! | park: until the next request, time may pass while other lines wait | `P`, 0 |
//!
//! | answer | bytes |
//! |---|---|
//! | the boards' time in µs; output, empty after a write | the time, the number of bytes, the bytes |
//!
//! The time has 8 bytes, the other numbers 4, the lowest first. Time passes in steps of a millisecond. It also passes in a
//! write that finds more than 4096 bytes waiting, until they are fewer. A line has one program at a time; another one is
//! disconnected. Programs are answered one after the other: each waits again, or has closed its line, before the next one
//! is answered. A park is answered at once: a program that has several lines open parks all but the one that it uses. With the
//! same orders and requests, a run repeats exactly.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::output::{Output, Sent};

/// Maximum number of bytes of a write.
const LONGEST_WRITE: usize = 65_536;

/// Maximum number of bytes on their way to a board when a write is answered.
const MOST_COMING: usize = 4096;

/// Length of a request without its bytes.
const HEAD: usize = 5;

/// A line.
#[derive(Debug)]
pub struct LockStepLine {
    listener: UnixListener,
    program: Option<Program>,
    /// Bytes on their way to the board, or the adapter.
    coming: VecDeque<u8>,
    /// Bytes for the program.
    pub(super) output: Output,
}

/// A program that has the line open.
#[derive(Debug)]
struct Program {
    stream: UnixStream,
    /// Part of a request.
    received: Vec<u8>,
    /// Request to be answered; `None` while the program computes.
    request: Option<Request>,
}

#[derive(Clone, Copy, Debug)]
enum Request {
    Write,
    /// Ends with output, or at this time, µs.
    Run(u64),
    /// Ends with the next request.
    Parked,
}

/// Change of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// A program has opened it.
    Opened,
    /// The program has closed it.
    Closed,
}

/// Whose turn it is.
#[derive(Debug, PartialEq, Eq)]
pub enum Turn {
    /// Each program waits, so the boards' time passes.
    Boards,
    /// A program computes, or no program is connected.
    Programs,
}

/// Accepts programs and requests on all lines, waits up to `longest` while it is the programs' turn, and answers the next
/// due request. `now_us` is the boards' time; `changed` is called with the index of a line that is opened or closed.
///
/// # Errors
/// If a socket fails.
pub fn turn(
    lines: &mut [&mut LockStepLine],
    now_us: u64,
    longest: Duration,
    changed: &mut dyn FnMut(usize, Change),
) -> io::Result<Turn> {
    let longest = if is_turn_of_boards(lines) { Duration::ZERO } else { longest };
    if is_ready(lines, longest)? {
        for (index, line) in lines.iter_mut().enumerate() {
            if line.receive(now_us) == Some(Change::Closed) {
                changed(index, Change::Closed);
            }
            if line.accept()? {
                changed(index, Change::Opened);
            }
        }
    }
    if !is_turn_of_boards(lines) {
        return Ok(Turn::Programs);
    }
    let due = lines.iter_mut().position(|line| line.is_due(now_us));
    let Some(index) = due else {
        return Ok(Turn::Boards);
    };
    if lines[index].answer(now_us) == Some(Change::Closed) {
        changed(index, Change::Closed);
    }
    Ok(Turn::Programs)
}

fn is_turn_of_boards(lines: &[&mut LockStepLine]) -> bool {
    let programs = || lines.iter().filter_map(|line| line.program.as_ref());
    let is_waiting = |program: &Program| !matches!(program.request, None | Some(Request::Parked));
    programs().any(is_waiting) && programs().all(|program| program.request.is_some())
}

/// Waits for a connection, a request or an end of a program. Returns whether there is one.
fn is_ready(lines: &[&mut LockStepLine], longest: Duration) -> io::Result<bool> {
    let mut sockets = Vec::new();
    for line in lines {
        sockets.push(PollFd::new(&line.listener, PollFlags::IN));
        if let Some(program) = &line.program {
            sockets.push(PollFd::new(&program.stream, PollFlags::IN));
        }
    }
    let longest = Timespec::try_from(longest).map_err(|_| ErrorKind::InvalidInput)?;
    match poll(&mut sockets, Some(&longest)) {
        Ok(count) => Ok(count > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

impl LockStepLine {
    /// Creates the line of a socket.
    ///
    /// # Errors
    /// If the socket cannot be used.
    pub fn new(listener: UnixListener) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { listener, program: None, coming: VecDeque::new(), output: Output::default() })
    }

    /// Takes bytes of the program, at most `most`.
    pub fn read(&mut self, most: usize) -> Vec<u8> {
        let count = self.coming.len().min(most);
        self.coming.drain(..count).collect()
    }

    /// Writes bytes to the program, all or none.
    pub fn write(&mut self, bytes: &[u8]) -> Sent {
        if self.program.is_none() {
            return Sent::Taken;
        }
        self.output.push(bytes)
    }

    /// Accepts a program, and disconnects others. Returns whether there is a new one.
    fn accept(&mut self) -> io::Result<bool> {
        let mut is_new = false;
        loop {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(is_new),
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            if self.program.is_none() {
                stream.set_nonblocking(true)?;
                self.program = Some(Program { stream, received: Vec::new(), request: None });
                is_new = true;
            }
        }
    }

    /// Reads from the program. One that has ended, or does not follow the protocol, is disconnected.
    fn receive(&mut self, now_us: u64) -> Option<Change> {
        let program = self.program.as_mut()?;
        let mut piece = [0; 4096];
        loop {
            match program.stream.read(&mut piece) {
                Ok(count @ 1..) if matches!(program.request, None | Some(Request::Parked)) => {
                    program.received.extend_from_slice(&piece[..count]);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return None,
                _ => return Some(self.disconnect()),
            }
            let Some([kind, number @ ..]) = program.received.first_chunk::<HEAD>() else {
                continue;
            };
            let number = u32::from_le_bytes(*number);
            let (request, length) = match kind {
                b'W' => (Request::Write, number as usize),
                b'R' => (Request::Run(now_us + u64::from(number)), 0),
                b'P' => (Request::Parked, 0),
                _ => return Some(self.disconnect()),
            };
            let excess = program.received.len().checked_sub(HEAD + length);
            if length > LONGEST_WRITE || excess.is_some_and(|excess| excess > 0) {
                return Some(self.disconnect());
            }
            if excess.is_some() {
                self.coming.extend(program.received.drain(..).skip(HEAD));
                program.request = Some(request);
                if let Request::Parked = request
                    && program.answer(now_us, &[]).is_err()
                {
                    return Some(self.disconnect());
                }
            }
        }
    }

    /// Returns whether the request is to be answered.
    fn is_due(&self, now_us: u64) -> bool {
        let request = self.program.as_ref().and_then(|program| program.request);
        request.is_some_and(|request| match request {
            Request::Write => self.coming.len() <= MOST_COMING,
            Request::Run(end_us) => !self.output.waiting.is_empty() || end_us <= now_us,
            Request::Parked => false,
        })
    }

    fn answer(&mut self, now_us: u64) -> Option<Change> {
        let program = self.program.as_mut()?;
        let output = match program.request.take() {
            Some(Request::Run(_)) => std::mem::take(&mut self.output.waiting),
            _ => Vec::new(),
        };
        match program.answer(now_us, &output) {
            Ok(()) => None,
            Err(_) => Some(self.disconnect()),
        }
    }

    fn disconnect(&mut self) -> Change {
        self.program = None;
        self.output.waiting.clear();
        Change::Closed
    }
}

impl Program {
    /// Sends an answer.
    fn answer(&mut self, now_us: u64, output: &[u8]) -> io::Result<()> {
        let length = output.len() as u32;
        let answer = [&now_us.to_le_bytes()[..], &length.to_le_bytes(), output].concat();
        write_all(&mut self.stream, &answer)
    }
}

/// Writes all bytes, also beyond the buffer of the system: the program reads them.
fn write_all(stream: &mut UnixStream, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match stream.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                poll(&mut [PollFd::new(&*stream, PollFlags::OUT)], None)?;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines with `programs` programs each. The first program of a line owns it.
    fn lines(name: &str, count: usize, programs: usize) -> (Vec<LockStepLine>, Vec<UnixStream>) {
        let (mut lines, mut ends) = (Vec::new(), Vec::new());
        for index in 0..count {
            let name = format!("footfall-{}-{name}-{index}", std::process::id());
            let path = std::env::temp_dir().join(name);
            let listener = UnixListener::bind(&path).expect("a socket");
            for _ in 0..programs {
                ends.push(UnixStream::connect(&path).expect("connected"));
            }
            std::fs::remove_file(&path).expect("removed");
            lines.push(LockStepLine::new(listener).expect("a line"));
        }
        (lines, ends)
    }

    fn turn_at(lines: &mut [LockStepLine], now_us: u64) -> (Turn, Vec<(usize, Change)>) {
        let mut changes = Vec::new();
        let mut lines: Vec<_> = lines.iter_mut().collect();
        let mut changed = |index, change| changes.push((index, change));
        let turn = turn(&mut lines, now_us, Duration::ZERO, &mut changed).expect("sockets");
        (turn, changes)
    }

    fn ask(stream: &mut UnixStream, kind: u8, number: u32, bytes: &[u8]) {
        let [a, b, c, d] = number.to_le_bytes();
        let request = [&[kind, a, b, c, d], bytes].concat();
        stream.write_all(&request).expect("sent");
    }

    fn answer(stream: &mut UnixStream) -> (u64, Vec<u8>) {
        let (mut time, mut length) = ([0; 8], [0; 4]);
        stream.read_exact(&mut time).expect("an answer");
        stream.read_exact(&mut length).expect("an answer");
        let mut output = vec![0; u32::from_le_bytes(length) as usize];
        stream.read_exact(&mut output).expect("its bytes");
        (u64::from_le_bytes(time), output)
    }

    #[test]
    fn time_passes_while_each_program_waits() {
        let (mut lines, mut programs) = lines("wait", 2, 1);
        let opened = vec![(0, Change::Opened), (1, Change::Opened)];
        assert_eq!(turn_at(&mut lines, 0), (Turn::Programs, opened));
        ask(&mut programs[0], b'R', 3_000, &[]);
        assert_eq!(turn_at(&mut lines, 0).0, Turn::Programs, "one computes");
        ask(&mut programs[1], b'R', 1_000, &[]);
        assert_eq!(turn_at(&mut lines, 0).0, Turn::Boards);
        assert_eq!(turn_at(&mut lines, 1_000).0, Turn::Programs);
        assert_eq!(answer(&mut programs[1]), (1_000, Vec::new()));
        drop(programs.pop());
        let closed = vec![(1, Change::Closed)];
        assert_eq!(turn_at(&mut lines, 1_000), (Turn::Boards, closed));
        assert_eq!(lines[0].write(b"out"), Sent::Taken);
        assert_eq!(lines[1].write(b"lost"), Sent::Taken);
        assert_eq!(turn_at(&mut lines, 2_000).0, Turn::Programs);
        assert_eq!(answer(&mut programs[0]), (2_000, b"out".to_vec()));
    }

    #[test]
    fn programs_are_answered_one_after_the_other() {
        let (mut lines, mut programs) = lines("order", 2, 1);
        turn_at(&mut lines, 0);
        for program in &mut programs {
            ask(program, b'R', 0, &[]);
        }
        turn_at(&mut lines, 0);
        answer(&mut programs[0]);
        assert_eq!(turn_at(&mut lines, 0).0, Turn::Programs);
        programs[1].set_nonblocking(true).expect("set");
        assert!(programs[1].read(&mut [0]).is_err(), "the first computes");
        ask(&mut programs[0], b'R', 5, &[]);
        turn_at(&mut lines, 0);
        programs[1].set_nonblocking(false).expect("set");
        answer(&mut programs[1]);
    }

    #[test]
    fn time_passes_for_one_of_the_lines_of_a_program() {
        let (mut lines, mut programs) = lines("parked", 2, 1);
        turn_at(&mut lines, 0);
        for program in &mut programs {
            ask(program, b'P', 0, &[]);
        }
        assert_eq!(turn_at(&mut lines, 0).0, Turn::Programs, "none waits");
        assert!(programs.iter_mut().all(|program| answer(program) == (0, Vec::new())));
        ask(&mut programs[1], b'R', 1_000, &[]);
        assert_eq!(turn_at(&mut lines, 0).0, Turn::Boards);
        assert_eq!(lines[0].write(b"out"), Sent::Taken);
        assert_eq!(turn_at(&mut lines, 1_000).0, Turn::Programs);
        assert_eq!(answer(&mut programs[1]), (1_000, Vec::new()));
        ask(&mut programs[1], b'P', 0, &[]);
        ask(&mut programs[0], b'R', 1_000, &[]);
        turn_at(&mut lines, 1_000);
        assert_eq!(answer(&mut programs[0]), (1_000, b"out".to_vec()));
    }

    #[test]
    fn writes_wait_for_room_and_long_ones_disconnect() {
        let (mut lines, mut programs) = lines("room", 1, 1);
        turn_at(&mut lines, 0);
        ask(&mut programs[0], b'W', 5_000, &[7; 5_000]);
        while lines[0].coming.is_empty() {
            turn_at(&mut lines, 0);
        }
        assert_eq!(turn_at(&mut lines, 0).0, Turn::Boards, "no room");
        assert_eq!(lines[0].read(1_000), [7; 1_000]);
        assert_eq!(turn_at(&mut lines, 1_000).0, Turn::Programs);
        assert_eq!(answer(&mut programs[0]), (1_000, Vec::new()));
        ask(&mut programs[0], b'W', 65_537, &[]);
        assert_eq!(turn_at(&mut lines, 1_000).1, [(0, Change::Closed)]);
        assert_eq!(lines[0].read(9_999).len(), 4_000, "they were sent before");
    }

    #[test]
    fn second_program_is_disconnected_and_unread_output_is_limited() {
        let (mut lines, mut programs) = lines("second", 1, 2);
        turn_at(&mut lines, 0);
        assert_eq!(programs[1].read(&mut [0]).expect("its end"), 0);
        while lines[0].write(&[7; 1000]) == Sent::Taken {}
        assert_eq!((lines[0].output.lost, lines[0].output.waiting.len()), (1000, 65_000));
        ask(&mut programs[0], b'R', 1, &[]);
        turn_at(&mut lines, 0);
        assert_eq!(answer(&mut programs[0]).1.len(), 65_000);
    }
}
