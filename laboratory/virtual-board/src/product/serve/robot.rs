//! Feet on one bus, with the controller of their robot, in steps of a millisecond.
//!
//! Within a millisecond the boards run in parallel. Their frames reach the others a millisecond later: they share
//! the load and the order of the bus, but not the exact times of transmission. [`BoardBus`] puts the frames of all
//! nodes into the one order that an adapter receives: one at a time, the lowest identifier first.

use std::collections::VecDeque;

use gait::GaitName;
use gait::control::{LOAD_OVER_CAN, PHASE_S, RobotControl};
use thiserror::Error;
use wire::dictionary::index;
use wire::foot::cob_id;
use wire::{Address, Foot as Position, NodeId, Value};

use super::MILLISECOND;
use super::foot::{BoardFoot, BoardFootOptions, BoardPrograms, Order, SliceInput, SliceOutput};
use crate::emulator::board::BoardOptions;
use crate::emulator::corner::Corner;
use crate::emulator::part::can::{BusFrame, TimedFrame};
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::time::cycle;
use crate::product::scenario::ScenarioError;

/// A robot of emulated boards.
pub struct BoardRobot {
    members: Vec<Member>,
    /// The bus of the feet, the controller and the host.
    pub bus: BoardBus,
    control: Option<RobotControl>,
    /// Time since it was switched on, ms.
    pub ms: u64,
}

/// A foot of the robot, with its input for the next millisecond.
struct Member {
    position: Position,
    foot: BoardFoot,
    node: NodeId,
    /// Bit rate of its last transmission, bit/s.
    bit_rate: u32,
    /// Output of the last millisecond.
    output: SliceOutput,
    /// Bytes for its serial line.
    bytes: Vec<u8>,
    orders: Vec<Order>,
}

/// Presence of the robot's controller on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlNode {
    /// The controller sends SYNCs and loads, and feet take their load from it.
    Present,
    /// Only the feet and the host are on the bus.
    Absent,
}

/// Options of a robot.
#[derive(Clone, Debug)]
pub struct RobotOptions {
    /// Number of feet, 1 to [`MOST_FEET`](gait::control::MOST_FEET).
    pub feet: usize,
    /// Gait.
    pub gait: GaitName,
    /// Seed of the steps and of the sensors.
    pub seed: u64,
    /// Specimen of the chips.
    pub corner: Corner,
    /// Presence of the robot's controller.
    pub control: ControlNode,
    /// Settings that each foot has stored, besides its position.
    pub settings: Vec<(Address, Value)>,
}

/// A foot that failed, and the reason.
#[derive(Debug, Error)]
#[error("{}: {problem}", foot.name())]
pub struct Stopped {
    /// Position of the foot.
    pub foot: Position,
    /// Reason.
    pub problem: ScenarioError,
}

/// Events of a millisecond.
#[derive(Debug, Default)]
pub struct StepEvents {
    /// Frames transmitted on the bus.
    pub carried: Vec<BusTransfer>,
    /// Bytes of each serial line.
    pub bytes: Vec<Vec<u8>>,
    /// Boards that were reset, with the cause.
    pub resets: Vec<(Position, ResetCause)>,
}

/// Maximum number of bytes on their way to a board over a serial line: as many as 1 Mbaud carries in two
/// milliseconds.
const SERIAL_ROOM: usize = 200;

/// Maximum number of the host's frames that wait for the bus.
const HOST_ROOM: usize = 32;

impl BoardRobot {
    /// Creates the feet, each on a board with these programs in its flash, and switches them on.
    ///
    /// # Errors
    /// If the ELF is invalid, or its program does not store its settings.
    pub fn start(
        programs: impl Into<BoardPrograms>,
        options: &RobotOptions,
    ) -> Result<Self, Stopped> {
        let programs = programs.into();
        let positions = gait::control::feet(options.feet);
        let members: Vec<Member> = (0..)
            .zip(positions)
            .map(|(index, &position)| Member {
                position,
                foot: BoardFoot::start(foot_options(&programs, options, index, position)),
                node: position.default_node_id(),
                bit_rate: 0,
                output: SliceOutput::default(),
                bytes: Vec::new(),
                orders: Vec::new(),
            })
            .collect();
        for member in &members {
            member.wait()?;
        }
        Ok(Self {
            bus: BoardBus::new(members.len() + 2),
            members,
            control: (options.control == ControlNode::Present).then(RobotControl::default),
            ms: 0,
        })
    }

