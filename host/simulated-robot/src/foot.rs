//! Simulated foot: its walk and its sensor, and the board's program around [`firmware::Foot`].

use estimator_core::{Timestamp, Validity};
use firmware::Start;
use firmware::exchange::{Input, Reloaded, Request};
use firmware::sampling::{Activity, Measurement, SensorFault};
use firmware::uart_requests::UartReceiver;
use gait::control::MOST_FEET;
use gait::{EndlessRounds, Walked};
use storage::{Erase, Origin, Storage};
use wire::dictionary::index;
use wire::node::BootCause;
use wire::{Address, CanFrame, Fault, Foot as Position, Settings, Value};

use crate::DemoLine;
use crate::board::{self, SimulatedFlash, SimulatedProgram};

/// Duration of the sensor's self-test, ticks; shorter than on the board, whose waits are longer.
const SELF_TEST_TICKS: u32 = 300;

/// Rate error of the feet's clocks against the robot's, ppm; the tolerance of a crystal is 30 ppm.
const CLOCKS_PPM: [f64; MOST_FEET] = [0.0, 18.0, -11.0, 25.0, -27.0, 7.0];

/// Interval by which each foot was switched on before the preceding one, µs.
const SWITCHED_ON_US: i64 = 137_000;

/// Simulated foot.
pub(crate) struct SimulatedFoot {
    pub(crate) position: Position,
    /// Walk and sensor.
    pub(crate) walk: EndlessRounds,
    pub(crate) program: SimulatedProgram,
    /// Remaining ticks of the sensor's self-test since the last reset of the board; `None` once its result was returned.
    self_test: Option<u32>,
    storage: Storage<SimulatedFlash>,
    clock: OwnClock,
    serial: u32,
    receiver: UartReceiver,
    /// Axes that fail the sensor's self-test, as the detail of the fault: bit *i* is axis *i*.
    pub(crate) failing_axes: u32,
}

/// Clock of a foot, which starts at 0 with each start of the board and has its own rate error.
struct OwnClock {
    /// Start time on the robot's clock, µs; negative if the foot was switched on before the robot.
    began_us: i64,
    ppm: f64,
}

impl OwnClock {
    /// Converts a time of the robot to this clock.
    fn time(&self, robot: Timestamp) -> Timestamp {
        let since_us = robot.as_micros() as i64 - self.began_us;
        let gained_us = since_us as f64 * self.ppm * 1.0e-6;
        Timestamp::from_micros((since_us + gained_us as i64).max(0) as u64)
    }
}

/// Ticks of the self-test that begins with a reset, if the settings demand one.
fn self_test(settings: &Settings) -> Option<u32> {
    settings.self_test().then_some(SELF_TEST_TICKS)
}

impl SimulatedFoot {
    /// Creates a foot that has just been switched on, with settings for its position and line. `index` counts
    /// the feet of a robot from 0.
    pub(crate) fn new(
        index: usize,
        position: Position,
        line: DemoLine,
        seed: u64,
        phase_s: f64,
    ) -> Self {
        let mut storage = Storage::new(SimulatedFlash::blank(), &(0..SimulatedFlash::SIZE as u32))
            .unwrap_or_else(|_| unreachable!("there are two whole pages"));
        let mut settings = board::settings();
        let mut set = |object, sub, value| {
            let set = settings.set(Address::new(object, sub), value);
            debug_assert_eq!(set, Ok(()), "the dictionary has this value");
        };
        set(index::FOOT, 0, Value::U8(position.code()));
        if line == DemoLine::Uart {
            set(index::UART_STREAMS, 2, Value::U16(1));
        }
        let stored = storage.store(&settings, Erase::Allowed);
        debug_assert_eq!(stored, Ok(()), "blank flash takes a record");
        let serial = 0xF007_0000 + u32::from(position.code());
        let clock = OwnClock {
            began_us: -(index as i64) * SWITCHED_ON_US,
            ppm: CLOCKS_PPM.get(index).copied().unwrap_or_default(),
        };
        Self {
            clock,
            failing_axes: 0,
            position,
            walk: EndlessRounds::new(seed, phase_s),
            self_test: self_test(&settings),
            program: started(settings, serial, BootCause::PowerUp),
            storage,
            serial,
            receiver: UartReceiver::new(),
        }
    }

