//! The foot: a function of its inputs. A tick takes a sample and what has arrived, and gives what is to be sent.
//!
//! [`Foot::tick`] lists the steps up to the frames of the tick on the bus. [`Foot::stream`] makes the messages of the
//! serial line. [`Foot::respond`] lists the steps that have no deadline. This file follows their order:
//!
//! - reports of the start, and inputs up to the first request with a response;
//! - faults of the tick and the sensor, and the load;
//! - the estimate, by a new estimator if settings of the estimator have changed;
//! - frames and lines of text;
//! - responses, faults that end, and the check of the last rest.
//!
//! Each fills an [`Outbox`], and touches nothing else. The work of a tick is bounded: at most
//! [`INPUTS_PER_TICK`](crate::exchange::INPUTS_PER_TICK) requests, one estimate, and one frame of each kind.
//!
//! **Fail-safe.** While a fault that [voids the estimate](Fault) is active, every frame has P = 0 and the fault flag,
//! whatever the estimate is. Without a valid sample no frame reports "stable". A fault of the sensor stays active until
//! [`SOUND_TICKS`] consecutive samples are good.

use core::mem::MaybeUninit;
use core::ops::RangeInclusive;

use estimator_core::any::AnyConfig;
use estimator_core::{ContactEstimate, Flag, Learnt, Load, ParamsError, Stream, Validity};
use lsm6dsox::scale::{FullScale, STANDARD_GRAVITY};
use storage::{Erase, Origin, StoreFailed};
use wire::dictionary::Concern;
use wire::node::{
    BootCause, Calibration, Costs, Crash, Due, Finished, NmtState, Program, Published,
};
use wire::pdo::{Pdo, Quantity, TEMPERATURE_STEP};
use wire::settings::{LoadInput, LoadSource, UartStreams, WINDOW_CAPACITY};
use wire::uart::{self, ContactMessage, HealthMessage, LogMessage, Message};
use wire::{
    AbortCode, CanFrame, Counter, Counters, Diagnosis, Event, Fault, Node, NodeId, Settings, Stage,
};

use crate::diagnosis::DiagnosisMeter;
use crate::estimation::{Estimation, Renewal};
use crate::exchange::{BusState, Dropped, Input, Lane, Outbox, Received, Reloaded, Request};
use crate::sampling::{Activity, Measurement, ReadAt, SATURATED_TICKS, SensorFault, Tick};
use crate::supervision::{FaultLatch, Hysteresis, Worker};
use crate::uart_requests;

/// Period of the ticks unless [`Foot::disable_can`] sets another, µs.
const TICK_US: u32 = 1_000;

/// Number of stores and restores that are possible at once after power-up. Every 1024 ticks, one more becomes possible.
///
/// A sector of flash endures 10 000 erases (STM32F405 data sheet, DS8626), and 50 stores a second would use them up in
/// hours. After a commanded reset there is none at first, so that resets do not raise the rate.
pub const STORES_AT_ONCE: u8 = 4;

/// Ticks between two checks of the readings at rest, and ticks until one more store is possible.
const REST_TICKS: u32 = 1024;

/// Consecutive good samples after which a fault of the sensor is cleared.
pub const SOUND_TICKS: u16 = 20;

/// Ticks for which a fault that is an event stays active after the event.
const EVENT_TICKS: u16 = 1000;

/// Ticks for which the crash before this start stays active as a fault. Object 0x2113 keeps it until the next start.
const CRASH_TICKS: u16 = 10_000;

/// Plausible specific force at rest, m/s². The range detects an LSM6DSO32, which has the `WHO_AM_I` of an LSM6DSOX but
/// half its sensitivity, so it reads 0.5 g at rest. Outside the range, the error of the subtracted gravity is so large
/// that the estimator never detects rest.
const FORCE_AT_REST: RangeInclusive<f32> = 0.88 * STANDARD_GRAVITY..=1.12 * STANDARD_GRAVITY;

/// Readings of a connected load input. At the ends of the 12-bit range the input is open or shorted.
pub const LOAD_READINGS: RangeInclusive<u16> = 16..=4079;

/// Ticks after which the input counts as open, and as connected again.
const LOAD_OPEN: Hysteresis = Hysteresis::new(10, 100);