    /// Positions of the feet.
    pub fn positions(&self) -> impl Iterator<Item = Position> + '_ {
        self.members.iter().map(|member| member.position)
    }

    /// Node index of the host on the bus, in [`BusTransfer`].
    #[must_use]
    pub const fn host(&self) -> usize {
        self.members.len() + 1
    }

    /// Gives an order to a foot, or to all. Returns false if the foot does not exist.
    pub fn order(&mut self, foot: Option<Position>, order: Order) -> bool {
        let mut found = false;
        for member in &mut self.members {
            if foot.is_none_or(|foot| foot == member.position) {
                member.orders.push(order);
                found = true;
            }
        }
        found
    }

    /// Returns whether the bus accepts another frame of the host.
    #[must_use]
    pub fn has_room_for_host(&self) -> bool {
        self.bus.waiting(self.host()) < HOST_ROOM
    }

    /// Sends a frame of the host.
    pub fn send(&mut self, frame: BusFrame, bit_rate: u32) {
        let ready = self.before();
        self.bus.send(self.host(), frame, bit_rate, ready);
    }

    /// Number of bytes that the serial line of a foot, counted from 0, accepts in this millisecond.
    #[must_use]
    pub fn serial_room(&self, foot: usize) -> usize {
        let member = self.members.get(foot);
        member.map_or(0, |member| {
            SERIAL_ROOM.saturating_sub(member.output.bytes_incoming + member.bytes.len())
        })
    }

    /// Sends bytes to the serial line of a foot, counted from 0.
    pub fn send_serial(&mut self, foot: usize, bytes: &[u8]) {
        if let Some(member) = self.members.get_mut(foot) {
            member.bytes.extend_from_slice(bytes);
        }
    }

    /// Start of the previous millisecond, which the bus processes.
    const fn before(&self) -> u64 {
        (self.ms * MILLISECOND).saturating_sub(MILLISECOND)
    }

    /// Runs one millisecond.
    ///
    /// # Errors
    /// As [`Board::run_for`](crate::emulator::board::Board::run_for).
    pub fn step(&mut self) -> Result<StepEvents, Stopped> {
        let now = self.ms * MILLISECOND;
        self.send_control();
        let carried: Vec<BusTransfer> = core::iter::from_fn(|| self.bus.next(now)).collect();
        for (index, member) in self.members.iter_mut().enumerate() {
            let rate = member.output.bit_rate;
            let others = carried.iter();
            let received =
                others.filter(|carried| carried.node != index && Some(carried.bit_rate) == rate);
            let frames = received.map(|carried| TimedFrame {
                time: (carried.start + MILLISECOND).max(now),
                frame: carried.frame.clone(),
            });
            member.foot.begin(SliceInput {
                until: now + MILLISECOND,
                frames: frames.collect(),
                bytes: core::mem::take(&mut member.bytes),
                orders: core::mem::take(&mut member.orders),
            });
        }
        let mut events = StepEvents { carried, ..StepEvents::default() };
        for (index, member) in self.members.iter_mut().enumerate() {
            let mut output = member.wait()?;
            member.bit_rate = output.bit_rate.unwrap_or(member.bit_rate);
            for TimedFrame { time, frame } in output.frames.drain(..) {
                if let Some(node) = booted(&frame) {
                    member.node = node;
                }
                let length = frame.bits().saturating_mul(cycle(member.bit_rate));
                let ready = time.saturating_sub(length);
                self.bus.send(index, frame, member.bit_rate, ready);
            }
            let resets = output.resets.drain(..);
            events.resets.extend(resets.map(|cause| (member.position, cause)));
            events.bytes.push(core::mem::take(&mut output.bytes));
            member.output = output;
        }
        self.ms += 1;
        Ok(events)
    }

    /// Sends the due messages of the controller, at the bit rate of the first foot on the bus.
    fn send_control(&mut self) {
        let loads = self.members.iter();
        let loads = loads.map(|member| (member.node, member.output.load));
        let frames = match &mut self.control {
            Some(control) => control.frames(self.ms, loads),
            None => return,
        };
        // Without a foot on the bus, frames are not acknowledged.
        let mut rates = self.members.iter().map(|member| member.output.bit_rate);
        let Some(rate) = rates.find_map(|rate| rate) else {
            return;
        };
        let (node, ready) = (self.members.len(), self.before());
        for frame in frames {
            let frame = BusFrame::of(&frame);
            self.bus.send(node, frame, rate, ready);
        }
    }
}

impl Member {
    /// Waits until its board has run.
    fn wait(&self) -> Result<SliceOutput, Stopped> {
        let foot = self.position;
        self.foot.finish().map_err(|problem| Stopped { foot, problem })
    }
}

/// Node of a boot-up message.
fn booted(frame: &BusFrame) -> Option<NodeId> {
    let is_boot_up = frame.data == [0];
    let id = frame.id.checked_sub(u32::from(cob_id::HEARTBEAT))?;
    NodeId::new(u8::try_from(id).ok()?).filter(|_| is_boot_up)
}

/// Options of the foot with this index at a position.
fn foot_options(
    programs: &BoardPrograms,
    options: &RobotOptions,
    index: u64,
    position: Position,
) -> BoardFootOptions {
    let mut board = BoardOptions::default();
    board.set_corner(options.corner);
    let seed = options.seed.wrapping_add(index);
    if let Some(sensor) = &mut board.sensor {
        sensor.seed = seed;
    }
    let mut settings = options.settings.clone();
    if position != Position::default() {
        let code = Value::U8(position.code());
        settings.push((Address::new(index::FOOT, 0), code));
    }
    if options.control == ControlNode::Present {
        settings.push((Address::new(index::LOAD_INPUT, 1), LOAD_OVER_CAN));
    }
    BoardFootOptions {
        programs: programs.clone(),
        board,
        position,
        settings,
        gait: options.gait,
        seed,
        phase_s: index as f64 * PHASE_S,
    }
}

