//! The surroundings of the core: time, the cost of code, the private peripherals, and the chip.
//!
//! | step | where |
//! |---|---|
//! | a block of instructions begins: charge the one before, look whether something is due | `blocks` |
//! | fetch it from flash | `blocks` |
//! | a load or store outside of memory | `access` |
//! | events that are due: `catch_up`, `sleep` | here |
//! | instructions and cycles so far | `counting` |

mod access;
mod blocks;
mod counting;

use std::collections::BTreeMap;

use crate::emulator::block::Block;
use crate::emulator::chip::Chip;
use crate::emulator::core::dbgmcu::Dbgmcu;
use crate::emulator::core::nvic::{Nvic, exception};
use crate::emulator::core::scb::Scb;
use crate::emulator::core::semihosting::Semihosting;
use crate::emulator::core::systick::SysTick;
use crate::emulator::failure::Failure;
use crate::emulator::memory::{FLASH, Memory};
use crate::emulator::part::flash::accelerator::Literal;
use crate::emulator::time::to_ns;
use blocks::Beginning;
pub(crate) use blocks::RunningBlock;
pub use counting::MachineCounters;
pub(crate) use counting::{Profile, Watched};

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
