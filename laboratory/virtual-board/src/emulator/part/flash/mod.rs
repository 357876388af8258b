//! The flash interface: wait states, locks, programming and erasing, option bytes.
//!
//! Code and constants are fetched from the same bank, so the core stops while it is busy.

pub mod accelerator;

use super::unknown;
use crate::emulator::corner::Corner;
use crate::emulator::memory::{FLASH, Memory, OPTIONS};
use crate::emulator::time::{NEVER, from_us};
use accelerator::Accelerator;

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

const OPTLOCK: u32 = 1;
const OPTSTRT: u32 = 1 << 1;

/// Factory settings of the option bytes: no protection, brown-out reset off, watchdog started by software.
const DELIVERED: u32 = 0x0FFF_AAEC;

/// Option bytes that were erased, and not programmed.
const BLANK: u32 = 0x0FFF_FFEC;

/// `nWRP` of the first sector.
const NWRP: u32 = 1 << 16;

/// Sectors that no program can change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Protection {
    /// No sector, as delivered.
    None,
    /// The sectors of the bootloader, as protected by the program at the first power-up of a board.
    #[default]
    Bootloader,
}

/// Progress of unlocking by keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Keys {
    #[default]
    None,
    First,
    /// A wrong key locks until the next reset.
    Wrong,
}

impl Keys {
    /// Processes a key. Returns whether it opens the lock.
    const fn take(&mut self, key: u32, [first, second]: [u32; 2]) -> bool {
        let before = core::mem::replace(self, Self::Wrong);
        match before {
            Self::None if key == first => *self = Self::First,
            Self::First if key == second => {
                *self = Self::None;
                return true;
            }
            _ => {}
        }
        false
    }
}

/// The registers. `default` is all zeros; the state after reset is [`new`](Self::new).
#[derive(Clone, Debug, Default)]
pub struct FlashRegisters {
    /// The accelerator between it and the core.
    pub accelerator: Accelerator,
    access: u32,
    status: u32,
    control: u32,
    keys: Keys,
    option_keys: Keys,
    /// Option register, and the option bytes as programmed.
    option_control: u32,
    options: u32,
    corner: Corner,
    /// The supply, mV.
    pub supply_mv: u32,
    /// Time of a reset that aborts an operation begun now.
    pub reset_at: u64,
    /// Number of program and erase operations.
    pub operations: u64,
    /// Number of erased sectors.
    pub erases: u64,
    /// Number of the operation in which the supply fails.
    pub cut_at: Option<u64>,
    /// Whether the supply has failed.
    pub cut: bool,
    /// Number of the operation that, if it programs, clears one more bit.
    pub worn_at: Option<u64>,
    /// Address of a word with a bad cell: each time it is programmed, one more bit is cleared.
    pub bad_cell: Option<u32>,
    /// Time to program the option bytes, ms; `None` for the time of the sector that holds them.
    pub option_bytes_ms: Option<u32>,
    /// Whether the flash keeps its option bytes and reports an error, instead of programming them.
    pub refuses_option_bytes: bool,
    /// Duration for which the core is stalled at its next access to a peripheral, in units of
    /// [`time`](crate::emulator::time).
    pub stall: u64,
    /// Range of changed addresses: the first, and the one after the last.
    pub(crate) changed: Option<(u32, u32)>,
}

impl FlashRegisters {
    /// Creates the state after power-on, on a chip with factory settings.
    #[must_use]
    pub fn new(corner: Corner) -> Self {
        Self {
            control: LOCK,
            option_control: DELIVERED | OPTLOCK,
            options: DELIVERED,
            corner,
            supply_mv: 3_300,
            reset_at: NEVER,
            ..Self::default()
        }
    }

    /// Returns this flash with a brown-out level in its option bytes.
    #[must_use]
    pub fn with_brown_out_level(mut self, level: u8) -> Self {
        self.options = self.options & !(3 << 2) | u32::from(3 - level.min(3)) << 2;
        self.option_control = self.options | OPTLOCK;
        self
    }

    /// This flash with write protection in its option bytes.
    #[must_use]
    pub const fn with_protection(mut self, protection: Protection) -> Self {
        self.options |= 3 * NWRP;
        if let Protection::Bootloader = protection {
            self.options &= !(3 * NWRP);
        }
        self.option_control = self.options | OPTLOCK;
        self
    }

    /// Option bytes as programmed, at their place in memory: those of the user and of readout protection in the first
    /// word, those of write protection in the third (RM0090, table 9).
    #[must_use]
    pub const fn option_bytes(&self) -> [u8; 10] {
        let [user, readout, low, high] = self.options.to_le_bytes();
        let high = high | 0xF0;
        [user, readout, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, low, high]
    }

