//! Memory map as seen by programs (RM0090, 2.3), the only place for these addresses.

use unicorn_engine::Prot;

/// Access to memory.
pub trait Memory {
    /// Reads bytes; false if the address is unmapped.
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool;
    /// Writes bytes; false if the address is unmapped.
    fn write(&mut self, address: u32, bytes: &[u8]) -> bool;

    /// Reads a byte.
    fn byte(&mut self, address: u32) -> Option<u8> {
        let mut bytes = [0; 1];
        self.read(address, &mut bytes).then_some(bytes[0])
    }

    /// Reads a little-endian word.
    fn word(&mut self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes).then(|| u32::from_le_bytes(bytes))
    }
}

/// A range of addresses with memory behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First address.
    pub start: u32,
    /// Length, bytes.
    pub size: usize,
}

impl Region {
    const fn new(start: u32, size: usize) -> Self {
        Self { start, size }
    }

    /// Address after the last byte.
    #[must_use]
    pub const fn end(&self) -> u32 {
        self.start + self.size as u32
    }

    /// Returns whether the region contains an address.
    #[must_use]
    pub const fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.start) < self.size as u32
    }

    /// Returns whether the region contains all of `length` bytes starting at an address.
    #[must_use]
    pub const fn holds(&self, address: u32, length: usize) -> bool {
        address >= self.start && (address - self.start) as usize + length <= self.size
    }
}

/// Flash.
pub const FLASH: Region = Region::new(0x0800_0000, 1 << 20);

/// Unique number of the chip, three words of the factory area.
pub const UNIQUE_NUMBER: u32 = 0x1FFF_7A10;

/// RAM that only the core can access, not DMA.
pub const CCM: Region = Region::new(0x1000_0000, 0x1_0000);

/// Area programmed in the factory: serial number, size of flash.
pub const FACTORY: Region = Region::new(0x1FFF_7000, 0x1000);

/// Option bytes, mapped as memory.
pub const OPTIONS: Region = Region::new(0x1FFF_C000, 0x1000);

/// RAM.
pub const RAM: Region = Region::new(0x2000_0000, 0x2_0000);

/// Permits reads.
const READ: Prot = Prot::READ;
/// Permits reads and writes.
const WRITE: Prot = Prot(Prot::READ.0 | Prot::WRITE.0);
/// Permits reads and execution.
const EXECUTE: Prot = Prot(Prot::READ.0 | Prot::EXEC.0);

/// All memory: its access rights, and the value of each byte at power-up.
pub const MEMORIES: [(Region, Prot, u8); 5] = [
    (FLASH, EXECUTE, 0xFF),
    (CCM, WRITE, UNTOUCHED),
    (FACTORY, READ, 0xFF),
    (RAM, WRITE, UNTOUCHED),
    (OPTIONS, READ, 0xFF),
];

/// Returns whether there is memory behind all of `length` bytes.
#[must_use]
pub fn is_memory(address: u32, length: usize) -> bool {
    MEMORIES.iter().any(|(region, ..)| region.holds(address, length))
}

/// Value of each byte of RAM before the first write to it.
pub const UNTOUCHED: u8 = 0xA5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_ends_after_its_last_byte() {
        assert!(RAM.contains(RAM.start) && RAM.contains(RAM.end() - 1));
        assert!(!RAM.contains(RAM.end()) && !RAM.contains(RAM.start - 1));
        assert!(RAM.holds(RAM.end() - 4, 4) && !RAM.holds(RAM.end() - 4, 5));
        assert!(!RAM.holds(RAM.start - 1, 2));
    }
}
