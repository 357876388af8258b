//! The register file.

use std::vec::Vec;

use crate::register::{self, Access, Register};

/// Something a driver must not do to the registers. The part shrugs it off; tests need not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offence {
    /// A write to a register that only can be read.
    WroteReadOnly {
        /// Where.
        address: u8,
        /// What.
        value: u8,
    },
    /// A write that would have changed reserved bits.
    ChangedReservedBits {
        /// Where.
        address: u8,
        /// What.
        value: u8,
    },
    /// A write to an address that is not described.
    WroteUnknown {
        /// Where.
        address: u8,
        /// What.
        value: u8,
    },
}

/// Offences that are kept; later ones are only counted by being missing.
const OFFENCES: usize = 256;

/// Values of the registers that hold some.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    values: [u8; 128],
    described: [Option<Register>; 128],
    offences: Vec<Offence>,
}

impl Memory {
    pub(super) fn new() -> Self {
        let mut described = [None; 128];
        for register in register::ALL {
            described[usize::from(register.address)] = Some(*register);
        }
        let mut memory = Self {
            values: [0; 128],
            described,
            offences: Vec::new(),
        };
        memory.reset();
        memory
    }

    pub(super) fn reset(&mut self) {
        self.values = self
            .described
            .map(|register| register.map_or(0, |register| register.reset));
    }

    pub(super) fn read(&self, address: u8) -> u8 {
        self.values[usize::from(address & 0x7F)]
    }

    pub(super) fn get(&self, register: Register) -> u8 {
        self.read(register.address)
    }

    /// Writes the bits that can be written.
    pub(super) fn write(&mut self, address: u8, value: u8) {
        let offence = match self.described[usize::from(address & 0x7F)] {
            None => Some(Offence::WroteUnknown { address, value }),
            Some(register) if register.access == Access::ReadOnly => {
                Some(Offence::WroteReadOnly { address, value })
            }
            Some(register) => {
                self.put(
                    register,
                    (value & register.mask) | (register.reset & !register.mask),
                );
                (!register.keeps_reserved_bits(value))
                    .then_some(Offence::ChangedReservedBits { address, value })
            }
        };
        if let Some(offence) = offence
            && self.offences.len() < OFFENCES
        {
            self.offences.push(offence);
        }
    }

    /// Puts a value there whatever it is.
    pub(super) fn put(&mut self, register: Register, value: u8) {
        self.force(register.address, value);
    }

    /// The same by the address.
    pub(super) fn force(&mut self, address: u8, value: u8) {
        self.values[usize::from(address & 0x7F)] = value;
    }

    pub(super) fn offences(&self) -> &[Offence] {
        &self.offences
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_wake_up_with_their_values_after_reset() {
        let memory = Memory::new();
        for register in register::ALL {
            assert_eq!(memory.get(*register), register.reset, "{}", register.name);
        }
    }

    #[test]
    fn reserved_bits_keep_their_value_and_the_attempt_is_noted() {
        let mut memory = Memory::new();
        memory.write(0x10, 0xFF);
        assert_eq!(memory.read(0x10), 0xFE);
        memory.write(0x02, 0x40);
        assert_eq!(memory.read(0x02), 0x7F);
        let noted = |address, value| Offence::ChangedReservedBits { address, value };
        assert_eq!(memory.offences(), [noted(0x10, 0xFF), noted(0x02, 0x40)]);
    }

    #[test]
    fn what_can_only_be_read_does_not_change() {
        let mut memory = Memory::new();
        memory.write(0x0F, 0x00);
        assert_eq!(memory.read(0x0F), 0x6C);
        memory.write(0x50, 1);
        assert_eq!(
            memory.offences(),
            [
                Offence::WroteReadOnly {
                    address: 0x0F,
                    value: 0
                },
                Offence::WroteUnknown {
                    address: 0x50,
                    value: 1
                }
            ]
        );
    }
}
