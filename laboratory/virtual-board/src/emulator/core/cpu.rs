//! The core: its run loop, its registers, sleep, reset and exceptions, around the Unicorn engine.
//!
//! This file follows the run loop, [`Cpu::run_until`]:
//!
//! 1. Events that are due; failures, resets, a debugger's halt.
//! 2. If an exception is due, push a frame and go to its handler.
//! 3. Otherwise run blocks of instructions until a hook stops the engine, and handle the reason: a fault, a return from
//!    an exception, a wait, a breakpoint.
//!
//! Then come the engine with its hooks (blocks, peripherals, addresses without memory), and the writes to flash from
//! a hook, which wait until the engine stops.

use std::cell::{Cell, RefCell, RefMut};
use std::rc::Rc;

use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, TlbEntry, TlbType, Unicorn,
    uc_error,
};

use super::nvic::{THREAD, exception};
use super::scb::{FORCED, VECTTBL, cfsr};
use crate::emulator::block::Block;
use crate::emulator::chip::NOMINAL_MV;
use crate::emulator::failure::Failure;
use crate::emulator::machine::{Machine, RunningBlock, Stop};
use crate::emulator::memory::{
    CCM, FLASH, MEMORIES, Memory, RAM, UNIQUE_NUMBER, UNTOUCHED, is_memory,
};
use crate::emulator::part::adc::reference_code;

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
            engine: engine_with_memory(segments)?,
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
        // Leaves any IT block.
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
        // The program may differ from the program that the engine has translated.
        let _ = self.engine.ctl_flush_tb();
        // The core leaves any handler first, because the stack pointer of a handler is the main one.
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
                        lose_ram(&mut self.engine);
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
                // Only an NMI ends the lock-up, unless the core is already in an NMI (ARMv7-M, B1.5.15).
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

/// The engine.
type Engine = Unicorn<'static, ()>;

/// The general registers except SP, LR and PC, and the registers of floating point that an exception stacks.
const R: [RegisterARM; 13] = {
    use RegisterARM::{R0, R1, R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12};
    [R0, R1, R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12]
};

const FLOATS: [RegisterARM; 8] = {
    use RegisterARM::{D0, D1, D2, D3, D4, D5, D6, D7};
    [D0, D1, D2, D3, D4, D5, D6, D7]
};

/// Priority value below which exceptions are taken.
fn masked_below(engine: &Unicorn<'_, ()>, machine: &Machine) -> i16 {
    let get = |register| engine.reg_read(register).unwrap_or(0) as u8;
    let mut priority = THREAD;
    let base = get(RegisterARM::BASEPRI);
    if base != 0 {
        priority = i16::from(machine.nvic.group_of(base));
    }
    if get(RegisterARM::PRIMASK) & 1 != 0 {
        priority = 0;
    }
    if get(RegisterARM::FAULTMASK) & 1 != 0 {
        priority = -1;
    }
    priority
}

/// Returns whether the address is valid for a stack.
const fn is_writable(address: u32) -> bool {
    CCM.contains(address) || RAM.contains(address)
}

const WFI: u16 = 0xBF30;
const WFE: u16 = 0xBF20;
const YIELD: u16 = 0xBF10;
const SEMIHOSTING: u16 = 0xBEAB;

