//! Clocks of the peripherals, and the consequences of their change.

use super::Chip;
use super::map::MAP;
use crate::emulator::time::cycle;

impl Chip {
    /// Period of the core's clock.
    #[must_use]
    pub const fn period(&self) -> u64 {
        cycle(self.rcc.clocks.hclk)
    }

    /// The clock of an SPI controller, hertz.
    pub(super) const fn spi_clock(&self, index: usize) -> u32 {
        match index {
            0 => self.rcc.clocks.pclk2,
            _ => self.rcc.clocks.pclk1,
        }
    }

    /// The clock of a serial line, hertz.
    #[must_use]
    pub const fn usart_clock(&self, index: usize) -> u32 {
        match index {
            0 | 3 => self.rcc.clocks.pclk2,
            _ => self.rcc.clocks.pclk1,
        }
    }

    /// A store to reset and clock control.
    pub(super) fn write_rcc(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        let before = self.rcc.clocks;
        self.rcc.write(offset, value, now, self.flash.wait_states())?;
        if self.rcc.clocks != before {
            self.follow_clocks(now);
        }
        // Reset registers lie 0x20 below the enables.
        if matches!(offset, 0x10 | 0x20 | 0x24) {
            for entry in &MAP {
                if let Some((register, bit)) = entry.enable
                    && register == offset + 0x20
                    && value & 1 << bit != 0
                {
                    self.reset_part(entry.part, now);
                }
            }
        }
        Ok(())
    }

    /// Updates the clocks of timers and CAN.
    fn follow_clocks(&mut self, now: u64) {
        let clocks = self.rcc.clocks;
        for timer in &mut self.timers {
            timer.set_period(now, cycle(clocks.timers1));
        }
        self.can.pclk = clocks.pclk1;
    }

    /// Stops the crystal. Returns whether an NMI is due.
    ///
    /// # Errors
    /// As [`Rcc::lose_crystal`].
    pub(crate) fn lose_crystal(&mut self, now: u64) -> Result<bool, String> {
        let watched = self.rcc.lose_crystal(now, self.flash.wait_states())?;
        self.follow_clocks(now);
        Ok(watched)
    }
}
