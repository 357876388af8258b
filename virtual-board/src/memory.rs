//! Memory as programs see it, and where it lies (RM0090, 2.3): the one home of these addresses.

/// The memory that programs see as memory.
pub trait Memory {
    /// Reads; false where there is none.
    fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool;
    /// Writes; false where there is none.
    fn write(&mut self, address: u32, bytes: &[u8]) -> bool;

    /// A byte.
    fn byte(&mut self, address: u32) -> Option<u8> {
        let mut bytes = [0; 1];
        self.read(address, &mut bytes).then_some(bytes[0])
    }

    /// A word, little end first.
    fn word(&mut self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes)
            .then(|| u32::from_le_bytes(bytes))
    }
}

/// A range of addresses with memory behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Its first address.
    pub start: u32,
    /// Its length, bytes.
    pub size: usize,
}

impl Region {
    /// The address after its last.
    #[must_use]
    pub const fn end(&self) -> u32 {
        self.start + self.size as u32
    }

    /// Whether an address lies in it.
    #[must_use]
    pub const fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.start) < self.size as u32
    }

    /// Whether all of `length` bytes from an address on lie in it.
    #[must_use]
    pub const fn holds(&self, address: u32, length: usize) -> bool {
        address >= self.start && (address - self.start) as usize + length <= self.size
    }
}

/// Flash.
pub const FLASH: Region = Region {
    start: 0x0800_0000,
    size: 1 << 20,
};

/// The unique number of the chip, three words among the factory's bytes.
pub const UNIQUE_NUMBER: u32 = 0x1FFF_7A10;

/// RAM that only the core reaches: DMA does not.
pub const CCM: Region = Region {
    start: 0x1000_0000,
    size: 0x1_0000,
};

/// Programmed in the factory: serial number, size of flash.
pub const FACTORY: Region = Region {
    start: 0x1FFF_7000,
    size: 0x1000,
};

/// Option bytes, as memory.
pub const OPTIONS: Region = Region {
    start: 0x1FFF_C000,
    size: 0x1000,
};

/// RAM.
pub const RAM: Region = Region {
    start: 0x2000_0000,
    size: 0x2_0000,
};

/// Each byte of RAM before the first write to it.
pub const UNTOUCHED: u8 = 0xA5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_ends_where_its_last_byte_does() {
        assert!(RAM.contains(RAM.start) && RAM.contains(RAM.end() - 1));
        assert!(!RAM.contains(RAM.end()) && !RAM.contains(RAM.start - 1));
        assert!(RAM.holds(RAM.end() - 4, 4) && !RAM.holds(RAM.end() - 4, 5));
        assert!(!RAM.holds(RAM.start - 1, 2));
    }
}
