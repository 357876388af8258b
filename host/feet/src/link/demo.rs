//! Simulated feet: a [`Robot`] in real time, at a multiple of it, as fast as possible, or in steps of its own clock.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use estimator_core::Timestamp;

use super::clock::PlaybackPace;
use super::{Arrival, Arrived, LineClock, Link, LinkError, Sending, now};
use crate::robot::Robot;
use crate::robot::board::INTERFACE;
use crate::source::{Demo, DemoClock, DemoLine, Speed};

/// Line to a simulated robot.
pub struct SimulatedFeet {
    robot: Robot,
    line: DemoLine,
    clock: LineClock,
    pace: PlaybackPace,
    /// End of the walk, µs.
    end_us: u64,
    interface: Arc<str>,
    ports: Vec<Arc<str>>,
    waiting: VecDeque<Arrived>,
    /// Time of the tick that is computed but not due yet, µs.
    is_due: Option<u64>,
    /// Time by which the output is later than on the robot's clock, µs.
    later_us: u64,
}

impl SimulatedFeet {
    /// Creates a robot that has just been switched on.
    #[must_use]
    pub fn new(demo: &Demo) -> Self {
        let robot = Robot::new(demo.feet, demo.seed, demo.line);
        let later_us = match demo.clock {
            DemoClock::Fixed => 0,
            DemoClock::Now => now().as_micros().saturating_sub(robot.now().as_micros()),
        };
        Self {
            ports: robot.names().map(Arc::from).collect(),
            line: demo.line,
            clock: LineClock::default(),
            pace: PlaybackPace::new(demo.speed.unwrap_or(Speed::REAL)),
            // The cast saturates.
            end_us: (demo.seconds.unwrap_or(f64::INFINITY) * 1.0e6) as u64,
            interface: INTERFACE.into(),
            waiting: VecDeque::new(),
            is_due: None,
            later_us,
            robot,
        }
    }

    /// Creates a robot whose time passes only while data are awaited, and on whose clock timeouts are measured.
    #[must_use]
    pub fn in_steps(demo: &Demo) -> Self {
        Self {
            clock: LineClock::in_steps(),
            pace: PlaybackPace::new(Speed::Max),
            ..Self::new(demo)
        }
    }

    /// Simulates a tick, and collects the output of the feet.
    fn tick(&mut self) {
        self.robot.tick();
        self.clock.advance_to(self.robot.elapsed_us());
        let Self { robot, waiting, .. } = self;
        match self.line {
            DemoLine::Can => {
                while let Some((at, frame)) = robot.next_frame() {
                    let interface = Arc::clone(&self.interface);
                    waiting.push_back((at, Arrival::Frame { interface, frame }));
                }
            }
            DemoLine::Uart => {
                let at = robot.now();
                for (index, port) in self.ports.iter().enumerate() {
                    let bytes = robot.take_serial(index);
                    if !bytes.is_empty() {
                        let port = Arc::clone(port);
                        waiting.push_back((at, Arrival::Bytes { port, bytes }));
                    }
                }
            }
        }
    }
}

impl Link for SimulatedFeet {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let end = self.clock.now() + longest;
        loop {
            if let Some(due) = self.is_due {
                if !self.pace.wait(due, longest) {
                    return Ok(None);
                }
                self.is_due = None;
            }
            if let Some((at, arrival)) = self.waiting.pop_front() {
                let at = Timestamp::from_micros(at.as_micros() + self.later_us);
                return Ok(Some((at, arrival)));
            }
            if self.robot.elapsed_us() >= self.end_us {
                return Err(LinkError::Ended("the demo".to_owned()));
            }
            if self.clock.is_in_steps() && self.clock.now() >= end {
                return Ok(None);
            }
            self.tick();
            self.is_due = Some(self.robot.elapsed_us());
        }
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        match (sending, self.line) {
            (Sending::Frame(frame), DemoLine::Can) => self.robot.send(*frame),
            (Sending::Bytes { port, bytes }, DemoLine::Uart) => {
                for (index, name) in self.ports.iter().enumerate() {
                    if port.as_ref().is_none_or(|port| port == name) {
                        self.robot.send_serial(index, bytes);
                    }
                }
            }
            (_, line) => {
                let takes = match line {
                    DemoLine::Can => "CAN frames",
                    DemoLine::Uart => "bytes of the serial line",
                };
                return Err(LinkError::wrong_kind("the demo", takes));
            }
        }
        Ok(())
    }

    fn clock(&self) -> LineClock {
        self.clock.clone()
    }
}