/// Inputs of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The tick.
    pub tick: &'a Tick,
    /// The sample, or the reason why there is none.
    pub measurement: &'a Measurement,
    /// Newest reading of the analog load input, if the board has one.
    pub load_reading: Option<u16>,
    /// Inputs and settings that have arrived since the previous tick.
    pub received: &'a Received,
    /// Largest costs so far.
    pub costs: Costs,
}

/// Crystal at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Crystal {
    /// The crystal drives the clock, and has the frequency of the board's crystal.
    #[default]
    InUse,
    /// The crystal drives the clock. Its frequency could not be measured.
    NotMeasured,
    /// The crystal is not used, so there is no CAN.
    Unused {
        /// Measured frequency of the crystal, kHz; 0 if it does not start.
        khz: u32,
    },
}

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
    /// The crystal.
    pub crystal: Crystal,
    /// Level of the chip's brown-out reset: 0 off, 1 to 3. `None` if the chip has no levels.
    pub brown_out_level: Option<u8>,
    /// The running program.
    pub program: Program,
    /// Diagnosis of the board. The foot adds that of the sensor.
    pub diagnosis: Diagnosis,
}

/// Node, estimator and the state between them.
#[derive(Debug)]
pub struct Foot {
    node: Node,
    /// Newest estimate and all else that the node publishes.
    published: Published,
    estimation: Estimation,
    /// Settings of the node that each tick uses.
    in_use: InUse,
    /// Present until the first tick has reported the start.
    start: Option<Start>,
    ticks: u32,
    /// Period of the ticks, µs.
    tick_us: u32,
    sensor: SensorHealth,
    diagnosis: DiagnosisMeter,
    load_open: Hysteresis,
    bus: BusState,
    /// Received CAN frames lost since the start.
    can_lost: u32,
    latch: FaultLatch,
    /// Number of stores that are possible now, at most [`STORES_AT_ONCE`].
    stores_left: u8,
    restart: Restart,
    with_can: bool,
    /// Sequence number of the next UART frame.
    uart_sequence: u16,
}

/// Settings that each tick uses, decoded when they change.
#[derive(Clone, Copy, Debug)]
struct InUse {
    accelerometer_range: f32,
    load_input: LoadInput,
    uart_streams: UartStreams,
    log_level: u8,
}

impl InUse {
    fn of(settings: &Settings) -> Self {
        Self {
            accelerometer_range: settings.accelerometer_range(),
            load_input: settings.load_input(),
            uart_streams: settings.uart_streams(),
            log_level: settings.log_level(),
        }
    }
}

/// Severity of a line of text. The log level of the settings is compared with these numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Error = 1,
    Warning = 2,
    Information = 3,
}

impl Foot {
    /// Creates a foot, which reports its boot on the first tick.
    ///
    /// # Errors
    /// The parameters are inconsistent. Checked [`Settings`] exclude that.
    pub fn new(settings: Settings, start: Start) -> Result<Self, ParamsError> {
        let config = settings.params().validate(Stream::KILOHERTZ)?;
        Ok(Self::with_config(settings, start, &config))
    }

    /// Creates a foot in its place, like [`new`](Self::new). Inconsistent settings are replaced by the defaults. Moving
    /// a foot to its place would take several times its size on the stack.
    ///
    /// # Errors
    /// The defaults are inconsistent, too.
    // Not inlined, because the caller never returns and would keep the parts of the foot on the stack.
    #[inline(never)]
    pub fn new_in(
        place: &mut MaybeUninit<Self>,
        settings: Settings,
        start: Start,
    ) -> Result<&mut Self, ParamsError> {
        let (settings, start, config) = match settings.params().validate(Stream::KILOHERTZ) {
            Ok(config) => (settings, start, config),
            Err(_) => {
                let settings = Settings::default();
                let config = settings.params().validate(Stream::KILOHERTZ)?;
                (settings, Start { origin: Origin::Incompatible, ..start }, config)
            }
        };
        Ok(place.write(Self::with_config(settings, start, &config)))
    }

