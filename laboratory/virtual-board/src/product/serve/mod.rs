//! Boards at the speed of real time behind pseudo-terminals, or in lock step with programs behind sockets: a serial line
//! for each foot, and their bus behind an slcan adapter.
//!
//! | step, each millisecond | module |
//! |---|---|
//! | typed lines become orders to feet | `typed` |
//! | in lock step: wait until each program waits | [`lock_step`] |
//! | bytes of programs arrive from terminals or sockets | [`port`] |
//! | bytes for the adapter become frames | [`adapter`] |
//! | frames of all nodes are put in order; the boards run | [`robot`] |
//! | each board runs in its thread; feet walk, and hands hold them | `foot`, `hands`, [`gait::EndlessGait`] |
//! | bytes and frames are sent to the programs | [`adapter`], [`port`] |
//! | in real time: wait until the millisecond is over | [`pace`] |

pub mod adapter;
mod foot;
mod hands;
pub mod lock_step;
pub mod output;
pub mod pace;
pub mod port;
pub mod robot;
mod typed;

use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use thiserror::Error;
use wire::Foot as Position;

use crate::emulator::time::PER_SECOND;
use crate::product::fault;
use adapter::EmulatedAdapter;
pub use foot::BoardPrograms;
use foot::Order;
use lock_step::{Change, Turn};
use output::Sent;
use pace::{Pace, VirtualSpeed};
use port::{Links, Port};
use robot::{BoardRobot, RobotOptions, Stopped};
use typed::{Command, HELP};

/// Options of a server.
#[derive(Clone)]
pub struct ServeOptions {
    /// The robot.
    pub robot: RobotOptions,
    /// Directory for links to the terminals, or for the sockets.
    pub links: Option<PathBuf>,
    /// Duration, ms; `None` to run until the end is requested.
    pub ms: Option<u64>,
    /// Passage of virtual time.
    pub passage: Passage,
}

/// Passage of virtual time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passage {
    /// At a speed, behind pseudo-terminals.
    Speed(VirtualSpeed),
    /// In lock step with programs, behind sockets in the directory of the links.
    LockStep,
}

/// Serves feet with these programs in their boards' flash until the duration has passed, `quit` is typed, or `stop` is set.
///
/// # Errors
/// If a terminal or a link cannot be created, or a foot fails.
pub fn serve(
    programs: impl Into<BoardPrograms>,
    options: &ServeOptions,
    typed: &Receiver<String>,
    stop: &AtomicBool,
    report: &mut dyn FnMut(Note),
) -> Result<ServeSummary, ServeError> {
    let robot = BoardRobot::start(programs, &options.robot)?;
    let mut links = Links::default();
    let mut sources = Vec::new();
    let mut open = |name, kind| -> Result<Port, ServeError> {
        let (port, path) = Port::open(options, &mut links, &format!("{name}.{kind}"))?;
        sources.push((name, format!("{kind}:{}", path.display())));
        Ok(port)
    };
    let mut serial = Vec::new();
    for position in robot.positions() {
        let name = position.name();
        serial.push((name, open(name, "uart")?));
    }
    let slcan = open(BUS, "slcan")?;
    let mut server = Server {
        robot,
        serial,
        slcan,
        adapter: EmulatedAdapter::default(),
        planned: Vec::new(),
        report,
    };
    for (name, source) in sources {
        (server.report)(Note::Source(name, source));
    }
    (server.report)(Note::Ready);
    let mut pace = Pace::new(match options.passage {
        Passage::Speed(speed) => speed,
        Passage::LockStep => VirtualSpeed::Max,
    });
    while !stop.load(Ordering::Relaxed) && options.ms.is_none_or(|end| server.robot.ms < end) {
        if typed.try_iter().any(|line| server.execute(&line)) {
            break;
        }
        if server.turn()? == Turn::Programs {
            continue;
        }
        server.give_planned();
        server.read_programs()?;
        server.run_boards()?;
        pace.wait(server.robot.ms);
        if let Some(behind) = pace.report() {
            let behind = behind.as_secs_f64();
            server.report(format!("slower than real time: {behind:.1} s lost so far"));
        }
    }
    let lines = server.serial.iter();
    let lines = lines.map(|(name, port)| (format!("{name}.uart"), port.lost()));
    let bus = (format!("{BUS}.slcan"), server.slcan.lost());
    Ok(ServeSummary {
        ms: server.robot.ms,
        took: pace.elapsed(),
        behind: pace.lost,
        lost: lines.chain([bus]).collect(),
        lost_on_bus: server.robot.bus.lost,
    })
}

/// Statistics of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct ServeSummary {
    /// Virtual time, ms.
    pub ms: u64,
    /// Real time.
    pub took: Duration,
    /// Real time for which virtual time stood still because the computer was too slow.
    pub behind: Duration,
    /// Bytes lost by readers, with the name of each terminal.
    pub lost: Vec<(String, u64)>,
    /// Frames discarded because the queue for the bus was full.
    pub lost_on_bus: u64,
}

/// A message to the user.
pub enum Note<'a> {
    /// The serial line of a foot, or the bus: its name, and the source in the notation of this workspace's
    /// programs.
    Source(&'a str, String),
    /// All lines are open and all feet run.
    Ready,
    /// Text for the user.
    Text(String),
}

