//! The independent watchdog, on the low-speed internal oscillator.

use super::unknown;
use crate::emulator::time::{self, NEVER};

/// Key that opens the prescaler and the reload value.
const UNLOCK: u32 = 0x5555;
/// Key that starts the watchdog.
const START: u32 = 0xCCCC;
/// Key that feeds it.
const RELOAD: u32 = 0xAAAA;

/// The registers.
#[derive(Clone, Debug)]
pub struct Iwdg {
    prescaler: u32,
    reload: u32,
    open: bool,
    /// Frequency of its oscillator, Hz.
    lsi_hz: u32,
    /// Time since which a debugger's halt has frozen the watchdog.
    frozen_at: Option<u64>,
    /// Time at which the watchdog resets the chip.
    deadline: u64,
}

impl Iwdg {
    /// Creates the state after reset.
    #[must_use]
    pub const fn new(lsi_hz: u32) -> Self {
        Self { prescaler: 0, reload: 0xFFF, open: false, lsi_hz, frozen_at: None, deadline: NEVER }
    }

    /// Resets the registers.
    pub const fn reset(&mut self) {
        *self = Self::new(self.lsi_hz);
    }

    /// Freezes the watchdog while a debugger halts the core, or releases it.
    pub const fn freeze(&mut self, frozen: bool, now: u64) {
        match (frozen, self.frozen_at) {
            (true, None) => self.frozen_at = Some(now),
            (false, Some(since)) => {
                self.frozen_at = None;
                self.deadline = self.deadline.saturating_add(now - since);
            }
            _ => {}
        }
    }

    fn period(&self) -> u64 {
        // 6 and 7 both mean 256.
        let divider = 4 << self.prescaler.min(6);
        time::cycle(self.lsi_hz) * divider * (u64::from(self.reload) + 1)
    }

    /// Time at which the watchdog resets the chip.
    #[must_use]
    pub const fn next_event(&self) -> u64 {
        match self.frozen_at {
            Some(_) => NEVER,
            None => self.deadline,
        }
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
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
    /// If the register does not exist.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        match offset {
            0 => {
                let key = value & 0xFFFF;
                self.open = key == UNLOCK;
                if key == START || key == RELOAD && self.deadline != NEVER {
                    self.deadline = now + self.period();
                }
            }
            4 if self.open => self.prescaler = value & 7,
            8 if self.open => self.reload = value & 0xFFF,
            4 | 8 => {}
            _ => return unknown("IWDG", offset),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::corner::Corner;

    #[test]
    fn a_one_second_watchdog_bites_after_0_67_to_2_seconds() {
        let mut bites = Vec::new();
        for corner in Corner::ALL {
            let mut iwdg = Iwdg::new(corner.lsi_hz());
            // 32 kHz / 8, 4000 times.
            for (offset, value) in [(0, 0x5555), (4, 1), (8, 3_999), (0, 0xCCCC)] {
                iwdg.write(offset, value, 0).expect("a register");
            }
            bites.push(time::to_us(iwdg.next_event()) as u32 / 1000);
        }
        assert_eq!(bites, [680, 1_000, 1_882]);
    }

    #[test]
    fn a_frozen_watchdog_waits() {
        let mut iwdg = Iwdg::new(32_000);
        iwdg.write(0, 0xCCCC, 0).expect("a register");
        let before = iwdg.next_event();
        iwdg.freeze(true, 1_000);
        assert_eq!(iwdg.next_event(), NEVER);
        iwdg.freeze(false, 5_000);
        assert_eq!(iwdg.next_event(), before + 4_000);
    }
}
