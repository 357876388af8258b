//! The flash interface: wait states, locks, programming and erasing.
//!
//! Code and constants are fetched from the same bank, so the core stands still while it is busy.

use super::unknown;
use crate::machine::Memory;
use crate::time::from_us;

/// Programming a word, typical (data sheet, table 40).
const PROGRAM: u64 = from_us(16);

const BASE: u32 = 0x0800_0000;

const PGSERR: u32 = 1 << 7;
const PGPERR: u32 = 1 << 6;
const WRPERR: u32 = 1 << 4;
const EOP: u32 = 1;

const PG: u32 = 1;
const SER: u32 = 1 << 1;
const MER: u32 = 1 << 2;
const STRT: u32 = 1 << 16;
const EOPIE: u32 = 1 << 24;
const ERRIE: u32 = 1 << 25;
const LOCK: u32 = 1 << 31;

/// The registers.
#[derive(Clone, Debug)]
pub struct Flash {
    access: u32,
    status: u32,
    control: u32,
    keys: u8,
    /// How often something was programmed or erased.
    pub operations: u64,
    /// The supply fails in the operation of this number.
    pub cut_at: Option<u64>,
    /// It has failed.
    pub cut: bool,
    stall: u64,
    changed: bool,
}

impl Default for Flash {
    fn default() -> Self {
        Self {
            access: 0,
            status: 0,
            control: LOCK,
            keys: 0,
            operations: 0,
            cut_at: None,
            cut: false,
            stall: 0,
            changed: false,
        }
    }
}

impl Flash {
    /// A reset: locked, no wait states.
    pub fn reset(&mut self) {
        *self = Self {
            operations: self.operations,
            cut_at: self.cut_at,
            cut: self.cut,
            ..Self::default()
        };
    }

    /// Wait states set.
    #[must_use]
    pub const fn wait_states(&self) -> u32 {
        self.access & 7
    }

    /// How long the core has to stand still.
    pub const fn take_stall(&mut self) -> u64 {
        core::mem::replace(&mut self.stall, 0)
    }

    /// Whether its content has changed.
    pub const fn take_changed(&mut self) -> bool {
        core::mem::replace(&mut self.changed, false)
    }

    /// Whether it asks for its interrupt.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        self.control & EOPIE != 0 && self.status & EOP != 0
            || self.control & ERRIE != 0 && self.status & 0xF2 != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// Where there is none.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        Ok(match offset {
            0x00 => self.access,
            0x04 | 0x08 => 0,
            0x0C => self.status,
            0x10 => self.control,
            0x14 => 0x0FFF_AAED,
            _ => return unknown("FLASH", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// Where there is none.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        memory: &mut dyn Memory,
    ) -> Result<(), String> {
        match offset {
            0x00 => self.access = value & 0x1F07 & !0x1800,
            0x04 => {
                self.keys = match (self.keys, value) {
                    (0, 0x4567_0123) => 1,
                    (1, 0xCDEF_89AB) => {
                        self.control &= !LOCK;
                        0
                    }
                    // A wrong key locks until the next reset.
                    _ => 2,
                };
            }
            0x0C => self.status &= !(value & 0xF3),
            0x10 if self.control & LOCK != 0 => {}
            0x10 => {
                self.control = value & !STRT;
                if value & STRT != 0 {
                    self.erase(memory);
                }
            }
            _ => return unknown("FLASH", offset),
        }
        Ok(())
    }

    /// Counts an operation: whether the supply fails in it.
    fn operate(&mut self) -> bool {
        self.operations += 1;
        self.changed = true;
        if self.cut_at == Some(self.operations) {
            self.cut = true;
        }
        self.cut
    }

    fn erase(&mut self, memory: &mut dyn Memory) {
        if self.control & MER != 0 || self.control & SER == 0 {
            self.status |= PGSERR;
            return;
        }
        let sector = self.control >> 3 & 0xF;
        // Typical times for 32 bits at once, ms.
        let (start, size, ms) = match sector {
            0..=3 => (sector * 0x4000, 0x4000, 250),
            4 => (0x1_0000, 0x1_0000, 550),
            5..=11 => ((sector - 4) * 0x2_0000, 0x2_0000, 1000),
            _ => {
                self.status |= WRPERR;
                return;
            }
        };
        let cut = self.operate();
        // Cut off half-way, the rest is what it was.
        let erased = if cut { size / 2 } else { size };
        memory.write(BASE + start, &vec![0xFF; erased as usize]);
        self.stall += from_us(ms * 1000);
        self.done();
    }

    const fn done(&mut self) {
        if self.control & EOPIE != 0 {
            self.status |= EOP;
        }
    }

    /// A store to flash.
    ///
    /// # Errors
    /// Where flash is not open to it.
    pub fn program(
        &mut self,
        address: u32,
        size: usize,
        value: u32,
        memory: &mut dyn Memory,
    ) -> Result<(), String> {
        if self.control & LOCK != 0 || self.control & PG == 0 {
            self.status |= PGSERR;
            return Err("a store to flash that is locked or not set to be programmed".into());
        }
        if 1 << (self.control >> 8 & 3) != size {
            self.status |= PGPERR;
            return Err(format!("{size} bytes programmed at another parallelism"));
        }
        let mut old = [0; 4];
        memory.read(address, old.get_mut(..size).unwrap_or(&mut []));
        let cut = self.operate();
        let new: Vec<u8> = old
            .into_iter()
            .zip(value.to_le_bytes())
            // Programming only clears bits; cut off, it has cleared some of them.
            .map(|(old, new)| if cut { old & (new | 0x55) } else { old & new })
            .take(size)
            .collect();
        memory.write(address, &new);
        self.stall += PROGRAM;
        self.done();
        Ok(())
    }
}
