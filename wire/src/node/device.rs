//! State behind the objects, and the rules for reading and writing them.

use canopen_rs::NmtState;
use canopen_rs::time::TimeOfDay;
use estimator_core::any::Method;
use estimator_core::{ContactEstimate, Learning, Learnt, Timestamp, VelocitySigma};
use heapless::Deque;

use super::{Calibration, Event};
use crate::abort::AbortCode;
use crate::board::{Counter, Counters, Stage};
use crate::diagnosis::Diagnosis;
use crate::dictionary::{
    self, Access, Address, Concern, ERROR_HISTORY, Place, Role, SIGNATURE_BROWN_OUT,
    SIGNATURE_RESTORE, SIGNATURE_STORE, index,
};
use crate::fault::{Fault, Faults};
use crate::foot::NodeId;
use crate::pdo::{Load, LongTime, Snapshot};
use crate::sdo::{Objects, WriteOutcome};
use crate::settings::Settings;
use crate::value::Value;

/// Values of the application behind the objects. The application owns them, and lends them to each call that reads or
/// writes an object.
#[derive(Clone, Debug)]
pub struct Published {
    /// Newest estimate.
    pub estimate: ContactEstimate,
    /// Temperature of the sensor, °C; NaN before the first sample.
    pub temperature: f32,
    /// Stage of the board.
    pub stage: Stage,
    /// Counters since the start.
    pub counters: Counters,
    /// Values learnt by the estimator. They may be as old as the last request: bring them up to date before
    /// [`Node::receive`](super::Node::receive), [`read`](super::Node::read) and [`write`](super::Node::write).
    pub learnt: Learnt,
    /// Largest costs so far, under the same rule.
    pub costs: Costs,
    /// Name of the board.
    pub hardware: &'static str,
    /// The last crash.
    pub crash: Option<Crash>,
    /// Brown-out level at the start, 0 to 3.
    pub brown_out_level: u8,
    /// The running program.
    pub program: Program,
    /// Diagnosis of the board and its sensor.
    pub diagnosis: Diagnosis,
}

impl Default for Published {
    fn default() -> Self {
        Self {
            estimate: ContactEstimate::default(),
            temperature: f32::NAN,
            stage: Stage::Starting,
            counters: Counters::default(),
            learnt: Learnt::default(),
            costs: Costs::default(),
            hardware: "",
            crash: None,
            brown_out_level: 0,
            program: Program::default(),
            diagnosis: Diagnosis::default(),
        }
    }
}

/// State behind the objects: everything of the node except its protocols.
#[derive(Clone, Debug)]
pub(super) struct Device {
    pub(super) id: Option<NodeId>,
    pub(super) serial: u32,
    pub(super) settings: Settings,
    pub(super) state: NmtState,
    pub(super) faults: Faults,
    /// Emergencies, the newest first.
    pub(super) history: Deque<u32, ERROR_HISTORY>,
    pub(super) snapshot: Snapshot,
    /// Period of the ticks, µs.
    pub(super) tick_us: u16,
    pub(super) load: Option<Load>,
    /// Time since the load was received, µs.
    pub(super) load_age_us: u32,
    pub(super) time: Option<(TimeOfDay, Timestamp)>,
    pub(super) event: Option<Event>,
    /// Requester of the pending event that is answered later, if there is one. Until it is answered, another such event is refused.
    pub(super) pending: Option<Requester>,
}

/// The objects: the state of the node, and the values that the application publishes.
pub(super) struct DeviceObjects<'a> {
    pub(super) device: &'a mut Device,
    pub(super) published: &'a mut Published,
}

/// Requester of a store, a restore, a protection or a confirmation that is pending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Requester {
    /// The SDO client.
    Sdo,
    /// The LSS master.
    Lss,
    /// The application, which wrote this object.
    Application(Address),
    /// A master that has reset the communication since.
    Gone,
}

/// Cause and location of the last crash, as kept in RAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crash {
    /// [`Fault::Panic`], [`Fault::HardFault`] or [`Fault::WatchdogReset`].
    pub fault: Fault,
    /// The program counter.
    pub program_counter: u32,
}

