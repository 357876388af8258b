//! The foot: a sample goes in each tick, frames come out on the same tick.
//!
//! [`Foot::tick`] reads top to bottom as what happens in a millisecond: requests that came in since
//! the last one, the sensor's troubles, the load, the estimate, the frames. Its work is bounded:
//! at most [`INPUTS_PER_TICK`] requests, one estimate, one frame of each kind.
//!
//! **Fail-safe.** While a fault of the sensor lasts, every frame has P = 0 and the fault flag,
//! whatever the estimator says; without a believable sample no frame says "stable". A fault lasts
//! until [`SOUND_TICKS`] good samples have come in a row.

use embassy_sync::blocking_mutex::raw::RawMutex;
use estimator_core::{
    AccelerometerCorrection, Config, ContactEstimate, ContactEstimator, Flag, Flags, ImuSample,
    Learnt, Load, Params, ParamsError, Timestamp, Validity,
};
use lsm6dsox::scale::FullScale;
use wire::dictionary::{self, Concern};
use wire::node::{BootCause, Calibration, Crash, State};
use wire::pdo::{Pdo, Quantity, TEMPERATURE_STEP};
use wire::settings::{LoadSource, WINDOW_CAPACITY};
use wire::uart::{self, ContactMessage, HealthMessage, LogMessage, Payload};
use wire::{AbortCode, Address, CanFrame, Counter, Counters, Event, Fault, Node, Settings, Stage};

use crate::commands;
use crate::ports::{Bus, BusState, Erase, Input, Ports, Reloaded, Request, StoreFailed};
use crate::sampling::{Activity, Measurement, Tick, Trouble};
use crate::storage::Origin;
use crate::supervision::{Fading, Hysteresis, Worker};
use crate::telemetry::Lane;

/// Requests that one tick takes in; more wait for the next.
pub const INPUTS_PER_TICK: usize = 8;

/// Good samples in a row after which a fault of the sensor is over.
pub const SOUND_TICKS: u16 = 20;

/// Readings of the load input in which it is connected; at the ends of the 12-bit range it is
/// open or shorted.
pub const LOAD_READINGS: core::ops::RangeInclusive<u16> = 16..=4079;

/// Ticks from one look at the gyroscope's bias to the next.
const BIAS_TICKS: u32 = 1024;

/// Ticks for which a fault that is an event is kept up after it last happened.
const FADING_TICKS: u16 = 1000;

/// Ticks for which the reason of the last restart is kept up as a fault. The object 0x2113 keeps
/// it for good.
const RESTART_TICKS: u16 = 10_000;

/// What is known at the start, beside the settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// Tells this board from all others.
    pub serial: u32,
    /// Whether somebody asked for the start.
    pub cause: BootCause,
    /// Why the board was restarted, where it was not switched on: a [`CrashRecord`] of before, or
    /// [`Fault::WatchdogReset`].
    ///
    /// [`CrashRecord`]: crate::supervision::CrashRecord
    pub crash: Option<Crash>,
    /// The kept settings could not be read: defaults are in use.
    pub settings_corrupted: bool,
    /// The crystal does not start: there is no CAN.
    pub crystal_missing: bool,
    /// From which supply voltage on the chip resets itself: 0 off, 1 to 3.
    pub brown_out_level: u8,
}

/// Who waits for settings to be stored or forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asker {
    Can,
    Uart(Address),
}

/// How a new estimator starts. Of two, the greater counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Renewal {
    /// With what the one before has learnt.
    Continue,
    /// With what the settings say.
    Restart,
}

/// What the estimator, the node and everything between them know.
#[derive(Debug)]
pub struct Foot {
    node: Node,
    estimator: ContactEstimator<WINDOW_CAPACITY>,
    /// What the settings say of the accelerometer, out of their slots because every tick asks.
    accelerometer: AccelerometerCorrection,
    /// What a change of settings since the last tick asks for.
    renewal: Option<Renewal>,
    counters: Counters,
    temperature: f32,
    stage: Stage,
    /// Good samples since the last bad one.
    sound_ticks: u16,
    saturated: Hysteresis,
    load_open: Hysteresis,
    fading: Fading,
    bus: BusState,
    can_lost: u32,
    start: Option<Start>,
    with_can: bool,
    /// What takes frames past their queue.
    sends: Bus,
    storing: Option<Asker>,
    /// A request for an answer, which waits until the estimate is sent.
    deferred: Option<Input>,
    /// A request that did not get through yet.
    wanted: Option<Request>,
    ticks: u32,
    uart_sequence: u16,
}

