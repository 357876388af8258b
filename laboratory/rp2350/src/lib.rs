//! The program of the Feather RP2350, run by [rp2350-emu](https://crates.io/crates/rp2350-emu), a third-party emulator of the
//! chip, from the UF2 file that is flashed.
//!
//! The emulator has the core, clocks, timers, watchdog and pins. It lacks what this package adds: the instructions of
//! [`instructions`], the wires of the [I²C controller](i2c), [a computer at the USB socket](usb), and a stand-in for the boot ROM.

pub mod i2c;
pub mod instructions;
pub mod usb;

use std::sync::Arc;

use lsm6dsox::sim::SharedPart;
use rp2350_emu::core::CoreBus;
use rp2350_emu::threaded::CoreAtomics;
use rp2350_emu::{Bus, Config, CortexM33, Emulator, EmulatorBuilder};

use i2c::Controller;
use instructions::Monitor;
use usb::Usb;

/// Clock of the core once the program has set it.
const CLOCK_HZ: u32 = 150_000_000;
const CYCLES_PER_US: u64 = CLOCK_HZ as u64 / 1_000_000;

const FLASH: u32 = 0x1000_0000;
const FLASH_SIZE: usize = 8 << 20;

const BOOTRAM: u32 = 0x400E_0000;

const I2C1: u32 = 0x4009_8000;
const I2C1_IRQ: u32 = 37;

/// Registers of the ticks. Every third register is the number of cycles of a tick.
const TICKS: u32 = 0x4010_8000;

/// Clock of the crystal, from which ticks come. The emulator counts cycles of the core instead.
const CRYSTAL_HZ: u32 = 12_000_000;

const USB_MEMORY: u32 = 0x5010_0000;
const USB: u32 = 0x5011_0000;
const USB_IRQ: u32 = 14;

/// Registers of the core that make interrupts pending.
const NVIC_ISPR: u32 = 0xE000_E200;

/// Cycles between two looks of the emulator at its peripherals.
const QUANTUM: u32 = 64;

/// Addresses of the stand-in for the boot ROM: the table's lookup, then its functions in the order of [`FUNCTIONS`].
const LOOKUP: u32 = 0x100;
const FIRST_FUNCTION: u32 = 0x200;

/// Functions of the ROM that the program calls, by their codes (RP2350 data sheet, 5.4).
const FUNCTIONS: [&[u8; 2]; 7] = [b"IF", b"EX", b"RE", b"RP", b"FC", b"CX", b"RB"];

/// The board.
pub struct Machine {
    emulator: Emulator,
    monitor: Monitor,
    flash: Vec<u8>,
    /// Cycles that the core has waited for interrupts. The emulator does not count them.
    waited: u64,
    /// The controller of the sensor's bus.
    pub i2c: Controller,
    /// The USB controller, and the computer at its socket.
    pub usb: Usb,
}

impl Machine {
    /// A board with this content of its flash, and a sensor on its cable. It starts where the boot ROM would.
    pub fn new(flash: Vec<u8>, part: SharedPart) -> Self {
        let config = Config { sys_clk_hz: CLOCK_HZ };
        let builder = EmulatorBuilder::new(config).step_quantum(QUANTUM);
        let mut emulator = builder.build().expect("one thread");
        emulator.load_bootrom(&rom());
        emulator.reset();
        emulator.load_flash(&flash);
        let word = |at: usize| u32::from_le_bytes(flash[at..at + 4].try_into().expect("a word"));
        let core = emulator.core_mut(0);
        (core.regs.msp, core.regs.r[13]) = (word(0), word(0));
        core.regs.set_pc(word(4) & !1);
        core.ppb.vtor = FLASH;
        // The boot ROM leaves a function at `BOOTRAM` that makes the flash readable. The emulated flash is always
        // readable, so this function only returns (`bx lr`).
        emulator.mmio_write32(BOOTRAM, 0x4770_4770);
        // The second core waits in the ROM.
        emulator.bus.atomics.set_halted(1);
        let i2c = Controller::new(part, CLOCK_HZ.into());
        Self { emulator, monitor: Monitor::default(), flash, waited: 0, i2c, usb: Usb::default() }
    }

    /// Content of the flash.
    pub fn into_flash(self) -> Vec<u8> {
        self.flash
    }