    #[inline]
    fn with_config(settings: Settings, start: Start, config: &AnyConfig<WINDOW_CAPACITY>) -> Self {
        Self {
            estimation: Estimation::new(&settings, config),
            in_use: InUse::of(&settings),
            node: Node::new(settings, start.serial),
            published: Published::default(),
            start: Some(start),
            ticks: 0,
            tick_us: TICK_US,
            sensor: SensorHealth::new(),
            diagnosis: DiagnosisMeter::default(),
            load_open: LOAD_OPEN,
            bus: BusState::Active,
            can_lost: 0,
            latch: FaultLatch::default(),
            stores_left: 0,
            restart: Restart::default(),
            // Without a crystal there is no CAN.
            with_can: !matches!(start.crystal, Crystal::Unused { .. }),
            uart_sequence: 0,
        }
    }

    /// Lets the foot of a board without CAN send only to the serial line. Its ticks may have another period than a
    /// millisecond: `tick_us`, 1000 to 50 000 µs. Faster ticks would make the longest window of the settings exceed its
    /// capacity, and slower ones would be fewer than the estimator takes.
    pub fn disable_can(&mut self, tick_us: u32) {
        self.tick_us = tick_us;
        self.with_can = false;
        self.estimation.renew(Renewal::Restart);
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
        self.published.stage
    }

    /// Active faults, for the LED.
    #[must_use]
    pub const fn faults(&self) -> wire::Faults {
        self.node.faults()
    }

    /// Newest estimate.
    #[must_use]
    pub const fn estimate(&self) -> &ContactEstimate {
        &self.published.estimate
    }

