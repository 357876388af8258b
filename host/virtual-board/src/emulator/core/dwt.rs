//! The cycle counter. It stands still while the core sleeps, as without a debugger.

/// Counter of cycles awake.
#[derive(Clone, Debug, Default)]
pub struct Dwt {
    control: u32,
    base: u32,
    since: u64,
}

impl Dwt {
    fn count(&self, cycles: u64) -> u32 {
        match self.control & 1 {
            0 => self.base,
            // The counter wraps.
            _ => self.base.wrapping_add((cycles - self.since) as u32),
        }
    }

    /// Reads a register at an offset from `0xE000_1000`, `cycles` awake since power-up.
    #[must_use]
    pub fn read(&self, offset: u32, cycles: u64) -> Option<u32> {
        match offset {
            0 => Some(0x4000_0000 | self.control),
            4 => Some(self.count(cycles)),
            // The lock is open.
            0xFB4 => Some(0),
            _ => None,
        }
    }

    /// Writes a register.
    pub fn write(&mut self, offset: u32, value: u32, cycles: u64) -> Option<()> {
        self.base = self.count(cycles);
        self.since = cycles;
        match offset {
            0 => self.control = value & 1,
            4 => self.base = value,
            0xFB0 => {}
            _ => return None,
        }
        Some(())
    }
}
