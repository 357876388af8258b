//! The foot: takes a sample each tick, and sends frames on the same tick.
//!
//! [`Foot::tick`] lists the steps of a millisecond in order. Its work is bounded: at most
//! [`INPUTS_PER_TICK`] requests, one estimate, one frame of each kind.
//!
//! | step | file |
//! |---|---|
//! | requests that came in, and their answers | `requests` |
//! | faults of the sensor, the bus and the tick: raised and cleared | `faults` |
//! | the load on the foot | `load` |
//! | the sample put right and turned to the foot's axes; the estimate, by a new estimator after a change of settings | `renewal`, `estimator_core` |
//! | frames and lines of text to the queues | `output` |
//!
//! **Fail-safe.** While a fault of the sensor is active, every frame has P = 0 and the fault flag,
//! whatever the estimate is; without a valid sample no frame reports "stable". A fault stays
//! active until [`SOUND_TICKS`] consecutive samples are good.

mod faults;
mod load;
mod output;
mod renewal;
mod requests;

use estimator_core::{
    ContactEstimate, ContactEstimator, Flag, Flags, Learnt, ParamsError, Validity,
};
use wire::node::{BootCause, Crash, Program};
use wire::settings::WINDOW_CAPACITY;
use wire::uart::LogMessage;
use wire::{Counter, Counters, Fault, Node, NodeId, Settings, Stage};

use crate::outlet::Lane;
use crate::ports::Ports;
use crate::sampling::{Activity, Measurement, Tick};
use crate::supervision::{Hysteresis, Worker};
use storage::Origin;

use faults::FaultState;
use output::{Level, Output};
use renewal::Renewal;
use requests::Requests;

pub use faults::SOUND_TICKS;
pub use load::LOAD_READINGS;
pub use requests::{INPUTS_PER_TICK, STORES_AT_ONCE};

/// Period of the ticks unless [`Foot::without_can`] sets another, µs.
const TICK_US: u32 = 1_000;

/// Ticks between two checks of the readings at rest, and after which one more store is possible.
const REST_TICKS: u32 = 1024;

/// State at the start, besides the settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// Serial number, unique to the board.
    pub serial: u32,
    /// Name of the board.
    pub hardware: &'static str,
    /// Cause of the boot.
    pub cause: BootCause,
    /// Previous crash, if it caused this start: a [`CrashRecord`] or
    /// [`Fault::WatchdogReset`].
    ///
    /// [`CrashRecord`]: crate::supervision::CrashRecord
    pub crash: Option<Crash>,
    /// Origin of the settings.
    pub origin: Origin,
    /// Frequency of a crystal that is not used, kHz, 0 if it does not start: there is no CAN.
    pub unused_crystal_khz: Option<u32>,
    /// Level of the chip's brown-out reset: 0 off, 1 to 3.
    pub brown_out_level: u8,
    /// Program that runs.
    pub program: Program,
}

/// Node, estimator and the state between them.
#[derive(Debug)]
pub struct Foot {
    node: Node,
    estimator: ContactEstimator<WINDOW_CAPACITY>,
    /// New estimator, requested since the last tick.
    renewal: Option<Renewal>,
    counters: Counters,
    /// Temperature of the sensor, °C; NaN before the first sample.
    temperature: f32,
    stage: Stage,
    /// Present until the first tick has reported it.
    start: Option<Start>,
    ticks: u32,
    /// Period of the ticks, µs.
    tick_us: u32,
    requests: Requests,
    fault_state: FaultState,
    load_open: Hysteresis,
    output: Output,
}

impl Foot {
    /// Creates a foot, which reports its boot on the first tick.
    ///
    /// # Errors
    /// The parameters do not fit each other, which checked [`Settings`] exclude.
    pub fn new(settings: Settings, start: Start) -> Result<Self, ParamsError> {
        let config = settings.params().validate()?;
        Ok(Self {
            node: Node::new(settings, start.serial),
            estimator: ContactEstimator::new(&config),
            renewal: None,
            counters: Counters::default(),
            temperature: f32::NAN,
            stage: Stage::Starting,
            start: Some(start),
            ticks: 0,
            tick_us: TICK_US,
            requests: Requests::default(),
            fault_state: FaultState::default(),
            load_open: load::OPEN,
            output: Output::new(start.unused_crystal_khz.is_none()),
        })
    }

    /// Sends to the serial line alone, on a board without CAN; its ticks may have another period than a millisecond.
    #[must_use]
    pub fn without_can(mut self, tick_us: u32) -> Self {
        self.tick_us = tick_us;
        self.output = Output::new(false);
        self.renew(Renewal::Restart);
        self
    }

