//! The run loop: blocks of instructions, exceptions in and out, sleep, reset.

use std::cell::{Cell, RefCell, RefMut};
use std::rc::Rc;

use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, TlbEntry, TlbType, Unicorn,
};

use super::nvic::{THREAD, exception};
use super::scb::{FORCED, VECTTBL, cfsr};
use crate::block::Block;
use crate::failure::Failure;
use crate::machine::{Machine, Memory, RunningBlock, Stop};

type Engine = Unicorn<'static, ()>;

/// Where peripherals live: start and length.
const WINDOWS: [(u64, u64); 4] = [
    (0x4000_0000, 0x0008_0000),
    (0x4200_0000, 0x0100_0000),
    (0x5000_0000, 0x0006_1000),
    (0xE000_0000, 0x0010_0000),
];

/// Flash, its start.
pub const FLASH: u32 = 0x0800_0000;
/// Flash, its length.
pub const FLASH_SIZE: usize = 1 << 20;
const MEMORIES: [(u32, usize, Prot); 5] = [
    (FLASH, FLASH_SIZE, Prot(1 | 4)),
    (0x1000_0000, 0x1_0000, Prot(1 | 2)),
    (0x1FFF_7000, 0x1000, Prot(1)),
    (RAM, RAM_SIZE, Prot(1 | 2)),
    (0x1FFF_C000, 0x1000, Prot(1)),
];

const RAM: u32 = 0x2000_0000;
const RAM_SIZE: usize = 0x2_0000;

/// Everything but RAM, first and last address. A hook on RAM makes every store there slow.
const NOT_RAM: [(u64, u64); 3] = [
    (0, 0x0FFF_FFFF),
    (0x1001_0000, 0x1FFF_FFFF),
    (0x2002_0000, 0xFFFF_FFFF),
];

/// What RAM holds before anything was written to it.
pub const UNTOUCHED: u8 = 0xA5;

const R: [RegisterARM; 13] = [
    RegisterARM::R0,
    RegisterARM::R1,
    RegisterARM::R2,
    RegisterARM::R3,
    RegisterARM::R4,
    RegisterARM::R5,
    RegisterARM::R6,
    RegisterARM::R7,
    RegisterARM::R8,
    RegisterARM::R9,
    RegisterARM::R10,
    RegisterARM::R11,
    RegisterARM::R12,
];

const FLOATS: [RegisterARM; 8] = [
    RegisterARM::D0,
    RegisterARM::D1,
    RegisterARM::D2,
    RegisterARM::D3,
    RegisterARM::D4,
    RegisterARM::D5,
    RegisterARM::D6,
    RegisterARM::D7,
];

/// What an exception stacks before the return address and the program status, in this order.
const STACKED: [RegisterARM; 6] = [
    RegisterARM::R0,
    RegisterARM::R1,
    RegisterARM::R2,
    RegisterARM::R3,
    RegisterARM::R12,
    RegisterARM::LR,
];

const WFI: u16 = 0xBF30;
const WFE: u16 = 0xBF20;
const YIELD: u16 = 0xBF10;
const SEMIHOSTING: u16 = 0xBEAB;

/// Cycles from an exception's arrival to its handler, from its end to what it interrupted, and
/// from one handler to the next.
const ENTRY: u64 = 12;
const EXIT: u64 = 10;
const TAIL: u64 = 6;

impl Memory for Unicorn<'_, ()> {
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool {
        is_memory(address, bytes.len()) && self.mem_read(u64::from(address), bytes).is_ok()
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> bool {
        is_memory(address, bytes.len()) && self.mem_write(u64::from(address), bytes).is_ok()
    }
}

fn is_memory(address: u32, length: usize) -> bool {
    MEMORIES
        .iter()
        .any(|&(start, size, _)| address >= start && (address - start) as usize + length <= size)
}

/// What the core does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Executes.
    Running,
    /// Waits for an interrupt.
    WaitingForInterrupt,
    /// Waits for an event.
    WaitingForEvent,
    /// A fault while a fault was handled: only a reset helps.
    LockedUp {
        /// Where.
        pc: u32,
    },
}

