//! The connection to a debugger: the debug block, and semihosting calls for printing and exiting.

use crate::emulator::memory::Memory;

/// The debug block of the chip: its identification, and the peripherals that stop while a debugger halts the core. Only
/// power-up resets it (RM0090, 38.16).
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

const SYS_OPEN: u32 = 0x01;
const SYS_WRITE: u32 = 0x05;
const SYS_EXIT: u32 = 0x18;

const EXIT_SUCCESS: u32 = 0x2_0026;

/// The output of a program to its debugger.
#[derive(Clone, Debug, Default)]
pub struct Semihosting {
    /// Bytes written, to any file.
    pub output: Vec<u8>,
    /// `Some` once the program has exited; true for success.
    pub exit: Option<bool>,
}

impl Semihosting {
    /// Executes one call. Returns its result in R0, or `None` if it is not modelled.
    pub(crate) fn call(&mut self, memory: &mut dyn Memory, r0: u32, r1: u32) -> Option<u32> {
        let word = |memory: &mut dyn Memory, index: u32| memory.word(r1.wrapping_add(4 * index));
        match r0 {
            SYS_OPEN => return Some(1),
            SYS_WRITE => {
                let (start, length) = (word(memory, 1)?, word(memory, 2)?);
                for offset in 0..length {
                    self.output.push(memory.byte(start.wrapping_add(offset))?);
                }
            }
            SYS_EXIT => self.exit = Some(r1 == EXIT_SUCCESS),
            _ => return None,
        }
        Some(0)
    }
}
