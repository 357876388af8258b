//! Power control: the regulator's scale, the write protection of the backup domain, and the supply detector.

use super::unknown;
use crate::emulator::time::from_us;

/// The registers.
#[derive(Clone, Debug)]
pub struct Pwr {
    control: u32,
    status: u32,
    /// Time from which the supply detector has settled.
    settled_at: u64,
}

impl Default for Pwr {
    fn default() -> Self {
        Self { control: 0x4000, status: 0, settled_at: 0 }
    }
}

/// Thresholds of the supply detector, by `PLS`, mV (RM0090, 5.4.1).
const THRESHOLDS_MV: [u32; 8] = [2_000, 2_100, 2_300, 2_500, 2_600, 2_700, 2_800, 2_900];

/// Time that the supply detector takes to settle (assumed: no data sheet has it).
const SETTLING: u64 = from_us(100);

impl Pwr {
    const VOSRDY: u32 = 1 << 14;
    const PVDO: u32 = 1 << 2;
    const PVDE: u32 = 1 << 4;

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist, or the supply detector has not settled.
    pub fn read(&self, offset: u32, supply_mv: u32, now: u64) -> Result<u32, String> {
        match offset {
            0 => Ok(self.control),
            4 if self.control & Self::PVDE != 0 && now < self.settled_at => {
                Err("the supply detector is read before it has settled".into())
            }
            4 => {
                let threshold = THRESHOLDS_MV[(self.control >> 5 & 7) as usize];
                let is_low = self.control & Self::PVDE != 0 && supply_mv < threshold;
                Ok(self.status | Self::VOSRDY | if is_low { Self::PVDO } else { 0 })
            }
            _ => unknown("PWR", offset),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), String> {
        match offset {
            // Clear bits read as zero.
            0 => {
                if value & !self.control & Self::PVDE != 0 {
                    self.settled_at = now + SETTLING;
                }
                self.control = value & !0xC;
            }
            4 => self.status = value & 0x300,
            _ => return unknown("PWR", offset),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_supply_detector_reports_its_threshold() {
        let mut pwr = Pwr::default();
        let low = |pwr: &Pwr, mv| pwr.read(4, mv, SETTLING).expect("a register") & Pwr::PVDO != 0;
        pwr.write(0, 5 << 5, 0).expect("a register");
        assert!(!low(&pwr, 2_000), "it is off");
        pwr.write(0, 5 << 5 | Pwr::PVDE, 0).expect("a register");
        assert!(pwr.read(4, 3_300, SETTLING - 1).is_err(), "too early");
        assert!(low(&pwr, 2_699) && !low(&pwr, 2_700));
    }
}