/// Reason why feet cannot be served.
#[derive(Debug, Error)]
pub enum ServeError {
    /// Error of a terminal or a socket.
    #[error("a line: {0}")]
    Terminal(#[from] io::Error),
    /// Lock step without a directory for its sockets.
    #[error("lock step needs a directory for its sockets")]
    NoFolder,
    /// Error of a link to a terminal, or of a socket.
    #[error("{path}: {1}", path = .0.display())]
    Link(PathBuf, io::Error),
    /// Failure of a foot.
    #[error(transparent)]
    Foot(#[from] Stopped),
}

/// A millisecond, in units of [`time`](crate::emulator::time).
const MILLISECOND: u64 = PER_SECOND / 1000;

/// In lock step, maximum delay until a typed line or a stop is noticed while time stands still.
const NOTICE: Duration = Duration::from_millis(5);

/// Name of the bus.
const BUS: &str = "bus";

/// A server of feet.
struct Server<'a> {
    robot: BoardRobot,
    /// Serial lines, one per foot.
    serial: Vec<(&'static str, Port)>,
    slcan: Port,
    adapter: EmulatedAdapter,
    /// Orders to be given, with their times, ms.
    planned: Vec<(u64, Option<Position>, Order)>,
    report: &'a mut dyn FnMut(Note),
}

impl Server<'_> {
    /// Executes a typed line. Returns whether it requests the end.
    fn execute(&mut self, line: &str) -> bool {
        match typed::parse(line) {
            Ok(Some(Command::Order(foot, order))) => self.give(foot, order),
            Ok(Some(Command::Planned(ms, foot, order))) => self.plan(ms, foot, order),
            Ok(Some(Command::Faults)) => self.report(fault::names()),
            Ok(Some(Command::Help)) => self.report(HELP.trim_end().to_owned()),
            Ok(Some(Command::Quit)) => return true,
            Ok(None) => {}
            Err(error) => self.report(format!("error: {error}")),
        }
        false
    }

    /// Gives an order to a foot, or to all.
    fn give(&mut self, foot: Option<Position>, order: Order) {
        let whom = foot.map_or("all feet", Position::name);
        let text = if self.robot.order(foot, order) {
            format!("{:.3} s  {whom}: {order}", self.now_s())
        } else {
            format!("error: the robot has no foot {whom}")
        };
        self.report(text);
    }

    /// Plans an order for a time.
    fn plan(&mut self, ms: u64, foot: Option<Position>, order: Order) {
        let whom = foot.map_or("all feet", Position::name);
        if foot.is_some_and(|foot| !self.has(foot)) {
            return self.report(format!("error: the robot has no foot {whom}"));
        }
        self.planned.push((ms, foot, order));
        self.report(format!("planned for {:.3} s  {whom}: {order}", ms as f64 * 1e-3));
    }

    /// Returns whose turn it is; in real time, always the boards' turn.
    fn turn(&mut self) -> io::Result<Turn> {
        let serial = self.serial.iter_mut().map(|(name, port)| (*name, "uart", port));
        let ports = serial.chain([(BUS, "slcan", &mut self.slcan)]);
        let (mut names, mut lines) = (Vec::new(), Vec::new());
        for (name, kind, port) in ports {
            if let Port::LockStep(line) = port {
                names.push((name, kind));
                lines.push(line);
            }
        }
        if lines.is_empty() {
            return Ok(Turn::Boards);
        }
        let now_s = self.robot.ms as f64 * 1e-3;
        let report = &mut *self.report;
        let mut changed = |line: usize, change| {
            let (name, kind) = names[line];
            let change = match change {
                Change::Opened => "opened",
                Change::Closed => "closed",
            };
            report(Note::Text(format!("{now_s:.3} s  {name}.{kind}: {change}")));
        };
        lock_step::turn(&mut lines, self.robot.ms * 1000, NOTICE, &mut changed)
    }

    /// Gives the planned orders that are due.
    fn give_planned(&mut self) {
        let now_ms = self.robot.ms;
        let due: Vec<_> = self.planned.extract_if(.., |(ms, ..)| *ms <= now_ms).collect();
        for (_, foot, order) in due {
            self.give(foot, order);
        }
    }

    /// Reads the input of programs.
    fn read_programs(&mut self) -> io::Result<()> {
        for (index, (_, port)) in self.serial.iter_mut().enumerate() {
            let bytes = port.read(self.robot.serial_room(index))?;
            self.robot.send_serial(index, &bytes);
        }
        // Reads no more than the bus accepts: the rest waits, as with an adapter.
        while self.robot.has_room_for_host() {
            let bytes = self.slcan.read(1)?;
            let Some(&byte) = bytes.first() else { break };
            let reaction = self.adapter.push(byte);
            if let Some((frame, bit_rate)) = reaction.frame {
                self.robot.send(frame, bit_rate);
            }
            self.slcan.write(&reaction.answer)?;
        }
        Ok(())
    }

    /// Runs one millisecond and forwards its output.
    fn run_boards(&mut self) -> Result<(), ServeError> {
        let output = self.robot.step()?;
        for ((_, port), bytes) in self.serial.iter_mut().zip(&output.bytes) {
            port.write(bytes)?;
            port.flush()?;
        }
        let host = self.robot.host();
        let others = output.carried.iter();
        for carried in others.filter(|carried| carried.node != host) {
            if let Some(line) = self.adapter.line_for(carried)
                && self.slcan.write(&line)? == Sent::Lost
            {
                self.adapter.has_lost = true;
            }
        }
        self.slcan.flush()?;
        for (foot, cause) in output.resets {
            let at_s = self.now_s();
            let text = format!("{at_s:.3} s  {}: reset by {}", foot.name(), cause.name());
            self.report(text);
        }
        Ok(())
    }

    /// Passes a message to the user.
    fn report(&mut self, message: String) {
        (self.report)(Note::Text(message));
    }

    /// Returns whether the robot has a foot.
    fn has(&self, foot: Position) -> bool {
        self.robot.positions().any(|known| known == foot)
    }

    /// Time of the boards, s.
    fn now_s(&self) -> f64 {
        self.robot.ms as f64 * 1e-3
    }
}