/// The running program, as the objects of CiA 302-3 describe it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Program {
    /// Object 0x1F56: the first four bytes of the program's hash. If a debug probe wrote the program, the first four bytes
    /// of its commit, or 0 if no commit has the sources.
    pub identification: u32,
    /// Identification of the program before the last update, whose copy is kept; 0 without a copy.
    pub previous: u32,
    /// Object 0x1F57: the reason why the last update failed; 0 if it succeeded.
    pub flash_status: u32,
}

/// Largest costs of the running program so far, measured by the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Costs {
    /// Time from the data-ready edge to the contact in its mailbox, µs.
    pub mailbox_us: u16,
    /// Time from the data-ready edge to the end of the tick's work, µs.
    pub work_us: u16,
    /// Depth of the stack, bytes.
    pub stack_bytes: u16,
}

/// State of the calibration: sub-index 2 of object 0x2120.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationState {
    /// Not enough has been learnt yet.
    Settling,
    /// Enough has been learnt; learning continues.
    Settled,
    /// Learning is disabled by the settings.
    Frozen,
}

impl CalibrationState {
    /// The state's code on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Settling => 0,
            Self::Settled => 1,
            Self::Frozen => 2,
        }
    }

    /// The state with this code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        let all = [Self::Settling, Self::Settled, Self::Frozen];
        all.into_iter().find(|state| state.code() == code)
    }
}

impl Device {
    fn id(&self) -> u32 {
        self.id.map_or(0, |id| u32::from(id.get()))
    }

    pub(super) const fn take_load(&mut self, load: Load) {
        self.load = Some(load);
        self.load_age_us = 0;
    }
}