// Running until a hook stops the engine.
impl Cpu {
    /// Runs the engine until a hook stops it, and handles the reason.
    fn run_blocks(&mut self) -> Result<(), Failure> {
        self.machine.borrow_mut().stop = None;
        let start = self.get(RegisterARM::PC);
        let result = self.engine.emu_start(u64::from(start | 1), 0, 0, 0);
        self.write_deferred();
        let pc = self.get(RegisterARM::PC);
        let stop = self.machine.borrow_mut().stop.take();
        // The current block, up to the place where it stopped.
        let block = self.finish_block(pc, &stop);
        match stop {
            // A store continues to the end of its block, and the bus refuses it afterwards.
            Some(Stop::Boundary) => {}
            Some(Stop::Store { address }) => {
                self.fault(pc, exception::BUS_FAULT, cfsr::IMPRECISERR, Some(address));
            }
            Some(Stop::Load { address }) => {
                let status = cfsr::PRECISERR | cfsr::BFARVALID;
                self.fault(pc, exception::BUS_FAULT, status, Some(address));
            }
            Some(Stop::FetchFault) => {
                if pc >= 0xFFFF_FF00 {
                    self.leave(pc);
                } else if RAM.contains(pc) && !self.runs_from_ram.replace(true) {
                    // Stores to executable memory are slow, so it is enabled on first use only.
                    let (start, size) = (u64::from(RAM.start), RAM.size as u64);
                    (self.engine.mem_protect(start, size, Prot::ALL))
                        .or_else(|error| failed(pc, format!("{error:?}")))?;
                } else {
                    self.fault(pc, exception::BUS_FAULT, cfsr::IBUSERR, None);
                }
            }
            Some(Stop::NoFloat { instructions, offset }) => {
                self.without_float(instructions, offset)?;
            }
            Some(Stop::Exception(7)) => self.breakpoint(pc)?,
            Some(Stop::Exception(8)) => self.leave(pc),
            Some(Stop::Exception(22)) => self.usage_fault(pc, cfsr::UNALIGNED),
            Some(Stop::Exception(number)) => {
                return failed(pc, format!("the engine stopped with {number}"));
            }
            Some(Stop::Invalid) => {
                let last = self.half(pc.wrapping_sub(2));
                let at_end = block.is_some_and(|(address, size)| address + size == pc);
                if self.get(RegisterARM::EPSR) & 0x0100_0000 == 0 {
                    self.usage_fault(pc, cfsr::INVSTATE);
                } else if at_end && last == WFE {
                    if !core::mem::take(&mut self.event) {
                        self.state = CoreState::WaitingForEvent;
                    }
                } else if !(at_end && last == YIELD) {
                    self.usage_fault(pc, cfsr::UNDEFINSTR);
                }
            }
            None => match result {
                Ok(()) if self.half(pc.wrapping_sub(2)) == WFI => {
                    self.state = CoreState::WaitingForInterrupt;
                }
                Ok(()) => {}
                Err(error) => return failed(pc, format!("the engine failed: {error:?}")),
            },
        }
        Ok(())
    }

    /// Charges the block that was running when the engine stopped. Returns its start and length.
    fn finish_block(&mut self, pc: u32, stop: &Option<Stop>) -> Option<(u32, u32)> {
        let mut machine = self.machine.borrow_mut();
        let block = machine.running.take()?;
        let whole = !matches!(
            stop,
            Some(Stop::Load { .. } | Stop::FetchFault | Stop::Exception(7 | 22) | Stop::Invalid)
        ) || pc < block.address
            || pc >= block.address + block.block.size;
        let mut ran = block;
        if !whole {
            ran.block = Block::at(&mut self.engine, block.address, pc - block.address);
        }
        self.event |= machine.charge(&ran, pc);
        self.event |= core::mem::take(&mut machine.event_sent);
        Some((block.address, block.block.size))
    }

    /// Applies the writes that hooks have deferred; the engine has stopped.
    fn write_deferred(&mut self) {
        apply_late_writes(&mut self.late.borrow_mut(), &mut self.engine);
    }

    /// Handles a floating-point instruction while the unit is off: runs up to it, then faults.
    fn without_float(&mut self, instructions: u32, offset: u32) -> Result<(), Failure> {
        let start = self.get(RegisterARM::PC);
        let pc = start + offset;
        if instructions > 0 {
            self.machine.borrow_mut().allow_float = true;
            let result = self.engine.emu_start(u64::from(start | 1), 0, 0, instructions as usize);
            self.write_deferred();
            let mut machine = self.machine.borrow_mut();
            machine.allow_float = false;
            machine.stop = None;
            machine.running = None;
            let block = Block::at(&mut self.engine, start, offset);
            let address = start;
            machine.charge(&RunningBlock { address, block }, pc);
            result.or_else(|error| failed(start, format!("{error:?}")))?;
        }
        self.usage_fault(pc, cfsr::NOCP);
        Ok(())
    }

