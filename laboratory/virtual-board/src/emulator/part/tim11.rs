//! TIM11 as a measure of the crystal: channel 1 captures edges of `HSE_RTC`, the crystal's divided clock
//! (RM0090, 7.2.11 and 19.5). No other use of it is modelled.

use super::unknown;

const CR1: u32 = 0x00;
const SR: u32 = 0x10;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CCR1: u32 = 0x34;
const OR: u32 = 0x50;

/// Flags of a capture, and of one that was not read before the next.
const CC1IF: u32 = 1 << 1;
const CC1OF: u32 = 1 << 9;

/// Value of OR that connects channel 1 to `HSE_RTC`.
const TO_CRYSTAL: u32 = 0b10;

/// The registers.
#[derive(Clone, Debug, Default)]
pub struct Tim11 {
    mode: u32,
    enable: u32,
    option: u32,
    /// Time of the start of the counter.
    started: Option<u64>,
    /// Captures up to the last that was read.
    taken: u64,
}

impl Tim11 {
    /// Period of the captures, if the channel is set up, at a period of `HSE_RTC`.
    fn capture_period(&self, input: Option<u64>) -> Option<u64> {
        let is_set = self.mode & 0b11 == 1 && self.enable & 1 == 1 && self.option == TO_CRYSTAL;
        let edges = 1 << (self.mode >> 2 & 0b11);
        input.filter(|_| is_set).map(|period| period * edges)
    }

    /// Reads a register, with the periods of its clock and of `HSE_RTC`.
    ///
    /// # Errors
    /// If the register is not modelled.
    pub fn read(
        &mut self,
        offset: u32,
        now: u64,
        clock: u64,
        input: Option<u64>,
    ) -> Result<u32, String> {
        let period = self.capture_period(input);
        let elapsed = self.started.map_or(0, |started| now - started);
        let captures = period.map_or(self.taken, |period| elapsed / period);
        Ok(match offset {
            CR1 => u32::from(self.started.is_some()),
            SR => match captures.saturating_sub(self.taken) {
                0 => 0,
                1 => CC1IF,
                _ => CC1IF | CC1OF,
            },
            CCMR1 => self.mode,
            CCER => self.enable,
            CCR1 => {
                self.taken = captures;
                let counts = period.map_or(0, |period| captures * period / clock);
                counts as u32 & 0xFFFF
            }
            OR => self.option,
            _ => return unknown("TIM11", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register is not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        match offset {
            CR1 => self.started = (value & 1 == 1).then(|| self.started.unwrap_or(now)),
            CCMR1 => self.mode = value,
            CCER => self.enable = value,
            OR => self.option = value,
            _ => return unknown("TIM11", offset),
        }
        Ok(())
    }
}
