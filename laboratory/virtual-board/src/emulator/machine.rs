//! The surroundings of the core: time, the cost of code, the private peripherals, and the chip.
//!
//! In the order of execution: a block of instructions begins, which charges the one before and looks whether something is
//! due (`enter_block`); it is fetched from flash; it loads or stores outside of memory (`load`, `store`); events that are
//! due occur (`catch_up`, `sleep`). [`MachineCounters`] are instructions and cycles so far.

use std::collections::BTreeMap;

use crate::emulator::block::{Block, TAKEN, literals};
use crate::emulator::chip::Chip;
use crate::emulator::core::debugger::{Dbgmcu, Semihosting};
use crate::emulator::core::nvic::{Nvic, exception};
use crate::emulator::core::scb::Scb;
use crate::emulator::core::systick::SysTick;
use crate::emulator::failure::Failure;
use crate::emulator::memory::{FLASH, Memory};
use crate::emulator::part::flash::accelerator::{Literal, StraightRun};
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::time::to_ns;

/// Surroundings of the core: everything except its registers and memory.
pub struct Machine {
    /// Virtual time, in units of [`time`](crate::emulator::time).
    pub now: u64,
    /// Cycles awake since power-up.
    pub cycles: u64,
    /// Instructions since power-up.
    pub instructions: u64,
    /// Cycles in which the core waited for flash, part of `cycles`.
    pub flash_waits: u64,
    /// The chip.
    pub chip: Chip,
    /// The output of the program to its debugger.
    pub semihosting: Semihosting,
    /// The interrupt controller.
    pub nvic: Nvic,
    /// The system control block.
    pub scb: Scb,
    /// Number of times each exception was taken.
    pub exceptions: BTreeMap<u16, u64>,
    /// Faults that the program observed.
    pub faults: Vec<FaultNote>,
    /// Functions whose calls are counted separately, including their callees.
    pub(crate) watched: Vec<Watched>,
    /// Instructions of each place in flash, if they are counted.
    pub(crate) profile: Option<Profile>,
    pub(crate) stop: Option<Stop>,
    pub(crate) failure: Option<Failure>,
    pub(crate) running: Option<RunningBlock>,
    pub(crate) limit: u64,
    pub(crate) reset_requested: bool,
    pub(crate) allow_float: bool,
    pub(crate) event_sent: bool,
    /// Time until which a debugger halts the core.
    pub(crate) halted_until: Option<u64>,
    debug: Dbgmcu,
    systick: SysTick,
    period: u64,
    deadline: u64,
    /// Number of the block at each half-word of flash, counted from 1; 0 if it has not been decoded.
    block_of: Vec<u32>,
    /// Decoded blocks.
    blocks: Vec<Block>,
    /// Beginnings of blocks up to accesses to peripherals, each at the last bits of its end.
    beginnings: Box<[Beginning; BEGINNINGS]>,
    /// Loads from flash of all blocks, at addresses known from their code.
    literals: Vec<Literal>,
}

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

/// A fault that the program observed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultNote {
    /// Time, ns.
    pub time_ns: u64,
    /// Address of the instruction, or the return address.
    pub pc: u32,
    /// Number of the exception that it raised.
    pub exception: u16,
    /// Bits of the fault status register.
    pub status: u32,
    /// Address that was accessed, if any.
    pub address: Option<u32>,
}

impl Machine {
    /// Creates a machine just powered up.
    #[must_use]
    pub fn new(chip: Chip) -> Self {
        let period = chip.period();
        Self {
            now: 0,
            cycles: 0,
            instructions: 0,
            flash_waits: 0,
            chip,
            semihosting: Semihosting::default(),
            nvic: Nvic::default(),
            scb: Scb::new(),
            exceptions: BTreeMap::new(),
            faults: Vec::new(),
            watched: Vec::new(),
            profile: None,
            stop: None,
            failure: None,
            running: None,
            limit: 0,
            reset_requested: false,
            allow_float: false,
            event_sent: false,
            halted_until: None,
            debug: Dbgmcu::default(),
            systick: SysTick::new(0, period),
            period,
            deadline: 0,
            block_of: vec![0; FLASH.size / 2],
            blocks: Vec::new(),
            beginnings: Box::new([Beginning::default(); BEGINNINGS]),
            literals: Vec::new(),
        }
    }

    /// Resets everything except memory and the state that survives a reset.
    pub(crate) fn reset(&mut self) {
        self.chip.reset(self.now);
        self.nvic = Nvic::default();
        self.scb = Scb::new();
        self.period = self.chip.period();
        self.systick = SysTick::new(self.now, self.period);
        self.running = None;
        self.halted_until = None;
        self.deadline = self.now;
    }

    /// Halts the core by a debugger for a duration.
    pub(crate) fn halt(&mut self, duration: u64) {
        self.halted_until = Some(self.now + duration);
        self.chip.freeze(true, &self.debug, self.now);
        self.deadline = self.now;
    }

