//! The foot: takes a sample each tick, and sends frames on the same tick.
//!
//! [`Foot::tick`] lists the steps of a millisecond, and this file follows their order:
//!
//! - requests that have arrived;
//! - faults of the sensor, the bus and the tick;
//! - the load;
//! - the estimate, by a new estimator if settings of the estimator have changed;
//! - frames and lines of text;
//! - responses.
//!
//! The work of a tick is bounded: at most [`INPUTS_PER_TICK`] requests, one estimate, and one frame of each kind.
//!
//! **Fail-safe.** While a fault that [voids the estimate](Fault) is active, every frame has P = 0 and the fault flag,
//! whatever the estimate is. Without a valid sample no frame reports "stable". A fault of the sensor stays active until
//! [`SOUND_TICKS`] consecutive samples are good.

use core::mem::MaybeUninit;
use core::ops::RangeInclusive;

use estimator_core::any::{AnyConfig, AnyEstimator};
use estimator_core::correction::AccelerometerCorrection;
use estimator_core::mounting::Mounting;
use estimator_core::{
    ContactEstimate, Flag, Flags, Gravity, Learnt, Load, ParamsError, Stream, Timestamp, Validity,
};
use lsm6dsox::scale::{DEGREE, FullScale, STANDARD_GRAVITY};
use storage::{Erase, Origin, StoreFailed};
use wire::dictionary::Concern;
use wire::node::{BootCause, Calibration, Crash, NmtState, Program};
use wire::pdo::{Quantity, TEMPERATURE_STEP};
use wire::settings::{LoadInput, LoadSource, UartStreams, WINDOW_CAPACITY};
use wire::uart::{self, ContactMessage, HealthMessage, LogMessage, Message};
use wire::{
    AbortCode, Address, CanFrame, Counter, Counters, Event, Fault, Node, NodeId, Settings, Stage,
};

use crate::ports::{BusState, Input, Lane, Mailboxes, Ports};
use crate::sampling::{Activity, Measurement, ReadAt, SATURATED_TICKS, SensorFault, Tick};
use crate::supervision::{FaultLatch, Hysteresis, Worker};
use crate::thread::{Reloaded, Request};
use crate::uart_requests;

/// Period of the ticks unless [`Foot::disable_can`] sets another, µs.
const TICK_US: u32 = 1_000;

/// Maximum number of requests handled per tick. Further requests wait for the next tick.
pub const INPUTS_PER_TICK: usize = 8;

/// Stores and restores that may follow each other at once after power-up. Later, there is one in each 1024 ticks.
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

/// Specific force at rest of a sound accelerometer, m/s². An LSM6DSO32 has the same identity as an LSM6DSOX, but half
/// of its codes. Beyond these limits so much of gravity is left in the estimator that the foot never rests.
const FORCE_AT_REST: RangeInclusive<f32> = 0.88 * STANDARD_GRAVITY..=1.12 * STANDARD_GRAVITY;

/// Readings of a connected load input. At the ends of the 12-bit range the input is open or shorted.
pub const LOAD_READINGS: RangeInclusive<u16> = 16..=4079;

/// Ticks after which the input counts as open, and as connected again.
const LOAD_OPEN: Hysteresis = Hysteresis::new(10, 100);

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
        /// Its frequency, kHz; 0 if it does not start.
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
}

/// Node, estimator and the state between them.
#[derive(Debug)]
pub struct Foot {
    node: Node,
    /// Settings of the node that each tick uses.
    in_use: InUse,
    estimator: AnyEstimator<WINDOW_CAPACITY>,
    /// Pending request for a new estimator.
    renewal: Option<Renewal>,
    counters: Counters,
    /// Temperature of the sensor, °C; NaN before the first sample.
    temperature: f32,
    stage: Stage,
    /// Present until the first tick has reported the start.
    start: Option<Start>,
    ticks: u32,
    /// Period of the ticks, µs.
    tick_us: u32,

    /// Request that needs a response, deferred until the estimate is sent.
    deferred: Option<Input>,
    /// Requester of the store that is pending, if one is.
    waiting_requester: Option<Requester>,
    /// Number of stores that are possible now, at most [`STORES_AT_ONCE`].
    stores_left: u8,
    /// Request to the board that waits for room in the queue.
    pending_request: Option<Request>,