    /// Handles a breakpoint: a semihosting call, or an error.
    fn breakpoint(&mut self, pc: u32) -> Result<(), Failure> {
        if self.half(pc) != SEMIHOSTING {
            return failed(pc, "a breakpoint, and no debugger");
        }
        let (r0, r1) = (self.get(RegisterARM::R0), self.get(RegisterARM::R1));
        let answer = {
            let mut machine = self.machine.borrow_mut();
            machine.count_instruction();
            machine.semihosting.call(&mut self.engine, r0, r1)
        };
        let Some(answer) = answer else {
            return failed(pc, format!("semihosting call {r0:#x}"));
        };
        self.set(RegisterARM::R0, answer);
        self.set(RegisterARM::PC, (pc + 2) | 1);
        Ok(())
    }

    /// Reads two bytes of code.
    fn half(&mut self, address: u32) -> u16 {
        let mut bytes = [0; 2];
        self.engine.read(address, &mut bytes);
        u16::from_le_bytes(bytes)
    }
}

/// Ends the run at an instruction.
fn failed(pc: u32, what: impl Into<String>) -> Result<(), Failure> {
    Err(Failure::new(pc, None, what))
}

/// The registers that an exception stacks before the return address and the program status, in this order.
const STACKED: [RegisterARM; 6] = {
    use RegisterARM::{LR, R0, R1, R2, R3, R12};
    [R0, R1, R2, R3, R12, LR]
};

/// Cycles from an exception's arrival to its handler, from its end to the interrupted code, and from one handler
/// to the next.
const ENTRY: u64 = 12;
const EXIT: u64 = 10;
const TAIL: u64 = 6;

// Exception entry and return: frames, vectors, faults (ARMv7-M, B1.5).
impl Cpu {
    /// Raises a usage fault.
    fn usage_fault(&mut self, pc: u32, status: u32) {
        self.fault(pc, exception::USAGE_FAULT, status, None);
    }

    /// Raises a fault: exception number `fault`, bits `status` of CFSR, the frame's return address `pc`, and the address
    /// that was accessed, if known. BFAR takes it only with `BFARVALID`.
    fn fault(&mut self, pc: u32, fault: u16, status: u32, address: Option<u32>) {
        let running = self.execution_priority();
        let number = {
            let mut machine = self.machine.borrow_mut();
            machine.note_fault(pc, fault, status, address);
            machine.scb.cfsr |= status;
            if let Some(address) = address
                && status & cfsr::BFARVALID != 0
            {
                machine.scb.bfar = address;
            }
            let takes = machine.nvic.is_enabled(fault) && machine.nvic.priority_of(fault) < running;
            if takes {
                fault
            } else if running > -1 {
                machine.scb.hfsr |= FORCED;
                exception::HARD_FAULT
            } else {
                drop(machine);
                self.state = CoreState::LockedUp { pc };
                return;
            }
        };
        self.enter(number, pc);
    }

