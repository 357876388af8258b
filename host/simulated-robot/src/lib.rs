//! Robot with simulated feet, each of which runs the board's own program: [`firmware::Foot`] with its
//! ports and its settings in flash. The walk, the sensor, the bus and the robot's control, which reports
//! loads and numbers its SYNCs, are simulated.
//!
//! | item | file |
//! |---|---|
//! | the robot: one bus, or a serial line for each foot | this one |
//! | the robot as a line of [`feet`], in real time or faster; its options | [`demo`] |
//! | its control: SYNCs and loads | [`gait::control`] |
//! | a foot: its walk, its sensor, its requests | `foot` |
//! | the recorded walk of one foot, with all that it sends | [`walk`] |
//! | board around a foot: settings, start, measurements, program, flash; and the bus | [`board`] |

pub mod board;
pub mod demo;
mod foot;
pub mod walk;

use std::collections::VecDeque;

use estimator_core::Timestamp;
use feet::link::clock::since_2021;
use gait::control::{PHASE_S, RobotControl};
use gait::record::TICK_US;
use wire::CanFrame;

use board::SimulatedBus;
pub use demo::{Demo, DemoClock, DemoError, DemoLine, SimulatedFeet};
use foot::SimulatedFoot;

/// Simulated robot.
pub struct Robot {
    feet: Vec<SimulatedFoot>,
    line: DemoLine,
    ticks: u64,
    control: RobotControl,
    /// Frames that the bus has carried and that were not read yet.
    carried: VecDeque<(Timestamp, CanFrame)>,
    /// Frames of a master waiting for the bus.
    pending: Vec<CanFrame>,
    bus: SimulatedBus,
}

impl Robot {
    /// Creates a robot that has just been switched on, with up to six feet, connected by `line`.
    #[must_use]
    pub fn new(feet: usize, seed: u64, line: DemoLine) -> Self {
        let feet = gait::control::feet(feet).iter().enumerate();
        let feet = feet.map(|(index, position)| {
            let seed = seed.wrapping_add(index as u64);
            SimulatedFoot::new(index, *position, line, seed, index as f64 * PHASE_S)
        });
        Self {
            feet: feet.collect(),
            line,
            ticks: 0,
            control: RobotControl::default(),
            carried: VecDeque::new(),
            pending: Vec::new(),
            bus: SimulatedBus::default(),
        }
    }

