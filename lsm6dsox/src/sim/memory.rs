//! The register file: settings, with the accesses that a driver must not make, and outputs.

use std::vec::Vec;

use crate::register::{
    self, Access, Field, Register, counter_bdr_reg1, ctrl3_c, ctrl4_c, ctrl5_c, ctrl6_c, ctrl7_g,
    ctrl8_xl, ctrl9_xl, fifo_ctrl4, func_cfg_access, int1_ctrl, int2_ctrl, status_reg,
};

/// Access to the registers that a driver must not make. The part tolerates it, but a test need not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// A write to a read-only register.
    WroteReadOnly {
        /// Address of the register.
        address: u8,
        /// Value written.
        value: u8,
    },
    /// A write that would have changed reserved bits.
    ChangedReservedBits {
        /// Address of the register.
        address: u8,
        /// Value written.
        value: u8,
    },
    /// A write to an address without a description.
    WroteUnknown {
        /// Address written to.
        address: u8,
        /// Value written.
        value: u8,
    },
    /// A write that enabled a function that this part does not simulate. The register stores it without effect.
    NotSimulated {
        /// Address of the register.
        address: u8,
        /// Bits without simulation.
        bits: u8,
    },
}

/// Fields, by register, that affect a real part but not this one. Setting them is reported.
const NOT_SIMULATED: &[(Register, &[Field])] = &[
    (register::FUNC_CFG_ACCESS, &[func_cfg_access::OIS_CTRL_FROM_UI]),
    (register::FIFO_CTRL4, &[fifo_ctrl4::FIFO_MODE]),
    (
        register::COUNTER_BDR_REG1,
        &[counter_bdr_reg1::TRIG_COUNTER_BDR, counter_bdr_reg1::RST_COUNTER_BDR],
    ),
    (
        register::INT1_CTRL,
        &[
            int1_ctrl::BOOT,
            int1_ctrl::FIFO_TH,
            int1_ctrl::FIFO_OVR,
            int1_ctrl::FIFO_FULL,
            int1_ctrl::CNT_BDR,
            int1_ctrl::DEN_DRDY_FLAG,
        ],
    ),
    (
        register::INT2_CTRL,
        &[
            int2_ctrl::DRDY_TEMP,
            int2_ctrl::FIFO_TH,
            int2_ctrl::FIFO_OVR,
            int2_ctrl::FIFO_FULL,
            int2_ctrl::CNT_BDR,
        ],
    ),
    (register::CTRL3_C, &[ctrl3_c::PP_OD]),
    (register::CTRL4_C, &[ctrl4_c::DRDY_MASK]),
    (register::CTRL5_C, &[ctrl5_c::ROUNDING_STATUS, ctrl5_c::XL_ULP_EN]),
    (register::CTRL6_C, &[ctrl6_c::USR_OFF_W, ctrl6_c::DEN_MODE]),
    (
        register::CTRL7_G,
        &[
            ctrl7_g::OIS_ON,
            ctrl7_g::USR_OFF_ON_OUT,
            ctrl7_g::OIS_ON_EN,
            ctrl7_g::HP_EN_G,
            ctrl7_g::G_HM_MODE,
        ],
    ),
    (
        register::CTRL8_XL,
        &[ctrl8_xl::HP_SLOPE_XL_EN, ctrl8_xl::FASTSETTL_MODE_XL, ctrl8_xl::HP_REF_MODE_XL],
    ),
    (register::CTRL9_XL, &[ctrl9_xl::DEN_LH, ctrl9_xl::DEN_XL_G]),
];

/// Returns the bits of `value` that are not simulated.
fn not_simulated(address: u8, value: u8) -> u8 {
    let fields = NOT_SIMULATED.iter().find(|(r, _)| r.address == address);
    let fields = fields.map_or(&[][..], |(_, fields)| fields);
    fields.iter().fold(0, |bits, field| bits | field.mask()) & value
}

/// Largest number of recorded violations; later ones are dropped.
const MAX_VIOLATIONS: usize = 256;

/// A register bank without a description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bank {
    EmbeddedFunctions,
    SensorHub,
}

/// Values of the registers.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    values: [u8; 128],
    /// The other banks: values written, without effect.
    others: [[u8; 128]; 2],
    described: [Option<Register>; 128],
    violations: Vec<Violation>,
}

impl Memory {
    pub(super) fn new() -> Self {
        let mut described = [None; 128];
        for register in register::ALL {
            described[usize::from(register.address)] = Some(*register);
        }
        let mut memory =
            Self { values: [0; 128], others: [[0; 128]; 2], described, violations: Vec::new() };
        memory.reset();
        memory
    }

    pub(super) fn reset(&mut self) {
        self.values = self.described.map(|register| register.map_or(0, |register| register.reset));
        self.others = [[0; 128]; 2];
    }

    pub(super) fn read(&self, address: u8) -> u8 {
        self.values[usize::from(address & 0x7F)]
    }

    pub(super) fn read_other(&self, bank: Bank, address: u8) -> u8 {
        self.others[bank as usize][usize::from(address & 0x7F)]
    }

    pub(super) fn write_other(&mut self, bank: Bank, address: u8, value: u8) {
        self.others[bank as usize][usize::from(address & 0x7F)] = value;
    }

    pub(super) fn get(&self, register: Register) -> u8 {
        self.read(register.address)
    }

