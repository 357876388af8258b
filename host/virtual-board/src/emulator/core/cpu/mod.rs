//! The core: its run loop, its registers, sleep and reset.
//!
//! | step of the run loop | where |
//! |---|---|
//! | events that are due; failures, resets, a debugger's halt: [`Cpu::run_until`] | here |
//! | an exception is due: push a frame, go to its handler | `exceptions` |
//! | run blocks of instructions until a hook stops the engine | `stops` |
//! | the engine's hooks: blocks, peripherals, addresses without memory | `engine` |
//! | writes to flash from a hook, delayed until the engine stops | `late` |
//! | a fault, or a return from an exception | `exceptions` |

mod engine;
mod exceptions;
mod late;
mod stops;

use std::cell::{Cell, RefCell, RefMut};
use std::rc::Rc;

use unicorn_engine::{RegisterARM, uc_error};

use super::nvic::exception;
use crate::emulator::failure::Failure;
use crate::emulator::machine::Machine;
use crate::emulator::memory::{FLASH, Memory};
use engine::Engine;
use exceptions::{FLOATS, masked_below};
use late::LateWrites;

const R: [RegisterARM; 13] = {
    use RegisterARM::{R0, R1, R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12};
    [R0, R1, R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12]
};

/// The state of the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoreState {
    /// Executes.
    Running,
    /// Waits for an interrupt.
    WaitingForInterrupt,
    /// Waits for an event.
    WaitingForEvent,
    /// A fault occurred in a fault handler: only a reset ends this state.
    LockedUp {
        /// Address of the instruction.
        pc: u32,
    },
}

/// State of PRIMASK.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interrupts {
    /// Interrupts are taken.
    Enabled = 0,
    /// Interrupts are masked.
    Masked = 1,
}

/// The core with everything connected to it.
pub struct Cpu {
    engine: Engine,
    machine: Rc<RefCell<Machine>>,
    /// The state of the core.
    pub state: CoreState,
    event: bool,
    /// Whether the next exception is entered directly from the end of another (tail-chaining).
    returned: bool,
    /// Whether code in RAM has been executed.
    runs_from_ram: Rc<Cell<bool>>,
    /// Writes from within hooks.
    late: Rc<RefCell<LateWrites>>,
    /// Vector table after a reset.
    vectors: u32,
}

impl Cpu {
    /// Creates a core with memory and `machine` around it, its memory loaded with `segments`.
    ///
    /// At a reset it begins with the vector table at `vectors`: that at the start of the flash, or that of a program
    /// whose bootloader takes no time.
    pub fn new(
        machine: Machine,
        segments: &[(u32, Vec<u8>)],
        vectors: u32,
    ) -> Result<Self, String> {
        let text = |error: uc_error| format!("{error:?}");
        let mut cpu = Self {
            engine: engine::with_memory(segments)?,
            machine: Rc::new(RefCell::new(machine)),
            state: CoreState::Running,
            event: false,
            returned: false,
            runs_from_ram: Rc::default(),
            late: Rc::default(),
            vectors,
        };
        cpu.translate_addresses().map_err(text)?;
        cpu.map_peripherals().map_err(text)?;
        cpu.add_hooks().map_err(text)?;
        cpu.reset();
        Ok(cpu)
    }