impl DeviceObjects<'_> {
    fn live(&self, address: Address) -> Option<u32> {
        let part = usize::from(address.subindex).checked_sub(1);
        let Self { device, published } = self;
        Some(match address.index {
            index::ERROR_HISTORY => device.history.iter().nth(part?).copied().unwrap_or(0),
            index::IDENTITY => device.serial,
            index::STAGE => u32::from(published.stage.code()),
            index::FAULTS => device.faults.bits(),
            index::COUNTERS => {
                (published.counters).get(part.and_then(|i| Counter::ALL.get(i).copied())?)
            }
            index::LAST_CRASH => match (published.crash, address.subindex) {
                (Some(crash), 1) => u32::from(crash.fault.code()),
                (Some(crash), _) => crash.program_counter,
                (None, _) => 0,
            },
            index::VELOCITY_SIGMA => self.velocity_sigma().0.to_bits(),
            index::SUPPLY => u32::from(published.brown_out_level),
            index::COSTS => u32::from(match address.subindex {
                1 => published.costs.mailbox_us,
                2 => published.costs.work_us,
                3 => published.costs.stack_bytes,
                4 => device.tick_us,
                _ => return None,
            }),
            index::DIAGNOSIS => published.diagnosis.raw(address.subindex)?,
            index::SETTINGS_HASH => device.settings.hash(),
            index::PROGRAM_ID => match address.subindex {
                1 => published.program.identification,
                _ => published.program.previous,
            },
            index::FLASH_STATUS => published.program.flash_status,
            index::TIME => match (device.time, address.subindex) {
                (Some((time, _)), 1) => u32::from(time.days),
                (Some((time, _)), 2) => time.milliseconds,
                (Some((_, at)), _) => LongTime::from(at).0,
                (None, _) => 0,
            },
            index::CALIBRATION => match address.subindex {
                2 => u32::from(self.calibration().code()),
                sub => {
                    let number = usize::from(sub).checked_sub(3)?;
                    published.learnt.to_array().get(number)?.to_bits()
                }
            },
            _ => return None,
        })
    }

    /// Zero-velocity sigma of the newest estimate; the maximum while a fault voids it.
    fn velocity_sigma(&self) -> VelocitySigma {
        if self.device.faults.void_estimate() {
            VelocitySigma::MOST
        } else {
            self.published.estimate.velocity_sigma
        }
    }

    fn calibration(&self) -> CalibrationState {
        match (self.device.settings.method(), self.device.settings.learning()) {
            (Method::SelfCalibrating, Learning::On) if self.published.learnt.is_settled() => {
                CalibrationState::Settled
            }
            (Method::SelfCalibrating, Learning::On) => CalibrationState::Settling,
            _ => CalibrationState::Frozen,
        }
    }

    /// Checks whether a setting may be written: in pre-operational state, or (over UART) while there is no node id.
    /// While the lock is set, only the lock itself may be written.
    fn may_be_changed(&self, index: u16) -> Result<(), AbortCode> {
        if self.device.state != NmtState::PreOperational && self.device.id.is_some() {
            return Err(AbortCode::DeviceState);
        }
        if self.device.settings.is_locked() && index != index::LOCK {
            return Err(AbortCode::Locked);
        }
        Ok(())
    }

    fn write_setting(
        &mut self,
        address: Address,
        concern: Concern,
        value: Value,
    ) -> Result<(), AbortCode> {
        self.may_be_changed(address.index)?;
        self.device.settings.set(address, value)?;
        if address.index == index::LEARNT {
            self.restart_learning();
        }
        self.device.event = Some(Event::Changed { address, concern });
        Ok(())
    }

    /// Resets the learnt values to the values of the settings, until new ones are published.
    fn restart_learning(&mut self) {
        self.published.learnt = self.device.settings.learnt().unwrap_or_default();
    }

    fn run_command(&mut self, address: Address, value: Value) -> Result<WriteOutcome, AbortCode> {
        match (address.index, value) {
            (index::ERROR_HISTORY, Value::U8(1..)) => Err(AbortCode::InvalidValue),
            (index::ERROR_HISTORY, _) => {
                self.device.history.clear();
                Ok(WriteOutcome::Done)
            }
            (index::STORE, Value::U32(SIGNATURE_STORE))
            | (index::RESTORE, Value::U32(SIGNATURE_RESTORE))
            | (index::SUPPLY, Value::U32(SIGNATURE_BROWN_OUT))
                if self.device.pending.is_some() =>
            {
                Err(AbortCode::Hardware)
            }
            (index::STORE, Value::U32(SIGNATURE_STORE)) => {
                self.device.event = Some(Event::Store);
                Ok(WriteOutcome::Pending)
            }
            (index::RESTORE, Value::U32(SIGNATURE_RESTORE)) if self.device.settings.is_locked() => {
                Err(AbortCode::Locked)
            }
            (index::RESTORE, Value::U32(SIGNATURE_RESTORE)) => {
                self.device.event = Some(Event::Restore);
                Ok(WriteOutcome::Pending)
            }
            (index::SUPPLY, Value::U32(SIGNATURE_BROWN_OUT)) => {
                self.may_be_changed(address.index)?;
                self.device.event = Some(Event::ProtectSupply);
                Ok(WriteOutcome::Pending)
            }
            (index::STORE | index::RESTORE | index::SUPPLY, _) => Err(AbortCode::CannotStore),
            (index::PROGRAM_CONTROL, Value::U8(command)) => self.control_program(command),
            (index::CALIBRATION, Value::U8(command)) => {
                self.may_be_changed(address.index)?;
                let command = match command {
                    1 if !self.published.learnt.is_settled() => {
                        return Err(AbortCode::InvalidValue);
                    }
                    1 => Calibration::Keep,
                    _ => Calibration::Forget,
                };
                match command {
                    Calibration::Keep => {
                        self.device.settings.set_learnt(Some(self.published.learnt))?;
                    }
                    Calibration::Forget => {
                        self.device.settings.set_learnt(None)?;
                        self.restart_learning();
                    }
                }
                self.device.event = Some(Event::Calibration(command));
                Ok(WriteOutcome::Done)
            }
            _ => Err(AbortCode::ReadOnly),
        }
    }

    /// Executes a command of CiA 302-3 to the running program.
    fn control_program(&mut self, command: u8) -> Result<WriteOutcome, AbortCode> {
        match command {
            0 | 0x80 if self.device.pending.is_some() => return Err(AbortCode::Hardware),
            // The bootloader answers, so that it is ready for the master's next request.
            0 => {
                self.may_be_changed(index::PROGRAM_CONTROL)?;
                self.device.event = Some(Event::StopProgram);
                return Ok(WriteOutcome::Pending);
            }
            // Start: the program already runs.
            1 => {}
            2 => self.device.event = Some(Event::ResetNode),
            // Only the bootloader clears, while the program does not run.
            3 => return Err(AbortCode::DeviceState),
            0x80 => {
                self.device.event = Some(Event::ConfirmProgram);
                return Ok(WriteOutcome::Pending);
            }
            _ => return Err(AbortCode::InvalidValue),
        }
        Ok(WriteOutcome::Done)
    }
}