    /// Runs until a time since the start, µs.
    pub fn run_until(&mut self, us: u64) {
        while self.emulator.cycles() < us * CYCLES_PER_US {
            self.step();
        }
    }

    /// Sends bytes to the board over USB.
    pub fn send(&mut self, bytes: &[u8]) {
        self.usb.send(bytes, self.emulator.cycles());
    }

    /// Runs a quantum.
    fn step(&mut self) {
        let Self { emulator, monitor, flash, waited, i2c, usb } = self;
        let start = emulator.cycles();
        let end = start + u64::from(QUANTUM);
        *waited += start.saturating_sub(*waited + emulator.core_cycles(0));
        loop {
            let now = *waited + emulator.core_cycles(0);
            let atomics = &emulator.bus.atomics;
            if now >= end || atomics.is_halted(0) || atomics.is_wfe_waiting(0) {
                break;
            }
            let pc = emulator.core(0).regs.pc();
            if (LOOKUP..FIRST_FUNCTION + 0x100).contains(&pc) {
                call_rom(emulator, flash);
                continue;
            }
            let Emulator { cores, bus, .. } = &mut *emulator;
            let core = &mut cores.expect_arm_mut()[0];
            let mut wires = Wires { bus, i2c, usb, now, instead: None };
            let interrupt = instructions::software_interrupt(core, &mut wires);
            if !monitor.execute(core, &mut wires) {
                wires.execute(core);
            }
            // If an exception came instead, the store is still to come.
            if let Some(interrupt) = interrupt.filter(|_| core.regs.pc().wrapping_sub(pc) <= 4) {
                core.ppb.write32(NVIC_ISPR + interrupt / 32 * 4, 1 << (interrupt % 32));
            }
            core.invalidate_decode_cache_entries(&bus.pending_cache_invalidations);
            bus.pending_cache_invalidations.clear();
        }
        i2c.advance(emulator.cycles());
        usb.advance(emulator.cycles());
        for (is_pending, irq) in [(i2c.is_pending(), I2C1_IRQ), (usb.is_pending(), USB_IRQ)] {
            if is_pending && emulator.core(0).regs.ipsr() != 16 + irq {
                emulator.bus.assert_irq_shared(irq);
            }
        }
        // An interrupt ends the wait of a WFE. The emulator waits for an event alone.
        if emulator.bus.atomics.irq_pending_load(0) != 0 {
            emulator.bus.atomics.set_event_flag(0);
        }
        // The core has run: this advances the peripherals.
        let is_halted = emulator.bus.atomics.is_halted(0);
        emulator.bus.atomics.set_halted(0);
        emulator.step().expect("no threads");
        if !is_halted {
            emulator.bus.atomics.clear_halted(0);
        }
    }
}

/// Content of a flash to which the ROM's loader has written a UF2 file.
pub fn flash_with(uf2: &[u8]) -> Vec<u8> {
    let mut flash = vec![0xFF; FLASH_SIZE];
    for block in uf2.chunks(512) {
        let word = |at: usize| u32::from_le_bytes(block[at..at + 4].try_into().expect("a word"));
        let (address, length) = (word(12), word(16) as usize);
        let start = (address - FLASH) as usize;
        flash[start..start + length].copy_from_slice(&block[32..32 + length]);
    }
    flash
}

/// A ROM of which only the version, and the addresses of the table's lookup, are there.
fn rom() -> Vec<u8> {
    let mut rom = vec![0; 32 << 10];
    rom[0x10..0x14].copy_from_slice(b"Mu\x02\x02");
    rom[0x16..0x18].copy_from_slice(&(LOOKUP as u16 | 1).to_le_bytes());
    for at in (LOOKUP as usize..0x400).step_by(2) {
        // bx lr
        rom[at..at + 2].copy_from_slice(&0x4770_u16.to_le_bytes());
    }
    rom
}

