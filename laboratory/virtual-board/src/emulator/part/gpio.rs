//! General-purpose pins.

use super::unknown;

const MODER: usize = 0;
const PUPDR: usize = 3;
const ODR: usize = 5;
const AFRL: usize = 8;

/// One port.
#[derive(Clone, Debug, Default)]
pub struct Gpio {
    /// The registers by their place; the registers of inputs and of single bits are not stored.
    registers: [u32; 10],
    /// Pins that are driven from outside.
    pub driven: u16,
    /// Levels of the driven pins.
    pub levels: u16,
    index: usize,
}

impl Gpio {
    /// Creates port number `index`, A first.
    #[must_use]
    pub fn new(index: usize) -> Self {
        let (modes, speeds, pulls) = match index {
            0 => (0xA800_0000, 0, 0x6400_0000),
            1 => (0x0000_0280, 0x0000_00C0, 0x0000_0100),
            _ => (0, 0, 0),
        };
        Self { registers: [modes, 0, speeds, pulls, 0, 0, 0, 0, 0, 0], index, ..Self::default() }
    }

    /// Resets the registers; the levels of inputs stay.
    pub fn reset(&mut self) {
        *self = Self { driven: self.driven, levels: self.levels, ..Self::new(self.index) };
    }

    /// Mode of a pin: 0 input, 1 output, 2 alternate function, 3 analogue.
    #[must_use]
    pub const fn mode(&self, pin: u32) -> u32 {
        self.registers[MODER] >> (2 * pin) & 3
    }

    /// Alternate function of a pin.
    #[must_use]
    pub const fn function(&self, pin: u32) -> u32 {
        self.registers[AFRL + (pin / 8) as usize] >> (4 * (pin % 8)) & 0xF
    }

    /// Level of a pin.
    #[must_use]
    pub const fn level(&self, pin: u32) -> bool {
        let bit = 1_u32 << pin;
        if self.mode(pin) == 1 {
            return self.registers[ODR] & bit != 0;
        }
        if self.driven as u32 & bit != 0 {
            self.levels as u32 & bit != 0
        } else {
            self.is_pulled_up(pin)
        }
    }

    /// Returns whether a pin has its pull-up enabled.
    #[must_use]
    pub const fn is_pulled_up(&self, pin: u32) -> bool {
        self.registers[PUPDR] >> (2 * pin) & 3 == 1
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        Ok(match offset {
            0x10 => (0..16).filter(|&pin| self.level(pin)).fold(0, |word, pin| word | 1 << pin),
            0x00..0x1C | 0x20..0x28 => self.registers[offset as usize / 4],
            _ => return unknown("GPIO", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            0x00 | 0x08 | 0x0C | 0x20 | 0x24 => self.registers[offset as usize / 4] = value,
            0x04 | 0x14 => self.registers[offset as usize / 4] = value & 0xFFFF,
            0x18 => {
                self.registers[ODR] = self.registers[ODR] & !(value >> 16) | value & 0xFFFF;
            }
            _ => return unknown("GPIO", offset),
        }
        Ok(())
    }
}