    /// Names of the feet.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.feet.iter().map(|foot| foot.position.name())
    }

    /// Time since the robot was switched on, µs.
    #[must_use]
    pub const fn elapsed_us(&self) -> u64 {
        self.ticks * TICK_US
    }

    /// Current time as logged.
    #[must_use]
    pub fn now(&self) -> Timestamp {
        since_2021(Timestamp::from_micros(self.elapsed_us()))
    }

    /// Sends a frame as a master; the bus carries it with the next tick.
    pub fn send(&mut self, frame: CanFrame) {
        self.pending.push(frame);
    }

    /// Sends bytes to the serial line of a foot, counted from 0.
    pub fn send_serial(&mut self, foot: usize, bytes: &[u8]) {
        if let Some(foot) = self.feet.get_mut(foot) {
            foot.receive_serial(bytes);
        }
    }

    /// Returns the next frame that the bus has carried, and the time of its end.
    pub fn next_frame(&mut self) -> Option<(Timestamp, CanFrame)> {
        self.carried.pop_front()
    }

    /// Returns the bytes that a foot, counted from 0, has sent on its serial line since the last call.
    pub fn take_serial(&mut self, foot: usize) -> Vec<u8> {
        let foot = self.feet.get_mut(foot);
        let bytes = foot.map(|foot| foot.program.take_serial());
        bytes.unwrap_or_default()
    }

    /// Makes these axes of a foot's sensor fail from its next self-test on: bit *i* is axis *i*. Feet are counted
    /// from 0.
    pub fn fail_self_test(&mut self, foot: usize, axes: u32) {
        if let Some(foot) = self.feet.get_mut(foot) {
            foot.failing_axes = axes;
        }
    }

    /// Simulates one millisecond.
    pub fn tick(&mut self) {
        let now_us = self.elapsed_us();
        let walked = self.feet.iter_mut().map(|foot| foot.walk.tick());
        let walked: Vec<_> = walked.collect();
        let loads = self.feet.iter().zip(&walked).filter_map(|(foot, walked)| {
            let node = foot.program.foot.settings().node_id()?;
            Some((node, walked.truth.load))
        });
        // A tick is a millisecond.
        let frames = self.control.frames(self.ticks, loads);
        self.pending.extend(frames);
        for frame in std::mem::take(&mut self.pending) {
            let at = self.carry(now_us, frame);
            for foot in &mut self.feet {
                foot.receive(frame, at);
            }
        }
        let mut sent = Vec::new();
        for (foot, walked) in self.feet.iter_mut().zip(walked) {
            foot.tick(Timestamp::from_micros(now_us), &walked);
            sent.extend(foot.program.frames());
        }
        // The lowest identifier wins the bus; frames of one foot with equal identifiers keep their order.
        sent.sort_by_key(CanFrame::id);
        for frame in sent {
            self.carry(now_us, frame);
        }
        // Output on an unconnected line is discarded.
        match self.line {
            DemoLine::Can => self.feet.iter_mut().for_each(|foot| {
                foot.program.take_serial();
            }),
            DemoLine::Uart => self.carried.clear(),
        }
        self.ticks += 1;
    }

    /// Occupies the bus with a frame that is ready at `ready_us`, once the bus is free. Returns the
    /// time of the frame's end on the robot's clock.
    fn carry(&mut self, ready_us: u64, frame: CanFrame) -> Timestamp {
        let complete = self.bus.carry(Timestamp::from_micros(ready_us));
        self.carried.push_back((since_2021(complete), frame));
        complete
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use feet::decode::ContactRow;
    use feet::decode::live::{FootMessage, LiveDecoder, MessageBody};
    use wire::{Foot as Position, Pdo};

    fn run(robot: &mut Robot, ticks: u64) -> Vec<(Timestamp, CanFrame)> {
        (0..ticks).for_each(|_| robot.tick());
        std::iter::from_fn(|| robot.next_frame()).collect()
    }

    #[test]
    fn four_feet_share_the_bus_without_losing_contacts() {
        let mut robot = Robot::new(4, 1, DemoLine::Can);
        let frames = run(&mut robot, 1000);
        for position in &Position::ALL[..4] {
            let id = Pdo::Contact.cob_id(position.default_node_id());
            let contacts = frames.iter().filter(|(_, frame)| frame.id() == id);
            assert_eq!(contacts.count(), 1000, "{}", position.name());
        }
        assert!(frames.windows(2).all(|pair| pair[0].0.as_micros() < pair[1].0.as_micros()));
    }

    #[test]
    fn walking_foot_reports_stance_swing_and_load() {
        let mut robot = Robot::new(1, 1, DemoLine::Can);
        let mut decoder = LiveDecoder::default();
        for (at, frame) in run(&mut robot, 12_000) {
            decoder.frame("can0", &frame, at);
        }
        let messages: Vec<FootMessage> = std::iter::from_fn(|| decoder.next_message()).collect();
        let stable = |row: &ContactRow| row.stable > 0.9;
        let rows: Vec<_> = messages
            .iter()
            .filter_map(|message| match &message.body {
                MessageBody::Contact(row) => Some(row),
                _ => None,
            })
            .collect();
        assert!(rows.len() >= 11_999);
        let share = rows.iter().filter(|row| stable(row)).count() as f64 / rows.len() as f64;
        assert!((0.2..0.9).contains(&share), "{share}");
        assert!(
            messages
                .iter()
                .any(|message| matches!(message.body, MessageBody::Load(load) if load > 10.0))
        );
    }

    #[test]
    fn serial_lines_carry_contacts_and_raw_samples() {
        let mut robot = Robot::new(2, 1, DemoLine::Uart);
        let mut decoder = LiveDecoder::default();
        for _ in 0..500 {
            robot.tick();
            for foot in 0..2 {
                let bytes = robot.take_serial(foot);
                decoder.bytes(&foot.to_string(), &bytes, robot.now());
            }
        }
        let messages: Vec<FootMessage> = std::iter::from_fn(|| decoder.next_message()).collect();
        for foot in ["0", "1"] {
            let of = |is_wanted: fn(&MessageBody) -> bool| {
                let of_foot = messages.iter().filter(|message| &*message.foot.line == foot);
                of_foot.filter(|message| is_wanted(&message.body)).count()
            };
            assert_eq!(of(|body| matches!(body, MessageBody::Contact(_))), 500);
            assert_eq!(of(|body| matches!(body, MessageBody::Raw(_))), 500);
        }
    }
}