/// Does what the ROM's function at the program counter does, and returns to the caller.
fn call_rom(emulator: &mut Emulator, flash: &mut [u8]) {
    let core = emulator.core_mut(0);
    let [first, second, third, _] = [0, 1, 2, 3].map(|number| core.regs.r[number]);
    let pc = core.regs.pc();
    let result = if pc == LOOKUP {
        let code = (first as u16).to_le_bytes();
        let found = FUNCTIONS.iter().position(|function| **function == code);
        let found =
            found.unwrap_or_else(|| panic!("ROM has no {:?}", String::from_utf8_lossy(&code)));
        FIRST_FUNCTION + 4 * found as u32 + 1
    } else {
        match FUNCTIONS[((pc - FIRST_FUNCTION) / 4) as usize] {
            b"RE" => {
                let start = first as usize;
                flash[start..start + second as usize].fill(0xFF);
                emulator.load_flash(flash);
            }
            b"RP" => {
                for at in 0..third {
                    let byte = emulator.peek((second + at) & !3) >> (8 * ((second + at) % 4));
                    flash[(first + at) as usize] &= byte as u8;
                }
                emulator.load_flash(flash);
            }
            b"RB" => panic!("the program asks for the loader"),
            _ => {}
        }
        0
    };
    let core = emulator.core_mut(0);
    core.regs.r[0] = result;
    let back = core.regs.lr();
    core.regs.set_pc(back & !1);
}

/// The chip's bus, with the controllers of this package in the place of the emulator's.
struct Wires<'a> {
    bus: &'a mut Bus,
    i2c: &'a mut Controller,
    usb: &'a mut Usb,
    now: u64,
    /// Instruction that is fetched in the place of the one at an address.
    instead: Option<(u32, [u16; 2])>,
}

/// Place of an address in a controller of this package.
enum Place {
    I2c(u32),
    Usb(u32),
    UsbMemory(u32),
}

impl Place {
    const fn of(address: u32) -> Option<Self> {
        match address {
            _ if address & !0x3FFF == I2C1 => Some(Self::I2c(address & 0xFFC)),
            _ if address & !0x3FFF == USB => Some(Self::Usb(address & 0xFFC)),
            _ if address & !0xFFF == USB_MEMORY => Some(Self::UsbMemory(address & 0xFFF)),
            _ => None,
        }
    }
}

impl Wires<'_> {
    /// Executes the instruction at the core's program counter.
    fn execute(&mut self, core: &mut CortexM33) {
        let pc = core.regs.pc();
        let first = self.bus.read16(pc, 0);
        if !matches!(first & 0xFE00, 0xEC00 | 0xFE00) {
            return core.step(self);
        }
        let second = self.bus.read16(pc + 2, 0);
        let Some((known, next)) = instructions::as_known(first, second) else {
            return core.step(self);
        };
        for instruction in [Some(known), next].into_iter().flatten() {
            core.regs.set_pc(pc);
            self.instead = Some((pc, instruction));
            core.invalidate_decode_cache_entries(&[pc]);
            core.step(self);
            core.invalidate_decode_cache_entries(&[pc]);
            self.instead = None;
            if core.regs.pc() != pc + 4 {
                // An exception came instead.
                return;
            }
        }
    }

    fn load(&mut self, address: u32, size: usize) -> Option<u32> {
        let word = match Place::of(address)? {
            Place::UsbMemory(at) => return Some(self.usb.load(at, size)),
            Place::I2c(offset) => {
                self.i2c.advance(self.now);
                self.i2c.read(offset)
            }
            Place::Usb(offset) => self.usb.read(offset),
        };
        Some(word >> (8 * (address % 4)))
    }

    /// Returns whether the address is in a controller of this package. Bits 12 and 13 of a register's address select
    /// the kind of write: plain, exclusive or, set, clear (2.1.3).
    fn store(&mut self, address: u32, size: usize, value: u32) -> bool {
        let Some(place) = Place::of(address) else { return false };
        if let Place::UsbMemory(at) = place {
            self.usb.store(at, size, value, self.now);
            return true;
        }
        assert_eq!(size, 4, "a narrow write to {address:#010x}");
        let value = match (address >> 12) & 3 {
            0 => value,
            kind => {
                let old = self.load(address, 4).unwrap_or(0);
                [value, old ^ value, old | value, old & !value][kind as usize]
            }
        };
        match place {
            Place::I2c(offset) => self.i2c.write(offset, value, self.now),
            Place::Usb(offset) => self.usb.write(offset, value, self.now),
            Place::UsbMemory(_) => {}
        }
        true
    }
}

