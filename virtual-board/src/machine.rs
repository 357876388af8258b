//! What surrounds the core: time, what code costs, the private peripherals, and the chip.

use std::collections::{BTreeMap, HashMap};

use crate::block::{Block, TAKEN, literals};
use crate::chip::{Chip, Context};
use crate::core::cpu::{FLASH, FLASH_SIZE, block_at};
use crate::core::dbgmcu::Dbgmcu;
use crate::core::dwt::Dwt;
use crate::core::nvic::{Nvic, exception};
use crate::core::scb::Scb;
use crate::core::semihosting::Semihosting;
use crate::core::systick::SysTick;
use crate::failure::Failure;
use crate::part::flash::accelerator::{Literal, Run};

/// The memory that programs see as memory.
pub trait Memory {
    /// Reads; false where there is none.
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool;
    /// Writes; false where there is none.
    fn write(&mut self, address: u32, bytes: &[u8]) -> bool;

    /// A byte.
    fn byte(&mut self, address: u32) -> Option<u8> {
        let mut bytes = [0; 1];
        self.read(address, &mut bytes).then_some(bytes[0])
    }

    /// A word, little end first.
    fn word(&mut self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes)
            .then(|| u32::from_le_bytes(bytes))
    }
}

/// No block of the engine is longer, bytes.
const LONGEST_BLOCK: u32 = 0x1000;

/// Why the engine was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// Between two blocks.
    Boundary,
    /// A load from where nothing answers.
    Load { address: u32 },
    /// A store to where nothing answers.
    Store { address: u32 },
    /// No code there.
    FetchFault,
    /// A floating-point instruction is ahead, and the unit is off.
    NoFloat { instructions: u32, offset: u32 },
    /// An exception of the engine's own numbering.
    Exception(u32),
    /// An instruction it does not know, or a hint that it leaves to others.
    Invalid,
}

/// A block that executes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunningBlock {
    pub(crate) address: u32,
    pub(crate) block: Block,
}

/// A fault that the program saw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultNote {
    /// When, ns.
    pub time_ns: u64,
    /// The instruction, or where it would have returned.
    pub pc: u32,
    /// Which exception it asked for.
    pub exception: u16,
    /// Bits of the fault status register.
    pub status: u32,
    /// What it was about.
    pub address: Option<u32>,
}

/// Everything but the core's registers and memory.
pub struct Machine {
    /// Virtual time, in units of [`time`](crate::time).
    pub now: u64,
    /// Cycles awake since power-up.
    pub cycles: u64,
    /// Instructions since power-up.
    pub instructions: u64,
    /// Those of the cycles in which the core waited for flash.
    pub flash_waits: u64,
    /// The chip.
    pub chip: Chip,
    /// What the program told its debugger.
    pub semihosting: Semihosting,
    /// The interrupt controller.
    pub nvic: Nvic,
    /// The system control block.
    pub scb: Scb,
    /// How often each exception was taken.
    pub exceptions: BTreeMap<u16, u64>,
    /// Faults that the program saw.
    pub faults: Vec<FaultNote>,
    /// Blocks executed at addresses that somebody asked about: how often.
    pub(crate) probes: HashMap<u32, Probe>,
    /// Instructions by half-word of flash; empty where nobody wants to know.
    pub(crate) profile: Vec<u64>,
    /// Cycles of waiting for flash, by the same.
    pub(crate) wait_profile: Vec<u64>,
    /// Functions whose calls are counted apart, with all that they call.
    pub(crate) watched: Vec<Watched>,
    pub(crate) stop: Option<Stop>,
    pub(crate) failure: Option<Failure>,
    pub(crate) running: Option<RunningBlock>,
    pub(crate) limit: u64,
    pub(crate) reset_requested: bool,
    pub(crate) allow_float: bool,
    pub(crate) event_sent: bool,
    /// A debugger halts the core until then.
    pub(crate) halted_until: Option<u64>,
    debug: Dbgmcu,
    systick: SysTick,
    dwt: Dwt,
    period: u64,
    deadline: u64,
    blocks: Vec<Block>,
    /// What all blocks load from flash at places known from their code.
    literals: Vec<Literal>,
}

