//! Boards at the speed of real time behind pseudo-terminals: a serial line for each foot, and their bus
//! behind an slcan adapter.
//!
//! | step, each millisecond | where |
//! |---|---|
//! | lines that were typed become orders | `commands` |
//! | bytes of programs come from the terminals | [`terminal`] |
//! | those of the adapter become frames | [`adapter`], [`lawicel`] |
//! | frames of all nodes are put in order | [`bus`] |
//! | the boards run, each in a thread; feet walk, and hands hold them | [`robot`], `foot`, [`gait::EndlessGait`], `hands` |
//! | bytes and frames go out | [`terminal`], [`adapter`] |
//! | wait until the millisecond is over | [`pace`] |

pub mod adapter;
pub mod bus;
mod commands;
mod foot;
mod hands;
pub mod lawicel;
mod links;
pub mod pace;
pub mod robot;
pub mod terminal;

use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use thiserror::Error;
use wire::Foot as Position;

use crate::emulator::time::{PER_SECOND, to_us};
use crate::product::fault::{self, SelectedFault};
use adapter::EmulatedAdapter;
pub use commands::fault_at;
use commands::{Command, HELP};
pub use foot::BoardPrograms;
use foot::Order;
use links::Links;
use pace::{Pace, VirtualSpeed};
use robot::{BoardRobot, RobotOptions, Stopped};
use terminal::{Sent, Terminal};

const MILLISECOND: u64 = PER_SECOND / 1000;

/// A planned fault: the foot, or `None` for all, the fault, and its time, ms.
pub type Planned = (Option<Position>, SelectedFault, u64);

/// Options of a server.
#[derive(Clone)]
pub struct ServeOptions {
    /// The robot.
    pub robot: RobotOptions,
    /// Directory for links to the terminals.
    pub links: Option<PathBuf>,
    /// Planned faults.
    pub faults: Vec<Planned>,
    /// Duration, ms; `None` to run until the end is requested.
    pub ms: Option<u64>,
    /// Speed of virtual time.
    pub speed: VirtualSpeed,
}