impl Foot {
    /// A foot that has seen nothing yet; it introduces itself on its first tick.
    ///
    /// # Errors
    /// What [`Settings`] that were checked never cause: parameters that do not fit each other.
    pub fn new(settings: Settings, start: Start) -> Result<Self, ParamsError> {
        let config = settings.params().validate()?;
        Ok(Self::with_config(settings, &config, start))
    }

    /// The same with the estimator's `config`, which is that of the settings; made in its place
    /// where there is one.
    #[must_use]
    #[inline]
    pub fn with_config(settings: Settings, config: &Config<WINDOW_CAPACITY>, start: Start) -> Self {
        Self {
            accelerometer: settings.accelerometer(),
            node: Node::new(settings, start.serial),
            estimator: ContactEstimator::new(config),
            renewal: None,
            counters: Counters::default(),
            temperature: f32::NAN,
            stage: Stage::Starting,
            sound_ticks: 0,
            saturated: Hysteresis::new(1, SOUND_TICKS),
            load_open: Hysteresis::new(10, 100),
            fading: Fading::default(),
            bus: BusState::Active,
            can_lost: 0,
            start: Some(start),
            with_can: !start.crystal_missing,
            sends: |_| false,
            storing: None,
            deferred: None,
            wanted: None,
            ticks: 0,
            uart_sequence: 0,
        }
    }

    /// From now on `bus` gets each frame first; what it does not take waits in its queue.
    pub const fn set_bus(&mut self, bus: Bus) {
        self.sends = bus;
    }