    /// Takes an exception: pushes a frame and goes to the handler.
    fn enter(&mut self, number: u16, return_address: u32) {
        let xpsr = self.get(RegisterARM::XPSR);
        let control = self.get(RegisterARM::CONTROL);
        let handler = xpsr & 0x1FF != 0;
        let float = control & 4 != 0;
        let process = !handler && control & 2 != 0;
        let stack = self.get(RegisterARM::SP);
        let aligned = self.machine.borrow().scb.ccr & 0x200 != 0;
        let padded = aligned && stack & 4 != 0;
        let size: u32 = if float { 0x68 } else { 0x20 };
        let frame = stack.wrapping_sub(size) & if aligned { !7 } else { !3 };

        let mut words = [0_u32; 26];
        for (word, register) in words.iter_mut().zip(STACKED) {
            *word = self.get(register);
        }
        words[6] = return_address & !1;
        words[7] = xpsr & !0x200 | u32::from(padded) << 9;
        if float {
            for (pair, register) in FLOATS.into_iter().enumerate() {
                let value = self.engine.reg_read(register).unwrap_or(0);
                words[8 + 2 * pair] = value as u32;
                words[9 + 2 * pair] = (value >> 32) as u32;
            }
            words[24] = self.get(RegisterARM::FPSCR);
        }
        let bytes: Vec<u8> =
            words.iter().take(size as usize / 4).flat_map(|word| word.to_le_bytes()).collect();
        let stacked = is_writable(frame) && self.engine.write(frame, &bytes);

        self.set(RegisterARM::SP, frame);
        // CONTROL is written before the exception's number, because a handler cannot change its stack.
        self.set(RegisterARM::CONTROL, control & 1);
        self.set(RegisterARM::XPSR_NZCVQG, xpsr & 0xF80F_0000 | 0x0100_0000);
        self.set(RegisterARM::IPSR, u32::from(number));
        let mut link = 0xFFFF_FFE1_u32;
        link |= if float { 0 } else { 0x10 };
        link |= if handler { 0 } else { 0x8 };
        link |= if process { 0x4 } else { 0 };
        self.set(RegisterARM::LR, link);

        let mut machine = self.machine.borrow_mut();
        machine.spend(if core::mem::take(&mut self.returned) { TAIL } else { ENTRY });
        machine.nvic.begin(number);
        machine.count_exception(number);
        let table = match machine.scb.vtor {
            0 => FLASH.start,
            vtor => vtor,
        };
        let vector = self.engine.word(table + 4 * u32::from(number));
        // If the frame cannot be written, that is a fault of its own. An NMI and a hard fault begin nevertheless, because
        // nothing may interrupt them; after an NMI the fault is then pending.
        let unbroken = matches!(number, exception::NMI | exception::HARD_FAULT);
        if !stacked && number == exception::NMI {
            machine.scb.hfsr |= FORCED;
            machine.nvic.pend(exception::HARD_FAULT);
        }
        let failed = !stacked && !unbroken;
        if !stacked {
            machine.scb.cfsr |= cfsr::STKERR;
            machine.note_fault(return_address, exception::BUS_FAULT, cfsr::STKERR, Some(frame));
        }
        drop(machine);
        match vector {
            Some(vector) if vector & 1 == 1 => self.set(RegisterARM::PC, vector),
            _ => {
                self.machine.borrow_mut().scb.hfsr |= VECTTBL;
                self.state = CoreState::LockedUp { pc: return_address };
            }
        }
        self.fresh_flags();
        if failed {
            // The derived fault replaces the first instruction of the exception.
            let mut machine = self.machine.borrow_mut();
            machine.nvic.end(number);
            if number < exception::INTERRUPT || machine.nvic.priority_of(number) >= 0 {
                machine.nvic.pend(number);
            }
            machine.scb.hfsr |= FORCED;
            machine.nvic.begin(exception::HARD_FAULT);
            machine.count_exception(exception::HARD_FAULT);
            drop(machine);
            let hard_fault = u32::from(exception::HARD_FAULT);
            let vector = self.engine.word(table + 4 * hard_fault);
            self.set(RegisterARM::IPSR, hard_fault);
            self.set(RegisterARM::PC, vector.unwrap_or(1));
            self.fresh_flags();
        }
    }

    /// Refreshes the flags that the engine has cached.
    fn fresh_flags(&mut self) {
        let flags = self.get(RegisterARM::XPSR) & 0xF000_0000;
        self.set(RegisterARM::APSR_NZCV, flags);
    }

