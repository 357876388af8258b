//! Analogue-to-digital converter: regular conversions of one channel, started by software, once or continuously.
//! Channel 17 is the internal reference.

use super::unknown;
use crate::emulator::time::{NEVER, cycle, from_us};

// Offsets of the registers (RM0090, 13.13).
const SR: u32 = 0x00;
const CR1: u32 = 0x04;
const CR2: u32 = 0x08;
const SMPR1: u32 = 0x0C;
const SMPR2: u32 = 0x10;
const JOFR1: u32 = 0x14;
const LTR: u32 = 0x28;
const SQR1: u32 = 0x2C;
const SQR3: u32 = 0x34;
const JSQR: u32 = 0x38;
const JDR4: u32 = 0x48;
const DR: u32 = 0x4C;
const CSR: u32 = 0x300;
const CCR: u32 = 0x304;

// Bits of SR, CR1 and CR2.
const EOC: u32 = 1 << 1;
const STRT: u32 = 1 << 4;
const EOCIE: u32 = 1 << 5;
const ADON: u32 = 1;
const CONT: u32 = 1 << 1;
const SWSTART: u32 = 1 << 30;

/// In the common register: the internal reference is connected.
const TSVREFE: u32 = 1 << 23;

/// Channel of the internal reference.
const REFERENCE: usize = 17;

/// Voltage of the internal reference, mV (DS8626, embedded internal reference voltage, typical).
const REFERENCE_MV: u32 = 1_210;

/// Least time for which it must be sampled, µs.
const REFERENCE_SAMPLING_US: u64 = 10;

/// Code of the internal reference at a supply.
#[must_use]
pub const fn reference_code(supply_mv: u32) -> u16 {
    (REFERENCE_MV * 4_095 / supply_mv) as u16
}

/// The registers. `default` is all zeros; the state after reset is [`new`](Self::new).
#[derive(Clone, Debug, Default)]
pub struct Adc {
    status: u32,
    control: [u32; 2],
    sampling: [u32; 2],
    others: [u32; 6],
    sequence: [u32; 3],
    data: u32,
    common: u32,
    done_at: u64,
    conversion: u64,
    /// Code of each channel's input.
    pub inputs: [u16; 19],
}

impl Adc {
    /// Creates the state after power-on, with all inputs at 0.
    #[must_use]
    pub fn new() -> Self {
        Self {
            others: [0, 0, 0, 0, 0xFFF, 0],
            done_at: NEVER,
            conversion: NEVER,
            ..Self::default()
        }
    }

    /// Resets the registers, but not the inputs.
    pub fn reset(&mut self) {
        *self = Self { inputs: self.inputs, ..Self::new() };
    }

    /// Sets the supply, to which all codes refer. Other inputs are given as codes.
    pub const fn set_supply(&mut self, mv: u32) {
        self.inputs[REFERENCE] = reference_code(mv);
    }

    fn channel(&self) -> usize {
        (self.sequence[2] & 0x1F).min(18) as usize
    }

    /// Advances to `now`.
    pub fn advance(&mut self, now: u64) {
        if now < self.done_at {
            return;
        }
        if self.control[1] & CONT == 0 {
            self.done_at = NEVER;
        } else {
            self.done_at += ((now - self.done_at) / self.conversion + 1) * self.conversion;
        }
        self.data = u32::from(self.inputs[self.channel()]) & 0xFFF;
        self.status |= EOC;
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&mut self, offset: u32, now: u64) -> Result<u32, String> {
        self.advance(now);
        Ok(match offset {
            SR => self.status,
            CR1 => self.control[0],
            CR2 => self.control[1],
            SMPR1 => self.sampling[0],
            SMPR2 => self.sampling[1],
            JOFR1..=LTR => self.others[(offset - JOFR1) as usize / 4],
            SQR1..=SQR3 => self.sequence[(offset - SQR1) as usize / 4],
            JSQR..=JDR4 => 0,
            DR => {
                self.status &= !EOC;
                self.data
            }
            CSR => self.status,
            CCR => self.common,
            _ => return unknown("ADC", offset),
        })
    }