    /// Returns whether a debugger halts the core. If so, time advances up to the end of the halt.
    pub(crate) fn is_halted(&mut self, memory: &mut dyn Memory) -> bool {
        let Some(end) = self.halted_until else {
            return false;
        };
        if self.now < end {
            self.now = self.deadline.min(self.limit).min(end).max(self.now);
            self.catch_up(memory);
            return true;
        }
        self.halted_until = None;
        self.chip.freeze(false, &self.debug, self.now);
        self.deadline = self.now;
        false
    }

    fn fail(&mut self, pc: u32, address: impl Into<Option<u32>>, what: impl Into<String>) {
        if self.failure.is_none() {
            self.failure = Some(Failure::new(pc, address, what));
        }
        self.stop = Some(Stop::Boundary);
    }

    /// Advances time by a number of cycles.
    pub(crate) const fn spend(&mut self, cycles: u64) {
        self.cycles += cycles;
        self.now += cycles * self.period;
    }

    pub(crate) const fn count_instruction(&mut self) {
        self.instructions += 1;
        self.spend(1);
    }

    pub(crate) fn count_exception(&mut self, number: u16) {
        *self.exceptions.entry(number).or_default() += 1;
    }

    pub(crate) fn note_fault(
        &mut self,
        pc: u32,
        exception: u16,
        status: u32,
        address: Option<u32>,
    ) {
        // A program that faults endlessly must not fill the host's memory.
        if self.faults.len() < 1000 {
            self.faults.push(FaultNote {
                time_ns: to_ns(self.now),
                pc,
                exception,
                status,
                address,
            });
        }
    }

    /// Processes all events that are due.
    pub(crate) fn catch_up(&mut self, memory: &mut dyn Memory) {
        if self.systick.advance(self.now) {
            self.nvic.pend(exception::SYS_TICK);
        }
        if let Err(what) = self.chip.advance(memory, self.now) {
            self.fail(0, None, what);
        }
        self.after_chip();
    }

    /// Applies the effects of the chip on the core: interrupts, resets and stalls.
    fn after_chip(&mut self) {
        self.chip.drive_lines(&mut self.nvic);
        if let Some((from, to)) = self.chip.flash.changed.take() {
            self.forget_blocks(from, to);
        }
        if self.chip.take_reset_request() {
            self.reset_requested = true;
        }
        let period = self.chip.period();
        if period != self.period {
            self.systick.set_period(self.now, period);
            self.period = period;
        }
        // A stall of the bus, for instance while flash is written.
        self.now += core::mem::take(&mut self.chip.flash.stall);
        self.deadline = self.systick.next_event().min(self.chip.next_event());
    }

    /// Stops the crystal.
    pub(crate) fn lose_crystal(&mut self) {
        match self.chip.lose_crystal(self.now) {
            Ok(true) => self.nvic.pend(exception::NMI),
            Ok(false) => {}
            Err(what) => self.fail(0, None, what),
        }
        self.after_chip();
    }

    /// Updates the next event after an external change to the chip, as it may be earlier.
    pub fn wake(&mut self) {
        self.deadline = self.now;
    }

