//! The system control block: fault status, handlers and their enables (ARMv7-M, B3.2).

use super::nvic::{Nvic, exception};

/// Bits of the fault status register `CFSR`.
pub mod cfsr {
    /// The bus refused a fetch.
    pub const IBUSERR: u32 = 1 << 8;
    /// The bus refused a load, at a known instruction.
    pub const PRECISERR: u32 = 1 << 9;
    /// The bus refused a store, reported later.
    pub const IMPRECISERR: u32 = 1 << 10;
    /// The frame of an exception could not be written.
    pub const STKERR: u32 = 1 << 12;
    /// The frame to return to could not be read.
    pub const UNSTKERR: u32 = 1 << 11;
    /// `BFAR` holds the address.
    pub const BFARVALID: u32 = 1 << 15;
    /// Undefined instruction.
    pub const UNDEFINSTR: u32 = 1 << 16;
    /// The processor is not in Thumb state.
    pub const INVSTATE: u32 = 1 << 17;
    /// A return matches no active exception.
    pub const INVPC: u32 = 1 << 18;
    /// The floating-point unit is off.
    pub const NOCP: u32 = 1 << 19;
    /// An unaligned access where alignment is required.
    pub const UNALIGNED: u32 = 1 << 24;
}

/// `HFSR`: a fault that became a hard fault.
pub const FORCED: u32 = 1 << 30;
/// `HFSR`: the vector could not be read.
pub const VECTTBL: u32 = 1 << 1;

/// The registers. `default` is all zeros; the state after reset is [`new`](Self::new).
#[derive(Clone, Debug, Default)]
pub struct Scb {
    /// Vector table; 0 is the start of flash.
    pub vtor: u32,
    /// Configuration and control.
    pub ccr: u32,
    /// System control: sleep.
    pub scr: u32,
    /// Fault status.
    pub cfsr: u32,
    /// Hard fault status.
    pub hfsr: u32,
    /// Address of a bus fault.
    pub bfar: u32,
    /// Coprocessor access.
    pub cpacr: u32,
    /// Floating-point context control.
    pub fpccr: u32,
    shcsr: u32,
    group: u8,
}

impl Scb {
    /// Creates the state after reset.
    #[must_use]
    pub fn new() -> Self {
        Self { ccr: 0x200, fpccr: 0xC000_0000, ..Self::default() }
    }

    /// Returns whether the floating-point unit is enabled.
    #[must_use]
    pub const fn float_is_on(&self) -> bool {
        self.cpacr & (0b11 << 20) != 0
    }

    /// Reads a word at an offset from `0xE000_E000`; `None` if nothing is modelled.
    #[must_use]
    pub fn read(&self, offset: u32, nvic: &Nvic, exception_number: u16) -> Option<u32> {
        Some(match offset {
            0xD00 => 0x410F_C241,
            0xD04 => {
                let pending = nvic.next.map_or(0, |(number, _)| u32::from(number));
                let bit = |number, bit: u32| u32::from(nvic.is_pending(number)) << bit;
                u32::from(exception_number)
                    | u32::from(nvic.active.len() < 2) << 11
                    | pending << 12
                    | u32::from(pending >= 16) << 22
                    | bit(exception::SYS_TICK, 26)
                    | bit(exception::PEND_SV, 28)
            }
            0xD08 => self.vtor,
            0xD0C => 0xFA05_0000 | u32::from(self.group) << 8,
            0xD10 => self.scr,
            0xD14 => self.ccr,
            0xD24 => {
                let active = |number| u32::from(nvic.active.contains(&number));
                self.shcsr
                    | active(exception::MEM_MANAGE)
                    | active(exception::BUS_FAULT) << 1
                    | active(exception::USAGE_FAULT) << 3
                    | active(exception::SV_CALL) << 7
                    | active(exception::PEND_SV) << 10
                    | active(exception::SYS_TICK) << 11
            }
            0xD28 => self.cfsr,
            0xD2C => self.hfsr,
            0xD30 | 0xD3C => 0,
            0xD34 | 0xD38 => self.bfar,
            0xD88 => self.cpacr,
            0xF34 => self.fpccr,
            _ => return None,
        })
    }

    /// Writes a word: `None` if nothing is modelled, `Some(true)` if it requests a reset.
    pub fn write(&mut self, offset: u32, value: u32, mask: u32, nvic: &mut Nvic) -> Option<bool> {
        let merged = |old: u32| old & !mask | value & mask;
        match offset {
            0xD04 => {
                use exception::{NMI, PEND_SV, SYS_TICK};
                let is_set = |bit: u32| value & mask & 1 << bit != 0;
                for (bit, number) in [(31, NMI), (28, PEND_SV), (26, SYS_TICK)] {
                    if is_set(bit) {
                        nvic.pend(number);
                    }
                }
                for (bit, number) in [(27, PEND_SV), (25, SYS_TICK)] {
                    if is_set(bit) {
                        nvic.unpend(number);
                    }
                }
            }
            0xD08 => self.vtor = merged(self.vtor) & 0xFFFF_FF80,
            0xD0C if value >> 16 == 0x05FA => {
                self.group = (value >> 8 & 7) as u8;
                nvic.set_group(self.group);
                return Some(value & 1 << 2 != 0);
            }
            0xD0C => {}
            0xD10 => self.scr = merged(self.scr),
            // The engine traps neither divisions by zero nor unaligned accesses.
            0xD14 if merged(self.ccr) & 0x18 != 0 => return None,
            0xD14 => self.ccr = merged(self.ccr),
            0xD18..=0xD20 => {
                nvic.write_priority_registers(4 + (offset - 0xD18) as usize, value, mask);
            }
            0xD24 => {
                self.shcsr = merged(self.shcsr) & (0b111 << 16);
                for (bit, number) in [
                    (16, exception::MEM_MANAGE),
                    (17, exception::BUS_FAULT),
                    (18, exception::USAGE_FAULT),
                ] {
                    nvic.enable(number, self.shcsr & 1 << bit != 0);
                }
            }
            0xD28 => self.cfsr &= !(value & mask),
            0xD2C => self.hfsr &= !(value & mask),
            0xD88 => self.cpacr = merged(self.cpacr) & 0x00F0_0000,
            0xF34 => self.fpccr = merged(self.fpccr),
            _ => return None,
        }
        Some(false)
    }
}
