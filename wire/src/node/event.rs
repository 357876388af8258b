//! What a node reports to its application.

use canopen_rs::NmtState;
use canopen_rs::time::TimeOfDay;

use crate::dictionary::Address;
use crate::fault::Fault;
use crate::frame::CanFrame;
use crate::pdo::Load;

/// Why the node boots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BootCause {
    /// Not commanded: power came, or the program had crashed. With autostart the node is
    /// operational at once.
    #[default]
    PowerUp,
    /// Commanded by a master: by Reset Node or Reset Communication or by giving the node its first
    /// id: the node waits in pre-operational state.
    Commanded,
}

/// Something the application has to know or to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A setting has a new value: [`Node::settings`](super::Node::settings).
    Changed(Address),
    /// Store the settings, then call [`Node::finish`](super::Node::finish).
    Store,
    /// Forget the stored settings so that the defaults apply from the next reset, then call
    /// [`Node::finish`](super::Node::finish).
    Restore,
    /// Set the highest brown-out level, then call [`Node::finish`](super::Node::finish).
    ProtectSupply,
    /// The NMT state has changed.
    State(NmtState),
    /// Reset the whole board.
    ResetNode,
    /// Reset the communication: load the stored settings and call [`Node::boot`](super::Node::boot). It was commanded,
    /// or LSS has given the node its first id.
    ResetCommunication,
    /// A SYNC came, with its counter where it has one.
    Sync(Option<u8>),
    /// A time stamp came.
    Time(TimeOfDay),
    /// The robot says what the load is.
    Load(Load),
    /// A command to the calibration was executed: [`Node::settings`](super::Node::settings).
    Calibration(Calibration),
}

/// A command to the calibration: sub-index 1 of object 0x2120.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// What the foot has learnt is in the settings now: the estimator goes on as it is.
    Keep,
    /// Nothing learnt is left in the settings: the estimator starts with nothing.
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

/// How far the calibration is: sub-index 2 of object 0x2120.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationState {
    /// The foot has not learnt enough yet.
    Settling,
    /// The foot has learnt enough, and goes on learning.
    Settled,
    /// The settings let it learn nothing.
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

/// What came of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// The frame to send in answer.
    pub reply: Option<CanFrame>,
    /// What the application has to know or to do.
    pub event: Option<Event>,
}

/// Why and where the board crashed last, as RAM remembers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crash {
    /// [`Fault::Panic`], [`Fault::HardFault`] or [`Fault::WatchdogReset`].
    pub fault: Fault,
    /// The program counter.
    pub program_counter: u32,
}