    /// Write protection of sectors 0 to 11: a bit that is set protects.
    #[must_use]
    pub const fn protected_sectors(&self) -> u16 {
        !(self.options >> 16) as u16 & 0x0FFF
    }

    /// Returns whether a sector is protected, and then sets the error in the status.
    const fn is_protected(&mut self, sector: u32) -> bool {
        let is_protected = self.protected_sectors() >> sector & 1 != 0;
        if is_protected {
            self.status |= WRPERR;
        }
        is_protected
    }

    /// Resets the registers: locked, no wait states, caches empty.
    pub fn reset(&mut self) {
        self.accelerator.reset();
        self.access = 0;
        self.status = 0;
        self.control = LOCK;
        self.keys = Keys::None;
        self.option_keys = Keys::None;
        self.option_control = self.options | OPTLOCK;
        self.reset_at = NEVER;
        self.stall = 0;
    }

    /// Number of wait states.
    #[must_use]
    pub const fn wait_states(&self) -> u32 {
        self.access & 7
    }

    /// Returns whether lines of flash are read ahead.
    #[must_use]
    pub const fn prefetches(&self) -> bool {
        self.access & accelerator::PREFETCH != 0
    }

    /// Supply below which the option bytes reset the chip, mV; below 1.7 V it is always reset (DS8626, table 23,
    /// falling edge, typical).
    #[must_use]
    pub const fn brown_out_mv(&self) -> u32 {
        match self.options >> 2 & 3 {
            0 => 2_830,
            1 => 2_500,
            2 => 2_190,
            _ => 1_700,
        }
    }