    /// Writes a register; the converter is clocked by a bus of `pclk` hertz.
    ///
    /// # Errors
    /// If the register does not exist, or the setting is not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, pclk: u32) -> Result<(), String> {
        self.advance(now);
        match offset {
            SR => self.status &= value | !0x3F,
            CR1 if value & EOCIE != 0 => {
                return Err("interrupts of the converter are not modelled".into());
            }
            CR1 => self.control[0] = value,
            CR2 => {
                if value & (1 << 8 | 1 << 22) != 0 {
                    return Err("injected and DMA conversions are not modelled".into());
                }
                self.control[1] = value & !SWSTART;
                if value & SWSTART != 0 {
                    self.start(now, pclk)?;
                }
            }
            SMPR1 => self.sampling[0] = value,
            SMPR2 => self.sampling[1] = value,
            JOFR1..=LTR => self.others[(offset - JOFR1) as usize / 4] = value,
            SQR1..=SQR3 => self.sequence[(offset - SQR1) as usize / 4] = value,
            JSQR => {}
            CCR => self.common = value,
            _ => return unknown("ADC", offset),
        }
        Ok(())
    }

    fn start(&mut self, now: u64, pclk: u32) -> Result<(), String> {
        if self.control[1] & ADON == 0 {
            return Err("a conversion is started while the converter is off".into());
        }
        if self.sequence[0] >> 20 & 0xF != 0 {
            return Err("a sequence of conversions is not modelled".into());
        }
        let clock = pclk / (2 * ((self.common >> 16 & 3) + 1));
        if clock > 36_000_000 {
            return Err(format!("the converter's clock is {clock} Hz"));
        }
        let channel = self.channel() as u32;
        let field = match channel {
            ..10 => self.sampling[1] >> (3 * channel) & 7,
            _ => self.sampling[0] >> (3 * (channel - 10)) & 7,
        };
        let sampling = [3, 15, 28, 56, 84, 112, 144, 480][field as usize];
        if self.channel() == REFERENCE {
            if self.common & TSVREFE == 0 {
                return Err("the internal reference is converted while it is off".into());
            }
            if sampling * cycle(clock) < from_us(REFERENCE_SAMPLING_US) {
                return Err("the internal reference is sampled for less than 10 µs".into());
            }
        }
        self.status |= STRT;
        self.conversion = cycle(clock) * (sampling + 12);
        self.done_at = now + self.conversion;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PCLK: u32 = 80_000_000;

    /// Converts the reference with these settings: the code 30 µs later.
    fn convert(common: u32, sampling: u32, supply_mv: u32) -> Result<u32, String> {
        let mut adc = Adc::new();
        adc.set_supply(supply_mv);
        // A clock of 20 MHz.
        for (offset, value) in [
            (CCR, common | 1 << 16),
            (SMPR1, sampling << 21),
            (SQR3, 17),
            (CR2, ADON),
            (CR2, ADON | SWSTART),
        ] {
            adc.write(offset, value, 0, PCLK)?;
        }
        adc.read(DR, from_us(30))
    }

    #[test]
    fn code_of_the_reference_follows_the_supply() {
        assert_eq!(convert(TSVREFE, 7, 3_300), Ok(1_501));
        assert_eq!(convert(TSVREFE, 7, 3_000), Ok(1_651));
    }

    #[test]
    fn reference_that_is_off_or_sampled_briefly_fails_the_run() {
        assert!(convert(0, 7, 3_300).is_err_and(|what| what.contains("while it is off")));
        // 144 cycles are 7.2 µs.
        assert!(convert(TSVREFE, 6, 3_300).is_err_and(|what| what.contains("10 µs")));
    }
}