/// Reason why feet cannot be served.
#[derive(Debug, Error)]
pub enum ServeError {
    /// Error of a terminal.
    #[error("a pseudo-terminal: {0}")]
    Terminal(#[from] io::Error),
    /// Error of a link to a terminal.
    #[error("{path}: {1}", path = .0.display())]
    Link(PathBuf, io::Error),
    /// Failure of a foot.
    #[error(transparent)]
    Foot(#[from] Stopped),
    /// A fault is planned for a foot that does not exist.
    #[error("the robot has no foot {}", .0.name())]
    NoSuchFoot(Position),
}

/// A message to the user.
pub enum Note<'a> {
    /// The serial line of a foot, or the bus: its name, and the source in the notation of this workspace's
    /// programs.
    Source(&'a str, String),
    /// All terminals are open and all feet run.
    Ready,
    /// Text.
    Words(String),
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

/// Name of the bus.
const BUS: &str = "bus";

/// A server of feet.
struct Server<'a> {
    robot: BoardRobot,
    /// Serial lines, one per foot.
    serial: Vec<(&'static str, Terminal)>,
    slcan: Terminal,
    adapter: EmulatedAdapter,
    tell: &'a mut dyn FnMut(Note),
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
    tell: &mut dyn FnMut(Note),
) -> Result<ServeSummary, ServeError> {
    let robot = BoardRobot::start(programs, &options.robot)?;
    let mut serial = Vec::new();
    for position in robot.positions() {
        serial.push((position.name(), Terminal::open()?));
    }
    let mut server = Server {
        robot,
        serial,
        slcan: Terminal::open()?,
        adapter: EmulatedAdapter::default(),
        tell,
    };
    for foot in options.faults.iter().filter_map(|(foot, ..)| *foot) {
        if !server.robot.positions().any(|known| known == foot) {
            return Err(ServeError::NoSuchFoot(foot));
        }
    }
    let mut links = Links::default();
    server.announce(options, &mut links)?;
    let mut pace = Pace::new(options.speed);
    while !stop.load(Ordering::Relaxed) && options.ms.is_none_or(|end| server.robot.ms < end) {
        let ms = server.robot.ms;
        for &(foot, fault, _) in options.faults.iter().filter(|(.., at)| *at == ms) {
            server.order(foot, Order::Fault(fault));
        }
        if typed.try_iter().any(|line| server.obey(&line)) {
            break;
        }
        server.take_in()?;
        server.run()?;
        pace.wait(server.robot.ms);
        if let Some(behind) = pace.report() {
            let behind = behind.as_secs_f64();
            server.report(format!("slower than real time: {behind:.1} s lost so far"));
        }
    }
    let lines = server.serial.iter();
    let lines = lines.map(|(name, terminal)| (format!("{name}.uart"), terminal.lost));
    let bus = (format!("{BUS}.slcan"), server.slcan.lost);
    Ok(ServeSummary {
        ms: server.robot.ms,
        took: pace.elapsed(),
        behind: pace.lost,
        lost: lines.chain([bus]).collect(),
        lost_on_bus: server.robot.bus.lost,
    })
}

impl Server<'_> {
    /// Passes a message to the user.
    fn report(&mut self, message: String) {
        (self.tell)(Note::Words(message));
    }

    /// Reports the sources.
    fn announce(&mut self, options: &ServeOptions, links: &mut Links) -> Result<(), ServeError> {
        let serial = self.serial.iter();
        let serial = serial.map(|(name, terminal)| (*name, "uart", terminal));
        for (name, kind, terminal) in serial.chain([(BUS, "slcan", &self.slcan)]) {
            let path = match &options.links {
                Some(folder) => links.add(folder, &format!("{name}.{kind}"), &terminal.path)?,
                None => terminal.path.clone(),
            };
            (self.tell)(Note::Source(name, format!("{kind}:{}", path.display())));
        }
        (self.tell)(Note::Ready);
        Ok(())
    }

    /// Executes a typed line. Returns whether it requests the end.
    fn obey(&mut self, line: &str) -> bool {
        match commands::parse(line) {
            Ok(Some(Command::Order(foot, order))) => self.order(foot, order),
            Ok(Some(Command::Faults)) => self.report(fault::names()),
            Ok(Some(Command::Help)) => self.report(HELP.trim_end().to_owned()),
            Ok(Some(Command::Quit)) => return true,
            Ok(None) => {}
            Err(error) => self.report(format!("error: {error}")),
        }
        false
    }

    fn order(&mut self, foot: Option<Position>, order: Order) {
        let whom = foot.map_or("all feet", Position::name);
        let what = match order {
            Order::Gait(gait) => format!("gait {gait}"),
            Order::Fault(fault) => format!("fault {}", fault.scenario.name),
            Order::Hold(side) => format!("hold {}", side.name()),
            Order::Tap => "tap".to_owned(),
            Order::PowerCycle => "power-cycle".to_owned(),
        };
        let words = match self.robot.order(foot, order) {
            true => format!("{:.3} s  {whom}: {what}", self.robot.ms as f64 * 1e-3),
            false => format!("error: the robot has no foot {whom}"),
        };
        self.report(words);
    }

    /// Reads the input of programs from the terminals.
    fn take_in(&mut self) -> io::Result<()> {
        for (index, (_, terminal)) in self.serial.iter_mut().enumerate() {
            let bytes = terminal.read(self.robot.serial_room(index))?;
            self.robot.send_serial(index, &bytes);
        }
        // Reads no more than the bus accepts: the rest waits in the terminal, as with an adapter.
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
    fn run(&mut self) -> Result<(), ServeError> {
        let happened = self.robot.step()?;
        for ((_, terminal), bytes) in self.serial.iter_mut().zip(&happened.bytes) {
            terminal.write(bytes)?;
            terminal.flush()?;
        }
        let host = self.robot.host();
        let others = happened.carried.iter();
        for carried in others.filter(|carried| carried.node != host) {
            let ms = (to_us(carried.start) * 1e-3) as u64;
            if let Some(line) = self.adapter.hear(carried, ms)
                && self.slcan.write(line.as_bytes())? == Sent::Lost
            {
                self.adapter.has_lost = true;
            }
        }
        self.slcan.flush()?;
        for (foot, cause) in happened.resets {
            let at_s = self.robot.ms as f64 * 1e-3;
            let words = format!("{at_s:.3} s  {}: reset by {}", foot.name(), cause.name());
            self.report(words);
        }
        Ok(())
    }
}
