//! Events that a node reports to its application.

use canopen_rs::NmtState;
use canopen_rs::time::TimeOfDay;

use crate::dictionary::{Address, Concern};
use crate::fault::Fault;
use crate::frame::CanFrame;
use crate::pdo::Load;

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
    /// A setting has changed: [`Node::settings`](super::Node::settings).
    Changed {
        /// Address of the setting.
        address: Address,
        /// Area affected by the setting.
        concern: Concern,
    },
    /// Store the settings, then call [`Node::finish`](super::Node::finish).
    Store,
    /// Delete the stored settings, so that the defaults apply from the next reset. Then call
    /// [`Node::finish`](super::Node::finish).
    Restore,
    /// Set the highest brown-out level, then call [`Node::finish`](super::Node::finish).
    ProtectSupply,
    /// Stop the program: restart into the bootloader, which can receive another program.
    StopProgram,
    /// Confirm the running program, if it is new, then call [`Node::finish`](super::Node::finish).
    ConfirmProgram,
    /// The NMT state has changed.
    State(NmtState),
    /// Reset the whole board.
    ResetNode,
    /// Reset the communication: load the stored settings and call [`Node::boot`](super::Node::boot). It was commanded,
    /// or LSS has assigned the first id.
    ResetCommunication,
    /// A SYNC was received, with its counter if it has one.
    Sync(Option<u8>),
    /// A time stamp was received.
    Time(TimeOfDay),
    /// The load was received from the robot.
    Load(Load),
    /// A command to the calibration was executed: [`Node::settings`](super::Node::settings).
    Calibration(Calibration),
}

impl Event {
    /// Returns whether the application answers the request on completion, by [`Node::finish`](super::Node::finish).
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

/// Result of a received frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Response to send.
    pub reply: Option<CanFrame>,
    /// Event for the application.
    pub event: Option<Event>,
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
    /// Object 0x1F56: the first four bytes of the program's hash. If a debug probe wrote the program, those of its
    /// commit, or 0 if no commit has the sources.
    pub identification: u32,
    /// The same for the program before the last update, of which a copy is kept; 0 without one.
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
