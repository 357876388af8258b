//! Interrupts from pins, and the port selection of SYSCFG.

use super::unknown;

/// State of EXTI and SYSCFG.
#[derive(Clone, Debug, Default)]
pub struct Exti {
    interrupt_mask: u32,
    event_mask: u32,
    rising: u32,
    falling: u32,
    pending: u32,
    ports: [u32; 4],
    other: [u32; 2],
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
        let chosen = self.ports[(pin / 4) as usize] >> (4 * (pin % 4)) & 0xF;
        let watched = if high { self.rising } else { self.falling };
        if chosen == port && watched & 1 << pin != 0 {
            self.pending |= 1 << pin;
        }
    }

    /// Lines that request an interrupt.
    #[must_use]
    pub const fn requesting(&self) -> u32 {
        self.pending & self.interrupt_mask
    }

    /// Reads a register of EXTI.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        Ok(match offset {
            0x00 => self.interrupt_mask,
            0x04 => self.event_mask,
            0x08 => self.rising,
            0x0C => self.falling,
            0x10 => 0,
            0x14 => self.pending,
            _ => return unknown("EXTI", offset),
        })
    }

    /// Writes a register of EXTI.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            0x00 => self.interrupt_mask = value,
            0x04 => self.event_mask = value,
            0x08 => self.rising = value,
            0x0C => self.falling = value,
            0x10 => self.pending |= value,
            0x14 => self.pending &= !value,
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
            0x00 | 0x04 => Ok(self.other[offset as usize / 4]),
            0x08..=0x14 => Ok(self.ports[(offset as usize - 8) / 4]),
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
            0x00 | 0x04 => self.other[offset as usize / 4] = value,
            0x08..=0x14 => self.ports[(offset as usize - 8) / 4] = value & 0xFFFF,
            0x20 => {}
            _ => return unknown("SYSCFG", offset),
        }
        Ok(())
    }
}