    /// Good samples since the last bad one.
    sound_ticks: u16,
    saturated: Hysteresis,
    latch: FaultLatch,
    bus: BusState,
    /// Received CAN frames lost since the start.
    can_lost: u32,
    /// Misreads on the sensor's bus that were reported.
    misreads: u32,
    load_open: Hysteresis,

    with_can: bool,
    /// Sequence number of the next UART frame.
    uart_sequence: u16,
}

/// Settings that each tick uses, decoded when they change.
#[derive(Clone, Copy, Debug)]
struct InUse {
    accelerometer: AccelerometerCorrection,
    accelerometer_range: f32,
    mounting: Mounting,
    load_input: LoadInput,
    uart_streams: UartStreams,
    log_level: u8,
}

impl InUse {
    fn of(settings: &Settings) -> Self {
        Self {
            accelerometer: settings.accelerometer(),
            accelerometer_range: settings.accelerometer_range(),
            mounting: settings.mounting(),
            load_input: settings.load_input(),
            uart_streams: settings.uart_streams(),
            log_level: settings.log_level(),
        }
    }
}

/// Start of a new estimator. Of two requests, the greater takes precedence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Renewal {
    /// With the values learnt by the previous one.
    Continue,
    /// With the learnt values of the settings.
    Restart,
}

