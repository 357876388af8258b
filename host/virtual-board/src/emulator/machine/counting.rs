//! Counters: instructions, cycles, the calls of a function, the instructions of each place in flash.

use super::Machine;
use crate::emulator::memory::FLASH;

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

/// Instructions of each block in flash since the last call of [`Self::take`] or [`Self::clear`].
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    /// Instructions of the block at each half-word.
    instructions: Vec<u32>,
    /// Half-words that are not 0.
    executed: Vec<u32>,
}

impl Profile {
    pub(crate) fn new() -> Self {
        Self { instructions: vec![0; FLASH.size / 2], executed: Vec::new() }
    }

    pub(super) fn add(&mut self, address: u32, instructions: u64) {
        let place = address.wrapping_sub(FLASH.start) / 2;
        if let Some(sum) = self.instructions.get_mut(place as usize) {
            if *sum == 0 {
                self.executed.push(place);
            }
            *sum += instructions as u32;
        }
    }

    /// Takes the address and the instructions of each executed block.
    pub(crate) fn take(&mut self) -> Vec<(u32, u64)> {
        let instructions = &mut self.instructions;
        let taken = self.executed.drain(..).map(|place| {
            let sum = core::mem::take(&mut instructions[place as usize]);
            (FLASH.start + 2 * place, u64::from(sum))
        });
        taken.collect()
    }

    pub(crate) fn clear(&mut self) {
        for place in self.executed.drain(..) {
            self.instructions[place as usize] = 0;
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
