//! What a node and its application tell each other.

use canopen_rs::NmtState;
use canopen_rs::time::TimeOfDay;
use estimator_core::PerAxis;

use crate::dictionary::Address;
use crate::fault::Fault;
use crate::frame::CanFrame;
use crate::pdo::Load;

/// Why the node boots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BootCause {
    /// Nobody asked for it: power came, or the program had crashed. With autostart the node is
    /// operational at once.
    #[default]
    PowerUp,
    /// A master asked for it, by Reset Node or Reset Communication or by giving the node its first
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
    /// Somebody wants half-widths from steps on good ground.
    Calibration(Calibration),
}

/// What the calibration is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// Collect steps.
    Start,
    /// Make the proposed half-widths the settings.
    Accept,
    /// Give up.
    Cancel,
}

/// How far the calibration is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CalibrationState {
    /// It was not asked for.
    #[default]
    Idle,
    /// It collects steps.
    Collecting,
    /// It proposes these half-widths.
    Ready(PerAxis<f32>),
    /// There were too few usable steps.
    Failed,
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
