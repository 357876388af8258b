//! A CANopen device built from dictionary, settings, SDO server, PDOs and faults: frames in, frames and [`Event`]s out.
//! It keeps no time of its own and touches no hardware.
//!
//! The application calls:
//!
//! - [`Node::boot`] at the start and after each reset, with its cause. The streams start without a command only at
//!   power-up. After a reset commanded by a master, the node waits in pre-operational state to be configured.
//! - [`Node::receive`] with each received frame.
//! - [`Node::tick`] each millisecond, or at the period given to [`Node::set_tick`].
//!
//! The application acts on the events that these functions return. It owns the estimate and all other values behind the objects, and
//! lends them to the node as [`Published`]. UART messages reach the same objects by [`Node::read`] and [`Node::write`], under the same
//! rules:
//!
//! - Settings are written only in pre-operational state, else the result is `0x0800_0022`. Over UART they can also be
//!   written while there is no node id. LSS, under its own rules, assigns a node id in every state.
//! - While the configuration is locked, no other setting can be changed or restored (`0x0800_0021`).
//! - A refused value changes nothing.
//!
//! This file has the node, its events, NMT, the timing of its frames, and its faults. `device` has the state behind the
//! objects, the values that the application publishes, and the rules for reading and writing them. `lss` has the
//! assignment of the node id.

mod device;
mod lss;

use canopen_rs::NmtStateMachine;
use canopen_rs::nmt;
use canopen_rs::time::TimeOfDay;
use estimator_core::Timestamp;
use heapless::Deque;

use device::{Device, DeviceObjects, Requester};
use lss::{Lss, NODE_ID};

use crate::abort::AbortCode;
use crate::dictionary::{Address, Concern};
use crate::fault::{Emergency, Fault, Faults};
use crate::foot::{NodeId, cob_id};
use crate::frame::CanFrame;
use crate::pdo::{ClockReading, Load, Pdo, Snapshot};
use crate::sdo::{self, Objects, SdoServer};
use crate::settings::{LoadSource, Settings, Trigger};
use crate::value::Value;

pub use device::{CalibrationState, Costs, Crash, Program, Published};

pub use canopen_rs::time::TimeOfDay as TimeStamp;
pub use canopen_rs::{NmtCommand, NmtState};

/// CANopen node of a foot.
#[derive(Debug)]
pub struct Node {
    device: Device,
    nmt: NmtStateMachine,
    lss: Lss,
    sdo: SdoServer,
    ticks: u32,
    /// Time since the last heartbeat, µs.
    heartbeat_age_us: u32,
    /// SYNCs received.
    syncs: u32,
    /// One bit per PDO, set if a SYNC has requested it.
    requested: u8,
    last_sync: ClockReading,
    /// Sequence number of the next contact.
    sequence: u8,
    /// Faults whose emergency message was sent since the last boot.
    reported: Faults,
    /// Faults whose emergency message is held back.
    held_back: Faults,
    /// Detail of each fault, by its number.
    details: [u32; Fault::ALL.len()],
}

/// Cause of a boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BootCause {
    /// Not commanded: power-up, or a crash of the program. With autostart the node is operational at once.
    #[default]
    PowerUp,
    /// Commanded by a master: Reset Node, Reset Communication, or the assignment of the first id. The node waits in
    /// pre-operational state.
    Commanded,
}

/// Event that the application has to handle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A setting has changed: [`Node::settings`].
    Changed {
        /// Address of the setting.
        address: Address,
        /// Area affected by the setting.
        concern: Concern,
    },
    /// Store the settings, then call [`Node::finish`].
    Store,
    /// Delete the stored settings, so that the defaults apply from the next reset. Then call [`Node::finish`].
    Restore,
    /// Set the highest brown-out level, then call [`Node::finish`].
    ProtectSupply,
    /// Stop the program: restart into the bootloader, which can receive another program.
    StopProgram,
    /// Confirm the running program, if it is new, then call [`Node::finish`].
    ConfirmProgram,
    /// The NMT state has changed.
    State(NmtState),
    /// Reset the whole board.
    ResetNode,
    /// Reset the communication: load the stored settings and call [`Node::boot`]. It was commanded, or LSS has assigned
    /// the first id.
    ResetCommunication,
    /// A SYNC was received, with its counter if it has one.
    Sync(Option<u8>),
    /// A time stamp was received.
    Time(TimeOfDay),
    /// The load was received from the robot.
    Load(Load),
    /// A command to the calibration was executed: [`Node::settings`].
    Calibration(Calibration),
}