    /// Receives a frame by the CAN controller.
    pub(crate) fn receive(&mut self, frame: CanFrame, at: Timestamp) {
        let at = self.clock.time(at);
        self.put(Input::Can(frame, at), Input::CanLost(1));
    }

    /// Receives bytes on the serial line.
    pub(crate) fn receive_serial(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(request) = self.receiver.push(*byte) {
                self.put(Input::Uart(request), Input::UartRefused(1));
            }
        }
        if let Some(refused) = self.receiver.refused() {
            self.put(Input::UartRefused(refused), Input::UartRefused(1));
        }
    }

    /// Queues an input; if the queue is full, it is discarded, and `lost` is queued if possible.
    fn put(&mut self, input: Input, lost: Input) {
        if !self.program.ports.try_put(input) {
            self.program.ports.try_put(lost);
        }
    }

    /// Runs the program for the millisecond that begins at `now`.
    pub(crate) fn tick(&mut self, now: Timestamp, walked: &Walked) {
        let edge = self.clock.time(walked.imu.timestamp);
        let measurement = self.measure(edge, walked);
        self.program.tick(self.clock.time(now), &measurement);
        while let Some(request) = self.program.ports.try_next_request() {
            self.serve(request, now);
        }
    }

    fn measure(&mut self, edge: Timestamp, walked: &Walked) -> Measurement {
        let mut sample = walked.imu;
        sample.timestamp = edge;
        if let Some(ticks @ 1..) = &mut self.self_test {
            *ticks -= 1;
            sample.validity = Validity::Invalid;
            return Measurement {
                activity: Activity::SelfTest,
                ..board::measurement(sample, None)
            };
        }
        let mut measurement = board::measurement(sample, walked.raw);
        if self.self_test.take().is_some() && self.failing_axes != 0 {
            measurement.fault =
                Some(SensorFault { fault: Fault::SensorSelfTest, detail: self.failing_axes });
        }
        measurement
    }

    /// Serves a request as the board's thread level does.
    fn serve(&mut self, request: Request, now: Timestamp) {
        let ports = &self.program.ports;
        match request {
            Request::Store(settings, erase) => {
                let stored = self.storage.store(&settings, erase);
                ports.try_put(Input::Stored(stored));
            }
            Request::Restore(erase) => {
                let forgotten = self.storage.restore(erase);
                ports.try_put(Input::Stored(forgotten));
            }
            // The program of a simulated foot is part of the host's program, so it cannot be replaced.
            Request::StopProgram => {}
            // The highest brown-out level is set from the start.
            Request::ProtectSupply | Request::ConfirmProgram => {
                ports.try_put(Input::Completed(Ok(())));
            }
            Request::Reload => {
                let (settings, origin) = self.storage.load();
                ports.reload(Reloaded { settings, origin });
            }
            Request::Reset => {
                let (settings, origin) = self.storage.load();
                self.receiver = UartReceiver::new();
                self.clock.began_us = now.as_micros() as i64;
                self.self_test = self_test(&settings);
                self.program = started(settings, self.serial, BootCause::Commanded);
                debug_assert_ne!(origin, Origin::Corrupted, "its flash keeps what is written");
            }
        }
    }
}

/// Starts the program of a board.
fn started(settings: Settings, serial: u32, cause: BootCause) -> SimulatedProgram {
    let start = Start { cause, ..board::switched_on(serial) };
    let program = SimulatedProgram::new(settings, start);
    program.unwrap_or_else(|_| unreachable!("stored settings fit each other"))
}