impl CoreBus for Wires<'_> {
    fn read8(&mut self, address: u32, core: u8) -> u8 {
        let found = self.load(address, 1);
        found.map_or_else(|| self.bus.read8(address, core), |value| value as u8)
    }

    fn read16(&mut self, address: u32, core: u8) -> u16 {
        if let Some((at, halfwords)) = self.instead
            && let Some(halfword) = halfwords.get((address.wrapping_sub(at) / 2) as usize)
        {
            return *halfword;
        }
        let found = self.load(address, 2);
        found.map_or_else(|| self.bus.read16(address, core), |value| value as u16)
    }

    fn read32(&mut self, address: u32, core: u8) -> u32 {
        let found = self.load(address, 4);
        found.unwrap_or_else(|| self.bus.read32(address, core))
    }

    fn write8(&mut self, address: u32, value: u8, core: u8) {
        if !self.store(address, 1, value.into()) {
            self.bus.write8(address, value, core);
        }
    }

    fn write16(&mut self, address: u32, value: u16, core: u8) {
        if !self.store(address, 2, value.into()) {
            self.bus.write16(address, value, core);
        }
    }

    fn write32(&mut self, address: u32, value: u32, core: u8) {
        if self.store(address, 4, value) {
            return;
        }
        let is_period = address & !0xFFF == TICKS && address % 12 == (TICKS + 4) % 12;
        let value = if is_period {
            value * (CLOCK_HZ / 1_000_000) / (CRYSTAL_HZ / 1_000_000)
        } else {
            value
        };
        self.bus.write32(address, value, core);
    }

    fn set_active_pc(&mut self, pc: u32, core: u8) {
        CoreBus::set_active_pc(self.bus, pc, core);
    }

    fn bus_fault(&self, core: u8) -> bool {
        CoreBus::bus_fault(self.bus, core)
    }

    fn bus_fault_addr(&self, core: u8) -> u32 {
        CoreBus::bus_fault_addr(self.bus, core)
    }

    fn clear_bus_fault(&mut self, core: u8) {
        CoreBus::clear_bus_fault(self.bus, core);
    }

    fn set_burst_mode(&mut self, on: bool) {
        CoreBus::set_burst_mode(self.bus, on);
    }

    fn add_extra_wait_states(&mut self, n: u32) {
        CoreBus::add_extra_wait_states(self.bus, n);
    }

    fn take_extra_wait_states(&mut self) -> u32 {
        CoreBus::take_extra_wait_states(self.bus)
    }

    fn atomics(&self) -> &Arc<CoreAtomics> {
        CoreBus::atomics(self.bus)
    }

    fn gpio_read_out(&self) -> u32 {
        self.bus.gpio_read_out()
    }

    fn gpio_write_out(&mut self, value: u32) {
        self.bus.gpio_write_out(value);
    }

    fn gpio_set_out(&mut self, mask: u32) {
        self.bus.gpio_set_out(mask);
    }

    fn gpio_clear_out(&mut self, mask: u32) {
        self.bus.gpio_clear_out(mask);
    }

    fn gpio_xor_out(&mut self, mask: u32) {
        self.bus.gpio_xor_out(mask);
    }

    fn gpio_read_oe(&self) -> u32 {
        self.bus.gpio_read_oe()
    }

    fn gpio_write_oe(&mut self, value: u32) {
        self.bus.gpio_write_oe(value);
    }

    fn gpio_set_oe(&mut self, mask: u32) {
        self.bus.gpio_set_oe(mask);
    }

    fn gpio_clear_oe(&mut self, mask: u32) {
        self.bus.gpio_clear_oe(mask);
    }

    fn gpio_xor_oe(&mut self, mask: u32) {
        self.bus.gpio_xor_oe(mask);
    }

    fn gpio_read_in(&self) -> u32 {
        self.bus.gpio_read_in()
    }

    fn extra_wait_states(&self) -> u32 {
        CoreBus::extra_wait_states(self.bus)
    }

    fn reset_extra_wait_states(&mut self) {
        CoreBus::reset_extra_wait_states(self.bus);
    }

    fn last_fetch_addr(&self) -> u32 {
        CoreBus::last_fetch_addr(self.bus)
    }

    fn set_last_fetch_addr(&mut self, address: u32) {
        CoreBus::set_last_fetch_addr(self.bus, address);
    }

    fn mmio_trace_enabled(&self) -> bool {
        CoreBus::mmio_trace_enabled(self.bus)
    }

    fn emit_mmio_trace(&mut self, rw: char, size: u32, address: u32, value: u32, core: u8) {
        CoreBus::emit_mmio_trace(self.bus, rw, size, address, value, core);
    }
}