/// What the calls of a function cost, from its first instruction to the one after the call.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched {
    address: u32,
    /// Where the current call returns to, and the count when it began.
    call: Option<(u32, u64)>,
    pub(crate) instructions: u64,
}

impl Watched {
    /// A block begins at `address`, and another one ended before `after`: a call where the first
    /// is the function, and then `after` is where it returns to.
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

/// What was seen each time a block began at an address.
#[derive(Clone, Debug, Default)]
pub struct Probe {
    /// The counters then.
    pub seen: Vec<Counters>,
}

/// What has been counted so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counters {
    /// Virtual time, in units of [`time`](crate::time).
    pub now: u64,
    /// Instructions since power-up.
    pub instructions: u64,
    /// Cycles awake.
    pub cycles: u64,
    /// Those of them in which the core waited for flash.
    pub flash_waits: u64,
}

impl Machine {
    /// A machine just powered up.
    #[must_use]
    pub fn new(chip: Chip) -> Self {
        let period = chip.period();
        let mut systick = SysTick::default();
        systick.set_period(0, period);
        Self {
            now: 0,
            cycles: 0,
            instructions: 0,
            flash_waits: 0,
            chip,
            semihosting: Semihosting::default(),
            nvic: Nvic::default(),
            scb: Scb::default(),
            exceptions: BTreeMap::new(),
            faults: Vec::new(),
            probes: HashMap::new(),
            profile: Vec::new(),
            wait_profile: Vec::new(),
            watched: Vec::new(),
            stop: None,
            failure: None,
            running: None,
            limit: 0,
            reset_requested: false,
            allow_float: false,
            event_sent: false,
            halted_until: None,
            debug: Dbgmcu::default(),
            systick,
            dwt: Dwt::default(),
            period,
            deadline: 0,
            blocks: vec![Block::default(); FLASH_SIZE / 2],
            literals: Vec::new(),
        }
    }

    /// Counts the instructions of calls of the function at `address` apart, from now on.
    pub(crate) fn watch(&mut self, address: u32) {
        self.watched.push(Watched {
            address,
            call: None,
            instructions: 0,
        });
    }

    /// Counts instructions by place from now on.
    pub fn start_profile(&mut self) {
        self.profile = vec![0; FLASH_SIZE / 2];
        self.wait_profile = vec![0; FLASH_SIZE / 2];
    }

