//! The independent watchdog, on the low-speed internal oscillator.

use super::unknown;
use crate::time::{self, NEVER};

/// The oscillator, typical, hertz.
const LSI: u32 = 32_000;

/// The registers.
#[derive(Clone, Debug)]
pub struct Iwdg {
    prescaler: u32,
    reload: u32,
    open: bool,
    /// When it bites.
    deadline: u64,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self {
            prescaler: 0,
            reload: 0xFFF,
            open: false,
            deadline: NEVER,
        }
    }
}

impl Iwdg {
    const fn period(&self) -> u64 {
        // 6 and 7 both mean 256.
        let shift = if self.prescaler > 6 {
            6
        } else {
            self.prescaler
        };
        time::cycle(LSI) * (4 << shift) * (self.reload as u64 + 1)
    }

    /// When it bites.
    #[must_use]
    pub const fn next_event(&self) -> u64 {
        self.deadline
    }

    /// Whether it has been started.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.deadline != NEVER
    }

    /// Reads a register.
    ///
    /// # Errors
    /// Where there is none.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        match offset {
            0 | 12 => Ok(0),
            4 => Ok(self.prescaler),
            8 => Ok(self.reload),
            _ => unknown("IWDG", offset),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// Where there is none.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        match offset {
            0 => match value & 0xFFFF {
                0x5555 => self.open = true,
                0xAAAA => {
                    self.open = false;
                    if self.is_running() {
                        self.deadline = now + self.period();
                    }
                }
                0xCCCC => {
                    self.open = false;
                    self.deadline = now + self.period();
                }
                _ => self.open = false,
            },
            4 if self.open => self.prescaler = value & 7,
            8 if self.open => self.reload = value & 0xFFF,
            4 | 8 => {}
            _ => return unknown("IWDG", offset),
        }
        Ok(())
    }
}
