//! The cost of executing blocks, and the events that stop it.

use super::{Machine, Stop};
use crate::emulator::block::{Block, TAKEN, literals};
use crate::emulator::memory::{FLASH, Memory};
use crate::emulator::part::flash::accelerator::StraightRun;

/// Maximum length of a block of the engine, bytes.
const LONGEST_BLOCK: u32 = 0x1000;

/// In place of a block's number: it has not been decoded.
const UNKNOWN: u32 = 0;

/// The instructions of a block before one that accesses a peripheral. None is at address 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beginning {
    address: u32,
    pc: u32,
    cycles: u32,
}

/// A block that executes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunningBlock {
    pub(crate) address: u32,
    pub(crate) block: Block,
}

impl Machine {
    /// Charges a block that continued at `next`. Returns whether it sent an event.
    pub(crate) fn charge(&mut self, running: &RunningBlock, next: u32) -> bool {
        let block = &running.block;
        let end = running.address.wrapping_add(block.size);
        self.instructions += u64::from(block.instructions);
        if let Some(profile) = &mut self.profile {
            profile.add(running.address, u64::from(block.instructions));
        }
        self.spend(u64::from(block.cycles) + if next == end { 0 } else { TAKEN });
        block.sends_event
    }

    fn block(&mut self, memory: &mut dyn Memory, address: u32, size: u32) -> Block {
        let index = (address.wrapping_sub(FLASH.start) / 2) as usize;
        let Some(&number) = self.block_of.get(index) else {
            // Code in RAM may change.
            return Block::at(memory, address, size);
        };
        if number != UNKNOWN
            && let Some(block) = self.blocks.get(number as usize - 1)
            && block.size == size
        {
            return *block;
        }
        let mut code = vec![0; size as usize];
        memory.read(address, &mut code);
        let mut block = Block::of(&code);
        let loads = literals(&code, address);
        block.literals = (self.literals.len() as u32, loads.len() as u16);
        self.literals.extend(loads);
        self.blocks.push(block);
        self.block_of[index] = self.blocks.len() as u32;
        block
    }

    /// Cycles of a block's instructions before `pc`.
    pub(super) fn cycles_before(&mut self, memory: &mut dyn Memory, address: u32, pc: u32) -> u32 {
        let at = (pc / 2) as usize % self.beginnings.len();
        let known = self.beginnings[at];
        if (known.address, known.pc) == (address, pc) {
            return known.cycles;
        }
        let cycles = Block::at(memory, address, pc - address).cycles;
        // Code in RAM may change.
        if FLASH.contains(address) {
            self.beginnings[at] = Beginning { address, pc, cycles };
        }
        cycles
    }

    /// Discards blocks, as flash has changed from one address to another.
    pub(super) fn forget_blocks(&mut self, from: u32, to: u32) {
        // Starts far enough before the change that no earlier block reaches into it.
        let slot = |address: u32| (address.saturating_sub(FLASH.start) / 2) as usize;
        let (from, to) = (slot(from.saturating_sub(LONGEST_BLOCK)), slot(to));
        if let Some(blocks) = self.block_of.get_mut(from..to.min(FLASH.size / 2)) {
            blocks.fill(UNKNOWN);
        }
        self.beginnings.fill(Beginning::default());
    }

    /// Skips the repetitions of an instruction that branches to itself, up to the next event.
    fn go_round(&mut self, running: &RunningBlock) {
        let round = u64::from(running.block.cycles) + TAKEN;
        let end = self.deadline.min(self.limit);
        let rounds = end.saturating_sub(self.now) / (round * self.period);
        self.instructions += rounds;
        self.spend(rounds * round);
    }

    /// Handles the entry of a block: charges the previous one, and stops the engine if an event comes first.
    pub(crate) fn enter_block(&mut self, memory: &mut dyn Memory, address: u32, size: u32) {
        if let Some(running) = self.running.take() {
            self.event_sent |= self.charge(&running, address);
            let after = running.address.wrapping_add(running.block.size);
            for watched in &mut self.watched {
                watched.enter(address, after, self.instructions);
            }
            if address == running.address && running.block.instructions == 1 {
                self.go_round(&running);
            }
        }
        if self.stop.is_some() {
            return;
        }
        if self.now >= self.deadline {
            self.catch_up(memory);
        }
        if self.now >= self.limit || self.reset_requested || self.failure.is_some() {
            self.stop = Some(Stop::Boundary);
            return;
        }
        let block = self.block(memory, address, size);
        if let Some((instructions, offset)) = block.float
            && !self.scb.float_is_on()
            && !self.allow_float
        {
            self.stop = Some(Stop::NoFloat { instructions, offset });
            return;
        }
        self.running = Some(RunningBlock { address, block });
    }

    /// Charges the fetch of the entered block from flash.
    pub(crate) fn fetch(&mut self) {
        let Some(RunningBlock { address, block }) = &self.running else {
            return;
        };
        let index = (address.wrapping_sub(FLASH.start) / 2) as usize;
        if index >= self.block_of.len() {
            return;
        }
        let (first, count) = (block.literals.0 as usize, usize::from(block.literals.1));
        let run = StraightRun {
            address: *address,
            size: block.size,
            cycles: block.cycles,
            literals: self.literals.get(first..first + count).unwrap_or(&[]),
        };
        let waits = self.chip.flash.accelerator.fetch(self.cycles, &run);
        self.flash_waits += waits;
        self.spend(waits);
    }
}
