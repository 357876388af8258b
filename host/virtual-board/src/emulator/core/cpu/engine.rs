//! The Unicorn engine around the core: its memory, its windows to peripherals, and its hooks.

use std::cell::Cell;
use std::rc::Rc;

use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, TlbEntry, TlbType, Unicorn,
    uc_error,
};

use super::Cpu;
use super::exceptions::masked_below;
use super::late::InHook;
use crate::emulator::chip::NOMINAL_MV;
use crate::emulator::machine::Stop;
use crate::emulator::memory::{CCM, MEMORIES, Memory, RAM, UNIQUE_NUMBER, UNTOUCHED, is_memory};
use crate::emulator::part::adc::reference_code;

pub(super) type Engine = Unicorn<'static, ()>;

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

impl Memory for Unicorn<'_, ()> {
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool {
        is_memory(address, bytes.len()) && self.mem_read(u64::from(address), bytes).is_ok()
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> bool {
        is_memory(address, bytes.len()) && self.mem_write(u64::from(address), bytes).is_ok()
    }
}

/// Creates an engine with memory that holds `segments`.
pub(super) fn with_memory(segments: &[(u32, Vec<u8>)]) -> Result<Engine, String> {
    let mut engine = powered_up().map_err(|error| format!("{error:?}"))?;
    for (address, bytes) in segments {
        if !engine.write(*address, bytes) {
            return Err(format!("there is no memory at {address:#010x}"));
        }
    }
    Ok(engine)
}

/// Creates an engine with memory as at power-up.
fn powered_up() -> Result<Engine, uc_error> {
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
pub(super) fn lose_ram(engine: &mut Engine) {
    for region in [RAM, CCM] {
        engine.write(region.start, &vec![UNTOUCHED; region.size]);
    }
}

impl Cpu {
    /// Disables address translation; RAM becomes executable only once code in it is executed. The engine inspects
    /// every store to a page that may hold code.
    pub(super) fn translate_addresses(&mut self) -> Result<(), uc_error> {
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
    pub(super) fn map_peripherals(&mut self) -> Result<(), uc_error> {
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

    pub(super) fn add_hooks(&mut self) -> Result<(), uc_error> {
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
