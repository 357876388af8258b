//! Semihosting calls for printing and exiting.

use crate::emulator::memory::Memory;

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
