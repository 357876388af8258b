//! Power control: the regulator's scale and the gate of the backup domain.

use super::unknown;

/// The registers.
#[derive(Clone, Debug)]
pub struct Pwr {
    control: u32,
    status: u32,
}

impl Default for Pwr {
    fn default() -> Self {
        Self {
            control: 0x4000,
            status: 0,
        }
    }
}

impl Pwr {
    const VOSRDY: u32 = 1 << 14;

    /// Reads a register.
    ///
    /// # Errors
    /// Where there is none.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        match offset {
            0 => Ok(self.control),
            4 => Ok(self.status | Self::VOSRDY),
            _ => unknown("PWR", offset),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// Where there is none.
    pub fn write(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            // Clear bits read as zero.
            0 => self.control = value & !0xC,
            4 => self.status = value & 0x300,
            _ => return unknown("PWR", offset),
        }
        Ok(())
    }
}