    /// Returns whether the interrupt is requested.
    #[must_use]
    pub const fn interrupts(&self) -> bool {
        self.control & EOPIE != 0 && self.status & EOP != 0
            || self.control & ERRIE != 0 && self.status & 0xF2 != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// If the register does not exist.
    pub fn read(&self, offset: u32) -> Result<u32, String> {
        Ok(match offset {
            0x00 => self.access,
            0x04 | 0x08 => 0,
            0x0C => self.status,
            0x10 => self.control,
            0x14 => self.option_control,
            _ => return unknown("FLASH", offset),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// If the register does not exist, or the part would not act as requested.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        memory: &mut dyn Memory,
    ) -> Result<(), String> {
        match offset {
            0x00 => {
                self.access = value & 0x1F07 & !0x1800;
                self.accelerator.configure(value)?;
            }
            0x04 => {
                if self.keys.take(value, [0x4567_0123, 0xCDEF_89AB]) {
                    self.control &= !LOCK;
                }
            }
            0x08 => {
                if self.option_keys.take(value, [0x0819_2A3B, 0x4C5D_6E7F]) {
                    self.option_control &= !OPTLOCK;
                }
            }
            0x0C => self.status &= !(value & 0xF3),
            0x10 if self.control & LOCK != 0 => {}
            0x10 => {
                self.control = value & !STRT;
                if value & STRT != 0 {
                    self.erase(now, memory)?;
                }
            }
            0x14 if self.option_control & OPTLOCK != 0 => {}
            0x14 => {
                self.option_control = value & 0x0FFF_FFED;
                if value & OPTSTRT != 0 && self.refuses_option_bytes {
                    self.status |= WRPERR;
                } else if value & OPTSTRT != 0 {
                    self.check_supply()?;
                    let ms = self.option_bytes_ms.unwrap_or_else(|| self.erase_ms(16));
                    let cut = self.operate(now, from_us(u64::from(ms) * 1000));
                    // The option bytes are erased before they are programmed.
                    self.options = if cut { BLANK } else { value & 0x0FFF_FFEC };
                    memory.write(OPTIONS.start, &self.option_bytes());
                }
            }
            _ => return unknown("FLASH", offset),
        }
        Ok(())
    }

    const fn psize(&self) -> u32 {
        self.control >> 8 & 3
    }

    const fn erase_ms(&self, kib: u32) -> u32 {
        self.corner.erase_ms(kib, self.psize())
    }

    /// Checks the number of bits programmed at once against the supply (RM0090, table 7).
    fn check_supply(&self) -> Result<(), String> {
        let needed = match self.psize() {
            0 => 1_800,
            1 => 2_100,
            _ => 2_700,
        };
        let supply = self.supply_mv;
        if supply < needed {
            return Err(format!(
                "flash is changed at {supply} mV, and its parallelism needs {needed} mV"
            ));
        }
        Ok(())
    }

    /// Counts an operation of this length. Returns whether the supply or a reset aborts it.
    fn operate(&mut self, now: u64, length: u64) -> bool {
        self.operations += 1;
        self.accelerator.forget();
        if self.cut_at == Some(self.operations) {
            self.cut = true;
        }
        let broken_off = now.saturating_add(length) > self.reset_at;
        self.stall += if broken_off { self.reset_at.saturating_sub(now) } else { length };
        self.cut || broken_off
    }

    fn erase(&mut self, now: u64, memory: &mut dyn Memory) -> Result<(), String> {
        if self.control & MER != 0 || self.control & SER == 0 {
            self.status |= PGSERR;
            return Ok(());
        }
        let sector = self.control >> 3 & 0xF;
        if sector < 12 && self.is_protected(sector) {
            return Ok(());
        }
        self.check_supply()?;
        let bounds = SECTOR_STARTS.get(sector as usize..sector as usize + 2);
        let Some(&[start, end]) = bounds else {
            self.status |= WRPERR;
            return Ok(());
        };
        self.erases += 1;
        let size = end - start;
        let length = from_us(u64::from(self.erase_ms(size / 1024)) * 1000);
        let cut = self.operate(now, length);
        // If cut off half-way, the rest is unchanged.
        let erased = if cut { size / 2 } else { size };
        memory.write(FLASH.start + start, &vec![0xFF; erased as usize]);
        self.changed = Some((FLASH.start + start, FLASH.start + end));
        self.done();
        Ok(())
    }

    const fn done(&mut self) {
        if self.control & EOPIE != 0 {
            self.status |= EOP;
        }
    }

    /// Stores to flash.
    ///
    /// # Errors
    /// If flash is not unlocked for it.
    pub fn program(
        &mut self,
        address: u32,
        size: usize,
        value: u32,
        now: u64,
        memory: &mut dyn Memory,
    ) -> Result<(), String> {
        if self.control & LOCK != 0 || self.control & PG == 0 {
            self.status |= PGSERR;
            return Err("a store to flash that is locked or not set to be programmed".into());
        }
        if 1 << self.psize() != size {
            self.status |= PGPERR;
            return Err(format!("{size} bytes programmed at another parallelism"));
        }
        if self.is_protected(sector_of(address)) {
            return Ok(());
        }
        self.check_supply()?;
        let mut old = [0; 4];
        memory.read(address, old.get_mut(..size).unwrap_or(&mut []));
        let cut = self.operate(now, from_us(u64::from(self.corner.program_us())));
        let worn = self.worn_at == Some(self.operations) || self.bad_cell == Some(address);
        let mut new: Vec<u8> = old
            .into_iter()
            .zip(value.to_le_bytes())
            // Programming only clears bits; if cut off, it has cleared some of them.
            .map(|(old, new)| if cut { old & (new | 0x55) } else { old & new })
            .take(size)
            .collect();
        if let Some(byte) = new.iter_mut().find(|byte| **byte != 0)
            && worn
        {
            // The lowest set bit.
            *byte &= *byte - 1;
        }
        memory.write(address, &new);
        self.changed = Some((address, address + size as u32));
        self.done();
        Ok(())
    }
}

/// Offset of the start of each sector in flash, and of the end of the last.
const SECTOR_STARTS: [u32; 13] = [
    0, 0x4000, 0x8000, 0xC000, 0x1_0000, 0x2_0000, 0x4_0000, 0x6_0000, 0x8_0000, 0xA_0000,
    0xC_0000, 0xE_0000, 0x10_0000,
];

/// Sector of an address in flash.
fn sector_of(address: u32) -> u32 {
    SECTOR_STARTS.partition_point(|start| *start <= address - FLASH.start) as u32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flash and option bytes without the other memories.
    struct Bank {
        flash: Vec<u8>,
        options: Vec<u8>,
    }

    impl Memory for Bank {
        fn read(&mut self, address: u32, bytes: &mut [u8]) -> bool {
            let at = (address - FLASH.start) as usize;
            bytes.copy_from_slice(&self.flash[at..at + bytes.len()]);
            true
        }

        fn write(&mut self, address: u32, bytes: &[u8]) -> bool {
            if address == OPTIONS.start {
                self.options = bytes.to_vec();
                return true;
            }
            let at = (address - FLASH.start) as usize;
            self.flash[at..at + bytes.len()].copy_from_slice(bytes);
            true
        }
    }

    /// Flash of zeros with this length, bytes.
    fn bank(length: usize) -> Bank {
        Bank { flash: vec![0; length], options: Vec::new() }
    }

    const MILLISECOND: u64 = from_us(1_000);

    /// Erases sector 2 at a parallelism. Returns the duration, ms, and the number of its blank bytes.
    fn erased(flash: &mut FlashRegisters, psize: u32) -> (u64, usize) {
        let mut bank = bank(0x2_0000);
        for key in [0x4567_0123, 0xCDEF_89AB] {
            flash.write(0x04, key, 0, &mut bank).expect("a register");
        }
        let control = SER | 2 << 3 | psize << 8;
        for value in [control, control | STRT] {
            flash.write(0x10, value, 0, &mut bank).expect("a register");
        }
        let blank = bank.flash.iter().filter(|&&byte| byte == 0xFF).count();
        (flash.stall / MILLISECOND, blank)
    }

    #[test]
    fn an_erase_takes_longer_at_lower_parallelism() {
        let mut times = Vec::new();
        for corner in Corner::ALL {
            for psize in 0..3 {
                times.push(erased(&mut FlashRegisters::new(corner), psize).0);
            }
        }
        assert_eq!(times, [200, 150, 125, 400, 300, 250, 800, 600, 500]);
    }

    #[test]
    fn a_reset_aborts_an_erase() {
        let mut flash = FlashRegisters::new(Corner::Typical);
        flash.reset_at = 100 * MILLISECOND;
        assert_eq!(erased(&mut flash, 2), (100, 0x2000));
    }

    #[test]
    fn words_are_not_programmed_below_their_supply() {
        let mut flash = FlashRegisters::new(Corner::Typical);
        flash.supply_mv = 2_600;
        assert!(flash.check_supply().is_ok(), "bytes are");
        flash.control |= 2 << 8;
        assert!(flash.check_supply().is_err());
    }

    #[test]
    fn option_bytes_need_their_keys_and_survive_a_reset() {
        let mut bank = bank(0);
        let mut flash = FlashRegisters::new(Corner::Typical);
        let mut write = |flash: &mut FlashRegisters, offset: u32, value: u32| {
            flash.write(offset, value, 0, &mut bank).expect("a register");
        };
        assert_eq!(flash.read(0x14), Ok(0x0FFF_AAED), "locked, as delivered");
        assert_eq!(flash.brown_out_mv(), 1_700);
        write(&mut flash, 0x14, 0x0FFF_AAE2);
        assert_eq!(flash.read(0x14), Ok(0x0FFF_AAED), "still locked");
        write(&mut flash, 0x08, 0x0819_2A3B);
        write(&mut flash, 0x08, 0x4C5D_6E7F);
        write(&mut flash, 0x14, 0x0FFF_AAE0);
        assert_eq!(flash.brown_out_mv(), 1_700, "not programmed yet");
        write(&mut flash, 0x14, 0x0FFF_AAE2);
        flash.reset();
        assert_eq!(flash.read(0x14), Ok(0x0FFF_AAE1));
        assert_eq!(flash.brown_out_mv(), 2_830);
        assert_eq!(bank.options[..2], [0xE0, 0xAA], "in memory");
        assert_eq!(bank.options[8..], [0xFF, 0xFF], "no sector is protected");
    }

    #[test]
    fn protected_sectors_keep_what_they_hold() {
        let mut bank = bank(0x2_0000);
        let mut flash =
            FlashRegisters::new(Corner::Typical).with_protection(Protection::Bootloader);
        assert_eq!(flash.read(0x14), Ok(0x0FFC_AAED));
        assert_eq!(flash.option_bytes()[8..], [0xFC, 0xFF]);
        for key in [0x4567_0123, 0xCDEF_89AB] {
            flash.write(0x04, key, 0, &mut bank).expect("a register");
        }
        for (sector, blank) in [(0, 0), (1, 0), (2, 0x4000)] {
            let control = SER | sector << 3 | 2 << 8 | STRT;
            flash.write(0x10, control, 0, &mut bank).expect("a register");
            let found = bank.flash.iter().filter(|&&byte| byte == 0xFF).count();
            assert_eq!(found, blank, "sector {sector}");
            assert_eq!(flash.status & WRPERR != 0, blank == 0, "sector {sector}");
            flash.write(0x0C, WRPERR, 0, &mut bank).expect("a register");
        }
        bank.flash.fill(0xFF);
        flash.write(0x10, PG | 2 << 8, 0, &mut bank).expect("a register");
        for (offset, is_protected) in [(0, true), (0x7FFC, true), (0x8000, false)] {
            flash.program(FLASH.start + offset, 4, 0, 0, &mut bank).expect("it is unlocked");
            let word = &bank.flash[offset as usize..][..4];
            assert_eq!(word == [0xFF; 4], is_protected, "{offset:#x}");
            assert_eq!(flash.status & WRPERR != 0, is_protected, "{offset:#x}");
            flash.write(0x0C, WRPERR, 0, &mut bank).expect("a register");
        }
    }

    #[test]
    fn sectors_have_the_addresses_of_the_manual() {
        let ends = [0x4000, 0x8000, 0xC000, 0x1_0000, 0x2_0000, 0x4_0000];
        for (sector, end) in ends.into_iter().enumerate() {
            assert_eq!(sector_of(FLASH.start + end - 4), sector as u32);
        }
        assert_eq!(sector_of(FLASH.start + 0xF_FFFC), 11);
    }
}