    /// The surroundings of the core.
    pub fn machine(&self) -> RefMut<'_, Machine> {
        self.machine.borrow_mut()
    }

    /// The memory, as a debugger reads it.
    pub fn memory(&mut self) -> &mut dyn Memory {
        &mut self.engine
    }

    /// Derails the core: it continues at `address`.
    pub fn derail(&mut self, address: u32, interrupts: Interrupts) {
        self.set(RegisterARM::PRIMASK, interrupts as u32);
        self.set(RegisterARM::PC, address | 1);
        // Out of any IT block.
        self.set(RegisterARM::EPSR, 0x0100_0000);
        self.state = CoreState::Running;
    }

    /// Moves the current stack pointer.
    pub fn move_stack(&mut self, address: u32) {
        self.set(RegisterARM::SP, address & !3);
    }

    fn get(&self, register: RegisterARM) -> u32 {
        // A register always reads.
        self.engine.reg_read(register).unwrap_or(0) as u32
    }

    fn set(&mut self, register: RegisterARM, value: u32) {
        // A register can always be written.
        let _ = self.engine.reg_write(register, u64::from(value));
    }

    /// Restarts the core; the machine has been reset.
    fn reset(&mut self) {
        self.state = CoreState::Running;
        self.event = false;
        self.returned = false;
        // The program may be another one than that which the engine has translated.
        let _ = self.engine.ctl_flush_tb();
        // Out of any handler first: its stack pointer is the main one.
        self.set(RegisterARM::XPSR_NZCVQG, 0x0100_0000);
        self.set(RegisterARM::CONTROL, 0);
        use RegisterARM::{BASEPRI, FAULTMASK, FPSCR, PRIMASK};
        for register in [PRIMASK, BASEPRI, FAULTMASK, FPSCR].into_iter().chain(R) {
            self.set(register, 0);
        }
        for register in FLOATS {
            let _ = self.engine.reg_write(register, 0);
        }
        self.set(RegisterARM::LR, !0);
        let stack = self.engine.word(self.vectors).unwrap_or(0);
        let start = self.engine.word(self.vectors + 4).unwrap_or(0);
        self.set(RegisterARM::SP, stack & !3);
        self.set(RegisterARM::PC, start);
        self.set(RegisterARM::APSR_NZCV, 0);
        if self.vectors != FLASH.start {
            self.machine.borrow_mut().scb.vtor = self.vectors;
        }
    }

    /// Execution priority, masks included.
    fn execution_priority(&self) -> i16 {
        let machine = self.machine.borrow();
        machine.nvic.active_priority().min(masked_below(&self.engine, &machine))
    }

    /// Runs until the machine's time is `until` or the program exits.
    ///
    /// # Errors
    /// If the firmware misused the part or used something that is not modelled.
    pub fn run_until(&mut self, until: u64) -> Result<(), Failure> {
        self.machine.borrow_mut().limit = until;
        loop {
            {
                let mut machine = self.machine.borrow_mut();
                machine.catch_up(&mut self.engine);
                if let Some(failure) = machine.failure.clone() {
                    return Err(failure);
                }
                if machine.now >= until || machine.semihosting.exit.is_some() {
                    return Ok(());
                }
                if core::mem::take(&mut machine.reset_requested) {
                    if core::mem::take(&mut machine.chip.power_lost) {
                        engine::lose_ram(&mut self.engine);
                    }
                    machine.reset();
                    drop(machine);
                    self.reset();
                    continue;
                }
            }
            if self.machine.borrow_mut().is_halted(&mut self.engine) {
                continue;
            }
            if self.machine.borrow().chip.rcc.stopped {
                self.machine.borrow_mut().sleep(&mut self.engine);
                continue;
            }
            let next = self.machine.borrow().nvic.next;
            if let CoreState::LockedUp { pc } = self.state {
                // Only an NMI ends it, unless it is in one (ARMv7-M, B1.5.15).
                match next {
                    Some((exception::NMI, priority)) if priority < self.execution_priority() => {
                        self.state = CoreState::Running;
                        self.enter(exception::NMI, pc);
                    }
                    _ => self.machine.borrow_mut().sleep(&mut self.engine),
                }
                continue;
            }
            if let Some((number, priority)) = next {
                if priority < self.execution_priority() {
                    self.state = CoreState::Running;
                    let pc = self.get(RegisterARM::PC);
                    self.enter(number, pc);
                    continue;
                }
                if self.state == CoreState::WaitingForInterrupt && self.wakes(priority) {
                    self.state = CoreState::Running;
                }
            }
            self.returned = false;
            if self.state == CoreState::WaitingForEvent && core::mem::take(&mut self.event) {
                self.state = CoreState::Running;
            }
            if self.state != CoreState::Running {
                self.machine.borrow_mut().sleep(&mut self.engine);
                continue;
            }
            self.run_blocks()?;
        }
    }

    /// Returns whether a pending exception ends a wait for interrupts, as if PRIMASK were clear.
    fn wakes(&self, priority: i16) -> bool {
        let machine = self.machine.borrow();
        let mut running = machine.nvic.active_priority();
        let base = self.get(RegisterARM::BASEPRI);
        if base != 0 {
            running = running.min(i16::from(machine.nvic.group_of(base as u8)));
        }
        priority < running
    }
}