impl Event {
    /// Returns whether the application answers the request on completion, by [`Node::finish`].
    #[must_use]
    pub const fn is_answered_later(self) -> bool {
        matches!(self, Self::Store | Self::Restore | Self::ProtectSupply | Self::ConfirmProgram)
    }
}

/// A command to the calibration: sub-index 1 of object 0x2120.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// The learnt values are now in the settings. The estimator continues unchanged.
    Keep,
    /// The learnt values were removed from the settings. The estimator starts without any.
    Forget,
}

impl Calibration {
    /// The command's code on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Keep => 1,
            Self::Forget => 2,
        }
    }
}

/// Result of a received frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Response to send.
    pub reply: Option<CanFrame>,
    /// Event for the application.
    pub event: Option<Event>,
}

/// Answer to a request that took longer than a tick: the result of [`Node::finish`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finished {
    /// Response to a master on the bus.
    Can(CanFrame),
    /// The application requested it by [`Node::write`] at this address, and answers it.
    Written(Address),
}

/// Kind of a frame that [`Node::tick`] sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Process data.
    Pdo(Pdo),
    /// Heartbeat.
    Heartbeat,
    /// Emergency message.
    Emergency,
}

/// Period of the ticks unless the application sets another, µs.
const TICK_US: u16 = 1_000;

impl Node {
    /// Creates a node that has not booted yet. `serial` is the board's serial number.
    #[must_use]
    pub fn new(settings: Settings, serial: u32) -> Self {
        let id = settings.node_id();
        Self {
            lss: Lss::new(id, serial),
            device: Device {
                id,
                serial,
                settings,
                state: NmtState::Initialising,
                faults: Faults::NONE,
                history: Deque::new(),
                snapshot: Snapshot::default(),
                tick_us: TICK_US,
                load: None,
                load_age_us: 0,
                time: None,
                event: None,
                pending: None,
            },
            nmt: NmtStateMachine::new(),
            sdo: SdoServer::new(),
            ticks: 0,
            heartbeat_age_us: 0,
            syncs: 0,
            requested: 0,
            last_sync: ClockReading::default(),
            sequence: 0,
            reported: Faults::NONE,
            held_back: Faults::NONE,
            details: [0; Fault::ALL.len()],
        }
    }

    /// Applies the node id, that of the settings or the one assigned by LSS since power-up. Returns the boot-up
    /// message. At power-up with autostart the node is operational at once, otherwise pre-operational. Without a node
    /// id there is no message, and only LSS is served.
    pub fn boot(&mut self, cause: BootCause) -> Option<CanFrame> {
        self.lss.apply_assigned_id(&mut self.device.settings);
        self.device.id = self.device.settings.node_id();
        self.lss.restart(self.device.id, self.device.serial);
        self.nmt = NmtStateMachine::new();
        self.sdo = SdoServer::new();
        if let Some(Requester::Sdo | Requester::Lss) = self.device.pending {
            self.device.pending = Some(Requester::Gone);
        }
        self.heartbeat_age_us = 0;
        self.requested = 0;
        self.reported = Faults::NONE;
        let id = self.device.id?;
        self.nmt.boot();
        if cause == BootCause::PowerUp && self.device.settings.autostart() {
            self.nmt.apply(NmtCommand::StartRemoteNode);
        }
        self.device.state = self.nmt.state();
        Some(CanFrame::of(id.cob_id(cob_id::HEARTBEAT), nmt::BOOTUP_FRAME))
    }

    /// Node id; `None` until one is assigned.
    #[must_use]
    pub const fn id(&self) -> Option<NodeId> {
        self.device.id
    }

    /// The NMT state.
    #[must_use]
    pub const fn state(&self) -> NmtState {
        self.device.state
    }