    /// Sleeps: advances time to the next event.
    pub(crate) fn sleep(&mut self, memory: &mut dyn Memory) {
        self.now = self.deadline.min(self.limit).max(self.now);
        self.catch_up(memory);
    }
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
    fn cycles_before(&mut self, memory: &mut dyn Memory, address: u32, pc: u32) -> u32 {
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
    fn forget_blocks(&mut self, from: u32, to: u32) {
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

impl Machine {
    /// Executes an access at its time in the middle of a block; the block's cost so far is charged later.
    fn during<T>(
        &mut self,
        memory: &mut dyn Memory,
        pc: u32,
        access: impl FnOnce(&mut Self, &mut dyn Memory) -> T,
    ) -> T {
        let ahead = match self.running {
            Some(RunningBlock { address, block }) if pc > address && pc - address < block.size => {
                u64::from(self.cycles_before(memory, address, pc))
            }
            _ => 0,
        };
        let ahead_time = ahead * self.period;
        self.cycles += ahead;
        self.now += ahead_time;
        if self.now >= self.deadline {
            self.catch_up(memory);
        }
        let result = access(self, memory);
        self.cycles -= ahead;
        self.now -= ahead_time;
        result
    }

    /// Loads from a peripheral; `None` stops the engine.
    pub(crate) fn load(
        &mut self,
        memory: &mut dyn Memory,
        pc: u32,
        address: u32,
        size: usize,
    ) -> Option<u32> {
        if !self.is_aligned(pc, address, size) {
            return None;
        }
        self.during(memory, pc, |machine, memory| match address {
            0xE000_0000.. => {
                let value = machine.load_private(address & !3);
                if value.is_none() {
                    machine.fail(pc, address, "a load from a register that is not modelled");
                }
                Some(value? >> (8 * (address & 3)))
            }
            _ => {
                let read = machine.chip.read(memory, machine.now, address, size);
                machine.after_chip();
                read.map_err(|what| machine.fail(pc, address, what)).ok()
            }
        })
    }

    /// Stores to a peripheral; false stops the engine.
    pub(crate) fn store(
        &mut self,
        memory: &mut dyn Memory,
        pc: u32,
        address: u32,
        size: usize,
        value: u32,
    ) -> bool {
        if !self.is_aligned(pc, address, size) {
            return false;
        }
        self.during(memory, pc, |machine, memory| {
            let result = if address >= 0xE000_0000 {
                let shift = 8 * (address & 3);
                let mask = (u64::from(u32::MAX) >> (32 - 8 * size.min(4))) as u32;
                let stored =
                    machine.store_private(address & !3, (value & mask) << shift, mask << shift);
                machine.deadline = machine.systick.next_event().min(machine.chip.next_event());
                if stored == Some(true) {
                    machine.chip.reset_cause = Some(ResetCause::Software);
                    machine.reset_requested = true;
                }
                let unknown = || "a store to a register that is not modelled".to_owned();
                stored.map(|_| ()).ok_or_else(unknown)
            } else {
                let chip = &mut machine.chip;
                let written = chip.write(memory, machine.now, address, size, value);
                machine.after_chip();
                written
            };
            let result = result.map_err(|what| machine.fail(pc, address, what));
            result.is_ok()
        })
    }

    fn is_aligned(&mut self, pc: u32, address: u32, size: usize) -> bool {
        let aligned = (address as usize).is_multiple_of(size);
        if !aligned {
            self.fail(pc, address, "an unaligned access to a peripheral");
        }
        aligned
    }

    /// Handles an access to an address without memory or peripheral: fails the run, or stops the engine.
    pub(crate) fn no_memory(&mut self, pc: u32, address: u32, stop: impl FnOnce(u32) -> Stop) {
        match address {
            0x4000_0000..0x6000_0000 => self.fail(pc, address, "a peripheral that is not modelled"),
            0..0x0010_0000 => self.fail(pc, address, "an access through a null pointer"),
            0x2200_0000..0x2400_0000 => {
                self.fail(pc, address, "the bit-band alias of RAM is not modelled");
            }
            _ => self.stop = Some(stop(address)),
        }
    }

    fn load_private(&mut self, address: u32) -> Option<u32> {
        match address {
            0xE000_E010..0xE000_E020 => Some(self.systick.read(address - 0xE000_E010, self.now)),
            0xE000_E004 => Some(2),
            0xE000_E000..0xE000_F000 => {
                let number = self.nvic.active.last().copied().unwrap_or(0);
                self.scb.read(address - 0xE000_E000, &self.nvic, number)
            }
            0xE004_2000..=0xE004_200C => self.debug.read(address - 0xE004_2000),
            // The identification of the flash patch unit and others is not modelled.
            _ => None,
        }
    }

    fn store_private(&mut self, address: u32, value: u32, mask: u32) -> Option<bool> {
        match address {
            0xE000_E010..0xE000_E020 => {
                self.systick.write(address - 0xE000_E010, value, self.now);
            }
            0xE000_E100..0xE000_ED00 => self.nvic.write(address - 0xE000_E100, value, mask),
            0xE000_EF00 => self.nvic.pend(exception::INTERRUPT + (value & 0xFF) as u16),
            0xE000_E000..0xE000_F000 => {
                return self.scb.write(address - 0xE000_E000, value, mask, &mut self.nvic);
            }
            0xE004_2004..=0xE004_200C => self.debug.write(address - 0xE004_2000, value)?,
            _ => return None,
        }
        Some(false)
    }
}

// State of blocks, stops and watched calls.

/// Maximum length of a block of the engine, bytes.
const LONGEST_BLOCK: u32 = 0x1000;

/// In place of a block's number: it has not been decoded.
const UNKNOWN: u32 = 0;

/// The instructions of a block before one that accesses a peripheral. None is at address 0.
#[derive(Clone, Copy, Debug, Default)]
struct Beginning {
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

/// Number of beginnings of blocks that are remembered.
const BEGINNINGS: usize = 1024;

/// Reason why the engine was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// Between two blocks.
    Boundary,
    /// A load from an unmapped address.
    Load { address: u32 },
    /// A store to an unmapped address.
    Store { address: u32 },
    /// A fetch from an address without code.
    FetchFault,
    /// The next instruction is floating-point, and the unit is off.
    NoFloat { instructions: u32, offset: u32 },
    /// An exception of the engine's own numbering.
    Exception(u32),
    /// An instruction unknown to the engine, or a hint.
    Invalid,
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
    const fn enter(&mut self, address: u32, after: u32, instructions: u64) {
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

    fn add(&mut self, address: u32, instructions: u64) {
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