/// Requester of a store, a restore, a protection or a confirmation. The response goes to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Requester {
    Can,
    Uart(Address),
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
    // Not inlined: the caller never returns, and would keep the parts of the foot on the stack.
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
            in_use: InUse::of(&settings),
            node: Node::new(settings, start.serial),
            estimator: AnyEstimator::new(config),
            renewal: None,
            counters: Counters::default(),
            temperature: f32::NAN,
            stage: Stage::Starting,
            start: Some(start),
            ticks: 0,
            tick_us: TICK_US,
            deferred: None,
            waiting_requester: None,
            stores_left: 0,
            pending_request: None,
            sound_ticks: 0,
            saturated: Hysteresis::new(1, SOUND_TICKS),
            latch: FaultLatch::default(),
            bus: BusState::Active,
            can_lost: 0,
            misreads: 0,
            load_open: LOAD_OPEN,
            // Without a crystal there is no CAN.
            with_can: !matches!(start.crystal, Crystal::Unused { .. }),
            uart_sequence: 0,
        }
    }

    /// Sends only to the serial line, on a board without CAN. The ticks may then have another period than a
    /// millisecond: `tick_us`, 1 to 65 535 µs.
    pub fn disable_can(&mut self, tick_us: u32) {
        self.tick_us = tick_us;
        self.with_can = false;
        self.renew(Renewal::Restart);
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

    /// Advances by one tick. `reading` is the newest reading of the analog load input, if the board has one.
    pub fn tick(
        &mut self,
        tick: &Tick,
        measurement: &Measurement,
        reading: Option<u16>,
        ports: &Ports<impl Mailboxes>,
    ) {
        self.ticks = self.ticks.wrapping_add(1);
        self.report_start(ports);
        let taken = self.take_inputs(ports);
        self.count(tick, measurement, ports);
        self.check_sensor(measurement, ports);
        let load = self.load(reading, ports);

        self.renew_estimator();
        let mut sample = measurement.sample;
        // (Reading − bias) × scale, along the sensor's axes. Then both vectors are rotated to the axes of the foot.
        sample.specific_force = self.in_use.accelerometer.apply(sample.specific_force);
        self.in_use.mounting.apply(&mut sample.specific_force, &mut sample.angular_rate);
        let estimate = self.estimator.update(&sample, load);
        self.set_stage(measurement, estimate.flags, ports);

        self.send_can(&estimate, ports);
        self.send_uart(&estimate, measurement, tick.time, ports);
        // Responses have no deadline. They follow after the frames are sent.
        self.answer_deferred(INPUTS_PER_TICK - taken, ports);
        self.clear_expired_faults(ports);
        if self.ticks.is_multiple_of(REST_TICKS) {
            self.check_rest(ports);
            self.allow_store();
        }
        self.report_liveness(measurement, ports);
    }

    /// Reports the boot-up and the faults known since before the start, on the first tick.
    fn report_start(&mut self, ports: &Ports<impl Mailboxes>) {
        let Some(start) = self.start.take() else {
            return;
        };
        self.allow_stores(match start.cause {
            BootCause::PowerUp => STORES_AT_ONCE,
            BootCause::Commanded => 0,
        });
        self.boot(start.cause, ports);
        match start.crystal {
            Crystal::InUse => {}
            Crystal::NotMeasured => self.log(Level::Warning, "crystal not measured", ports),
            Crystal::Unused { khz } => self.report_crystal(khz, ports),
        }
        self.check_origin(start.origin, ports);
        self.node.set_hardware(start.hardware);
        self.node.set_tick(self.tick_us as u16);
        self.node.set_brown_out_level(start.brown_out_level.unwrap_or(0));
        self.node.set_program(start.program);
        if start.brown_out_level == Some(0) {
            let text = "brown-out reset is off: see 0x2114";
            self.log(Level::Warning, text, ports);
        }
        if let Some(crash) = start.crash {
            self.node.set_crash(crash);
            self.raise_crash(crash, ports);
        }
    }

    /// Raises and logs the fault of a crystal that does not start or has another frequency.
    fn report_crystal(&mut self, khz: u32, ports: &Ports<impl Mailboxes>) {
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

    /// Boots the node.
    fn boot(&mut self, cause: BootCause, ports: &Ports<impl Mailboxes>) {
        if let Some(frame) = self.node.boot(cause) {
            self.push_can(Lane::Notice, frame, ports);
        }
    }

    /// Raises or clears the fault of settings that differ from the stored ones.
    fn check_origin(&mut self, origin: Origin, ports: &Ports<impl Mailboxes>) {
        match origin.fault_detail() {
            Some(detail) => self.raise(Fault::ConfigCorrupted, detail, ports),
            None => self.clear(Fault::ConfigCorrupted, ports),
        }
    }

    /// Handles inputs in order, up to the first request that needs a response. Returns the number of inputs handled.
    fn take_inputs(&mut self, ports: &Ports<impl Mailboxes>) -> usize {
        if let Some(reloaded) = ports.take_reloaded() {
            self.take_reloaded(reloaded, ports);
        }
        for taken in 0..INPUTS_PER_TICK {
            let Some(input) = ports.take_input() else {
                return taken;
            };
            if input.needs_answer() {
                self.deferred = Some(input);
                return taken;
            }
            self.take_input(&input, ports);
        }
        INPUTS_PER_TICK
    }

    /// Applies settings that the board has reloaded, and resets the communication.
    fn take_reloaded(&mut self, reloaded: Reloaded, ports: &Ports<impl Mailboxes>) {
        let Reloaded { settings, origin } = reloaded;
        let renewal = if settings.learnt() == self.settings().learnt() {
            Renewal::Continue
        } else {
            Renewal::Restart
        };
        self.node.set_settings(settings);
        self.in_use = InUse::of(self.node.settings());
        self.renew(renewal);
        self.boot(BootCause::Commanded, ports);
        self.check_origin(origin, ports);
    }

    /// Answers the deferred request, and handles later inputs: at most `most` in all.
    fn answer_deferred(&mut self, most: usize, ports: &Ports<impl Mailboxes>) {
        if let Some(input) = self.deferred.take() {
            self.node.set_learnt(self.learnt());
            self.node.set_costs(ports.costs.largest());
            self.take_input(&input, ports);
            for _ in 1..most {
                let Some(input) = ports.take_input() else {
                    break;
                };
                self.take_input(&input, ports);
            }
        }
        self.pass_pending_request(ports);
    }

    /// Passes the request to the board if the queue has room. Otherwise tries again on the next tick.
    fn pass_pending_request(&mut self, ports: &Ports<impl Mailboxes>) {
        if let Some(request) = self.pending_request.take()
            && !ports.request(request.clone())
        {
            self.pending_request = Some(request);
        }
    }

    /// Handles an input, and answers it.
    fn take_input(&mut self, input: &Input, ports: &Ports<impl Mailboxes>) {
        match input {
            Input::Can(frame, at) => {
                let outcome = self.node.receive(frame, *at);
                if let Some(reply) = outcome.reply {
                    self.push_can(Lane::Answer, reply, ports);
                }
                if let Some(event) = outcome.event {
                    self.act(event, Requester::Can, ports);
                }
            }
            Input::Uart(request) => {
                let outcome = uart_requests::answer(&mut self.node, request);
                if let Some(response) = outcome.response {
                    self.push_uart(Lane::Answer, &Message::ConfigResponse(response), ports);
                }
                if let Some(event) = outcome.event {
                    let address = outcome.address.unwrap_or(Address::new(0, 0));
                    self.act(event, Requester::Uart(address), ports);
                }
            }
            Input::UartRefused(count) => self.counters.add(Counter::UartRefused, *count),
            Input::UartLost(count) => {
                self.counters.add(Counter::UartOverruns, *count);
                let lost = self.counters.get(Counter::UartOverruns);
                self.raise_event(Fault::UartOverrun, lost, ports);
            }
            Input::UartDropped(count) => self.counters.add(Counter::UartDropped, *count),
            Input::CanWithdrawn(count) => self.counters.add(Counter::CanDropped, *count),
            Input::CanLost(count) => self.count_lost_can(*count, ports),
            Input::Bus(state) => self.take_bus_state(*state, ports),
            Input::Stored(result) => self.finish_settings(*result, ports),
            Input::Completed(result) => self.finish_request(*result, ports),
        }
    }

    /// Handles an event of the node.
    fn act(&mut self, event: Event, requester: Requester, ports: &Ports<impl Mailboxes>) {
        match event {
            Event::Changed { concern, .. } => {
                self.in_use = InUse::of(self.node.settings());
                match concern {
                    Concern::Learnt => self.renew(Renewal::Restart),
                    Concern::Correction
                    | Concern::Load
                    | Concern::Estimator
                    | Concern::Parameter(_) => self.renew(Renewal::Continue),
                    Concern::Node | Concern::Stream | Concern::Sensor => {}
                }
            }
            Event::Store | Event::Restore if self.stores_left == 0 => {
                self.answer_request(requester, Err(AbortCode::TooSoon), ports);
            }
            Event::Store => {
                let request = Request::Store(self.settings().clone(), self.erase_permission());
                self.pass_on(requester, request, ports);
            }
            Event::Restore => {
                self.pass_on(requester, Request::Restore(self.erase_permission()), ports);
            }
            Event::ProtectSupply => self.pass_on(requester, Request::ProtectSupply, ports),
            Event::ConfirmProgram => self.pass_on(requester, Request::ConfirmProgram, ports),
            Event::StopProgram => self.pending_request = Some(Request::StopProgram),
            Event::ResetNode => self.pending_request = Some(Request::Reset),
            // A reset of the node includes a reset of the communication.
            Event::ResetCommunication if self.pending_request == Some(Request::Reset) => {}
            Event::ResetCommunication => self.pending_request = Some(Request::Reload),
            Event::Calibration(Calibration::Forget) => self.renew(Renewal::Restart),
            // The estimator has the values already.
            Event::Calibration(Calibration::Keep) => {}
            // The node keeps the load and the time, with their age.
            Event::Load(_) | Event::State(_) | Event::Sync(_) | Event::Time(_) => {}
        }
    }

    /// Passes a request to the board for `requester`, who waits for its result. There is one such request at a time.
    fn pass_on(&mut self, requester: Requester, request: Request, ports: &Ports<impl Mailboxes>) {
        if self.waiting_requester.is_none() && ports.request(request) {
            self.waiting_requester = Some(requester);
        } else {
            self.answer_request(requester, Err(AbortCode::Hardware), ports);
        }
    }

    /// Returns whether a store may erase. An erase would interrupt process data, so only a foot that sends none may.
    fn erase_permission(&self) -> Erase {
        if self.node.state() == NmtState::Operational { Erase::Refused } else { Erase::Allowed }
    }

    /// Sets the number of stores that are possible now.
    const fn allow_stores(&mut self, count: u8) {
        self.stores_left = count;
    }

    /// Makes one more store possible.
    fn allow_store(&mut self) {
        self.allow_stores(self.stores_left.saturating_add(1).min(STORES_AT_ONCE));
    }

    /// Finishes a store or a restore of the settings.
    fn finish_settings(&mut self, result: Result<(), StoreFailed>, ports: &Ports<impl Mailboxes>) {
        if result != Err(StoreFailed::NeedsErase) {
            self.allow_stores(self.stores_left.saturating_sub(1));
        }
        match result {
            Ok(()) => {
                self.clear(Fault::ConfigStore, ports);
                self.clear(Fault::ConfigCorrupted, ports);
            }
            Err(StoreFailed::NeedsErase) => {}
            Err(error) => self.raise(Fault::ConfigStore, error.fault_detail(), ports),
        }
        self.finish_request(result, ports);
    }

    /// Sends the response of a request once the board has reported its result.
    fn finish_request(&mut self, result: Result<(), StoreFailed>, ports: &Ports<impl Mailboxes>) {
        if let Some(requester) = self.waiting_requester.take() {
            self.answer_request(requester, result.map_err(StoreFailed::abort_code), ports);
        }
    }

    fn answer_request(
        &mut self,
        requester: Requester,
        result: Result<(), AbortCode>,
        ports: &Ports<impl Mailboxes>,
    ) {
        match requester {
            Requester::Can => {
                if let Some(frame) = self.node.finish(result) {
                    self.push_can(Lane::Answer, frame, ports);
                }
            }
            Requester::Uart(address) => {
                let response = uart_requests::finished(address, result);
                self.push_uart(Lane::Answer, &Message::ConfigResponse(response), ports);
            }
        }
    }

    /// Counts the tick, its sample, and ticks missed before it.
    fn count(&mut self, tick: &Tick, measurement: &Measurement, ports: &Ports<impl Mailboxes>) {
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

    /// Raises faults of the sensor at once. Clears them after good samples.
    fn check_sensor(&mut self, measurement: &Measurement, ports: &Ports<impl Mailboxes>) {
        if let Some(raw) = &measurement.raw {
            self.temperature = raw.temperature.to_celsius();
            match measurement.read_at {
                ReadAt::Timer => self.raise(Fault::DataReadyDead, 0, ports),
                ReadAt::Edge => self.clear(Fault::DataReadyDead, ports),
            }
        }
        let good = matches!(measurement.sample.validity, Validity::Valid | Validity::Saturated(_));
        self.sound_ticks = match measurement.fault {
            None if good => self.sound_ticks.saturating_add(1),
            _ => 0,
        };
        if let Some(SensorFault { fault, detail }) = measurement.fault {
            self.raise(fault, detail, ports);
        }
        if measurement.misreads != self.misreads {
            self.misreads = measurement.misreads;
            self.raise_event(Fault::Misread, measurement.misreads, ports);
        }
        if self.saturated.update(measurement.saturated_for_long) {
            let samples = u32::from(SATURATED_TICKS);
            self.raise(Fault::SensorSaturated, samples, ports);
        } else {
            self.clear(Fault::SensorSaturated, ports);
        }
        if self.sound_ticks >= SOUND_TICKS {
            // A failed self-test stays a fault until the next start.
            for fault in [
                Fault::SensorSilent,
                Fault::SensorFrozen,
                Fault::SensorWrongId,
                Fault::SensorReset,
                Fault::SensorConfigMismatch,
                Fault::SensorTiming,
            ] {
                self.clear(fault, ports);
            }
        }
    }

    /// Raises a fault while the gyroscope's bias is too large to be learnt. Raises another from a rest with a wrong
    /// specific force until a rest with the right one.
    fn check_rest(&mut self, ports: &Ports<impl Mailboxes>) {
        match self.estimator.excess_bias() {
            Some(rate) => {
                let milli_degrees = rate.0.length() * (1000.0 / DEGREE);
                self.raise(Fault::GyroBias, milli_degrees as u32, ports);
            }
            None => self.clear(Fault::GyroBias, ports),
        }
        if let Some(force) = self.estimator.force_at_rest() {
            if FORCE_AT_REST.contains(&force) {
                self.clear(Fault::SensorScale, ports);
            } else if !self.faults().void_estimate() {
                self.raise(Fault::SensorScale, (force * (1000.0 / STANDARD_GRAVITY)) as u32, ports);
            }
        }
    }

    /// Raises, holds or clears the faults of the bus as its state changes.
    fn take_bus_state(&mut self, state: BusState, ports: &Ports<impl Mailboxes>) {
        let before = core::mem::replace(&mut self.bus, state);
        if state == BusState::Off && before != BusState::Off {
            self.counters.add(Counter::CanBusOff, 1);
            self.report_bus_off(ports);
        }
        if before == BusState::Off && state != BusState::Off {
            self.node.release(Fault::CanBusOff);
            self.latch.hold_for(Fault::CanBusOff, EVENT_TICKS);
        }
        match state {
            // Kept for a while, because a flickering bus would otherwise send an emergency each time.
            BusState::Active if before != BusState::Active => {
                self.latch.hold_for(Fault::CanErrorPassive, EVENT_TICKS);
            }
            BusState::Active => {}
            BusState::Passive(receive, transmit) => {
                self.latch.keep(Fault::CanErrorPassive);
                let detail = u32::from_le_bytes([receive, transmit, 0, 0]);
                self.raise(Fault::CanErrorPassive, detail, ports);
            }
            BusState::Off => {}
        }
    }

    /// Reports over the serial line at once. The emergency waits until the bus has recovered.
    fn report_bus_off(&mut self, ports: &Ports<impl Mailboxes>) {
        self.latch.keep(Fault::CanBusOff);
        let is_new = !self.faults().contains(Fault::CanBusOff);
        let times = self.counters.get(Counter::CanBusOff);
        self.node.raise_held_back(Fault::CanBusOff, times);
        if is_new {
            self.log(Level::Error, Fault::CanBusOff.name(), ports);
        }
    }

    /// Counts received frames that were lost.
    fn count_lost_can(&mut self, count: u32, ports: &Ports<impl Mailboxes>) {
        let lost = self.can_lost.wrapping_add(count);
        self.can_lost = lost;
        self.raise_event(Fault::CanOverrun, lost, ports);
    }

    /// Raises the fault of the crash before this start.
    fn raise_crash(&mut self, crash: Crash, ports: &Ports<impl Mailboxes>) {
        self.raise(crash.fault, crash.program_counter, ports);
        self.latch.hold_for(crash.fault, CRASH_TICKS);
    }

    /// Current load on the foot, if it is known.
    fn load(&mut self, reading: Option<u16>, ports: &Ports<impl Mailboxes>) -> Option<Load> {
        let input = self.in_use.load_input;
        let analog = (input.source == LoadSource::Analog).then_some(reading);
        let open = analog.is_some_and(|reading| {
            !reading.is_some_and(|reading| LOAD_READINGS.contains(&reading))
        });
        if self.load_open.update(open) {
            let detail = reading.map_or(u32::MAX, u32::from);
            self.raise(Fault::LoadSensorOpen, detail, ports);
            return None;
        }
        self.clear(Fault::LoadSensorOpen, ports);
        match input.source {
            LoadSource::None => None,
            LoadSource::Analog => {
                let reading = reading.filter(|_| !open)?;
                Some(Load(input.scale * (f32::from(reading) - input.offset)))
            }
            LoadSource::Can => self.node.load().map(Into::into),
        }
    }

    /// Requests a new estimator, from the next estimate on.
    fn renew(&mut self, renewal: Renewal) {
        self.renewal = self.renewal.max(Some(renewal));
    }

    /// Replaces the estimator, if requested.
    fn renew_estimator(&mut self) {
        let Some(renewal) = self.renewal.take() else {
            return;
        };
        let mut params = self.settings().params();
        if renewal == Renewal::Continue {
            params.params.learnt = Some(self.learnt());
        }
        let stream = Stream::new(1.0e6 / self.tick_us as f32, Gravity::Included);
        if let Ok(config) = stream.and_then(|stream| params.validate(stream)) {
            self.estimator = AnyEstimator::new(&config);
        }
    }

    /// Sets the stage, and reports a change.
    fn set_stage(
        &mut self,
        measurement: &Measurement,
        flags: Flags,
        ports: &Ports<impl Mailboxes>,
    ) {
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

    /// Advances the node, and sends the frames that are due on the bus.
    fn send_can(&mut self, estimate: &ContactEstimate, ports: &Ports<impl Mailboxes>) {
        let with_can = self.with_can;
        let mut dropped = 0;
        let (node, counters) = (&mut self.node, &self.counters);
        node.tick(estimate, self.temperature, counters, |frame| {
            if with_can {
                dropped += ports.push_can(Lane::of(&frame), frame);
            }
        });
        self.counters.add(Counter::CanDropped, dropped);
    }

    /// Sends the messages that are due on the serial line.
    fn send_uart(
        &mut self,
        estimate: &ContactEstimate,
        measurement: &Measurement,
        now: Timestamp,
        ports: &Ports<impl Mailboxes>,
    ) {
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
            let contact = ContactMessage::new(estimate, self.node.faults());
            self.push_uart(Lane::Estimate, &Message::Contact(contact), ports);
        }
        if is_due(streams.raw)
            && let Some(raw) = raw_message(measurement, self.in_use.accelerometer_range)
        {
            self.push_uart(Lane::Stream, &Message::Raw(raw), ports);
        }
        if is_due(streams.health) {
            let health = HealthMessage {
                timestamp: now,
                stage: self.stage,
                state: self.node.state(),
                id: self.node.id(),
                faults: self.node.faults(),
                temperature: Quantity::new(self.temperature, TEMPERATURE_STEP),
                counters: self.counters,
                unknown_faults: 0,
            };
            self.push_uart(Lane::Stream, &Message::Health(health), ports);
        }
    }

    /// Raises a fault unless it is active: sends an emergency and a line of text.
    fn raise(&mut self, fault: Fault, detail: u32, ports: &Ports<impl Mailboxes>) {
        if self.faults().contains(fault) {
            return;
        }
        if let Some(frame) = self.node.raise(fault, detail) {
            self.push_can(Lane::Notice, frame, ports);
        }
        self.log(Level::Error, fault.name(), ports);
    }

    /// Raises a fault that is an event. It stays active for a while.
    fn raise_event(&mut self, fault: Fault, detail: u32, ports: &Ports<impl Mailboxes>) {
        self.raise(fault, detail, ports);
        self.latch.hold_for(fault, EVENT_TICKS);
    }

    /// Clears a fault, if it is active.
    fn clear(&mut self, fault: Fault, ports: &Ports<impl Mailboxes>) {
        if !self.faults().contains(fault) {
            return;
        }
        if let Some(frame) = self.node.clear(fault) {
            self.push_can(Lane::Notice, frame, ports);
        }
    }

    /// Clears faults whose hold time after the event is over.
    fn clear_expired_faults(&mut self, ports: &Ports<impl Mailboxes>) {
        for fault in self.latch.tick().iter() {
            self.clear(fault, ports);
        }
    }

    /// Sends a line of text if the settings allow its level.
    fn log(&mut self, level: Level, text: &str, ports: &Ports<impl Mailboxes>) {
        self.log_line(level, LogMessage::new(level as u8, text), ports);
    }

    /// Sends a complete line if the settings allow its level.
    fn log_line(&mut self, level: Level, line: LogMessage, ports: &Ports<impl Mailboxes>) {
        if level as u8 <= self.in_use.log_level {
            // Errors go before responses, because many responses may wait.
            let lane = match level {
                Level::Error => Lane::Notice,
                Level::Warning | Level::Information => Lane::Answer,
            };
            self.push_uart(lane, &Message::Log(line), ports);
        }
    }

    /// Sends a frame on the bus, if there is one. Counts the frames dropped for it.
    fn push_can(&mut self, lane: Lane, frame: CanFrame, ports: &Ports<impl Mailboxes>) {
        if self.with_can {
            let dropped = ports.push_can(lane, frame);
            self.counters.add(Counter::CanDropped, dropped);
        }
    }

    /// Sends a message on the serial line. Counts those dropped for it.
    fn push_uart(&mut self, lane: Lane, message: &Message, ports: &Ports<impl Mailboxes>) {
        let sequence = self.uart_sequence;
        self.uart_sequence = sequence.wrapping_add(1);
        let dropped = ports.push_uart(lane, sequence, message);
        self.counters.add(Counter::UartDropped, dropped);
    }

    /// Reports to the watchdog. A failed sensor has its own fault, and does not cause a restart.
    fn report_liveness(&self, measurement: &Measurement, ports: &Ports<impl Mailboxes>) {
        let excused = measurement.activity != Activity::Measuring || self.faults().void_estimate();
        if measurement.raw.is_some() || excused {
            ports.liveness.report(Worker::Sampling);
        }
        if self.estimate().timestamp == measurement.sample.timestamp {
            ports.liveness.report(Worker::Estimator);
        }
        if !self.with_can {
            ports.liveness.report(Worker::Can);
        }
    }
}

/// Message with the codes of a sample. `range` is
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