    /// Values learnt by the estimator so far.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        self.estimation.learnt()
    }

    /// Counters since the start.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.published.counters
    }

    /// Advances by one tick: takes the sample, and the inputs up to the first request with a response. Afterwards the
    /// outbox contains the frames of the tick for the bus.
    pub fn tick(&mut self, inputs: &Inputs<'_>, out: &mut Outbox) {
        out.clear();
        let Inputs { tick, measurement, received, .. } = *inputs;
        self.ticks = self.ticks.wrapping_add(1);
        self.report_start(out);
        if let Some(reloaded) = &received.reloaded {
            self.take_reloaded(reloaded, out);
        }
        for input in received.split().0 {
            self.take_input(input, out);
        }
        self.count(tick, measurement, out);
        self.diagnosis.take(tick, measurement, &mut self.published.diagnosis);
        self.check_sensor(measurement, out);
        let load = self.load(inputs.load_reading, out);

        let settings = self.node.settings();
        self.published.estimate =
            self.estimation.update(measurement.sample, load, settings, self.tick_us);
        self.set_stage(measurement, out);

        self.send_can(out);
    }

    /// Makes the messages of the same tick for the serial line. They follow the contact on the bus, because encoding them
    /// first would delay it.
    pub fn stream(&mut self, inputs: &Inputs<'_>, out: &mut Outbox) {
        out.clear();
        self.send_uart(inputs.tick, inputs.measurement, out);
    }

    /// Does the work of the same tick that has no deadline: answers requests, ends faults that were events, and checks
    /// the last rest. Afterwards the outbox contains the responses.
    pub fn respond(&mut self, inputs: &Inputs<'_>, out: &mut Outbox) {
        out.clear();
        let (_, requests) = inputs.received.split();
        if !requests.is_empty() {
            self.published.learnt = self.learnt();
            self.published.costs = inputs.costs;
            inputs.measurement.bus.write(&mut self.published.diagnosis);
        }
        for input in requests {
            self.take_input(input, out);
        }
        if let Some(request) = self.restart.next() {
            out.request(request);
        }
        for fault in self.latch.tick().iter() {
            self.clear(fault, out);
        }
        if self.ticks.is_multiple_of(REST_TICKS) {
            self.check_rest(out);
            self.stores_left = self.stores_left.saturating_add(1).min(STORES_AT_ONCE);
        }
        self.report_liveness(inputs.measurement, out);
    }

    /// Counts frames that were dropped.
    pub fn count_dropped(&mut self, dropped: Dropped) {
        self.published.counters.add(Counter::CanDropped, dropped.can);
        self.published.counters.add(Counter::UartDropped, dropped.uart);
    }

    /// Reports the boot-up and the faults known since before the start, on the first tick.
    fn report_start(&mut self, out: &mut Outbox) {
        let Some(start) = self.start.take() else {
            return;
        };
        self.stores_left = match start.cause {
            BootCause::PowerUp => STORES_AT_ONCE,
            BootCause::Commanded => 0,
        };
        self.boot(start.cause, out);
        match start.crystal {
            Crystal::InUse => {}
            Crystal::NotMeasured => self.log(Level::Warning, "crystal not measured", out),
            Crystal::Unused { khz } => self.report_crystal(khz, out),
        }
        self.check_origin(start.origin, out);
        self.node.set_tick(self.tick_us as u16);
        self.published.hardware = start.hardware;
        self.published.brown_out_level = start.brown_out_level.unwrap_or(0);
        self.published.program = start.program;
        self.published.diagnosis = start.diagnosis;
        self.published.crash = start.crash;
        if start.brown_out_level == Some(0) {
            self.log(Level::Warning, "brown-out reset is off: see 0x2114", out);
        }
        if let Some(crash) = start.crash {
            self.raise(crash.fault, crash.program_counter, out);
            self.latch.hold_for(crash.fault, CRASH_TICKS);
        }
    }

    /// Raises and logs the fault of a crystal that does not start or has another frequency.
    fn report_crystal(&mut self, khz: u32, out: &mut Outbox) {
        self.raise(Fault::CrystalMissing, khz, out);
        if khz > 0 {
            let tenths = (khz + 50) / 100;
            let mut line = LogMessage::new(Level::Error as u8, "crystal of 00.0 MHz");
            line.set_digit(11, tenths / 100);
            line.set_digit(12, tenths / 10);
            line.set_digit(14, tenths);
            self.log_line(Level::Error, line, out);
        }
    }

    /// Boots the node.
    fn boot(&mut self, cause: BootCause, out: &mut Outbox) {
        let frame = self.node.boot(cause);
        self.send_frame(Lane::Notice, frame, out);
    }

    /// Raises or clears the fault of settings that differ from the stored ones.
    fn check_origin(&mut self, origin: Origin, out: &mut Outbox) {
        self.set(Fault::ConfigCorrupted, origin.fault_detail(), out);
    }

    /// Applies settings that the board has reloaded, and resets the communication.
    fn take_reloaded(&mut self, reloaded: &Reloaded, out: &mut Outbox) {
        self.restart.is_passed = false;
        let Reloaded { settings, origin } = reloaded;
        let renewal = if settings.learnt() == self.settings().learnt() {
            Renewal::Continue
        } else {
            Renewal::Restart
        };
        self.node.set_settings(settings.clone());
        self.use_settings();
        self.estimation.renew(renewal);
        self.boot(BootCause::Commanded, out);
        self.check_origin(*origin, out);
    }

    /// Decodes the settings that each tick uses.
    fn use_settings(&mut self) {
        let settings = self.node.settings();
        self.in_use = InUse::of(settings);
        self.estimation.use_settings(settings);
    }

    /// Handles an input, and answers it.
    fn take_input(&mut self, input: &Input, out: &mut Outbox) {
        match input {
            Input::Can(frame, at) => {
                let outcome = self.node.receive(frame, *at, &mut self.published);
                self.send_frame(Lane::Answer, outcome.reply, out);
                self.act(outcome.event, out);
            }
            Input::Uart(request) => {
                let outcome = uart_requests::answer(&mut self.node, request, &mut self.published);
                if let Some(response) = outcome.response {
                    self.send_message(Lane::Answer, &Message::ConfigResponse(response), out);
                }
                self.act(outcome.event, out);
            }
            Input::UartRefused(count) => self.add(Counter::UartRefused, *count),
            Input::UartLost(count) => {
                self.add(Counter::UartOverruns, *count);
                let lost = self.counters().get(Counter::UartOverruns);
                self.raise_event(Fault::UartOverrun, lost, out);
            }
            Input::UartDropped(count) => self.add(Counter::UartDropped, *count),
            Input::CanWithdrawn(count) => self.add(Counter::CanDropped, *count),
            Input::CanLost(count) => {
                self.can_lost = self.can_lost.wrapping_add(*count);
                self.raise_event(Fault::CanOverrun, self.can_lost, out);
            }
            Input::Bus(state) => self.take_bus_state(*state, out),
            Input::Stored(result) => self.finish_settings(*result, out),
            Input::Completed(result) => {
                self.finish(result.map_err(StoreFailed::abort_code), out);
            }
        }
    }

    /// Handles an event of the node.
    fn act(&mut self, event: Option<Event>, out: &mut Outbox) {
        let Some(event) = event else {
            return;
        };
        match event {
            Event::Changed { concern, .. } => {
                self.use_settings();
                match concern {
                    Concern::Learnt => self.estimation.renew(Renewal::Restart),
                    Concern::Correction
                    | Concern::Load
                    | Concern::Estimator
                    | Concern::Parameter(_) => self.estimation.renew(Renewal::Continue),
                    Concern::Node | Concern::Stream | Concern::Sensor => {}
                }
            }
            Event::Store | Event::Restore if self.stores_left == 0 => {
                self.finish(Err(AbortCode::TooSoon), out);
            }
            Event::Store => {
                out.request(Request::Store(self.settings().clone(), self.erase_permission()));
            }
            Event::Restore => out.request(Request::Restore(self.erase_permission())),
            Event::ProtectSupply => out.request(Request::ProtectSupply),
            Event::ConfirmProgram => out.request(Request::ConfirmProgram),
            Event::StopProgram => self.restart.wanted = Some(Request::StopProgram),
            Event::ResetNode => self.restart.wanted = Some(Request::Reset),
            // A reset of the node includes a reset of the communication.
            Event::ResetCommunication if self.restart.wanted == Some(Request::Reset) => {}
            Event::ResetCommunication => self.restart.wanted = Some(Request::Reload),
            Event::Calibration(Calibration::Forget) => self.estimation.renew(Renewal::Restart),
            // The estimator has the values already.
            Event::Calibration(Calibration::Keep) => {}
            // The node keeps the load and the time, with their age.
            Event::Load(_) | Event::State(_) | Event::Sync(_) | Event::Time(_) => {}
        }
    }

    /// Returns whether a store may erase. An erase would interrupt process data, so only a foot that sends none may.
    fn erase_permission(&self) -> Erase {
        if self.node.state() == NmtState::Operational { Erase::Refused } else { Erase::Allowed }
    }

    /// Finishes a store or a restore of the settings.
    fn finish_settings(&mut self, result: Result<(), StoreFailed>, out: &mut Outbox) {
        if result != Err(StoreFailed::NeedsErase) {
            self.stores_left = self.stores_left.saturating_sub(1);
        }
        match result {
            Ok(()) => {
                self.clear(Fault::ConfigStore, out);
                self.clear(Fault::ConfigCorrupted, out);
            }
            Err(StoreFailed::NeedsErase) => {}
            Err(error) => self.raise(Fault::ConfigStore, error.fault_detail(), out),
        }
        self.finish(result.map_err(StoreFailed::abort_code), out);
    }

    /// Ends the request that the node has pending, and answers its requester.
    fn finish(&mut self, result: Result<(), AbortCode>, out: &mut Outbox) {
        match self.node.finish(result) {
            Some(Finished::Can(frame)) => self.send_frame(Lane::Answer, Some(frame), out),
            Some(Finished::Written(address)) => {
                let response = uart_requests::finished(address, result);
                self.send_message(Lane::Answer, &Message::ConfigResponse(response), out);
            }
            None => {}
        }
    }

    /// Counts the tick, its sample, and ticks missed before it.
    fn count(&mut self, tick: &Tick, measurement: &Measurement, out: &mut Outbox) {
        self.add(Counter::Ticks, 1);
        self.add(
            match measurement.sample.checked_validity() {
                Validity::Valid => Counter::ValidSamples,
                Validity::Saturated(_) => Counter::SaturatedSamples,
                Validity::Stale | Validity::Invalid => Counter::MissedSamples,
            },
            1,
        );
        let counted = self.counters().get(Counter::SensorRestarts);
        self.add(Counter::SensorRestarts, measurement.restarts.wrapping_sub(counted));
        if tick.missed > 0 {
            self.add(Counter::LateTicks, tick.missed);
            let late_us = tick.missed.saturating_mul(self.tick_us);
            self.raise_event(Fault::LateTick, late_us, out);
        }
    }

    fn add(&mut self, counter: Counter, count: u32) {
        self.published.counters.add(counter, count);
    }

    /// Raises faults of the sensor at once. Clears them after good samples.
    fn check_sensor(&mut self, measurement: &Measurement, out: &mut Outbox) {
        if let Some(raw) = &measurement.raw {
            self.published.temperature = raw.temperature.to_celsius();
            let is_dead = measurement.read_at == ReadAt::Timer;
            self.set(Fault::DataReadyDead, is_dead.then_some(0), out);
        }
        if let Some(SensorFault { fault, detail }) = measurement.fault {
            self.raise(fault, detail, out);
        }
        let verdict = self.sensor.judge(measurement);
        if verdict.is_misread {
            self.raise_event(Fault::Misread, measurement.misreads, out);
        }
        let samples = verdict.is_saturated.then_some(u32::from(SATURATED_TICKS));
        self.set(Fault::SensorSaturated, samples, out);
        if verdict.is_sound {
            // A failed self-test stays a fault until the next start.
            for fault in [
                Fault::SensorSilent,
                Fault::SensorFrozen,
                Fault::SensorWrongId,
                Fault::SensorReset,
                Fault::SensorConfigMismatch,
                Fault::SensorTiming,
            ] {
                self.clear(fault, out);
            }
        }
    }

    /// Current load on the foot, if it is known.
    fn load(&mut self, reading: Option<u16>, out: &mut Outbox) -> Option<Load> {
        let input = self.in_use.load_input;
        let analog = (input.source == LoadSource::Analog).then_some(reading);
        let is_open = analog.is_some_and(|reading| {
            !reading.is_some_and(|reading| LOAD_READINGS.contains(&reading))
        });
        if self.load_open.update(is_open) {
            let detail = reading.map_or(u32::MAX, u32::from);
            self.raise(Fault::LoadSensorOpen, detail, out);
            return None;
        }
        self.clear(Fault::LoadSensorOpen, out);
        match input.source {
            LoadSource::None => None,
            LoadSource::Analog => {
                let reading = reading.filter(|_| !is_open)?;
                Some(Load(input.scale * (f32::from(reading) - input.offset)))
            }
            LoadSource::Can => self.node.load().map(Into::into),
        }
    }

    /// Sets the stage, and reports a change.
    fn set_stage(&mut self, measurement: &Measurement, out: &mut Outbox) {
        let stage = match measurement.activity {
            Activity::Starting => Stage::Starting,
            Activity::SelfTest => Stage::SelfTest,
            Activity::Recovering => Stage::Recovering,
            Activity::Measuring => {
                if self.estimate().flags.contains(Flag::AttitudeNotInitialised) {
                    Stage::HoldStill
                } else {
                    Stage::Running
                }
            }
        };
        if stage != self.stage() {
            self.published.stage = stage;
            self.log(Level::Information, stage.name(), out);
        }
    }

    /// Advances the node, and sends the frames that are due on the bus.
    fn send_can(&mut self, out: &mut Outbox) {
        let with_can = self.with_can;
        self.node.tick(&self.published, |due, frame| {
            if with_can {
                let lane = match due {
                    Due::Pdo(Pdo::Contact) => Lane::Estimate,
                    Due::Pdo(_) => Lane::Stream,
                    Due::Heartbeat | Due::Emergency => Lane::Notice,
                };
                out.push_can(lane, frame);
            }
        });
    }

    /// Sends the messages that are due on the serial line.
    fn send_uart(&mut self, tick: &Tick, measurement: &Measurement, out: &mut Outbox) {
        if self.node.state() == NmtState::Stopped {
            return;
        }
        let streams = self.in_use.uart_streams;
        let ticks = self.ticks;
        let tick_us = self.tick_us.max(1);
        // The nearest number of ticks.
        let is_due = |every_ms: u16| {
            let every = (u32::from(every_ms) * 1_000 + tick_us / 2) / tick_us;
            every_ms != 0 && ticks.is_multiple_of(every.max(1))
        };
        if is_due(streams.contact) {
            let contact = ContactMessage::new(self.estimate(), self.node.faults());
            self.send_message(Lane::Estimate, &Message::Contact(contact), out);
        }
        if is_due(streams.raw)
            && let Some(raw) = raw_message(measurement, self.in_use.accelerometer_range)
        {
            self.send_message(Lane::Stream, &Message::Raw(raw), out);
        }
        if is_due(streams.health) {
            let health = HealthMessage {
                timestamp: tick.time,
                stage: self.stage(),
                state: self.node.state(),
                id: self.node.id(),
                faults: self.node.faults(),
                temperature: Quantity::new(self.published.temperature, TEMPERATURE_STEP),
                counters: self.published.counters,
                unknown_faults: 0,
            };
            self.send_message(Lane::Stream, &Message::Health(health), out);
        }
    }

    /// Raises, holds or clears the faults of the bus as its state changes.
    fn take_bus_state(&mut self, state: BusState, out: &mut Outbox) {
        let before = core::mem::replace(&mut self.bus, state);
        if state == BusState::Off && before != BusState::Off {
            self.add(Counter::CanBusOff, 1);
            self.report_bus_off(out);
        }
        if before == BusState::Off && state != BusState::Off {
            self.node.release(Fault::CanBusOff);
            self.latch.hold_for(Fault::CanBusOff, EVENT_TICKS);
        }
        match state {
            // The fault is kept for a while, because a flickering bus would otherwise cause an emergency each time.
            BusState::Active if before != BusState::Active => {
                self.latch.hold_for(Fault::CanErrorPassive, EVENT_TICKS);
            }
            BusState::Active => {}
            BusState::Passive(receive, transmit) => {
                self.latch.keep(Fault::CanErrorPassive);
                let detail = u32::from_le_bytes([receive, transmit, 0, 0]);
                self.raise(Fault::CanErrorPassive, detail, out);
            }
            BusState::Off => {}
        }
    }

    /// Reports bus-off over the serial line at once. Its emergency waits until the bus has recovered.
    fn report_bus_off(&mut self, out: &mut Outbox) {
        self.latch.keep(Fault::CanBusOff);
        let is_new = !self.faults().contains(Fault::CanBusOff);
        let times = self.counters().get(Counter::CanBusOff);
        self.node.raise_held_back(Fault::CanBusOff, times);
        if is_new {
            self.log(Level::Error, Fault::CanBusOff.name(), out);
        }
    }

    /// Raises a fault while the gyroscope's bias is too large to be learnt. Raises another fault after a rest with a
    /// wrong specific force, and clears it after a rest with a plausible one.
    fn check_rest(&mut self, out: &mut Outbox) {
        self.set(Fault::GyroBias, self.estimation.excess_bias(), out);
        if let Some(force) = self.estimation.force_at_rest() {
            if FORCE_AT_REST.contains(&force) {
                self.clear(Fault::SensorScale, out);
            } else if !self.faults().void_estimate() {
                self.raise(Fault::SensorScale, (force * (1000.0 / STANDARD_GRAVITY)) as u32, out);
            }
        }
    }

    /// Raises `fault` if there is a detail, and clears it otherwise.
    fn set(&mut self, fault: Fault, detail: Option<u32>, out: &mut Outbox) {
        match detail {
            Some(detail) => self.raise(fault, detail, out),
            None => self.clear(fault, out),
        }
    }

    /// Raises a fault unless it is active: sends an emergency and a line of text.
    // Not inlined, because it is called in twenty places and seldom does anything.
    #[inline(never)]
    fn raise(&mut self, fault: Fault, detail: u32, out: &mut Outbox) {
        if self.faults().contains(fault) {
            return;
        }
        let emergency = self.node.raise(fault, detail);
        self.send_frame(Lane::Notice, emergency, out);
        self.log(Level::Error, fault.name(), out);
    }

    /// Raises a fault that is an event. It stays active for a while.
    fn raise_event(&mut self, fault: Fault, detail: u32, out: &mut Outbox) {
        self.raise(fault, detail, out);
        self.latch.hold_for(fault, EVENT_TICKS);
    }

    /// Clears a fault, if it is active.
    fn clear(&mut self, fault: Fault, out: &mut Outbox) {
        if self.faults().contains(fault) {
            let emergency = self.node.clear(fault);
            self.send_frame(Lane::Notice, emergency, out);
        }
    }

    /// Sends a line of text if the settings allow its level.
    #[inline(never)]
    fn log(&mut self, level: Level, text: &str, out: &mut Outbox) {
        self.log_line(level, LogMessage::new(level as u8, text), out);
    }

    /// Sends a complete line if the settings allow its level.
    fn log_line(&mut self, level: Level, line: LogMessage, out: &mut Outbox) {
        if level as u8 <= self.in_use.log_level {
            // Errors go before responses, because many responses may wait.
            let lane = match level {
                Level::Error => Lane::Notice,
                Level::Warning | Level::Information => Lane::Answer,
            };
            self.send_message(lane, &Message::Log(line), out);
        }
    }

    /// Sends a frame on the bus, if there is one.
    fn send_frame(&self, lane: Lane, frame: Option<CanFrame>, out: &mut Outbox) {
        if let Some(frame) = frame.filter(|_| self.with_can) {
            out.push_can(lane, frame);
        }
    }

    /// Sends a message on the serial line.
    fn send_message(&mut self, lane: Lane, message: &Message, out: &mut Outbox) {
        out.push_uart(lane, self.uart_sequence, message);
        self.uart_sequence = self.uart_sequence.wrapping_add(1);
    }

    /// Reports the workers that are alive, for the watchdog. A failed sensor has its own fault, and does not cause a
    /// restart.
    fn report_liveness(&self, measurement: &Measurement, out: &mut Outbox) {
        let excused = measurement.activity != Activity::Measuring || self.faults().void_estimate();
        if measurement.raw.is_some() || excused {
            out.report(Worker::Sampling);
        }
        if self.estimate().timestamp == measurement.sample.timestamp {
            out.report(Worker::Estimator);
        }
        if !self.with_can {
            out.report(Worker::Can);
        }
    }
}

