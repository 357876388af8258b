//! Interrupts from pins, and the port selection of SYSCFG.

use super::unknown;

const IMR: usize = 0;
const RTSR: usize = 2;
const FTSR: usize = 3;
const PR: usize = 5;

/// State of EXTI and SYSCFG.
#[derive(Clone, Debug, Default)]
pub struct Exti {
    /// IMR, EMR, RTSR, FTSR, SWIER, which is not stored, and PR.
    registers: [u32; 6],
    /// Two registers without effect, and four with the ports of the pins.
    syscfg: [u32; 6],
}

/// Interrupt and lines of EXTI: lines 0 to 4, 5 to 9 and 10 to 15.
pub const LINES: [(u16, u32); 7] = [
    (6, 1 << 0),
    (7, 1 << 1),
    (8, 1 << 2),
    (9, 1 << 3),
    (10, 1 << 4),
    (23, 0x03E0),
    (40, 0xFC00),
];

impl Exti {
    /// Handles an edge of a pin.
    pub const fn edge(&mut self, port: u32, pin: u32, high: bool) {
        let chosen = self.syscfg[2 + (pin / 4) as usize] >> (4 * (pin % 4)) & 0xF;
        let watched = self.registers[if high { RTSR } else { FTSR }];
        if chosen == port && watched & 1 << pin != 0 {
            self.registers[PR] |= 1 << pin;
        }
    }

    /// Lines that request an interrupt.
    #[must_use]
    pub const fn requesting(&self) -> u32 {
        self.registers[PR] & self.registers[IMR]
    }

    /// Reads a register of EXTI.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        match self.registers.get(offset as usize / 4) {
            Some(&value) => Ok(value),
            None => unknown("EXTI", offset),
        }
    }

    /// Writes a register of EXTI.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            0x00 | 0x04 | 0x08 | 0x0C => self.registers[offset as usize / 4] = value,
            0x10 => self.registers[PR] |= value,
            0x14 => self.registers[PR] &= !value,
            _ => return unknown("EXTI", offset),
        }
        Ok(())
    }

    /// Reads a register of SYSCFG.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read_syscfg(&self, offset: u32) -> Result<u32, String> {
        match offset {
            0x00..=0x14 => Ok(self.syscfg[offset as usize / 4]),
            // The compensation cell is ready.
            0x20 => Ok(0x101),
            _ => unknown("SYSCFG", offset),
        }
    }

    /// Writes a register of SYSCFG.
    ///
    /// # Errors
    /// If the register does not exist, or the value would remap memory.
    pub fn write_syscfg(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            0x00 if value & 3 != 0 => return Err("memory is remapped".into()),
            0x00 | 0x04 => self.syscfg[offset as usize / 4] = value,
            0x08..=0x14 => self.syscfg[offset as usize / 4] = value & 0xFFFF,
            0x20 => {}
            _ => return unknown("SYSCFG", offset),
        }
        Ok(())
    }
}
