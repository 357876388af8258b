//! Starts: of a program, and of the bootloader itself.

use crate::image::Refusal;

/// Why the bootloader is to restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restart {
    /// A master has asked for it.
    ByMaster,
    /// No master has controlled or sent a program for a minute.
    AfterSilence,
}

/// Whether there is a program that can be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// There is one.
    CanRun,
    /// There is none, for this reason; `None` where there has been none.
    Missing(Option<Refusal>),
    /// The flash has failed in the steps at the start, which the next start does again.
    Unsettled,
}