    /// Writes the writable bits.
    pub(super) fn write(&mut self, address: u8, value: u8) {
        let violation = match self.described[usize::from(address & 0x7F)] {
            None => Some(Violation::WroteUnknown { address, value }),
            Some(register) if register.access == Access::ReadOnly => {
                Some(Violation::WroteReadOnly { address, value })
            }
            Some(register) => {
                self.put(register, (value & register.mask) | (register.reset & !register.mask));
                let bits = not_simulated(address, value);
                if !register.keeps_reserved_bits(value) {
                    Some(Violation::ChangedReservedBits { address, value })
                } else if bits != 0 {
                    Some(Violation::NotSimulated { address, bits })
                } else {
                    None
                }
            }
        };
        if let Some(violation) = violation
            && self.violations.len() < MAX_VIOLATIONS
        {
            self.violations.push(violation);
        }
    }

    /// Sets a register to any value.
    pub(super) fn put(&mut self, register: Register, value: u8) {
        self.force(register.address, value);
    }

    /// Sets the register at an address to any value.
    pub(super) fn force(&mut self, address: u8, value: u8) {
        self.values[usize::from(address & 0x7F)] = value;
    }

    pub(super) fn violations(&self) -> &[Violation] {
        &self.violations
    }
}

/// Handling of a new value while a word is half read, as set by `BDU`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Update {
    /// The outputs take it at once.
    Continuous,
    /// The update waits until the other half has been read.
    Blocked,
}

/// One 16-bit output.
#[derive(Clone, Copy, Debug, Default)]
struct Word {
    value: i16,
    /// The byte that has been read while the other has not: 0 low, 1 high.
    half_read: Option<u8>,
}

impl Word {
    const fn update(&mut self, value: i16, update: Update) {
        match (update, self.half_read) {
            (Update::Blocked, Some(_)) => {}
            _ => self.value = value,
        }
    }

    fn read(&mut self, half: u8) -> u8 {
        self.half_read = match self.half_read {
            Some(other) if other != half => None,
            _ => Some(half),
        };
        self.value.to_le_bytes()[usize::from(half)]
    }
}

/// The output registers, from `OUT_TEMP_L` to `OUTZ_H_A`, and their data-ready flags.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Words {
    words: [Word; 7],
    pub(super) accel_fresh: bool,
    pub(super) gyro_fresh: bool,
    pub(super) temperature_fresh: bool,
}

impl Words {
    pub(super) fn update_temperature(&mut self, code: i16, update: Update) {
        self.words[0].update(code, update);
        self.temperature_fresh = true;
    }

    pub(super) fn update_gyro(&mut self, codes: Option<[i16; 3]>, update: Update) {
        update_all(&mut self.words[1..4], codes, update);
        self.gyro_fresh = true;
    }

    pub(super) fn update_accel(&mut self, codes: Option<[i16; 3]>, update: Update) {
        update_all(&mut self.words[4..7], codes, update);
        self.accel_fresh = true;
    }

    pub(super) fn status(&self) -> u8 {
        status_reg::XLDA.place(u8::from(self.accel_fresh))
            | status_reg::GDA.place(u8::from(self.gyro_fresh))
            | status_reg::TDA.place(u8::from(self.temperature_fresh))
    }

    /// Reads a byte of an output; reading a high byte clears its sample's data-ready flag.
    pub(super) fn read(&mut self, offset: u8) -> u8 {
        let (word, half) = (offset / 2, offset % 2);
        if half == 1 {
            match word {
                0 => self.temperature_fresh = false,
                1..=3 => self.gyro_fresh = false,
                _ => self.accel_fresh = false,
            }
        }
        self.words[usize::from(word)].read(half)
    }
}

fn update_all(words: &mut [Word], codes: Option<[i16; 3]>, update: Update) {
    for (word, code) in words.iter_mut().zip(codes.into_iter().flatten()) {
        word.update(code, update);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_bits_keep_their_value_and_writes_are_recorded() {
        let mut memory = Memory::new();
        memory.write(0x10, 0xFF);
        assert_eq!(memory.read(0x10), 0xFE);
        memory.write(0x02, 0x40);
        assert_eq!(memory.read(0x02), 0x7F);
        let noted = |address, value| Violation::ChangedReservedBits { address, value };
        assert_eq!(memory.violations(), [noted(0x10, 0xFF), noted(0x02, 0x40)]);
    }

    #[test]
    fn unsimulated_bits_are_stored_and_recorded() {
        let mut memory = Memory::new();
        memory.write(register::CTRL7_G.address, 0x40);
        memory.write(register::CTRL5_C.address, 0x05);
        assert_eq!(memory.get(register::CTRL7_G), 0x40);
        assert_eq!(memory.violations(), [Violation::NotSimulated { address: 0x16, bits: 0x40 }]);
    }

    #[test]
    fn read_only_register_does_not_change() {
        let mut memory = Memory::new();
        memory.write(0x0F, 0x00);
        assert_eq!(memory.read(0x0F), 0x6C);
        memory.write(0x50, 1);
        assert_eq!(
            memory.violations(),
            [
                Violation::WroteReadOnly { address: 0x0F, value: 0 },
                Violation::WroteUnknown { address: 0x50, value: 1 }
            ]
        );
    }

    #[test]
    fn blocked_output_waits_until_its_other_half_is_read() {
        for [first, second] in [[0, 1], [1, 0]] {
            let mut word = Word::default();
            let bytes =
                |value: i16| [first, second].map(|half| value.to_le_bytes()[usize::from(half)]);
            word.update(0x0102, Update::Blocked);
            assert_eq!([word.read(first), word.read(first)], [bytes(0x0102)[0]; 2]);
            word.update(0x0304, Update::Blocked);
            assert_eq!(word.read(second), bytes(0x0102)[1]);
            word.update(0x0506, Update::Blocked);
            assert_eq!([word.read(first), word.read(second)], bytes(0x0506));
        }
    }
}
