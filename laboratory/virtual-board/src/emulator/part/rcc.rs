//! Reset and clock control: oscillators, PLL, prescalers, enables, and the cause of the last reset.

use super::unknown;
use crate::emulator::corner::Corner;
use crate::emulator::time::{self, from_us};

samples::named! {
    /// Cause of a reset.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ResetCause {
        /// Power-on.
        PowerOn = "power-up",
        /// Dip of the supply.
        BrownOut = "a brown-out",
        /// Request by the program.
        Software = "its program",
        /// Watchdog.
        Watchdog = "the watchdog",
        /// Reset pin.
        Pin = "its pin",
    }
}

impl ResetCause {
    /// Flags of `RCC_CSR`; every reset also pulls the pin.
    const fn flags(self) -> u32 {
        const PIN: u32 = 1 << 26;
        match self {
            Self::PowerOn => PIN | 1 << 27 | 1 << 25,
            Self::BrownOut => PIN | 1 << 25,
            Self::Software => PIN | 1 << 28,
            Self::Watchdog => PIN | 1 << 29,
            Self::Pin => PIN,
        }
    }
}

/// The clocks, hertz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockTree {
    /// Clock of core, memory and DMA.
    pub hclk: u32,
    /// Clock of the peripherals on APB1.
    pub pclk1: u32,
    /// Clock of the peripherals on APB2.
    pub pclk2: u32,
    /// Clock of the timers on APB1.
    pub timers1: u32,
    /// Clock of the timers on APB2.
    pub timers2: u32,
}

impl ClockTree {
    /// All clocks at the internal oscillator's frequency.
    const fn reset(corner: Corner) -> Self {
        let hsi = corner.hsi_hz();
        Self { hclk: hsi, pclk1: hsi, pclk2: hsi, timers1: hsi, timers2: hsi }
    }
}

/// The registers.
#[derive(Clone, Debug)]
pub struct Rcc {
    registers: [u32; 35],
    /// Current clocks.
    pub(crate) clocks: ClockTree,
    /// Frequency of the crystal, Hz; `None` if it does not start.
    pub crystal: Option<u32>,
    /// Whether the crystal's divided clock reaches the timer that measures it.
    pub is_measurable: bool,
    corner: Corner,
    /// Whether the crystal has stopped after it ran.
    lost: bool,
    /// Whether the core's clock has stopped, so that only the watchdog continues.
    pub(crate) stopped: bool,
    hse_ready_at: u64,
    pll_ready_at: u64,
    lsi_ready_at: u64,
    flags: u32,
}

const CR: usize = 0;
const PLLCFGR: usize = 1;
const CFGR: usize = 2;
const CIR: usize = 3;
const BDCR: usize = 0x70 / 4;
const CSR: usize = 0x74 / 4;

/// Clock for which flash needs another wait state at 2.7 V and above, Hz (table 10).
pub const HERTZ_A_STATE: u32 = 30_000_000;

/// Bit in CR: the clock security system is on.
const CSSON: u32 = 1 << 19;

/// Bit in CIR: the crystal has failed. Cleared by writing a one to the bit 16 positions higher.
const CSSF: u32 = 1 << 7;

/// Reserved on this part; HALs for its siblings write a zero there.
const DCKCFGR: u32 = 0x8C;

impl Rcc {
    /// Creates the state after power-on, with or without a crystal.
    #[must_use]
    pub fn new(crystal: Option<u32>, corner: Corner) -> Self {
        let mut registers = [0; 35];
        for (register, value) in [
            (0x00, 0x81),
            (0x04, 0x2400_3010),
            (0x30, 0x0010_0000),
            (0x50, 0x7E67_91FF),
            (0x54, 0xF1),
            (0x58, 1),
            (0x60, 0x36FE_C9FF),
            (0x64, 0x0007_5F33),
            (0x84, 0x2400_3000),
        ] {
            registers[register / 4] = value;
        }
        Self {
            registers,
            clocks: ClockTree::reset(corner),
            crystal,
            is_measurable: true,
            corner,
            lost: false,
            stopped: false,
            hse_ready_at: time::NEVER,
            pll_ready_at: time::NEVER,
            lsi_ready_at: time::NEVER,
            flags: ResetCause::PowerOn.flags(),
        }
    }