    /// Returns from an exception, with return code `code`.
    fn leave(&mut self, code: u32) {
        let number = (self.get(RegisterARM::XPSR) & 0x1FF) as u16;
        let ended = self.machine.borrow_mut().nvic.end(number);
        let (thread, process, float) = (code & 8 != 0, code & 4 != 0, code & 0x10 == 0);
        if number == 0 || !ended {
            return self.usage_fault(code, cfsr::INVPC);
        }
        if number != exception::NMI {
            self.set(RegisterARM::FAULTMASK, 0);
        }
        let process = process && thread;
        let stack_pointer = if process { RegisterARM::PSP } else { RegisterARM::SP };
        let stack = self.get(stack_pointer);
        let size: u32 = if float { 0x68 } else { 0x20 };
        let mut bytes = [0; 0x68];
        let read = self.engine.read(stack, bytes.get_mut(..size as usize).unwrap_or(&mut []));
        if !read {
            return self.fault(code, exception::BUS_FAULT, cfsr::UNSTKERR, Some(stack));
        }
        let word =
            |index: usize| u32::from_le_bytes(core::array::from_fn(|i| bytes[4 * index + i]));
        let xpsr = word(7);
        if thread != (xpsr & 0x1FF == 0) {
            return self.usage_fault(code, cfsr::INVPC);
        }
        for (index, register) in STACKED.into_iter().enumerate() {
            self.set(register, word(index));
        }
        if float {
            for (pair, register) in FLOATS.into_iter().enumerate() {
                let value = u64::from(word(8 + 2 * pair)) | u64::from(word(9 + 2 * pair)) << 32;
                let _ = self.engine.reg_write(register, value);
            }
            self.set(RegisterARM::FPSCR, word(24));
        }
        let unwound = stack.wrapping_add(size).wrapping_add(if xpsr & 0x200 == 0 { 0 } else { 4 });
        self.set(stack_pointer, unwound);
        let control = self.get(RegisterARM::CONTROL) & 1;
        // CONTROL is written after the exception's number, because the stack can change only now.
        self.set(RegisterARM::XPSR_NZCVQG, xpsr & !0x200);
        let control = control | if process { 2 } else { 0 } | if float { 4 } else { 0 };
        self.set(RegisterARM::CONTROL, control);
        self.set(RegisterARM::PC, word(6) | (xpsr >> 24) & 1);
        let bits = xpsr & 0x0600_FC00;
        self.fresh_flags();
        // Restores the IT state, which writing the PC and the flags may have changed.
        self.set(RegisterARM::EPSR, bits | xpsr & 0x0100_0000);
        self.event = true;

        let mut machine = self.machine.borrow_mut();
        // Tail-chaining: the stack is not popped and pushed between two handlers.
        let tail = machine
            .nvic
            .next
            .is_some_and(|(_, priority)| priority < machine.nvic.active_priority().min(THREAD));
        if !tail {
            machine.spend(EXIT);
        }
        self.returned = tail;
        if thread && machine.scb.scr & 2 != 0 {
            self.state = CoreState::WaitingForInterrupt;
        }
    }
}

/// Address ranges of peripherals: start and length.
const WINDOWS: [(u64, u64); 3] =
    [(0x4000_0000, 0x0008_0000), (0x5000_0000, 0x0006_1000), (0xE000_0000, 0x0010_0000)];

/// Factory bytes: a serial number, the size of flash in KiB, and the code of the reference at 3.3 V.
const FACTORY_WORDS: [(u32, u32); 5] = [
    (UNIQUE_NUMBER, 0x0034_001F),
    (UNIQUE_NUMBER + 4, 0x3332_5110),
    (UNIQUE_NUMBER + 8, 0x3038_3437),
    (0x1FFF_7A20, 0x0400_FFFF),
    (0x1FFF_7A28, (reference_code(NOMINAL_MV) as u32) << 16 | 0xFFFF),
];

/// Address space without RAM, first and last address. A hook on RAM makes every store there slow.
const NOT_RAM: [(u64, u64); 3] = [
    (0, CCM.start as u64 - 1),
    (CCM.end() as u64, RAM.start as u64 - 1),
    (RAM.end() as u64, 0xFFFF_FFFF),
];

// The engine: its windows to peripherals, and its hooks.
impl Cpu {
    /// Disables address translation; RAM becomes executable only once code in it is executed. The engine inspects
    /// every store to a page that may hold code.
    fn translate_addresses(&mut self) -> Result<(), uc_error> {
        self.engine.ctl_set_tlb_type(TlbType::VIRTUAL)?;
        let machine = Rc::clone(&self.machine);
        let runs_from_ram = Rc::clone(&self.runs_from_ram);
        self.engine.add_tlb_hook(1, 0, move |engine, address, kind| {
            let fetch = kind == MemType::FETCH;
            let data_only = RAM.contains(address as u32) && !runs_from_ram.get();
            if fetch && data_only {
                machine.borrow_mut().stop = Some(Stop::FetchFault);
                return None;
            }
            if !fetch {
                // As in the hook for peripherals.
                let _ = engine.reg_write(RegisterARM::EPSR, 0x0100_0000);
            }
            Some(TlbEntry {
                paddr: address,
                perms: if data_only { Prot(1 | 2) } else { Prot::ALL },
            })
        })?;
        Ok(())
    }

