//! Faults that can be injected into the board.

use lsm6dsox::sim::{Part as Sensor, PartFault as SensorFault};

use super::Board;
use crate::emulator::chip::NOMINAL_MV;
use crate::emulator::core::cpu::Interrupts;
use crate::emulator::core::nvic::exception;
use crate::emulator::memory::RAM;
use crate::emulator::part::can::BusFault;
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::part::usart::LineFault;
use crate::emulator::time::from_us;

/// A branch to itself.
const ENDLESS_LOOP: u16 = 0xE7FE;

/// An address with neither memory nor a peripheral.
const NOWHERE: u32 = 0x6000_0000;

/// A fault to inject into the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Injection {
    /// Fault of the sensor or its line.
    Sensor(SensorFault),
    /// The clock on the sensor's bus stops, and a reset of its controller does not start it again.
    SensorClockStopped,
    /// This stream of DMA2 has an error in the middle of each transfer.
    DmaError(usize),
    /// Fault of the CAN bus.
    Bus(BusFault),
    /// Fault of the serial line.
    Line(LineFault),
    /// The crystal stops and does not start again.
    CrystalLost,
    /// The supply dips.
    BrownOut,
    /// The supply changes to this voltage, mV. Below the brown-out level of the option bytes it is a dip, and
    /// returns.
    Supply(u32),
    /// A debugger halts the core for this long, ms.
    DebuggerHalt(u32),
    /// The reset pin is pulled low.
    Reset,
    /// The supply fails after this many flash operations.
    CutInFlash(u64),
    /// After this many flash operations, one that programs clears one bit too many.
    WornFlash(u64),
    /// The load sensor's voltage changes to this code.
    Load(u16),
    /// The core jumps to an address without memory.
    Derail,
    /// The core hangs in an endless loop with interrupts masked.
    Hang,
    /// The core jumps to the panic handler.
    Panic,
    /// The stack pointer moves to the end of the stack.
    StackOverflow,
    /// The interrupt with this number is disabled, as by a flipped bit: a task that waits for it waits until the
    /// next reset.
    InterruptLost(u16),
    /// The settings pages are blank.
    SettingsErased,
    /// The settings pages hold arbitrary bytes, generated from this seed.
    SettingsGarbage(u64),
    /// Bits have flipped throughout the written part of the settings pages.
    SettingsDamaged,
    /// Clears all faults of the sensor and its bus, of DMA, CAN, the serial line and the load sensor, and restores the supply.
    Clear,
}

impl Board {
    /// Injects a fault now, or clears all clearable faults.
    pub fn inject(&mut self, injection: Injection) {
        match injection {
            Injection::Derail => self.cpu.derail(NOWHERE, Interrupts::Enabled),
            Injection::Hang => {
                // At the far end of the stack, which a running program does not reach.
                let memory = self.cpu.memory();
                memory.write(RAM.start, &ENDLESS_LOOP.to_le_bytes());
                self.cpu.derail(RAM.start, Interrupts::Masked);
            }
            Injection::Panic => {
                if let Some(handler) = self.function("rust_begin_unwind") {
                    self.cpu.derail(handler, Interrupts::Enabled);
                }
            }
            Injection::StackOverflow => {
                let end = self.image.symbol("_stack_end").unwrap_or(RAM.start);
                self.cpu.move_stack(end);
            }
            Injection::SettingsErased => self.spoil_settings(|_, _| 0xFF),
            Injection::SettingsGarbage(seed) => self.fill_settings(seed),
            Injection::SettingsDamaged => self.spoil_settings(|index, byte| {
                let hit = index % 37 == 9 && byte != 0xFF;
                byte ^ u8::from(hit) << 2
            }),
            _ => self.inject_into_chip(injection),
        }
    }

    /// Injects a fault of the chip or of a part that is soldered to it.
    fn inject_into_chip(&mut self, injection: Injection) {
        let mut machine = self.cpu.machine();
        let now = machine.now;
        match injection {
            Injection::Sensor(fault) => {
                machine.chip.with_sensor(now, |sensor| sensor.inject(fault));
            }
            Injection::SensorClockStopped => machine.chip.set_sensor_clock_stopped(true, now),
            Injection::DmaError(stream) => machine.chip.failing_streams[stream & 7] = true,
            Injection::Bus(fault) => machine.chip.can.set_fault(fault),
            Injection::CrystalLost => machine.lose_crystal(),
            Injection::Supply(mv) => machine.chip.set_supply(mv),
            Injection::DebuggerHalt(ms) => machine.halt(from_us(u64::from(ms) * 1000)),
            Injection::BrownOut => machine.chip.request_reset(ResetCause::BrownOut),
            Injection::Reset => machine.chip.request_reset(ResetCause::Pin),
            Injection::CutInFlash(operations) => {
                let done = machine.chip.flash.operations;
                machine.chip.flash.cut_at = Some(done + operations);
            }
            Injection::WornFlash(operations) => {
                let done = machine.chip.flash.operations;
                machine.chip.flash.worn_at = Some(done + operations);
            }
            Injection::Load(code) => machine.chip.adc.inputs[self.wiring.load.1] = code,
            Injection::Line(fault) => {
                let pclk = machine.chip.usart_clock(self.wiring.usart);
                machine.chip.usarts[self.wiring.usart].set_fault(fault, now, pclk);
            }
            Injection::InterruptLost(interrupt) => {
                machine.nvic.enable(exception::INTERRUPT + interrupt, false);
            }
            Injection::Clear => {
                let pclk = machine.chip.usart_clock(self.wiring.usart);
                machine.chip.usarts[self.wiring.usart].set_fault(LineFault::None, now, pclk);
                machine.chip.with_sensor(now, Sensor::clear_faults);
                machine.chip.set_sensor_clock_stopped(false, now);
                machine.chip.failing_streams = [false; 8];
                machine.chip.can.set_fault(BusFault::None);
                machine.chip.adc.inputs[self.wiring.load.1] = self.load;
                machine.chip.set_supply(NOMINAL_MV);
            }
            Injection::Derail
            | Injection::Hang
            | Injection::Panic
            | Injection::StackOverflow
            | Injection::SettingsErased
            | Injection::SettingsGarbage(_)
            | Injection::SettingsDamaged => {}
        }
        machine.wake();
    }

    /// Fills the settings pages, as a seed selects: with noise, with noise in blank pages, or by clearing
    /// scattered bits of their content.
    fn fill_settings(&mut self, seed: u64) {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let kind = next() % 3;
        let (from, length) = (next() as usize % 0x8000, next() as usize % 0x1000);
        let noise: Vec<u8> = (0..0x8000).map(|_| (next() >> 32) as u8).collect();
        let sparse: Vec<bool> = (0..0x8000).map(|_| next() % 64 == 0).collect();
        self.spoil_settings(|index, byte| {
            let noise = noise.get(index).copied().unwrap_or(0);
            let is_sparse = sparse.get(index).copied().unwrap_or(false);
            match kind {
                0 => noise,
                1 if (from..from + length).contains(&index) => noise,
                1 => 0xFF,
                _ if is_sparse => byte & noise,
                _ => byte,
            }
        });
    }

    /// Modifies the settings pages byte by byte.
    fn spoil_settings(&mut self, change: impl Fn(usize, u8) -> u8) {
        let mut bytes = self.settings();
        for (index, byte) in bytes.iter_mut().enumerate() {
            *byte = change(index, *byte);
        }
        self.set_settings(&bytes);
    }
}