    /// Its settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        self.node.settings()
    }

    /// What the board is doing, for its LED.
    #[must_use]
    pub const fn stage(&self) -> Stage {
        self.stage
    }

    /// The faults that last, for its LED.
    #[must_use]
    pub const fn faults(&self) -> wire::Faults {
        self.node.faults()
    }

    /// The newest estimate.
    #[must_use]
    pub const fn estimate(&self) -> &ContactEstimate {
        self.node.estimate()
    }

    /// What the estimator has learnt so far.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        self.estimator.learnt()
    }

    /// What was counted so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// One millisecond. `reading` is the newest of the analog load input, where the board has one.
    pub fn tick<M: RawMutex>(
        &mut self,
        tick: &Tick,
        measurement: &Measurement,
        reading: Option<u16>,
        ports: &Ports<M>,
    ) {
        self.ticks = self.ticks.wrapping_add(1);
        self.introduce(ports);
        let taken = self.take_inputs(ports);
        self.count(tick, measurement, ports);
        self.judge_sensor(measurement, ports);
        let load = self.load(reading, ports);

        if let Some(renewal) = self.renewal.take() {
            self.renew_estimator(renewal);
        }
        let sample = ImuSample {
            specific_force: self.accelerometer.apply(measurement.sample.specific_force),
            ..measurement.sample
        };
        let estimate = self.estimator.update(&sample, load);
        self.set_stage(measurement, estimate.flags, ports);

        self.send_can(&estimate, ports);
        self.send_uart(&estimate, measurement, tick.time, ports);
        // Learning and answers have no deadline: they come after the frames are sent.
        self.estimator.finish();
        self.answer(INPUTS_PER_TICK - taken, ports);
        let mut gone = wire::Faults::NONE;
        self.fading.tick(|fault| gone = gone.with(fault));
        gone.iter().for_each(|fault| self.clear(fault, ports));
        if self.ticks.is_multiple_of(BIAS_TICKS) {
            self.judge_bias(ports);
        }
        self.report_progress(measurement, ports);
    }

    /// Takes up the settings of the estimator and of what it is given. Apart from the tick, whose
    /// stack would otherwise have room for a second estimator each time.
    #[inline(never)]
    fn renew_estimator(&mut self, renewal: Renewal) {
        self.accelerometer = self.settings().accelerometer();
        let settings = self.settings().params();
        let learnt = match renewal {
            Renewal::Continue => Some(self.learnt()),
            Renewal::Restart => settings.learnt,
        };
        if let Ok(config) = (Params { learnt, ..settings }).validate() {
            self.estimator = ContactEstimator::new(&config);
        }
    }

    /// On the first tick: the boot-up message, and what is wrong from before.
    fn introduce<M: RawMutex>(&mut self, ports: &Ports<M>) {
        if let Some(start) = self.start {
            self.start = None;
            self.introduce_with(start, ports);
        }
    }

    #[cold]
    #[inline(never)]
    fn introduce_with<M: RawMutex>(&mut self, start: Start, ports: &Ports<M>) {
        self.boot(start.cause, ports);
        if start.crystal_missing {
            self.raise(Fault::CrystalMissing, 0, ports);
        }
        if start.settings_corrupted {
            self.raise(Fault::ConfigCorrupted, 0, ports);
        }
        self.node.set_brown_out_level(start.brown_out_level);
        if start.brown_out_level == 0 {
            self.log(WARNING, "brown-out reset is off: see 0x2114", ports);
        }
        if let Some(crash) = start.crash {
            self.node.set_crash(crash);
            self.raise(crash.fault, crash.program_counter, ports);
            self.fading.hold(crash.fault, RESTART_TICKS);
        }
    }

    fn boot<M: RawMutex>(&mut self, cause: BootCause, ports: &Ports<M>) {
        if let Some(frame) = self.node.boot(cause) {
            self.push_can(Lane::Notice, frame, ports);
        }
    }

    /// Takes what has come in, in its order, up to the first request for an answer. Returns how many
    /// inputs that were.
    fn take_inputs<M: RawMutex>(&mut self, ports: &Ports<M>) -> usize {
        if let Some(reloaded) = ports.take_reloaded() {
            self.take_reloaded(reloaded, ports);
        }
        for taken in 0..INPUTS_PER_TICK {
            let Some(input) = ports.take_input() else {
                return taken;
            };
            if input.wants_answer() {
                self.deferred = Some(input);
                return taken;
            }
            self.take_input(&input, ports);
        }
        INPUTS_PER_TICK
    }

    /// Answers the request that was deferred, and takes what came after it: `most` inputs in all.
    fn answer<M: RawMutex>(&mut self, most: usize, ports: &Ports<M>) {
        if let Some(input) = self.deferred.take() {
            self.node.set_learnt(self.learnt());
            self.take_input(&input, ports);
            for _ in 1..most {
                let Some(input) = ports.take_input() else {
                    break;
                };
                self.take_input(&input, ports);
            }
        }
        if self.wanted.is_some()
            && let Some(request) = self.wanted.take()
            && !ports.request(request.clone())
        {
            self.wanted = Some(request);
        }
    }

    #[cold]
    #[inline(never)]
    fn take_reloaded<M: RawMutex>(&mut self, reloaded: Reloaded, ports: &Ports<M>) {
        let Reloaded { settings, origin } = reloaded;
        let same = settings.learnt() == self.settings().learnt();
        self.node.set_settings(settings);
        self.renew(match same {
            true => Renewal::Continue,
            false => Renewal::Restart,
        });
        self.boot(BootCause::Commanded, ports);
        match origin {
            Origin::Corrupted => self.raise(Fault::ConfigCorrupted, 0, ports),
            Origin::Stored | Origin::Blank => self.clear(Fault::ConfigCorrupted, ports),
        }
    }

    fn renew(&mut self, renewal: Renewal) {
        self.renewal = self.renewal.max(Some(renewal));
    }

    fn take_input<M: RawMutex>(&mut self, input: &Input, ports: &Ports<M>) {
        match input {
            Input::Can(frame, at) => {
                let outcome = self.node.receive(frame, *at);
                if let Some(reply) = outcome.reply {
                    self.push_can(Lane::Answer, reply, ports);
                }
                if let Some(event) = outcome.event {
                    self.act(event, Asker::Can, ports);
                }
            }
            Input::Uart(question) => {
                let outcome = commands::answer(&mut self.node, question);
                if let Some(response) = outcome.response {
                    self.push_uart(Lane::Answer, &response, ports);
                }
                if let Some(event) = outcome.event {
                    let address = outcome.address.unwrap_or(Address::new(0, 0));
                    self.act(event, Asker::Uart(address), ports);
                }
            }
            Input::UartRefused(count) => self.counters.add(Counter::UartRefused, *count),
            Input::UartLost(count) => {
                self.counters.add(Counter::UartOverruns, *count);
                let lost = self.counters.get(Counter::UartOverruns);
                self.raise_for_a_while(Fault::UartOverrun, lost, ports);
            }
            Input::UartDropped(count) => self.counters.add(Counter::UartDropped, *count),
            Input::CanWithdrawn(count) => self.counters.add(Counter::CanDropped, *count),
            Input::CanLost(count) => {
                self.can_lost = self.can_lost.wrapping_add(*count);
                self.raise_for_a_while(Fault::CanOverrun, self.can_lost, ports);
            }
            Input::Bus(state) => self.take_bus_state(*state, ports),
            Input::Stored(result) => self.stored(*result, ports),
            Input::Protected(result) => self.finish_store(*result, ports),
        }
    }

    fn act<M: RawMutex>(&mut self, event: Event, asker: Asker, ports: &Ports<M>) {
        match event {
            Event::Changed(address) => match dictionary::concern(address) {
                Some(Concern::Learnt) => self.renew(Renewal::Restart),
                Some(
                    Concern::Correction
                    | Concern::Load
                    | Concern::Estimator
                    | Concern::Parameter(_),
                ) => self.renew(Renewal::Continue),
                Some(Concern::Node | Concern::Stream | Concern::Sensor) | None => {}
            },
            Event::Store => {
                let request = Request::Store(self.settings().clone(), self.erase());
                self.store(asker, request, ports);
            }
            Event::Restore => self.store(asker, Request::Restore(self.erase()), ports),
            Event::ProtectSupply => self.store(asker, Request::ProtectSupply, ports),
            Event::ResetNode => self.wanted = Some(Request::Reset),
            // A reset of the node does that too, and more.
            Event::ResetCommunication if self.wanted == Some(Request::Reset) => {}
            Event::ResetCommunication => self.wanted = Some(Request::Reload),
            Event::Calibration(Calibration::Forget) => self.renew(Renewal::Restart),
            // The estimator has it already.
            Event::Calibration(Calibration::Keep) => {}
            // The node keeps the load and the time, and knows when it last heard of them.
            Event::Load(_) | Event::State(_) | Event::Sync(_) | Event::Time(_) => {}
        }
    }

    /// Process data do not stop for an erase that nobody asked for.
    fn erase(&self) -> Erase {
        match self.node.state() {
            State::Operational => Erase::Refused,
            _ => Erase::Allowed,
        }
    }

    fn store<M: RawMutex>(&mut self, asker: Asker, request: Request, ports: &Ports<M>) {
        if self.storing.is_none() && ports.request(request) {
            self.storing = Some(asker);
        } else {
            self.answer_store(asker, Err(AbortCode::Hardware), ports);
        }
    }

    fn stored<M: RawMutex>(&mut self, result: Result<(), StoreFailed>, ports: &Ports<M>) {
        match result {
            Ok(()) => {
                self.clear(Fault::ConfigStore, ports);
                self.clear(Fault::ConfigCorrupted, ports);
            }
            Err(StoreFailed::NeedsErase) => {}
            Err(why) => self.raise(Fault::ConfigStore, why as u32, ports),
        }
        self.finish_store(result, ports);
    }

    fn finish_store<M: RawMutex>(&mut self, result: Result<(), StoreFailed>, ports: &Ports<M>) {
        if let Some(asker) = self.storing.take() {
            self.answer_store(asker, result.map_err(StoreFailed::abort_code), ports);
        }
    }

    fn answer_store<M: RawMutex>(
        &mut self,
        asker: Asker,
        result: Result<(), AbortCode>,
        ports: &Ports<M>,
    ) {
        match asker {
            Asker::Can => {
                if let Some(frame) = self.node.finish(result) {
                    self.push_can(Lane::Answer, frame, ports);
                }
            }
            Asker::Uart(address) => {
                self.push_uart(Lane::Answer, &commands::finished(address, result), ports);
            }
        }
    }

    fn take_bus_state<M: RawMutex>(&mut self, state: BusState, ports: &Ports<M>) {
        let before = core::mem::replace(&mut self.bus, state);
        if state == BusState::Off && before != BusState::Off {
            self.counters.add(Counter::CanBusOff, 1);
            self.lose_bus(ports);
        }
        if before == BusState::Off && state != BusState::Off {
            self.node.release(Fault::CanBusOff);
            self.fading.hold(Fault::CanBusOff, FADING_TICKS);
        }
        match state {
            BusState::Active => self.clear(Fault::CanErrorPassive, ports),
            BusState::Passive(receive, transmit) => {
                let detail = u32::from_le_bytes([receive, transmit, 0, 0]);
                self.raise(Fault::CanErrorPassive, detail, ports);
            }
            BusState::Off => {}
        }
    }

    /// Says over the serial line at once what the bus gets to know when it is back.
    fn lose_bus<M: RawMutex>(&mut self, ports: &Ports<M>) {
        self.fading.stay(Fault::CanBusOff);
        let is_news = !self.faults().contains(Fault::CanBusOff);
        let times = self.counters.get(Counter::CanBusOff);
        self.node.raise_held_back(Fault::CanBusOff, times);
        if is_news {
            self.log(ERROR, Fault::CanBusOff.name(), ports);
        }
    }

    fn count<M: RawMutex>(&mut self, tick: &Tick, measurement: &Measurement, ports: &Ports<M>) {
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
            let late_us = tick.missed.saturating_mul(1000);
            self.raise_for_a_while(Fault::LateTick, late_us, ports);
        }
    }

    /// Faults of the sensor come at once and go after good samples.
    fn judge_sensor<M: RawMutex>(&mut self, measurement: &Measurement, ports: &Ports<M>) {
        if let Some(raw) = &measurement.raw {
            self.temperature = raw.temperature.to_celsius();
        }
        let good = matches!(
            measurement.sample.validity,
            Validity::Valid | Validity::Saturated(_)
        );
        self.sound_ticks = match measurement.trouble {
            None if good => self.sound_ticks.saturating_add(1),
            _ => 0,
        };
        if let Some(Trouble { fault, detail }) = measurement.trouble {
            self.raise(fault, detail, ports);
        }
        if self.saturated.update(measurement.saturated_for_long) {
            let samples = u32::from(crate::sampling::SATURATED_TICKS);
            self.raise(Fault::SensorSaturated, samples, ports);
        } else {
            self.clear(Fault::SensorSaturated, ports);
        }
        if self.sound_ticks >= SOUND_TICKS && !self.faults().is_empty() {
            // What the self-test has found stays until the next start.
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

    /// Reports a bias of the gyroscope that is too large to be learnt.
    #[inline(never)]
    fn judge_bias<M: RawMutex>(&mut self, ports: &Ports<M>) {
        match self.estimator.excess_bias() {
            Some(rate) => {
                let milli_degrees = rate.0.length() * (1000.0 / lsm6dsox::scale::DEGREE);
                self.raise(Fault::GyroBias, milli_degrees as u32, ports);
            }
            None => self.clear(Fault::GyroBias, ports),
        }
    }

    /// The load on the foot now, where it is known.
    fn load<M: RawMutex>(&mut self, reading: Option<u16>, ports: &Ports<M>) -> Option<Load> {
        let input = self.settings().load_input();
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

    fn set_stage<M: RawMutex>(
        &mut self,
        measurement: &Measurement,
        flags: Flags,
        ports: &Ports<M>,
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
            self.log(INFORMATION, stage.name(), ports);
        }
    }

    fn send_can<M: RawMutex>(&mut self, estimate: &ContactEstimate, ports: &Ports<M>) {
        let (with_can, bus) = (self.with_can, self.sends);
        let mut dropped = 0;
        let (node, counters) = (&mut self.node, &self.counters);
        node.tick(estimate, self.temperature, counters, |frame| {
            if with_can {
                dropped += ports.push_can(lane_of(&frame), &frame, bus);
            }
        });
        self.counters.add(Counter::CanDropped, dropped);
    }

    fn send_uart<M: RawMutex>(
        &mut self,
        estimate: &ContactEstimate,
        measurement: &Measurement,
        now: Timestamp,
        ports: &Ports<M>,
    ) {
        if self.node.state() == State::Stopped {
            return;
        }
        let streams = self.settings().uart_streams();
        let ticks = self.ticks;
        let is_due = |every: u16| every != 0 && ticks.is_multiple_of(u32::from(every));
        if is_due(streams.contact) {
            let contact = ContactMessage::new(estimate, self.node.faults());
            self.push_uart(Lane::Estimate, &contact, ports);
        }
        if is_due(streams.raw)
            && let Some(raw) = raw_message(measurement)
        {
            self.push_uart(Lane::Stream, &raw, ports);
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
            self.push_uart(Lane::Stream, &health, ports);
        }
    }

    fn report_progress<M: RawMutex>(&self, measurement: &Measurement, ports: &Ports<M>) {
        let excused = measurement.activity != Activity::Measuring || self.faults().void_estimate();
        if measurement.raw.is_some() || excused {
            ports.progress.report(Worker::Sampling);
        }
        if self.estimate().timestamp == measurement.sample.timestamp {
            ports.progress.report(Worker::Estimator);
        }
        if !self.with_can {
            ports.progress.report(Worker::Can);
        }
    }

    fn raise<M: RawMutex>(&mut self, fault: Fault, detail: u32, ports: &Ports<M>) {
        if self.faults().contains(fault) {
            return;
        }
        if let Some(frame) = self.node.raise(fault, detail) {
            self.push_can(Lane::Notice, frame, ports);
        }
        self.log(ERROR, fault.name(), ports);
    }

    fn raise_for_a_while<M: RawMutex>(&mut self, fault: Fault, detail: u32, ports: &Ports<M>) {
        self.raise(fault, detail, ports);
        self.fading.hold(fault, FADING_TICKS);
    }

    fn clear<M: RawMutex>(&mut self, fault: Fault, ports: &Ports<M>) {
        if !self.faults().contains(fault) {
            return;
        }
        if let Some(frame) = self.node.clear(fault) {
            self.push_can(Lane::Notice, frame, ports);
        }
    }

    fn log<M: RawMutex>(&mut self, level: u8, text: &str, ports: &Ports<M>) {
        if level <= self.settings().log_level() {
            let line = LogMessage::new(level, text);
            // What is wrong goes before answers, however many are asked for.
            let lane = match level {
                ERROR => Lane::Notice,
                _ => Lane::Answer,
            };
            self.push_uart(lane, &line, ports);
        }
    }

    fn push_can<M: RawMutex>(&mut self, lane: Lane, frame: CanFrame, ports: &Ports<M>) {
        if self.with_can {
            let dropped = ports.push_can(lane, &frame, self.sends);
            self.counters.add(Counter::CanDropped, dropped);
        }
    }

    fn push_uart<M: RawMutex>(&mut self, lane: Lane, message: &impl Payload, ports: &Ports<M>) {
        let sequence = self.uart_sequence;
        self.uart_sequence = sequence.wrapping_add(1);
        let dropped = ports.push_uart(lane, sequence, message);
        self.counters.add(Counter::UartDropped, dropped);
    }
}

/// Levels of the log.
const ERROR: u8 = 1;
const WARNING: u8 = 2;
const INFORMATION: u8 = 3;

/// Process data are a stream, the contact before all others; emergencies (0x080) and heartbeats
/// (0x700) are not.
const fn lane_of(frame: &CanFrame) -> Lane {
    const CONTACT: u16 = Pdo::Contact.base();
    match frame.id() & 0x780 {
        CONTACT => Lane::Estimate,
        0x080 | 0x700 => Lane::Notice,
        _ => Lane::Stream,
    }
}

fn raw_message(measurement: &Measurement) -> Option<uart::RawSample> {
    let raw = measurement.raw?;
    Some(uart::RawSample {
        timestamp: measurement.sample.timestamp,
        validity: measurement.sample.validity,
        temperature: Quantity::new(raw.temperature.to_celsius(), TEMPERATURE_STEP),
        acceleration: raw.specific_force.codes,
        rate: raw.angular_rate.codes,
        acceleration_scale: raw.specific_force.full_scale.sensitivity(),
        rate_scale: raw.angular_rate.full_scale.sensitivity(),
    })
}