    /// Resets the registers for a cause.
    pub fn reset(&mut self, cause: ResetCause) {
        let backup = self.registers[BDCR];
        *self = Self {
            is_measurable: self.is_measurable,
            lost: self.lost,
            flags: self.flags | cause.flags(),
            ..Self::new(self.crystal, self.corner)
        };
        self.registers[BDCR] = backup;
    }

    /// Returns whether the crystal drives the PLL.
    const fn pll_is_from_crystal(&self) -> bool {
        self.registers[PLLCFGR] & 1 << 22 != 0
    }

    /// Period of `HSE_RTC`, the crystal's clock divided by `RTCPRE`, while both run.
    #[must_use]
    pub fn hse_rtc(&self, now: u64) -> Option<u64> {
        let divider = self.registers[CFGR] >> 16 & 0x1F;
        let runs = self.is_measurable && now >= self.hse_ready_at && divider >= 2;
        let crystal = self.crystal.filter(|_| runs)?;
        Some(u64::from(divider) * time::cycle(crystal))
    }

    /// Returns whether the clock of a peripheral is enabled, by register offset and bit.
    #[must_use]
    pub const fn is_enabled(&self, register: u32, bit: u32) -> bool {
        self.registers[register as usize / 4] & 1 << bit != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&self, offset: u32, now: u64) -> Result<u32, String> {
        let index = offset as usize / 4;
        let Some(&value) = self.registers.get(index) else {
            return match offset {
                DCKCFGR => Ok(0),
                _ => unknown("RCC", offset),
            };
        };
        let ready = |at: u64, bit: u32| u32::from(now >= at) << bit;
        Ok(match index {
            CR => {
                value & !(1 << 17 | 1 << 25 | 1 << 1)
                    | (value & 1) << 1
                    | ready(self.hse_ready_at, 17)
                    | ready(self.pll_ready_at, 25)
            }
            CSR => value & 1 | ready(self.lsi_ready_at, 1) | self.flags,
            _ => value,
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or the clock would exceed its limits.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        wait_states: u32,
    ) -> Result<(), String> {
        let index = offset as usize / 4;
        if offset == DCKCFGR && value == 0 {
            return Ok(());
        }
        if index >= self.registers.len() {
            return unknown("RCC", offset);
        }
        let old = self.registers[index];
        self.registers[index] = value;
        match index {
            CR => {
                let turned =
                    |bit: u32| (value & !old & 1 << bit != 0, old & !value & 1 << bit != 0);
                match turned(16) {
                    (true, _) if self.crystal.is_some() => {
                        self.hse_ready_at = now + from_us(self.corner.crystal_start_us().into());
                    }
                    (_, true) => self.hse_ready_at = time::NEVER,
                    _ => {}
                }
                match turned(24) {
                    // With a stopped crystal the PLL never locks.
                    (true, _) if self.lost && self.pll_is_from_crystal() => {}
                    (true, _) => {
                        self.check_pll(now)?;
                        self.pll_ready_at = now + from_us(self.corner.pll_lock_us().into());
                    }
                    (_, true) => self.pll_ready_at = time::NEVER,
                    _ => {}
                }
            }
            PLLCFGR if old != value && self.registers[CR] & 1 << 24 != 0 => {
                return Err("the PLL is set while it runs".into());
            }
            CFGR => {
                self.registers[CFGR] = value & !0xC | (value & 3) << 2;
                self.update_clocks(now, wait_states)?;
            }
            CIR => {
                let cleared = value >> 16 & CSSF;
                self.registers[CIR] = value & 0x7F00 | old & CSSF & !cleared;
            }
            CSR => {
                if value & 1 << 24 != 0 {
                    self.flags = 0;
                }
                self.registers[CSR] = value & 1;
                match (old & 1, value & 1) {
                    (_, 0) => self.lsi_ready_at = time::NEVER,
                    (0, _) => self.lsi_ready_at = now + from_us(self.corner.lsi_start_us().into()),
                    _ => {}
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Stops the crystal permanently. With the clock security system on, the system continues with the internal
    /// oscillator (RM0090, 7.2.7). Otherwise a core that ran on the crystal stops until the watchdog resets it. Returns
    /// whether the internal oscillator took over and an NMI is due.
    ///
    /// # Errors
    /// If flash is too slow for the internal oscillator.
    pub fn lose_crystal(&mut self, now: u64, wait_states: u32) -> Result<bool, String> {
        self.crystal = None;
        let ready_at = core::mem::replace(&mut self.hse_ready_at, time::NEVER);
        if now < ready_at {
            return Ok(false);
        }
        self.lost = true;
        let in_use = match self.registers[CFGR] & 3 {
            0 => false,
            1 => true,
            _ => self.pll_is_from_crystal(),
        };
        if self.pll_is_from_crystal() {
            self.pll_ready_at = time::NEVER;
        }
        if self.registers[CR] & CSSON == 0 {
            self.stopped = in_use;
            return Ok(false);
        }
        self.registers[CR] &= !(1 << 16);
        if self.pll_is_from_crystal() {
            self.registers[CR] &= !(1 << 24);
        }
        self.registers[CFGR] &= !0xF;
        self.registers[CIR] |= CSSF;
        self.update_clocks(now, wait_states)?;
        Ok(true)
    }

    fn pll_input(&self, now: u64) -> Result<u32, String> {
        let pll = self.registers[PLLCFGR];
        let source = if pll & 1 << 22 == 0 {
            self.corner.hsi_hz()
        } else if now >= self.hse_ready_at {
            self.crystal.unwrap_or(self.corner.hsi_hz())
        } else {
            return Err("the PLL is started from a crystal that is not ready".into());
        };
        Ok(source / (pll & 0x3F).max(1))
    }

    fn check_pll(&self, now: u64) -> Result<(), String> {
        let input = self.pll_input(now)?;
        let multiplier = self.registers[PLLCFGR] >> 6 & 0x1FF;
        let vco = u64::from(input) * u64::from(multiplier);
        if !(950_000..=2_100_000).contains(&input) || !(100_000_000..=432_000_000).contains(&vco) {
            return Err(format!("the PLL's input is {input} Hz and its oscillator {vco} Hz"));
        }
        Ok(())
    }

    fn update_clocks(&mut self, now: u64, wait_states: u32) -> Result<(), String> {
        let configuration = self.registers[CFGR];
        let system = match configuration & 3 {
            0 => self.corner.hsi_hz(),
            1 if now >= self.hse_ready_at => self.crystal.unwrap_or(self.corner.hsi_hz()),
            2 if now >= self.pll_ready_at => {
                let pll = self.registers[PLLCFGR];
                self.pll_input(now)? * (pll >> 6 & 0x1FF) / (2 * (pll >> 16 & 3) + 2)
            }
            _ => return Err("the clock is switched to a source that is not ready".into()),
        };
        let ahb = match configuration >> 4 & 0xF {
            shift @ 8..=11 => shift - 7,
            // The division by 32 does not exist.
            shift @ 12..=15 => shift - 6,
            _ => 0,
        };
        let apb = |field: u32| if field & 4 == 0 { 0 } else { (field & 3) + 1 };
        let (apb1, apb2) = (apb(configuration >> 10 & 7), apb(configuration >> 13 & 7));
        let hclk = system >> ahb;
        let timer = |shift: u32| match shift {
            0 => hclk,
            _ => (hclk >> shift) * 2,
        };
        self.clocks = ClockTree {
            hclk,
            pclk1: hclk >> apb1,
            pclk2: hclk >> apb2,
            timers1: timer(apb1),
            timers2: timer(apb2),
        };
        let ClockTree { pclk1, pclk2, .. } = self.clocks;
        if hclk > 168_000_000 || pclk1 > 42_000_000 || pclk2 > 84_000_000 {
            return Err(format!("clocks beyond their limits: {:?}", self.clocks));
        }
        self.check_wait_states(wait_states, HERTZ_A_STATE)
    }

    /// Checks that flash is fast enough for the clock, with another wait state for each `hertz_a_state` (table 10).
    ///
    /// # Errors
    /// If there are too few wait states.
    pub fn check_wait_states(&self, wait_states: u32, hertz_a_state: u32) -> Result<(), String> {
        let needed = self.clocks.hclk.div_ceil(hertz_a_state) - 1;
        if wait_states < needed {
            return Err(format!(
                "{wait_states} wait states of flash at {} Hz; {needed} are needed",
                self.clocks.hclk
            ));
        }
        Ok(())
    }
}