/// Maximum number of frames of a node that wait for the bus; beyond it the oldest is lost.
const MOST_WAITING: usize = 256;

/// A frame that waits for the bus, or was transmitted on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusTransfer {
    /// Index of the sending node.
    pub node: usize,
    /// Time at which the frame began. While it waits: the earliest time at which it may begin. In
    /// units of [`time`](crate::emulator::time).
    pub start: u64,
    /// Bit rate, bit/s: nodes with another rate do not receive it.
    pub bit_rate: u32,
    /// The frame.
    pub frame: BusFrame,
}

/// The bus.
#[derive(Clone, Debug)]
pub struct BoardBus {
    /// Frames that wait, by node; each starts no earlier than its time.
    nodes: Vec<VecDeque<BusTransfer>>,
    free_at: u64,
    /// Number of frames discarded because the queue was full.
    pub lost: u64,
}

impl BoardBus {
    /// Creates a bus with `nodes` nodes.
    #[must_use]
    pub fn new(nodes: usize) -> Self {
        Self { nodes: vec![VecDeque::new(); nodes], free_at: 0, lost: 0 }
    }

    /// Queues a frame of a node to be sent no earlier than `ready`. Frames of one node keep their order.
    pub fn send(&mut self, node: usize, frame: BusFrame, bit_rate: u32, ready: u64) {
        // A controller without a bit rate sends nothing.
        let Some(queue) = self.nodes.get_mut(node).filter(|_| bit_rate > 0) else {
            return;
        };
        if queue.len() == MOST_WAITING {
            queue.pop_front();
            self.lost += 1;
        }
        queue.push_back(BusTransfer { node, start: ready, bit_rate, frame });
    }

    /// Number of frames of a node that wait.
    #[must_use]
    pub fn waiting(&self, node: usize) -> usize {
        self.nodes.get(node).map_or(0, VecDeque::len)
    }

    /// Returns the next frame that begins before `until`.
    pub fn next(&mut self, until: u64) -> Option<BusTransfer> {
        let heads = || self.nodes.iter().filter_map(VecDeque::front);
        let first = heads().map(|waiting| waiting.start).min()?;
        let start = first.max(self.free_at);
        if start >= until {
            return None;
        }
        let ready = self.nodes.iter().enumerate().filter_map(|(node, queue)| {
            let head = queue.front().filter(|head| head.start <= start)?;
            Some((head.frame.id, node))
        });
        let (_, node) = ready.min()?;
        let mut carried = self.nodes.get_mut(node)?.pop_front()?;
        carried.start = start;
        self.free_at = start + carried.frame.bits() * cycle(carried.bit_rate);
        Some(carried)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: u32 = 1_000_000;

    fn carried(bus: &mut BoardBus, until: u64) -> Vec<(usize, u32)> {
        std::iter::from_fn(|| bus.next(until))
            .map(|carried| (carried.node, carried.frame.id))
            .collect()
    }

    #[test]
    fn the_lowest_identifier_wins_and_a_node_keeps_its_order() {
        let mut bus = BoardBus::new(3);
        for (node, id) in [(0, 0x191), (0, 0x080), (1, 0x192), (2, 0x180)] {
            bus.send(node, BusFrame::new(id, &[]), RATE, 0);
        }
        let order = [(2, 0x180), (0, 0x191), (0, 0x080), (1, 0x192)];
        assert_eq!(carried(&mut bus, u64::MAX), order);
    }

    #[test]
    fn a_frame_takes_its_time_and_waits_until_ready() {
        let mut bus = BoardBus::new(2);
        let frame = BusFrame::new(0x200, &[0; 8]);
        let length = frame.bits() * cycle(RATE);
        bus.send(0, frame.clone(), RATE, 10);
        bus.send(0, frame, RATE, 10);
        bus.send(1, BusFrame::new(0x100, &[]), RATE, 11);
        let first = bus.next(u64::MAX).expect("a frame");
        assert_eq!((first.node, first.start), (0, 10));
        let second = bus.next(u64::MAX).expect("a frame");
        assert_eq!((second.node, second.start), (1, 10 + length));
        assert_eq!(bus.next(10 + length), None, "it begins later");
        assert_eq!(bus.waiting(0), 1);
    }

    #[test]
    fn frames_that_never_find_the_bus_free_are_counted_as_lost() {
        let mut bus = BoardBus::new(1);
        for _ in 0..MOST_WAITING + 3 {
            bus.send(0, BusFrame::new(1, &[]), RATE, 0);
        }
        assert_eq!((bus.waiting(0), bus.lost), (MOST_WAITING, 3));
        bus.send(0, BusFrame::new(1, &[]), 0, 0);
        assert_eq!(bus.lost, 3, "a controller without a rate sends nothing");
    }
}
