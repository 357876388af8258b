//! Loads and stores outside memory: peripherals, and the core's private registers.

use super::{Machine, RunningBlock, Stop};
use crate::emulator::core::nvic::exception;
use crate::emulator::memory::Memory;
use crate::emulator::part::rcc::ResetCause;

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