    /// The settings.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.device.settings
    }

    /// Replaces all settings, as after loading the stored ones. A new node id takes effect at [`Node::boot`].
    pub fn set_settings(&mut self, settings: Settings) {
        self.device.settings = settings;
    }

    /// The active faults.
    #[must_use]
    pub const fn faults(&self) -> Faults {
        self.device.faults
    }

    /// Load last received from the robot, over RPDO1 or SDO. `None` before the first one, or if none was received for
    /// longer than the event timer of RPDO1.
    #[must_use]
    pub const fn load(&self) -> Option<Load> {
        self.device.load
    }

    /// Date and time of day of the last time stamp, and its reception time on the clock of the samples.
    #[must_use]
    pub const fn time(&self) -> Option<(TimeOfDay, Timestamp)> {
        self.device.time
    }

    /// Sets and publishes the period of the ticks, µs; 1,000 if it is not called.
    pub const fn set_tick(&mut self, tick_us: u16) {
        self.device.tick_us = tick_us;
    }

    /// Handles a received frame. `now` is its reception time on the clock of the samples.
    pub fn receive(
        &mut self,
        frame: &CanFrame,
        now: Timestamp,
        published: &mut Published,
    ) -> Outcome {
        if frame.id() == cob_id::LSS_MASTER {
            return self.receive_lss(frame);
        }
        let Some(id) = self.device.id else {
            return Outcome::default();
        };
        match frame.id() {
            nmt::NMT_COMMAND_COB_ID => event(self.receive_nmt(frame.data(), id)),
            cob_id::SYNC => event(self.receive_sync(frame.data(), now)),
            cob_id::TIME => event(self.receive_time(frame.data(), now)),
            other if other == id.cob_id(cob_id::SDO_REQUEST) => {
                self.receive_sdo(frame, id, published)
            }
            other if other == id.cob_id(Load::BASE) => self.receive_load(frame.data()),
            _ => Outcome::default(),
        }
    }

    /// Executes an NMT command, from the bus or from the UART.
    pub fn command(&mut self, command: NmtCommand) -> Option<Event> {
        let before = self.nmt.state();
        let after = self.nmt.apply(command);
        self.device.state = after;
        match command {
            NmtCommand::ResetNode => {
                self.lss.forget_assigned_id();
                Some(Event::ResetNode)
            }
            NmtCommand::ResetCommunication => Some(Event::ResetCommunication),
            _ => (after != before).then_some(Event::State(after)),
        }
    }

    /// Reads an object.
    ///
    /// # Errors
    /// The reason why it cannot be read.
    pub fn read(
        &mut self,
        address: Address,
        published: &mut Published,
    ) -> Result<Value, AbortCode> {
        self.objects(published).read(address)
    }

    /// Writes an object with the bytes of a value. Returns the event to handle. An
    /// [event that is answered later](Event::is_answered_later) is then pending for the application:
    /// [`Node::finish`] returns [`Finished::Written`].
    ///
    /// # Errors
    /// The reason why the value was refused. Nothing has changed then.
    pub fn write(
        &mut self,
        address: Address,
        bytes: &[u8],
        published: &mut Published,
    ) -> Result<Option<Event>, AbortCode> {
        let mut objects = self.objects(published);
        let size = objects.writable_size(address)?;
        if let Some(code) = sdo::wrong_length(bytes.len(), size) {
            return Err(code);
        }
        objects.write(address, bytes)?;
        Ok(self.take_event(Requester::Application(address)))
    }

    const fn objects<'a>(&'a mut self, published: &'a mut Published) -> DeviceObjects<'a> {
        DeviceObjects { device: &mut self.device, published }
    }

    /// Takes the event of the last write, by `requester`.
    fn take_event(&mut self, requester: Requester) -> Option<Event> {
        let event = self.device.event.take();
        if event.is_some_and(Event::is_answered_later) {
            self.device.pending = Some(requester);
        }
        // The latest assignment of the node id takes precedence.
        if matches!(event, Some(Event::Changed { address: NODE_ID, .. } | Event::Restore)) {
            self.lss.forget_assigned_id();
        }
        event
    }

    /// Ends the event that is [answered later](Event::is_answered_later) and pending. Returns its answer, if somebody
    /// still waits for it.
    pub fn finish(&mut self, result: Result<(), AbortCode>) -> Option<Finished> {
        match self.device.pending.take()? {
            Requester::Sdo => {
                let answer = self.sdo.finish(result)?;
                let id = self.device.id?.cob_id(cob_id::SDO_RESPONSE);
                Some(Finished::Can(CanFrame::of(id, answer)))
            }
            Requester::Lss => Some(Finished::Can(lss::answer_to_store(result))),
            Requester::Application(address) => Some(Finished::Written(address)),
            Requester::Gone => None,
        }
    }

    /// Raises a fault. Returns the emergency message to send, or `None` if the fault was already active. If the message
    /// cannot be sent in this state, [`Node::tick`] sends it later.
    pub fn raise(&mut self, fault: Fault, detail: u32) -> Option<CanFrame> {
        if self.device.faults.contains(fault) {
            return None;
        }
        self.note(fault, detail);
        self.report(fault)
    }

    /// Raises a fault that cannot be reported while it lasts. [`Node::tick`] sends the emergency message after
    /// [`Node::release`].
    pub fn raise_held_back(&mut self, fault: Fault, detail: u32) {
        if !self.reported.contains(fault) {
            self.held_back = self.held_back.with(fault);
        }
        if !self.device.faults.contains(fault) {
            self.note(fault, detail);
        }
    }

    /// Allows a fault that was held back to be reported.
    pub fn release(&mut self, fault: Fault) {
        self.held_back = self.held_back.without(fault);
    }

    /// Clears a fault. Returns the emergency message to send, if the fault was reported.
    pub fn clear(&mut self, fault: Fault) -> Option<CanFrame> {
        self.device.faults = self.device.faults.without(fault);
        self.held_back = self.held_back.without(fault);
        let reported = self.reported.contains(fault);
        self.reported = self.reported.without(fault);
        let id = self.id_for_emergencies().filter(|_| reported)?;
        let emergency = Emergency::cleared(fault, self.device.faults);
        Some(CanFrame::of(id, emergency.encode()))
    }

    /// Advances by one tick, with a new estimate. Calls `send` with the kind of each frame that is due and the frame: an
    /// emergency message of the load, process data with the contact first, the heartbeat, then emergency messages that
    /// could not be sent before.
    ///
    /// A frame that cannot be sent still advances its sequence, so that the gap is visible.
    pub fn tick(&mut self, published: &Published, mut send: impl FnMut(Due, CanFrame)) {
        self.ticks = self.ticks.wrapping_add(1);
        self.device.snapshot = Snapshot {
            is_taken: true,
            temperature: published.temperature,
            faults: self.device.faults,
            dropped: published.counters.dropped(),
            last_sync: self.last_sync,
            sequence: self.sequence,
        };
        if let Some(emergency) = self.watch_load() {
            send(Due::Emergency, emergency);
        }
        let Some(id) = self.device.id else {
            return;
        };
        if self.device.state == NmtState::Operational {
            // Phases differ, so that slow frames are not all due on one tick. They differ by the period of the contact,
            // so that the motion of a contact is sent with it.
            let spacing = match self.device.settings.trigger(Pdo::Contact) {
                Trigger::Ticks(period) => u32::from(period),
                Trigger::Off | Trigger::Sync(_) => 1,
            };
            for pdo in Pdo::ALL {
                if self.is_due(pdo, spacing) {
                    let payload = self.device.snapshot.payload(pdo, &published.estimate);
                    send(Due::Pdo(pdo), CanFrame::of(pdo.cob_id(id), payload));
                    if pdo == Pdo::Contact {
                        self.sequence = self.sequence.wrapping_add(1);
                    }
                }
            }
            self.requested = 0;
        }
        if let Some(heartbeat) = self.heartbeat(id) {
            send(Due::Heartbeat, heartbeat);
        }
        if let Some(fault) = self.unreported().iter().next()
            && let Some(emergency) = self.report(fault)
        {
            send(Due::Emergency, emergency);
        }
    }

    /// Discards a load that is too old. If the robot should send the load, reports when it stops and when it sends again.
    fn watch_load(&mut self) -> Option<CanFrame> {
        let device = &mut self.device;
        let limit_ms = u32::from(device.settings.load_timeout_ms());
        device.load_age_us = device.load_age_us.saturating_add(u32::from(device.tick_us));
        let overdue = device.load_age_us > 1_000 * limit_ms && device.load.take().is_some();
        let expected = device.state == NmtState::Operational
            && device.settings.load_input().source == LoadSource::Can;
        if expected && overdue {
            self.raise(Fault::PdoTimeout, limit_ms)
        } else if !expected || device.load.is_some() {
            self.clear(Fault::PdoTimeout)
        } else {
            None
        }
    }

    fn is_due(&self, pdo: Pdo, spacing: u32) -> bool {
        match self.device.settings.trigger(pdo) {
            Trigger::Off => false,
            Trigger::Sync(_) => self.requested & 1 << pdo as u8 != 0,
            Trigger::Ticks(period) => {
                let phase = pdo as u32 * spacing;
                self.ticks.wrapping_add(phase).is_multiple_of(u32::from(period).max(1))
            }
        }
    }

    fn heartbeat(&mut self, id: NodeId) -> Option<CanFrame> {
        let period_us = 1_000 * u32::from(self.device.settings.heartbeat_ms());
        self.heartbeat_age_us =
            self.heartbeat_age_us.saturating_add(u32::from(self.device.tick_us));
        let due = period_us != 0 && self.heartbeat_age_us >= period_us;
        if !due || self.device.state == NmtState::Initialising {
            return None;
        }
        self.heartbeat_age_us = 0;
        Some(CanFrame::of(id.cob_id(cob_id::HEARTBEAT), nmt::encode_heartbeat(self.device.state)))
    }

    fn receive_nmt(&mut self, data: &[u8], id: NodeId) -> Option<Event> {
        let (command, target) = nmt::decode_command(data.first_chunk()?).ok()?;
        if target.raw() == 0 || target.raw() == id.get() { self.command(command) } else { None }
    }

    /// Handles a request of a master that assigns the node id (CiA 305).
    fn receive_lss(&mut self, frame: &CanFrame) -> Outcome {
        let Some(request) = frame.data8() else {
            return Outcome::default();
        };
        let outcome = self.lss.handle(request, &mut self.device);
        if outcome.event.is_some_and(Event::is_answered_later) {
            self.device.pending = Some(Requester::Lss);
        }
        outcome
    }

    fn receive_sync(&mut self, data: &[u8], now: Timestamp) -> Option<Event> {
        self.last_sync =
            ClockReading { sync: data.first().copied().unwrap_or(0), time: now.into() };
        self.syncs = self.syncs.wrapping_add(1);
        let asking = self.device.state == NmtState::Operational;
        for pdo in Pdo::ALL.into_iter().filter(|_| asking) {
            if let Trigger::Sync(every) = self.device.settings.trigger(pdo)
                && self.syncs.is_multiple_of(u32::from(every))
            {
                self.requested |= 1 << pdo as u8;
            }
        }
        Some(Event::Sync(data.first().copied()))
    }

    fn receive_time(&mut self, data: &[u8], now: Timestamp) -> Option<Event> {
        let time = TimeOfDay::decode(data).ok()?;
        self.device.time = Some((time, now));
        Some(Event::Time(time))
    }

    fn receive_sdo(&mut self, frame: &CanFrame, id: NodeId, published: &mut Published) -> Outcome {
        let served = matches!(self.device.state, NmtState::PreOperational | NmtState::Operational);
        let (true, Some(request)) = (served, frame.data8()) else {
            return Outcome::default();
        };
        let mut objects = DeviceObjects { device: &mut self.device, published };
        let answer = self.sdo.handle(request, &mut objects);
        let event = self.take_event(Requester::Sdo);
        Outcome {
            reply: answer.map(|answer| CanFrame::of(id.cob_id(cob_id::SDO_RESPONSE), answer)),
            event,
        }
    }

    fn receive_load(&mut self, data: &[u8]) -> Outcome {
        if self.device.state != NmtState::Operational {
            return Outcome::default();
        }
        if data.len() < 4 {
            return Outcome { reply: self.raise(Fault::PdoLength, data.len() as u32), event: None };
        }
        // A load that is NaN counts as not received.
        let load = Load::decode(data);
        if let Some(load) = load {
            self.device.take_load(load);
        }
        // Only one reply can be returned, so the next tick reports the end of a timeout.
        Outcome { reply: self.clear(Fault::PdoLength), event: load.map(Event::Load) }
    }

    /// Records a fault in the set of active faults and in the history, with its detail.
    fn note(&mut self, fault: Fault, detail: u32) {
        self.device.faults = self.device.faults.with(fault);
        let history = &mut self.device.history;
        if history.is_full() {
            history.pop_back();
        }
        // The history has room now.
        let _ = history.push_front(u32::from(fault.code()) | u32::from(fault.number()) << 16);
        if let Some(kept) = self.details.get_mut(usize::from(fault.number())) {
            *kept = detail;
        }
    }

    /// Creates the emergency message of an active fault, in a state in which it may be sent.
    fn report(&mut self, fault: Fault) -> Option<CanFrame> {
        let id = self.id_for_emergencies()?;
        self.reported = self.reported.with(fault);
        let detail = self.details.get(usize::from(fault.number())).copied();
        let emergency = Emergency::raised(fault, detail.unwrap_or(0), self.device.faults);
        Some(CanFrame::of(id, emergency.encode()))
    }

    /// Identifier of emergency messages, in a state in which they may be sent.
    fn id_for_emergencies(&self) -> Option<u16> {
        match self.device.state {
            NmtState::PreOperational | NmtState::Operational => {
                Some(self.device.id?.cob_id(cob_id::EMERGENCY))
            }
            NmtState::Initialising | NmtState::Stopped => None,
        }
    }

    /// Active faults that are neither reported nor held back.
    #[inline]
    const fn unreported(&self) -> Faults {
        let reportable = self.device.faults.without_all(self.held_back);
        reportable.without_all(self.reported)
    }
}

/// Outcome without a reply.
fn event(event: Option<Event>) -> Outcome {
    Outcome { reply: None, event }
}