impl Objects for DeviceObjects<'_> {
    fn read(&mut self, address: Address) -> Result<Value, AbortCode> {
        let entry = match dictionary::find(address)? {
            Place::Highest(highest) => return Ok(Value::U8(highest)),
            Place::Entry(entry, _) if entry.access == Access::Wo => {
                return Err(AbortCode::WriteOnly);
            }
            Place::Entry(entry, _) => entry,
        };
        let raw = match (entry.role, address.index) {
            (_, index::ERROR_REGISTER) => u32::from(self.device.faults.register()),
            (Role::Constant, _) => return Ok(entry.default),
            (_, index::HARDWARE_VERSION) => return Ok(Value::Text(self.published.hardware)),
            (Role::Setting(_), _) => {
                return self.device.settings.get(address).ok_or(AbortCode::NoObject);
            }
            (Role::CobId, _) => entry.default.to_raw().wrapping_add(self.device.id()),
            (Role::PdoCobId, _) => self
                .device
                .settings
                .get(address)
                .ok_or(AbortCode::NoObject)?
                .to_raw()
                .wrapping_add(self.device.id()),
            (Role::Process, _) => {
                let value = self.device.snapshot.value(address, &self.published.estimate);
                value.ok_or(AbortCode::NoObject)?
            }
            (Role::Input, _) => self.device.load.map_or(f32::NAN, |load| load.0).to_bits(),
            (Role::Command, index::ERROR_HISTORY) => self.device.history.len() as u32,
            (Role::Command, _) => return Ok(entry.default),
            (Role::Live, _) => self.live(address).ok_or(AbortCode::NoObject)?,
        };
        Value::from_raw(entry.data_type(), raw).ok_or(AbortCode::NoObject)
    }

    fn writable_size(&mut self, address: Address) -> Result<usize, AbortCode> {
        match dictionary::find(address)? {
            Place::Entry(entry, _) if matches!(entry.access, Access::Rw | Access::Wo) => {
                entry.data_type().size().ok_or(AbortCode::ReadOnly)
            }
            Place::Entry(..) | Place::Highest(_) => Err(AbortCode::ReadOnly),
        }
    }

    fn write(&mut self, address: Address, bytes: &[u8]) -> Result<WriteOutcome, AbortCode> {
        let Place::Entry(entry, _) = dictionary::find(address)? else {
            return Err(AbortCode::ReadOnly);
        };
        let value = Value::from_bytes(entry.data_type(), bytes).ok_or(AbortCode::Length)?;
        match entry.role {
            Role::Setting(concern) => self.write_setting(address, concern, value)?,
            Role::PdoCobId => {
                let id = value.to_raw().wrapping_sub(self.device.id());
                self.write_setting(address, Concern::Stream, Value::U32(id))?;
            }
            Role::Input => {
                entry.limits().check(value)?;
                if let Value::F32(load) = value {
                    self.device.take_load(Load(load));
                    self.device.event = Some(Event::Load(Load(load)));
                }
            }
            Role::Command => {
                entry.limits().check(value)?;
                return self.run_command(address, value);
            }
            Role::Constant | Role::CobId | Role::Process | Role::Live => {
                return Err(AbortCode::ReadOnly);
            }
        }
        Ok(WriteOutcome::Done)
    }
}