/// A fault of the architecture.
#[derive(Clone, Copy, Debug)]
struct Fault {
    number: u16,
    status: u32,
    address: Option<u32>,
}

impl Fault {
    const fn usage(status: u32) -> Self {
        Self {
            number: exception::USAGE_FAULT,
            status,
            address: None,
        }
    }

    const fn bus(status: u32, address: Option<u32>) -> Self {
        Self {
            number: exception::BUS_FAULT,
            status,
            address,
        }
    }
}

/// The core with everything that it is connected to.
pub struct Cpu {
    engine: Engine,
    machine: Rc<RefCell<Machine>>,
    state: State,
    event: bool,
    /// The next instructions are the handler's of an exception just returned from another.
    returned: bool,
    /// Code in RAM has been met.
    runs_from_ram: Rc<Cell<bool>>,
}

impl Cpu {
    /// A core with memory and `machine` around it, its memory loaded with `segments`.
    pub fn new(machine: Machine, segments: &[(u32, Vec<u8>)]) -> Result<Self, String> {
        let text = |error: unicorn_engine::uc_error| format!("{error:?}");
        let mut engine = Unicorn::new(Arch::ARM, Mode::THUMB).map_err(text)?;
        // Not `Mode::MCLASS`, which overrides the model with a Cortex-M33.
        engine
            .ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)
            .map_err(text)?;
        for (start, size, rights) in MEMORIES {
            engine
                .mem_map(u64::from(start), size as u64, rights)
                .map_err(text)?;
        }
        for (start, size, byte) in [
            (FLASH, FLASH_SIZE, 0xFF),
            (0x1FFF_7000, 0x1000, 0xFF),
            (0x1FFF_C000, 0x1000, 0xFF),
            (0x1000_0000, 0x1_0000, UNTOUCHED),
            (0x2000_0000, 0x2_0000, UNTOUCHED),
        ] {
            engine
                .mem_write(u64::from(start), &vec![byte; size])
                .map_err(text)?;
        }
        // The factory's bytes: a serial number, and the size of flash in KiB.
        for (address, word) in [
            (0x1FFF_7A10_u32, 0x0034_001F_u32),
            (0x1FFF_7A14, 0x3332_5110),
            (0x1FFF_7A18, 0x3038_3437),
            (0x1FFF_7A20, 0x0400_FFFF),
        ] {
            engine
                .mem_write(u64::from(address), &word.to_le_bytes())
                .map_err(text)?;
        }
        for (address, bytes) in segments {
            if !is_memory(*address, bytes.len()) {
                return Err(format!("there is no memory at {address:#010x}"));
            }
            engine.mem_write(u64::from(*address), bytes).map_err(text)?;
        }
        let mut cpu = Self {
            engine,
            machine: Rc::new(RefCell::new(machine)),
            state: State::Running,
            event: false,
            returned: false,
            runs_from_ram: Rc::default(),
        };
        cpu.translate_addresses().map_err(text)?;
        cpu.map_peripherals().map_err(text)?;
        cpu.add_hooks().map_err(text)?;
        cpu.reset();
        Ok(cpu)
    }

    /// What is around the core.
    pub fn machine(&self) -> RefMut<'_, Machine> {
        self.machine.borrow_mut()
    }

    /// What the core does.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// The memory, as a debugger sees it.
    pub fn memory(&mut self) -> &mut dyn Memory {
        &mut self.engine
    }

    /// Sends the core astray: it goes on at `address`, with interrupts masked or not.
    pub fn derail(&mut self, address: u32, masked: bool) {
        self.set(RegisterARM::PRIMASK, u32::from(masked));
        self.set(RegisterARM::PC, address | 1);
        // Out of any IT block.
        self.set(RegisterARM::EPSR, 0x0100_0000);
        self.state = State::Running;
    }

    /// Moves the stack pointer of what executes.
    pub fn move_stack(&mut self, address: u32) {
        self.set(RegisterARM::SP, address & !3);
    }

    /// A core register: R0 to R12, SP, LR, PC.
    #[must_use]
    pub fn register(&self, index: usize) -> u32 {
        self.get(match index {
            13 => RegisterARM::SP,
            14 => RegisterARM::LR,
            15 => RegisterARM::PC,
            _ => R[index.min(12)],
        })
    }

    fn get(&self, register: RegisterARM) -> u32 {
        // A register always reads.
        self.engine.reg_read(register).unwrap_or(0) as u32
    }

    fn set(&mut self, register: RegisterARM, value: u32) {
        // A register can always be written.
        let _ = self.engine.reg_write(register, u64::from(value));
    }

    /// Addresses are what they are; only, RAM is not for code until code is met there. The engine
    /// looks at every store to a page that may hold code.
    fn translate_addresses(&mut self) -> Result<(), unicorn_engine::uc_error> {
        self.engine.ctl_set_tlb_type(TlbType::VIRTUAL)?;
        let machine = Rc::clone(&self.machine);
        let runs_from_ram = Rc::clone(&self.runs_from_ram);
        self.engine
            .add_tlb_hook(1, 0, move |engine, address, kind| {
                let fetch = kind == MemType::FETCH;
                let data_only = is_ram(address as u32) && !runs_from_ram.get();
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

    /// Peripherals are windows without rights. The engine then calls the hook for protection,
    /// which knows the exact PC, and after it the window, which does not.
    fn map_peripherals(&mut self) -> Result<(), unicorn_engine::uc_error> {
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
            self.engine.add_mem_hook(
                HookType::MEM_READ_PROT | HookType::MEM_WRITE_PROT,
                first,
                last,
                move |engine, kind, address, size, value| {
                    let address = address as u32;
                    let mut machine = machine.borrow_mut();
                    let pc = engine.reg_read(RegisterARM::PC).unwrap_or(0) as u32;
                    let go_on = if kind == MemType::READ_PROT {
                        let read = machine.load(engine, pc, address, size);
                        loaded.set(u64::from(read.unwrap_or(0)));
                        read.is_some()
                    } else {
                        machine.store(engine, pc, address, size, value as u32)
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

    fn add_hooks(&mut self) -> Result<(), unicorn_engine::uc_error> {
        let machine = Rc::clone(&self.machine);
        self.engine
            .add_block_hook(1, 0, move |engine, address, size| {
                let mut machine = machine.borrow_mut();
                machine.enter_block(engine, address as u32, size);
                let interrupted = machine.nvic.next().is_some_and(|(_, priority)| {
                    priority < machine.nvic.active_priority()
                        && priority < masked_below(engine, &machine)
                });
                if interrupted && machine.stop.is_none() {
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
                    let write = kind == MemType::WRITE_UNMAPPED;
                    let fetch = kind == MemType::FETCH_UNMAPPED || kind == MemType::FETCH_PROT;
                    let mut machine = machine.borrow_mut();
                    if fetch {
                        machine.stop = Some(Stop::FetchFault);
                    } else {
                        machine.no_memory(pc, address as u32, write);
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

    fn half(&mut self, address: u32) -> u16 {
        let mut bytes = [0; 2];
        self.engine.read(address, &mut bytes);
        u16::from_le_bytes(bytes)
    }

    /// Starts the core anew; the machine has been reset.
    fn reset(&mut self) {
        self.state = State::Running;
        self.event = false;
        self.returned = false;
        // Out of any handler first: its stack pointer is the main one.
        self.set(RegisterARM::XPSR_NZCVQG, 0x0100_0000);
        self.set(RegisterARM::CONTROL, 0);
        for register in [
            RegisterARM::PRIMASK,
            RegisterARM::BASEPRI,
            RegisterARM::FAULTMASK,
            RegisterARM::FPSCR,
        ] {
            self.set(register, 0);
        }
        for register in R {
            self.set(register, 0);
        }
        for register in FLOATS {
            let _ = self.engine.reg_write(register, 0);
        }
        self.set(RegisterARM::LR, !0);
        let stack = self.engine.word(FLASH).unwrap_or(0);
        let start = self.engine.word(FLASH + 4).unwrap_or(0);
        self.set(RegisterARM::SP, stack & !3);
        self.set(RegisterARM::PC, start);
        self.set(RegisterARM::APSR_NZCV, 0);
    }

    /// The priority of the code that runs, masks included.
    fn execution_priority(&self) -> i16 {
        let machine = self.machine.borrow();
        machine
            .nvic
            .active_priority()
            .min(masked_below(&self.engine, &machine))
    }

    /// Runs until the machine's time is `until`, or the program exits.
    ///
    /// # Errors
    /// Where the firmware did what is not modelled or what the part would not do as asked.
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
                    if machine.chip.take_power_lost() {
                        // What RAM holds after the supply was gone.
                        self.engine.write(0x2000_0000, &[UNTOUCHED; 0x2_0000]);
                        self.engine.write(0x1000_0000, &[UNTOUCHED; 0x1_0000]);
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
            if self.machine.borrow().chip.rcc.is_stopped() {
                self.machine.borrow_mut().sleep(&mut self.engine);
                continue;
            }
            let next = self.machine.borrow().nvic.next();
            if let State::LockedUp { pc } = self.state {
                // Nothing but an NMI ends it, where it is not in one (ARMv7-M, B1.5.15).
                match next {
                    Some((exception::NMI, priority)) if priority < self.execution_priority() => {
                        self.state = State::Running;
                        self.enter(exception::NMI, pc);
                    }
                    _ => self.machine.borrow_mut().sleep(&mut self.engine),
                }
                continue;
            }
            if let Some((number, priority)) = next {
                if priority < self.execution_priority() {
                    self.state = State::Running;
                    let pc = self.get(RegisterARM::PC);
                    self.enter(number, pc);
                    continue;
                }
                if self.state == State::WaitingForInterrupt && self.wakes(priority) {
                    self.state = State::Running;
                }
            }
            self.returned = false;
            if self.state == State::WaitingForEvent && core::mem::take(&mut self.event) {
                self.state = State::Running;
            }
            if self.state != State::Running {
                self.machine.borrow_mut().sleep(&mut self.engine);
                continue;
            }
            self.run_blocks()?;
        }
    }

    /// Whether a pending exception ends a wait for interrupts: as if PRIMASK were clear.
    fn wakes(&self, priority: i16) -> bool {
        let machine = self.machine.borrow();
        let mut running = machine.nvic.active_priority();
        let base = self.get(RegisterARM::BASEPRI);
        if base != 0 {
            running = running.min(i16::from(machine.nvic.group_of(base as u8)));
        }
        priority < running
    }

    /// Lets the engine run until a hook stops it, and acts on why.
    fn run_blocks(&mut self) -> Result<(), Failure> {
        {
            let mut machine = self.machine.borrow_mut();
            machine.stop = None;
        }
        let start = self.get(RegisterARM::PC);
        let result = self.engine.emu_start(u64::from(start | 1), 0, 0, 0);
        let pc = self.get(RegisterARM::PC);
        let stop = self.machine.borrow_mut().stop.take();
        // What was seen of the current block, up to where it stopped.
        let block = self.finish_block(pc, &stop);
        match stop {
            // A store goes on to the end of its block, and the bus refuses it afterwards.
            Some(Stop::Boundary) => {}
            Some(Stop::Store { address }) => {
                self.fault(pc, Fault::bus(cfsr::IMPRECISERR, None), Some(address));
            }
            Some(Stop::Load { address }) => {
                self.fault(
                    pc,
                    Fault::bus(cfsr::PRECISERR | cfsr::BFARVALID, Some(address)),
                    None,
                );
            }
            Some(Stop::FetchFault) => {
                if pc >= 0xFFFF_FF00 {
                    self.leave(pc);
                } else if is_ram(pc) && !self.runs_from_ram.replace(true) {
                    // Stores to executable memory are slow; only who needs it pays for it.
                    self.engine
                        .mem_protect(u64::from(RAM), RAM_SIZE as u64, Prot::ALL)
                        .map_err(|error| Failure::new(pc, None, format!("{error:?}")))?;
                } else {
                    self.fault(pc, Fault::bus(cfsr::IBUSERR, None), None);
                }
            }
            Some(Stop::NoFloat {
                instructions,
                offset,
            }) => self.without_float(instructions, offset)?,
            Some(Stop::Exception(2)) => self.call(pc),
            Some(Stop::Exception(7)) => self.breakpoint(pc)?,
            Some(Stop::Exception(8)) => self.leave(pc),
            Some(Stop::Exception(22)) => self.fault(pc, Fault::usage(cfsr::UNALIGNED), None),
            Some(Stop::Exception(number)) => {
                return Err(Failure::new(
                    pc,
                    None,
                    format!("the engine stopped with {number}"),
                ));
            }
            Some(Stop::Invalid) => {
                let last = self.half(pc.wrapping_sub(2));
                let at_end = block.is_some_and(|(address, size)| address + size == pc);
                if self.get(RegisterARM::EPSR) & 0x0100_0000 == 0 {
                    self.fault(pc, Fault::usage(cfsr::INVSTATE), None);
                } else if at_end && last == WFE {
                    if !core::mem::take(&mut self.event) {
                        self.state = State::WaitingForEvent;
                    }
                } else if !(at_end && last == YIELD) {
                    self.fault(pc, Fault::usage(cfsr::UNDEFINSTR), None);
                }
            }
            None => match result {
                Ok(()) if self.half(pc.wrapping_sub(2)) == WFI => {
                    self.state = State::WaitingForInterrupt;
                }
                Ok(()) => {}
                Err(error) => {
                    return Err(Failure::new(
                        pc,
                        None,
                        format!("the engine failed: {error:?}"),
                    ));
                }
            },
        }
        Ok(())
    }

    /// Charges the block that was running when the engine stopped: its start and length.
    fn finish_block(&mut self, pc: u32, stop: &Option<Stop>) -> Option<(u32, u32)> {
        let mut machine = self.machine.borrow_mut();
        let block = machine.running.take()?;
        let whole = !matches!(
            stop,
            Some(Stop::Load { .. } | Stop::FetchFault | Stop::Exception(7 | 22) | Stop::Invalid)
        ) || pc < block.address
            || pc >= block.address + block.block.size;
        if whole {
            self.event |= machine.charge(&block, pc);
        } else {
            let part = machine.part_of(&mut self.engine, block.address, pc - block.address);
            let block = RunningBlock {
                block: part,
                ..block
            };
            self.event |= machine.charge(&block, pc);
        }
        self.event |= core::mem::take(&mut machine.event_sent);
        Some((block.address, block.block.size))
    }

    /// A floating-point instruction comes while the unit is off: runs up to it, then faults.
    fn without_float(&mut self, instructions: u32, offset: u32) -> Result<(), Failure> {
        let start = self.get(RegisterARM::PC);
        let pc = start + offset;
        if instructions > 0 {
            self.machine.borrow_mut().allow_float = true;
            let result = self
                .engine
                .emu_start(u64::from(start | 1), 0, 0, instructions as usize);
            let mut machine = self.machine.borrow_mut();
            machine.allow_float = false;
            machine.stop = None;
            machine.running = None;
            let part = machine.part_of(&mut self.engine, start, offset);
            let block = RunningBlock {
                address: start,
                block: part,
            };
            machine.charge(&block, pc);
            result.map_err(|error| Failure::new(start, None, format!("{error:?}")))?;
        }
        self.fault(pc, Fault::usage(cfsr::NOCP), None);
        Ok(())
    }

    fn call(&mut self, pc: u32) {
        let (priority, running) = {
            let machine = self.machine.borrow();
            (
                machine.nvic.priority_of(exception::SV_CALL),
                self.execution_priority(),
            )
        };
        if priority < running {
            self.enter(exception::SV_CALL, pc);
        } else {
            // The call itself is at the address that the fault tells.
            self.fault(
                pc.wrapping_sub(2),
                Fault {
                    number: exception::SV_CALL,
                    status: 0,
                    address: None,
                },
                None,
            );
        }
    }

    fn breakpoint(&mut self, pc: u32) -> Result<(), Failure> {
        if self.half(pc) != SEMIHOSTING {
            return Err(Failure::new(pc, None, "a breakpoint, and no debugger"));
        }
        let (r0, r1) = (self.get(RegisterARM::R0), self.get(RegisterARM::R1));
        let answer = {
            let mut machine = self.machine.borrow_mut();
            machine.count_instruction();
            machine.semihosting.call(&mut self.engine, r0, r1)
        };
        let Some(answer) = answer else {
            return Err(Failure::new(pc, None, format!("semihosting call {r0:#x}")));
        };
        self.set(RegisterARM::R0, answer);
        self.set(RegisterARM::PC, (pc + 2) | 1);
        Ok(())
    }

    /// Raises a fault with the frame's return address `pc`.
    fn fault(&mut self, pc: u32, fault: Fault, late_address: Option<u32>) {
        let running = self.execution_priority();
        let number = {
            let mut machine = self.machine.borrow_mut();
            machine.note_fault(
                pc,
                fault.number,
                fault.status,
                fault.address.or(late_address),
            );
            machine.scb.cfsr |= fault.status;
            if let Some(address) = fault.address {
                machine.scb.bfar = address;
            }
            let takes = machine.nvic.is_enabled(fault.number)
                && machine.nvic.priority_of(fault.number) < running;
            if takes && fault.number != exception::SV_CALL {
                fault.number
            } else if running > -1 {
                machine.scb.hfsr |= FORCED;
                exception::HARD_FAULT
            } else {
                drop(machine);
                self.state = State::LockedUp { pc };
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
        let aligned = {
            let machine = self.machine.borrow();
            machine.scb.ccr & 0x200 != 0
        };
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
        let bytes: Vec<u8> = words
            .iter()
            .take(size as usize / 4)
            .flat_map(|word| word.to_le_bytes())
            .collect();
        let stacked = is_writable(frame) && self.engine.write(frame, &bytes);

        self.set(RegisterARM::SP, frame);
        // CONTROL before the exception's number: a handler cannot change its stack.
        self.set(RegisterARM::CONTROL, control & 1);
        self.set(RegisterARM::XPSR_NZCVQG, xpsr & 0xF80F_0000 | 0x0100_0000);
        self.set(RegisterARM::IPSR, u32::from(number));
        let mut link = 0xFFFF_FFE1_u32;
        link |= if float { 0 } else { 0x10 };
        link |= if handler { 0 } else { 0x8 };
        link |= if process { 0x4 } else { 0 };
        self.set(RegisterARM::LR, link);

        let mut machine = self.machine.borrow_mut();
        let cost = if core::mem::take(&mut self.returned) {
            TAIL
        } else {
            ENTRY
        };
        machine.spend(cost);
        machine.nvic.begin(number);
        machine.count_exception(number);
        let table = if machine.scb.vtor == 0 {
            FLASH
        } else {
            machine.scb.vtor
        };
        let vector = self.engine.word(table + 4 * u32::from(number));
        // A frame that could not be written is a fault of its own; one of the two exceptions that
        // nothing interrupts begins all the same, and after an NMI the fault is due.
        let unbroken = matches!(number, exception::NMI | exception::HARD_FAULT);
        if !stacked && number == exception::NMI {
            machine.scb.hfsr |= FORCED;
            machine.nvic.pend(exception::HARD_FAULT);
        }
        let failed = !stacked && !unbroken;
        if !stacked {
            machine.scb.cfsr |= cfsr::STKERR;
            machine.note_fault(
                return_address,
                exception::BUS_FAULT,
                cfsr::STKERR,
                Some(frame),
            );
        }
        drop(machine);
        match vector {
            Some(vector) if vector & 1 == 1 => self.set(RegisterARM::PC, vector),
            _ => {
                self.machine.borrow_mut().scb.hfsr |= VECTTBL;
                self.state = State::LockedUp { pc: return_address };
            }
        }
        self.fresh_flags();
        if failed {
            // The derived fault takes the place of the exception's first instruction.
            let mut machine = self.machine.borrow_mut();
            machine.nvic.end(number);
            if number < exception::INTERRUPT || machine.nvic.priority_of(number) >= 0 {
                machine.nvic.pend(number);
            }
            machine.scb.hfsr |= FORCED;
            machine.nvic.begin(exception::HARD_FAULT);
            machine.count_exception(exception::HARD_FAULT);
            let vector = self
                .engine
                .word(table + 4 * u32::from(exception::HARD_FAULT));
            drop(machine);
            self.set(RegisterARM::IPSR, u32::from(exception::HARD_FAULT));
            self.set(RegisterARM::PC, vector.unwrap_or(1));
            self.fresh_flags();
        }
    }

    /// The engine looks at the flags it has cached; this renews them.
    fn fresh_flags(&mut self) {
        let flags = self.get(RegisterARM::XPSR) & 0xF000_0000;
        self.set(RegisterARM::APSR_NZCV, flags);
    }

    /// Returns from an exception, as `code` says.
    fn leave(&mut self, code: u32) {
        let number = (self.get(RegisterARM::XPSR) & 0x1FF) as u16;
        let ended = self.machine.borrow_mut().nvic.end(number);
        let (thread, process, float) = (code & 8 != 0, code & 4 != 0, code & 0x10 == 0);
        if number == 0 || !ended {
            return self.fault(code, Fault::usage(cfsr::INVPC), None);
        }
        if number != exception::NMI {
            self.set(RegisterARM::FAULTMASK, 0);
        }
        let stack = if process && thread {
            self.get(RegisterARM::PSP)
        } else {
            self.get(RegisterARM::SP)
        };
        let size: u32 = if float { 0x68 } else { 0x20 };
        let mut bytes = [0; 0x68];
        let read = self
            .engine
            .read(stack, bytes.get_mut(..size as usize).unwrap_or(&mut []));
        if !read {
            return self.fault(code, Fault::bus(cfsr::UNSTKERR, None), Some(stack));
        }
        let word = |index: usize| {
            let at = 4 * index;
            u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let xpsr = word(7);
        if thread != (xpsr & 0x1FF == 0) {
            return self.fault(code, Fault::usage(cfsr::INVPC), None);
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
        let unwound = stack
            .wrapping_add(size)
            .wrapping_add(if xpsr & 0x200 == 0 { 0 } else { 4 });
        if process && thread {
            self.set(RegisterARM::PSP, unwound);
        } else {
            self.set(RegisterARM::SP, unwound);
        }
        let control = self.get(RegisterARM::CONTROL) & 1;
        // CONTROL after the exception's number: now the stack can change.
        self.set(RegisterARM::XPSR_NZCVQG, xpsr & !0x200);
        let control = control | if process && thread { 2 } else { 0 } | if float { 4 } else { 0 };
        self.set(RegisterARM::CONTROL, control);
        self.set(RegisterARM::PC, word(6) | (xpsr >> 24) & 1);
        let bits = xpsr & 0x0600_FC00;
        self.fresh_flags();
        // Writing the PC and the flags left the IT state alone, or it is written again here.
        self.set(RegisterARM::EPSR, bits | xpsr & 0x0100_0000);
        self.event = true;

        let mut machine = self.machine.borrow_mut();
        // The stack is not popped and pushed between two handlers.
        let tail = machine
            .nvic
            .next()
            .is_some_and(|(_, priority)| priority < machine.nvic.active_priority().min(THREAD));
        if !tail {
            machine.spend(EXIT);
        }
        self.returned = tail;
        if thread && machine.scb.scr & 2 != 0 {
            self.state = State::WaitingForInterrupt;
        }
    }
}

/// Exceptions run only where their priority value is below this.
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

const fn is_ram(address: u32) -> bool {
    address.wrapping_sub(RAM) < RAM_SIZE as u32
}

/// Whether the stack may lie there.
const fn is_writable(address: u32) -> bool {
    matches!(address, 0x1000_0000..0x1001_0000 | 0x2000_0000..0x2002_0000)
}

/// Takes the code of a block in.
pub(crate) fn block_at(memory: &mut dyn Memory, address: u32, size: u32) -> Block {
    let mut code = vec![0; size as usize];
    memory.read(address, &mut code);
    Block::of(&code, size)
}
