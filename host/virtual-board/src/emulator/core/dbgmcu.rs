//! The debug block of the chip: its identification, and the peripherals that stand still while a
//! debugger halts the core. Only power-up resets it (RM0090, 38.16).

/// The registers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dbgmcu {
    control: u32,
    /// Peripherals that freeze, on APB1 and APB2.
    freeze: [u32; 2],
}

/// An STM32F405, revision Y.
const IDENTIFICATION: u32 = 0x1007_6413;

impl Dbgmcu {
    /// Reads a register.
    #[must_use]
    pub const fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            0x0 => Some(IDENTIFICATION),
            0x4 => Some(self.control),
            0x8 => Some(self.freeze[0]),
            0xC => Some(self.freeze[1]),
            _ => None,
        }
    }

    /// Writes a register; `None` if the register does not exist.
    pub const fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            0x4 => self.control = value,
            0x8 => self.freeze[0] = value,
            0xC => self.freeze[1] = value,
            _ => return None,
        }
        Some(())
    }

    /// Returns whether TIM2 to TIM5, counted from 0, stands still during a halt.
    #[must_use]
    pub const fn freezes_timer(&self, index: usize) -> bool {
        self.freeze[0] >> index & 1 != 0
    }

    /// Returns whether the independent watchdog stands still during a halt.
    #[must_use]
    pub const fn freezes_watchdog(&self) -> bool {
        self.freeze[0] >> 12 & 1 != 0
    }
}
