//! Counters: instructions, cycles, the calls of a function.

use super::Machine;

/// Counters so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MachineCounters {
    /// Virtual time, in units of [`time`](crate::emulator::time).
    pub now: u64,
    /// Instructions since power-up.
    pub instructions: u64,
    /// Cycles awake.
    pub cycles: u64,
    /// Cycles in which the core waited for flash, part of `cycles`.
    pub flash_waits: u64,
}

/// Instruction count of the calls of a function, from its first instruction to the one after the call.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched {
    address: u32,
    /// Return address of the current call, and the count at its start.
    call: Option<(u32, u64)>,
    pub(crate) instructions: u64,
}

impl Watched {
    pub(crate) const fn new(address: u32) -> Self {
        Self { address, call: None, instructions: 0 }
    }

    /// Handles a block that begins at `address`, after one that ended before `after`: a call if `address` is the
    /// function, with `after` as its return address.
    pub(super) const fn enter(&mut self, address: u32, after: u32, instructions: u64) {
        match self.call {
            None if address == self.address => self.call = Some((after, instructions)),
            Some((end, start)) if address == end => {
                self.instructions += instructions - start;
                self.call = None;
            }
            _ => {}
        }
    }
}

impl Machine {
    /// Returns the current counters.
    #[must_use]
    pub const fn counters(&self) -> MachineCounters {
        MachineCounters {
            now: self.now,
            instructions: self.instructions,
            cycles: self.cycles,
            flash_waits: self.flash_waits,
        }
    }
}