    /// Settings in use.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        self.node.settings()
    }

    /// Node id on the bus; 0 until one is assigned.
    #[must_use]
    pub fn node_id(&self) -> u8 {
        self.node.id().map_or(0, NodeId::get)
    }

    /// Stage, for the LED.
    #[must_use]
    pub const fn stage(&self) -> Stage {
        self.stage
    }

    /// Active faults, for the LED.
    #[must_use]
    pub const fn faults(&self) -> wire::Faults {
        self.node.faults()
    }

    /// Newest estimate.
    #[must_use]
    pub const fn estimate(&self) -> &ContactEstimate {
        self.node.estimate()
    }

    /// Values learnt by the estimator so far.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        self.estimator.learnt()
    }

    /// Counters since the start.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Advances by one tick, a millisecond. `reading` is the newest of the analog load input, if the board has one.
    pub fn tick(
        &mut self,
        tick: &Tick,
        measurement: &Measurement,
        reading: Option<u16>,
        ports: &Ports,
    ) {
        self.ticks = self.ticks.wrapping_add(1);
        self.report_start(ports);
        let taken = self.take_inputs(ports);
        self.count(tick, measurement, ports);
        self.check_sensor(measurement, ports);
        let load = self.load(reading, ports);

        self.renew_estimator();
        let settings = self.settings();
        let mut sample = measurement.sample;
        sample.specific_force = settings.accelerometer().apply(sample.specific_force);
        settings.mounting().apply(&mut sample.specific_force, &mut sample.angular_rate);
        let estimate = self.estimator.update(&sample, load);
        self.set_stage(measurement, estimate.flags, ports);

        self.send_can(&estimate, ports);
        self.send_uart(&estimate, measurement, tick.time, ports);
        // Responses have no deadline: they follow after the frames are sent.
        self.answer(INPUTS_PER_TICK - taken, ports);
        self.clear_expired_faults(ports);
        if self.ticks.is_multiple_of(REST_TICKS) {
            self.check_rest(ports);
            self.allow_store();
        }
        self.report_liveness(measurement, ports);
    }

    /// Reports, on the first tick, the boot-up and the faults known since before the start.
    fn report_start(&mut self, ports: &Ports) {
        let Some(start) = self.start.take() else {
            return;
        };
        self.allow_stores(match start.cause {
            BootCause::PowerUp => STORES_AT_ONCE,
            BootCause::Commanded => 0,
        });
        self.boot(start.cause, ports);
        if let Some(khz) = start.unused_crystal_khz {
            self.report_crystal(khz, ports);
        }
        self.check_origin(start.origin, ports);
        self.node.set_hardware(start.hardware);
        self.node.set_tick(self.tick_us as u16);
        self.node.set_brown_out_level(start.brown_out_level);
        self.node.set_program(start.program);
        if start.brown_out_level == 0 {
            let text = "brown-out reset is off: see 0x2114";
            self.log(Level::Warning, text, ports);
        }
        if let Some(crash) = start.crash {
            self.node.set_crash(crash);
            self.raise_crash(crash, ports);
        }
    }

    /// Raises the fault of a crystal that does not start, or has another frequency, which is logged.
    fn report_crystal(&mut self, khz: u32, ports: &Ports) {
        self.raise(Fault::CrystalMissing, khz, ports);
        if khz > 0 {
            let tenths = (khz + 50) / 100;
            let mut line = LogMessage::new(Level::Error as u8, "crystal of 00.0 MHz");
            line.set_digit(11, tenths / 100);
            line.set_digit(12, tenths / 10);
            line.set_digit(14, tenths);
            self.log_line(Level::Error, line, ports);
        }
    }

    fn boot(&mut self, cause: BootCause, ports: &Ports) {
        if let Some(frame) = self.node.boot(cause) {
            self.push_can(Lane::Notice, frame, ports);
        }
    }

    fn count(&mut self, tick: &Tick, measurement: &Measurement, ports: &Ports) {
        self.counters.add(Counter::Ticks, 1);
        let counter = match measurement.sample.checked_validity() {
            Validity::Valid => Counter::ValidSamples,
            Validity::Saturated(_) => Counter::SaturatedSamples,
            Validity::Stale | Validity::Invalid => Counter::MissedSamples,
        };
        self.counters.add(counter, 1);
        let counted = self.counters.get(Counter::SensorRestarts);
        let restarts = measurement.restarts.wrapping_sub(counted);
        self.counters.add(Counter::SensorRestarts, restarts);
        if tick.missed > 0 {
            self.counters.add(Counter::LateTicks, tick.missed);
            let late_us = tick.missed.saturating_mul(self.tick_us);
            self.raise_event(Fault::LateTick, late_us, ports);
        }
    }

    fn set_stage(&mut self, measurement: &Measurement, flags: Flags, ports: &Ports) {
        let stage = match measurement.activity {
            Activity::Starting => Stage::Starting,
            Activity::SelfTest => Stage::SelfTest,
            Activity::Recovering => Stage::Recovering,
            Activity::Measuring => {
                if flags.contains(Flag::AttitudeNotInitialised) {
                    Stage::HoldStill
                } else {
                    Stage::Running
                }
            }
        };
        if stage != self.stage {
            self.stage = stage;
            self.node.set_stage(stage);
            self.log(Level::Information, stage.name(), ports);
        }
    }

    /// Reports to the watchdog. A failed sensor has its fault, and does not cause a restart.
    fn report_liveness(&self, measurement: &Measurement, ports: &Ports) {
        let excused = measurement.activity != Activity::Measuring || self.faults().void_estimate();
        if measurement.raw.is_some() || excused {
            ports.liveness.report(Worker::Sampling);
        }
        if self.estimate().timestamp == measurement.sample.timestamp {
            ports.liveness.report(Worker::Estimator);
        }
        if !self.output.with_can {
            ports.liveness.report(Worker::Can);
        }
    }
}