    /// Maps peripherals as windows without access rights. The engine then calls the protection hook, which has the
    /// exact PC, and after it the window, which does not.
    fn map_peripherals(&mut self) -> Result<(), uc_error> {
        let loaded = Rc::new(Cell::new(0));
        for (start, size) in WINDOWS {
            let value = Rc::clone(&loaded);
            self.engine.mmio_map(
                start,
                size,
                Some(move |_: &mut Unicorn<'_, ()>, _: u64, _: usize| value.get()),
                Some(|_: &mut Unicorn<'_, ()>, _: u64, _: usize, _: u64| ()),
            )?;
            self.engine.mem_protect(start, size, Prot::NONE)?;
        }
        for (first, last) in NOT_RAM {
            let machine = Rc::clone(&self.machine);
            let loaded = Rc::clone(&loaded);
            let late = Rc::clone(&self.late);
            self.engine.add_mem_hook(
                HookType::MEM_READ_PROT | HookType::MEM_WRITE_PROT,
                first,
                last,
                move |engine, kind, address, size, value| {
                    let address = address as u32;
                    let mut machine = machine.borrow_mut();
                    let pc = engine.reg_read(RegisterARM::PC).unwrap_or(0) as u32;
                    let late = &mut late.borrow_mut();
                    let mut memory = InHook { engine, late };
                    let go_on = if kind == MemType::READ_PROT {
                        let read = machine.load(&mut memory, pc, address, size);
                        loaded.set(u64::from(read.unwrap_or(0)));
                        read.is_some()
                    } else {
                        machine.store(&mut memory, pc, address, size, value as u32)
                    };
                    if machine.stop.is_some() {
                        let _ = engine.emu_stop();
                    }
                    // Memory hooks spoil the state of IT blocks (Unicorn issue 2309).
                    let _ = engine.reg_write(RegisterARM::EPSR, 0x0100_0000);
                    go_on
                },
            )?;
        }
        Ok(())
    }

    fn add_hooks(&mut self) -> Result<(), uc_error> {
        let machine = Rc::clone(&self.machine);
        let late = Rc::clone(&self.late);
        self.engine.add_block_hook(1, 0, move |engine, address, size| {
            let mut machine = machine.borrow_mut();
            let late = &mut late.borrow_mut();
            let mut memory = InHook { engine, late };
            machine.enter_block(&mut memory, address as u32, size);
            let interrupted = machine.nvic.next.is_some_and(|(_, priority)| {
                priority < machine.nvic.active_priority()
                    && priority < masked_below(engine, &machine)
            });
            // A stop at the store itself would store once more.
            if (interrupted || !late.is_empty()) && machine.stop.is_none() {
                machine.stop = Some(Stop::Boundary);
            }
            if machine.stop.is_some() {
                machine.running = None;
                let _ = engine.emu_stop();
            } else {
                machine.fetch();
            }
        })?;

        for (first, last) in NOT_RAM {
            let machine = Rc::clone(&self.machine);
            self.engine.add_mem_hook(
                HookType::MEM_READ_UNMAPPED
                    | HookType::MEM_WRITE_UNMAPPED
                    | HookType::MEM_FETCH_UNMAPPED
                    | HookType::MEM_FETCH_PROT,
                first,
                last,
                move |engine, kind, address, _, _| {
                    let pc = engine.reg_read(RegisterARM::PC).unwrap_or(0) as u32;
                    let address = address as u32;
                    let mut machine = machine.borrow_mut();
                    match kind {
                        MemType::FETCH_UNMAPPED | MemType::FETCH_PROT => {
                            machine.stop = Some(Stop::FetchFault);
                        }
                        MemType::WRITE_UNMAPPED => {
                            machine.no_memory(pc, address, |address| Stop::Store { address });
                        }
                        _ => machine.no_memory(pc, address, |address| Stop::Load { address }),
                    }
                    let _ = engine.emu_stop();
                    false
                },
            )?;
        }

        let machine = Rc::clone(&self.machine);
        self.engine.add_intr_hook(move |engine, number| {
            machine.borrow_mut().stop = Some(Stop::Exception(number));
            let _ = engine.emu_stop();
        })?;

        let machine = Rc::clone(&self.machine);
        self.engine.add_insn_invalid_hook(move |engine| {
            machine.borrow_mut().stop = Some(Stop::Invalid);
            let _ = engine.emu_stop();
            false
        })?;
        Ok(())
    }
}

impl Memory for Unicorn<'_, ()> {
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool {
        is_memory(address, bytes.len()) && self.mem_read(u64::from(address), bytes).is_ok()
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> bool {
        is_memory(address, bytes.len()) && self.mem_write(u64::from(address), bytes).is_ok()
    }
}

/// Creates an engine with memory that holds `segments`.
fn engine_with_memory(segments: &[(u32, Vec<u8>)]) -> Result<Engine, String> {
    let mut engine = engine_powered_up().map_err(|error| format!("{error:?}"))?;
    for (address, bytes) in segments {
        if !engine.write(*address, bytes) {
            return Err(format!("there is no memory at {address:#010x}"));
        }
    }
    Ok(engine)
}

/// Creates an engine with memory as at power-up.
fn engine_powered_up() -> Result<Engine, uc_error> {
    let mut engine = Unicorn::new(Arch::ARM, Mode::THUMB)?;
    // Not `Mode::MCLASS`, which overrides the model with a Cortex-M33.
    engine.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
    for (region, rights, byte) in MEMORIES {
        let start = u64::from(region.start);
        engine.mem_map(start, region.size as u64, rights)?;
        engine.mem_write(start, &vec![byte; region.size])?;
    }
    for (address, word) in FACTORY_WORDS {
        engine.mem_write(u64::from(address), &word.to_le_bytes())?;
    }
    Ok(engine)
}

/// Overwrites RAM, which loses its content without supply.
fn lose_ram(engine: &mut Engine) {
    for region in [RAM, CCM] {
        engine.write(region.start, &vec![UNTOUCHED; region.size]);
    }
}

/// Writes to flash from within a hook, which wait until the engine has stopped, at the end of the block; oldest first.
/// The engine rebuilds its map of the memory for each of them, and the access that has called the hook would go on with
/// the old one (a use of freed memory).
type LateWrites = Vec<(u32, Vec<u8>)>;

/// Memory as a hook sees it.
struct InHook<'a, 'b> {
    engine: &'a mut Unicorn<'b, ()>,
    late: &'a mut LateWrites,
}

impl Memory for InHook<'_, '_> {
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool {
        if !self.engine.read(address, bytes) {
            return false;
        }
        for (start, written) in &*self.late {
            let from = address.max(*start);
            let end = (address + bytes.len() as u32).min(start + written.len() as u32);
            if from < end {
                let (to, of) = ((from - address) as usize, (from - start) as usize);
                let length = (end - from) as usize;
                bytes[to..to + length].copy_from_slice(&written[of..of + length]);
            }
        }
        true
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> bool {
        if RAM.holds(address, bytes.len()) || CCM.holds(address, bytes.len()) {
            return self.engine.write(address, bytes);
        }
        if !is_memory(address, bytes.len()) {
            return false;
        }
        self.late.push((address, bytes.to_vec()));
        true
    }
}

/// Applies the writes that wait, once the engine has stopped.
fn apply_late_writes(late: &mut LateWrites, engine: &mut Unicorn<'_, ()>) {
    for (address, bytes) in late.drain(..) {
        engine.write(address, &bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_writes_are_read_at_once_and_written_after_the_stop() {
        let mut engine = engine_with_memory(&[]).expect("an engine");
        let mut late = LateWrites::default();
        let mut memory = InHook { engine: &mut engine, late: &mut late };
        assert!(memory.write(FLASH.start + 2, &[1, 2, 3, 4]));
        assert!(memory.write(FLASH.start + 4, &[5]));
        assert!(!memory.write(FLASH.end(), &[5]));
        assert!(memory.write(RAM.start, &[6]));
        let mut bytes = [0; 8];
        assert!(memory.read(FLASH.start, &mut bytes));
        let expected = [0xFF, 0xFF, 1, 2, 5, 4, 0xFF, 0xFF];
        assert_eq!(bytes, expected);
        assert_eq!(engine.byte(FLASH.start + 2), Some(0xFF));
        assert_eq!(engine.byte(RAM.start), Some(6));
        assert!(!late.is_empty());
        apply_late_writes(&mut late, &mut engine);
        assert!(late.is_empty());
        assert!(engine.read(FLASH.start, &mut bytes));
        assert_eq!(bytes, expected);
    }
}