    /// The counters now.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        Counters {
            now: self.now,
            instructions: self.instructions,
            cycles: self.cycles,
            flash_waits: self.flash_waits,
        }
    }

    /// Everything but memory and what a reset leaves alone starts anew.
    pub(crate) fn reset(&mut self) {
        self.chip.reset(self.now);
        self.nvic = Nvic::default();
        self.scb = Scb::default();
        self.dwt = Dwt::default();
        self.systick = SysTick::default();
        self.period = self.chip.period();
        self.systick.set_period(self.now, self.period);
        self.running = None;
        self.halted_until = None;
        self.deadline = self.now;
    }

    /// A debugger halts the core for a time.
    pub(crate) fn halt(&mut self, duration: u64) {
        self.halted_until = Some(self.now + duration);
        self.chip.freeze(true, &self.debug, self.now);
        self.deadline = self.now;
    }

    /// Whether a debugger halts the core: then time passes, at most until it goes on.
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

    /// Cycles pass.
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
        // A program that faults for ever must not fill the host's memory.
        if self.faults.len() < 1000 {
            self.faults.push(FaultNote {
                time_ns: crate::time::to_ns(self.now),
                pc,
                exception,
                status,
                address,
            });
        }
    }

    /// Charges a block that was left for `next`: whether it sent an event.
    pub(crate) fn charge(&mut self, running: &RunningBlock, next: u32) -> bool {
        let block = &running.block;
        let end = running.address.wrapping_add(block.size);
        self.instructions += u64::from(block.instructions);
        let place = (running.address.wrapping_sub(FLASH) / 2) as usize;
        if let Some(count) = self.profile.get_mut(place) {
            *count += u64::from(block.instructions);
        }
        self.spend(u64::from(block.cycles) + if next == end { 0 } else { TAKEN });
        block.sends_event
    }

    /// The first `size` bytes of a block.
    pub(crate) fn part_of(&self, memory: &mut dyn Memory, address: u32, size: u32) -> Block {
        block_at(memory, address, size)
    }

    fn block(&mut self, memory: &mut dyn Memory, address: u32, size: u32) -> Block {
        let slot = (address.wrapping_sub(FLASH) / 2) as usize;
        match self.blocks.get(slot) {
            Some(block) if block.size == size => *block,
            Some(_) => {
                let mut code = vec![0; size as usize];
                memory.read(address, &mut code);
                let mut block = Block::of(&code, size);
                let loads = literals(&code, address);
                block.literals = (self.literals.len() as u32, loads.len() as u16);
                self.literals.extend(loads);
                self.blocks[slot] = block;
                block
            }
            // Code in RAM may change.
            None => block_at(memory, address, size),
        }
    }

    /// An instruction that branches to itself goes on doing so until something happens.
    fn go_round(&mut self, running: &RunningBlock) {
        let round = u64::from(running.block.cycles) + TAKEN;
        let end = self.deadline.min(self.limit);
        let rounds = end.saturating_sub(self.now) / (round * self.period);
        self.instructions += rounds;
        self.spend(rounds * round);
    }

    /// The engine is about to execute a block: charges the one before, and stops it where
    /// something else comes first.
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
            self.stop = Some(Stop::NoFloat {
                instructions,
                offset,
            });
            return;
        }
        if !self.probes.is_empty() {
            let counters = self.counters();
            if let Some(probe) = self.probes.get_mut(&address) {
                probe.seen.push(counters);
            }
        }
        self.running = Some(RunningBlock { address, block });
    }

    /// The block that has been entered is fetched from flash, and executes.
    pub(crate) fn fetch(&mut self) {
        let Some(RunningBlock { address, block }) = self.running else {
            return;
        };
        let place = (address.wrapping_sub(FLASH) / 2) as usize;
        if place >= self.blocks.len() {
            return;
        }
        let (first, count) = (block.literals.0 as usize, usize::from(block.literals.1));
        let run = Run {
            address,
            size: block.size,
            cycles: block.cycles,
            literals: self.literals.get(first..first + count).unwrap_or(&[]),
        };
        let waits = self.chip.flash.accelerator.fetch(self.cycles, &run);
        if let Some(count) = self.wait_profile.get_mut(place) {
            *count += waits;
        }
        self.flash_waits += waits;
        self.spend(waits);
    }

    /// Lets everything happen that is due.
    pub(crate) fn catch_up(&mut self, memory: &mut dyn Memory) {
        if self.systick.advance(self.now) {
            self.nvic.pend(exception::SYS_TICK);
        }
        let mut context = Context {
            now: self.now,
            memory,
        };
        if let Err(what) = self.chip.advance(&mut context) {
            self.fail(0, None, what);
        }
        self.after_chip();
    }

    /// What the chip did reaches the core.
    fn after_chip(&mut self) {
        self.chip.drive_lines(&mut self.nvic);
        if let Some((from, to)) = self.chip.take_flash_changed() {
            // From so far before that no block reaches into it.
            let slot = |address: u32| (address.saturating_sub(FLASH) / 2) as usize;
            let (from, to) = (slot(from.saturating_sub(LONGEST_BLOCK)), slot(to));
            if let Some(blocks) = self.blocks.get_mut(from..to.min(FLASH_SIZE / 2)) {
                blocks.fill(Block::default());
            }
        }
        if self.chip.take_reset_request() {
            self.reset_requested = true;
        }
        let period = self.chip.period();
        if period != self.period {
            self.systick.set_period(self.now, period);
            self.period = period;
        }
        // A stall of the bus, as while flash is written.
        let stall = self.chip.take_stall();
        self.now += stall;
        self.deadline = self.systick.next_event().min(self.chip.next_event());
    }

    /// The crystal stops.
    pub(crate) fn lose_crystal(&mut self) {
        match self.chip.lose_crystal(self.now) {
            Ok(true) => self.nvic.pend(exception::NMI),
            Ok(false) => {}
            Err(what) => self.fail(0, None, what),
        }
        self.after_chip();
    }

    /// Somebody outside has touched the chip: what is next may be earlier.
    pub fn wake(&mut self) {
        self.deadline = self.now;
    }

    /// The core sleeps: time passes until the next event.
    pub(crate) fn sleep(&mut self, memory: &mut dyn Memory) {
        self.now = self.deadline.min(self.limit).max(self.now);
        self.catch_up(memory);
    }

    /// The time of an access in the middle of a block; the block's cost so far is charged later.
    fn during<T>(
        &mut self,
        memory: &mut dyn Memory,
        pc: u32,
        access: impl FnOnce(&mut Self, &mut dyn Memory) -> T,
    ) -> T {
        let ahead = match self.running {
            Some(RunningBlock { address, block }) if pc > address && pc - address < block.size => {
                u64::from(block_at(memory, address, pc - address).cycles)
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

    /// A load from a peripheral; `None` stops the engine.
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
                let mut context = Context {
                    now: machine.now,
                    memory,
                };
                let read = machine.chip.read(&mut context, address, size);
                machine.after_chip();
                match read {
                    Ok(value) => Some(value),
                    Err(what) => {
                        machine.fail(pc, address, what);
                        None
                    }
                }
            }
        })
    }

    /// A store to a peripheral; false stops the engine.
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
                match stored {
                    Some(true) => {
                        machine.chip.note_software_reset();
                        machine.reset_requested = true;
                        Ok(())
                    }
                    Some(false) => Ok(()),
                    None => Err("a store to a register that is not modelled".to_owned()),
                }
            } else {
                let mut context = Context {
                    now: machine.now,
                    memory,
                };
                let written = machine.chip.write(&mut context, address, size, value);
                machine.after_chip();
                written
            };
            match result {
                Ok(()) => true,
                Err(what) => {
                    machine.fail(pc, address, what);
                    false
                }
            }
        })
    }

    fn is_aligned(&mut self, pc: u32, address: u32, size: usize) -> bool {
        let aligned = (address as usize).is_multiple_of(size);
        if !aligned {
            self.fail(pc, address, "an unaligned access to a peripheral");
        }
        aligned
    }

    /// An access to an address without memory or peripheral windows.
    pub(crate) fn no_memory(&mut self, pc: u32, address: u32, write: bool) {
        match address {
            0x4000_0000..0x6000_0000 => self.fail(pc, address, "a peripheral that is not modelled"),
            0..0x0010_0000 => self.fail(pc, address, "an access through a null pointer"),
            0x2200_0000..0x2400_0000 => {
                self.fail(pc, address, "the bit-band alias of RAM is not modelled");
            }
            _ if write => self.stop = Some(Stop::Store { address }),
            _ => self.stop = Some(Stop::Load { address }),
        }
    }

    fn load_private(&mut self, address: u32) -> Option<u32> {
        match address {
            0xE000_1000..0xE000_2000 => self.dwt.read(address - 0xE000_1000, self.cycles),
            0xE000_E010..0xE000_E020 => Some(self.systick.read(address - 0xE000_E010, self.now)),
            0xE000_E004 => Some(2),
            0xE000_E100..0xE000_ED00 => Some(self.nvic.read(address - 0xE000_E100)),
            0xE000_E000..0xE000_F000 => {
                let number = self.nvic.active().last().copied().unwrap_or(0);
                self.scb.read(address - 0xE000_E000, &self.nvic, number)
            }
            0xE004_2000..=0xE004_200C => self.debug.read(address - 0xE004_2000),
            // The identification of the flash patch unit and others is not there.
            _ => None,
        }
    }

    fn store_private(&mut self, address: u32, value: u32, mask: u32) -> Option<bool> {
        match address {
            0xE000_1000..0xE000_2000 => {
                self.dwt.write(address - 0xE000_1000, value, self.cycles)?;
            }
            0xE000_E010..0xE000_E020 => {
                self.systick.write(address - 0xE000_E010, value, self.now);
            }
            0xE000_E100..0xE000_ED00 => self.nvic.write(address - 0xE000_E100, value, mask),
            0xE000_EF00 => self.nvic.pend(exception::INTERRUPT + (value & 0xFF) as u16),
            0xE000_E000..0xE000_F000 => {
                return self
                    .scb
                    .write(address - 0xE000_E000, value, mask, &mut self.nvic);
            }
            0xE004_2004..=0xE004_200C => self.debug.write(address - 0xE004_2000, value)?,
            _ => return None,
        }
        Some(false)
    }
}
