//! Simulated feet as a source: a [`Robot`] in real time, at a multiple of it, as fast as possible, or in steps of its own
//! clock.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use estimator_core::Timestamp;
use feet::link::clock::PlaybackPace;
use feet::link::{Arrived, LineClock, LineSource, now};
use feet::source::{InvalidValue, Speed, parse_value};
use feet::{Arrival, Link, LinkError, Sending};
use gait::control::MOST_FEET;
use thiserror::Error;

use crate::Robot;
use crate::board::INTERFACE;

/// Simulated feet.
#[derive(Clone, Debug, PartialEq)]
pub struct Demo {
    /// `feet`: their number, 1 to [`MOST_FEET`].
    pub feet: usize,
    /// `seed`: seed of steps and sensors.
    pub seed: u64,
    /// `speed`: playback speed; `None` for the original one.
    pub speed: Option<Speed>,
    /// `seconds`: duration in simulated time, s; `None` for no end.
    pub seconds: Option<f64>,
    /// `line`: connection, `can` or `uart`.
    pub line: DemoLine,
    /// `clock`: origin of the times, `2021` or `now`.
    pub clock: DemoClock,
}

samples::named! {
    /// Origin of the times of simulated feet.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DemoClock {
        /// The beginning of 2021: equal runs have equal times.
        Fixed = "2021",
        /// The clock of this machine at the start; the feet walk in real time.
        Now = "now",
    }
}

samples::named! {
    /// Connection of simulated feet.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DemoLine {
        /// One CAN bus.
        Can = "can",
        /// One serial line per foot, with the samples of the sensor.
        Uart = "uart",
    }
}

impl Default for Demo {
    fn default() -> Self {
        Self {
            feet: 1,
            seed: gait::plan::DEMO_SEED,
            speed: None,
            seconds: None,
            line: DemoLine::Can,
            clock: DemoClock::Fixed,
        }
    }
}

impl FromStr for Demo {
    type Err = DemoError;

    /// Parses the keys with their values: `feet=4,speed=10`.
    fn from_str(text: &str) -> Result<Self, DemoError> {
        let mut demo = Self::default();
        let mut keys = Vec::new();
        for pair in text.split(',').filter(|pair| !pair.is_empty()) {
            let (key, text) = pair.split_once('=').unwrap_or((pair, ""));
            if keys.contains(&key) {
                return Err(DemoError::Twice(key.to_owned()));
            }
            keys.push(key);
            match key {
                "feet" => {
                    let is_valid = |feet: &usize| (1..=MOST_FEET).contains(feet);
                    demo.feet = parse_value(text, "feet", "a number from 1 to 6", is_valid)?;
                }
                "seed" => demo.seed = parse_value(text, "seed", "a whole number", |_| true)?,
                "speed" => {
                    demo.speed = Some(parse_value(text, "speed", Speed::EXPECTED, |_| true)?);
                }
                "seconds" => {
                    let is_valid = |seconds: &f64| *seconds > 0.0 && seconds.is_finite();
                    demo.seconds =
                        Some(parse_value(text, "seconds", "a number above 0", is_valid)?);
                }
                "line" => {
                    let line = DemoLine::of_name(text);
                    demo.line = line.ok_or_else(|| invalid("line", text, "can or uart"))?;
                }
                "clock" => {
                    let clock = DemoClock::of_name(text);
                    demo.clock = clock.ok_or_else(|| invalid("clock", text, "2021 or now"))?;
                }
                other => return Err(DemoError::Key(other.to_owned())),
            }
        }
        match (demo.clock, demo.speed) {
            (DemoClock::Now, Some(speed)) if speed != Speed::REAL => {
                Err(DemoError::SpeedOfNow(speed))
            }
            _ => Ok(demo),
        }
    }
}

impl fmt::Display for Demo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "demo:feet={}", self.feet)
    }
}

impl Demo {
    /// Sets the speed if none is given. Feet with the clock of this machine stay at 1.
    #[must_use]
    pub fn at_speed(mut self, speed: Speed) -> Self {
        if self.clock != DemoClock::Now {
            self.speed.get_or_insert(speed);
        }
        self
    }
}

impl LineSource for Demo {
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        Ok(Box::new(SimulatedFeet::new(self)))
    }

    /// Opens the line. At the speed `max`, the time of the feet passes only while a response is awaited, and timeouts are
    /// measured in that time.
    fn open_for_requests(&self) -> Result<Box<dyn Link>, LinkError> {
        if self.speed == Some(Speed::Max) {
            return Ok(Box::new(SimulatedFeet::in_steps(self)));
        }
        self.open()
    }

    fn open_unpaced(&self) -> Result<Box<dyn Link>, LinkError> {
        let unpaced = Self { speed: Some(Speed::Max), ..self.clone() };
        Ok(Box::new(SimulatedFeet::new(&unpaced)))
    }

    fn speed(&self) -> Option<Speed> {
        Some(self.speed.unwrap_or(Speed::REAL))
    }
}

/// Error in the options of simulated feet.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DemoError {
    /// The value of a key is invalid.
    #[error(transparent)]
    Value(#[from] InvalidValue),
    /// A key is given twice.
    #[error("{0} is there twice")]
    Twice(String),
    /// A key is unknown.
    #[error("demo has no key {0:?}; its keys are feet, seed, speed, seconds, line and clock")]
    Key(String),
    /// The clock is the clock of this machine, and the speed is not 1.
    #[error("clock=now needs speed=1, but speed is {0}")]
    SpeedOfNow(Speed),
}

fn invalid(key: &'static str, value: &str, expected: &'static str) -> InvalidValue {
    InvalidValue { key, value: value.to_owned(), expected }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        text.parse::<Demo>().expect_err(text).to_string()
    }

    #[test]
    fn documented_keys_are_parsed() {
        assert_eq!("".parse(), Ok(Demo::default()));
        let four = Demo {
            feet: 4,
            seconds: Some(60.0),
            speed: Some(Speed::Max),
            line: DemoLine::Uart,
            ..Demo::default()
        };
        assert_eq!("feet=4,seconds=60,speed=max,line=uart".parse(), Ok(four));
    }

    #[test]
    fn invalid_key_error_names_the_expected_values() {
        assert_eq!(error("feet=9"), "feet is \"9\", but a number from 1 to 6 is expected");
        assert_eq!(
            error("legs=2"),
            "demo has no key \"legs\"; its keys are feet, seed, speed, seconds, line and clock"
        );
        for speed in ["0", "1e-300", "nan", "inf"] {
            let said = error(&format!("speed={speed}"));
            assert!(said.contains("a number from 0.001"), "{said}");
        }
        assert_eq!(error("feet=2,feet=3"), "feet is there twice");
        assert_eq!(error("clock=1970"), "clock is \"1970\", but 2021 or now is expected");
        for speed in ["10", "max"] {
            assert_eq!(
                error(&format!("speed={speed},clock=now")),
                format!("clock=now needs speed=1, but speed is {speed}")
            );
        }
    }

    #[test]
    fn given_speed_and_clock_of_this_machine_keep_their_speed() {
        let demo = |text: &str| text.parse::<Demo>().expect("keys");
        assert_eq!(demo("speed=2").at_speed(Speed::Max), demo("speed=2"));
        assert_eq!(demo("").at_speed(Speed::Max), demo("speed=max"));
        assert_eq!(demo("clock=now").at_speed(Speed::Max), demo("clock=now"));
        assert_ne!(demo("clock=now,speed=1"), demo("speed=1"));
    }
}