/// Health of the sensor over the last samples.
#[derive(Debug)]
struct SensorHealth {
    /// Good samples since the last bad one.
    sound_ticks: u16,
    saturated: Hysteresis,
    /// Misreads on the sensor's bus so far.
    misreads: u32,
}

/// Health of the sensor in a tick.
struct Verdict {
    /// Whether a register was misread since the previous tick.
    is_misread: bool,
    is_saturated: bool,
    /// Whether enough samples in a row were good.
    is_sound: bool,
}

impl SensorHealth {
    const fn new() -> Self {
        Self { sound_ticks: 0, saturated: Hysteresis::new(1, SOUND_TICKS), misreads: 0 }
    }

    fn judge(&mut self, measurement: &Measurement) -> Verdict {
        let is_good =
            matches!(measurement.sample.validity, Validity::Valid | Validity::Saturated(_));
        self.sound_ticks = match measurement.fault {
            None if is_good => self.sound_ticks.saturating_add(1),
            _ => 0,
        };
        let misreads = core::mem::replace(&mut self.misreads, measurement.misreads);
        Verdict {
            is_misread: misreads != measurement.misreads,
            is_saturated: self.saturated.update(measurement.saturated_for_long),
            is_sound: self.sound_ticks >= SOUND_TICKS,
        }
    }
}

/// Request to restart the program or to reload its settings. The board gets only one such request at a time. The next
/// one is passed on when the settings have been reloaded.
#[derive(Debug, Default)]
struct Restart {
    wanted: Option<Request>,
    is_passed: bool,
}

impl Restart {
    /// Request to pass to the board now.
    fn next(&mut self) -> Option<Request> {
        if self.is_passed {
            return None;
        }
        let request = self.wanted.take();
        self.is_passed = request.is_some();
        request
    }
}

/// Returns a message with the codes of the sample, or `None` if there are none. `range` is
/// [`Settings::accelerometer_range`](wire::Settings::accelerometer_range).
fn raw_message(measurement: &Measurement, range: f32) -> Option<uart::RawMessage> {
    let raw = measurement.raw?;
    Some(uart::RawMessage {
        timestamp: measurement.sample.timestamp,
        validity: measurement.sample.validity,
        temperature: Quantity::new(raw.temperature.to_celsius(), TEMPERATURE_STEP),
        acceleration: raw.specific_force.codes,
        rate: raw.angular_rate.codes,
        acceleration_scale: raw.specific_force.full_scale.sensitivity() * range,
        rate_scale: raw.angular_rate.full_scale.sensitivity(),
    })
}
