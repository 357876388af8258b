//! Sectors 2 and 3 of the flash hold the configuration, one page each. This module also sets the option bytes: the
//! supply voltage below which the chip resets itself, and the protection of the bootloader.
//!
//! While the flash erases or writes, the processor cannot fetch from it. The data sheet gives these times (DS8626,
//! table 40 \[M\]) for 32 bits at once, which requires a supply of 2.7 to 3.6 V:
//!
//! | operation | typical | maximum |
//! |---|---|---|
//! | write a word | 16 µs | 100 µs |
//! | erase a sector of 16 KiB | 250 ms | 500 ms |
//! | the same, 8 bits at once | 400 ms | 800 ms |
//!
//! The width must be set for an erase as well as for a write. After reset it is 8 bits, and an erase could outlast the
//! watchdog. Nothing is written or erased while the supply is below its [threshold](supply). The steps follow RM0090,
//! 3.6.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::pac::FLASH;
use embassy_stm32::pac::flash::vals::Psize;
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Instant};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use stm32f405_chip::supply;
use storage::StoreFailed;

use crate::{uart, watchdog};

/// Size of a sector, bytes.
pub const PAGE: u32 = 16 * 1024;

/// Size of both sectors, bytes.
pub const SIZE: u32 = 2 * PAGE;

/// Maximum duration of the erase of a sector, µs.
const ERASE_MICROS: u32 = 500_000;

// The processor cannot feed the watchdog during an erase.
const _: () = assert!(ERASE_MICROS / 1_000 < watchdog::LONGEST_STALL_MILLIS);

/// Start of the sectors: `_config_start` in memory.x.
const START: u32 = 0x0800_8000;

/// Number of the first sector.
const FIRST_SECTOR: u32 = 2;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
const OPTION_KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];

/// Option bytes in memory: a word with `BOR_LEV` in bits 2 and 3, and one with `nWRP` (RM0090, 3.6.1). `FLASH_OPTCR`
/// holds the value last written to it, whether programmed or not.
const OPTION_BYTES: [usize; 2] = [0x1FFF_C000, 0x1FFF_C008];

/// Bits of `FLASH_SR`: WRPERR, PGAERR, PGPERR, PGSERR, OPERR.
const ERRORS: u32 = 0xF2;

/// Level 3 in `BOR_LEV` of `FLASH_OPTCR`. The field counts downwards: 0 is level 3, and 3 is off.
const LEVEL_3: u8 = 0;

/// Sectors of the bootloader in `nWRP`. A clear bit protects its sector (RM0090, 3.6.4).
const BOOTLOADER: u16 = 0b11;

/// Time after a tick in which the next sample is not yet being read.
const REST_OF_TICK: Duration = Duration::from_micros(500);

/// Longest wait for the end of a tick. No tick ends while the timer or the sampling is stuck.
const LONGEST_WAIT: Duration = Duration::from_millis(3);

/// Number of ticks done since the start, modulo 2³².
static TICKS_DONE: AtomicU32 = AtomicU32::new(0);

/// Notes that the work of a tick is done.
pub fn note_tick() {
    // Only the sampling level writes the count.
    let done = TICKS_DONE.load(Ordering::Relaxed);
    TICKS_DONE.store(done.wrapping_add(1), Ordering::Relaxed);
}

/// Waits for the end of a tick whose frames have gone to the serial line. An erase then delays no sample that is being
/// read and no queued frame. Either would be sent as if it were new after the erase.
fn after_a_tick() {
    let until = Instant::now() + LONGEST_WAIT;
    let mut done = TICKS_DONE.load(Ordering::Relaxed);
    let mut ended = None;
    while Instant::now() < until {
        let now = Instant::now();
        let ticks = TICKS_DONE.load(Ordering::Relaxed);
        if ticks != done {
            (done, ended) = (ticks, Some(now));
        }
        if ended.is_some_and(|ended| now < ended + REST_OF_TICK) && uart::is_idle() {
            return;
        }
    }
}

/// Flash of the configuration, addressed from 0 to [`SIZE`].
pub struct ConfigFlash {
    /// Owned, so that no other code uses the flash.
    _flash: Peri<'static, peripherals::FLASH>,
}

/// Reason why a write or an erase failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error(StoreFailed);

const REFUSED: Error = Error(StoreFailed::Flash);

impl From<Error> for StoreFailed {
    fn from(Error(why): Error) -> Self {
        why
    }
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ConfigFlash {
    pub(crate) const fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self { _flash: flash }
    }
}

/// Sets brown-out level 3 (2.75 to 2.88 V, DS8626 \[M\]) from the next power-up on, and write-protects the sectors of
/// the bootloader. Whatever a program does, the foot can then be updated.
///
/// Call it at the thread level, while nothing else uses the flash. It takes as long as an erase. If it is interrupted,
/// the erased option bytes mean readout protection, level 1 (RM0090, 3.6.3).
///
/// # Errors
/// The supply is too low, or the option bytes do not read back.
pub fn protect() -> Result<(), StoreFailed> {
    if brown_out_level() == 3 && is_bootloader_protected() {
        return Ok(());
    }
    supply_suffices()?;
    unlock();
    FLASH.cr().write(|w| w.set_psize(Psize::PSIZE32));
    for key in OPTION_KEYS {
        FLASH.optkeyr().write_value(key);
    }
    after_a_tick();
    watchdog::extend();
    FLASH.optcr().modify(|w| {
        w.set_bor_lev(LEVEL_3);
        w.set_n_wrp(w.n_wrp() & !BOOTLOADER);
    });
    FLASH.optcr().modify(|w| w.set_optstrt(true));
    let done = finish();
    watchdog::start();
    FLASH.optcr().modify(|w| w.set_optlock(true));
    lock();
    done?;
    if brown_out_level() == 3 && is_bootloader_protected() {
        Ok(())
    } else {
        Err(StoreFailed::Flash)
    }
}

/// Brown-out level: 0 is off; 1 to 3 reset the chip below 2.19, 2.50 and 2.83 V, typical, falling (DS8626 \[M\]).
pub fn brown_out_level() -> u8 {
    let [level, _] = option_bytes();
    3 - (level >> 2 & 3) as u8
}

/// Returns whether the sectors of the bootloader are write-protected.
pub fn is_bootloader_protected() -> bool {
    let [_, unprotected] = option_bytes();
    unprotected & BOOTLOADER == 0
}

/// The option bytes in effect: `USER` and `RDP` in the low half, `nWRP` in the high half.
pub fn all_option_bytes() -> u32 {
    let [low, high] = option_bytes().map(u32::from);
    high << 16 | low
}

/// The option bytes as the flash holds them. The register with their name holds what was last written to it, even if the
/// flash has not taken that.
fn option_bytes() -> [u16; 2] {
    // SAFETY: the option bytes can be read at any time, and hold no variable of the program.
    OPTION_BYTES.map(|at| unsafe { core::ptr::with_exposed_provenance::<u16>(at).read_volatile() })
}

impl ErrorType for ConfigFlash {
    type Error = Error;
}

impl ReadNorFlash for ConfigFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let start = inside(offset, bytes.len())?;
        for (at, byte) in (start as usize..).zip(bytes) {
            // SAFETY: inside the pages of the configuration, which hold no program or variable.
            *byte = unsafe { core::ptr::with_exposed_provenance::<u8>(at).read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE as usize
    }
}

impl NorFlash for ConfigFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE as usize;

    /// Writes word by word, so that the sampling loop can run between two words.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let start = inside(offset, bytes.len())?;
        let (words, rest) = bytes.as_chunks::<4>();
        if !start.is_multiple_of(4) || !rest.is_empty() {
            return Err(REFUSED);
        }
        unlock_to_program();
        let mut written = Ok(());
        for (at, word) in (start as usize..).step_by(4).zip(words) {
            written = write_word(at, u32::from_le_bytes(*word));
            if written.is_err() {
                break;
            }
        }
        lock();
        written
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let length = to.checked_sub(from).ok_or(REFUSED)?;
        inside(from, length as usize)?;
        if !from.is_multiple_of(PAGE) || !length.is_multiple_of(PAGE) {
            return Err(REFUSED);
        }
        for page in from / PAGE..to / PAGE {
            supply_suffices()?;
            unlock();
            FLASH.cr().write(|w| {
                w.set_psize(Psize::PSIZE32);
                w.set_ser(true);
                w.set_snb((FIRST_SECTOR + page) as u8);
            });
            after_a_tick();
            // The erase needs the watchdog's whole period.
            watchdog::feed();
            FLASH.cr().modify(|w| w.set_strt(true));
            let erased = finish();
            lock();
            erased?;
        }
        Ok(())
    }
}

/// Programs a word of the [journal](crate::update). Call it at the thread level, while nothing else uses the flash.
pub(crate) fn program_word(at: usize, word: u32) -> Result<(), Error> {
    unlock_to_program();
    let written = write_word(at, word);
    lock();
    written
}

fn unlock_to_program() {
    unlock();
    FLASH.cr().write(|w| {
        w.set_psize(Psize::PSIZE32);
        w.set_pg(true);
    });
}

/// Writes a word to flash that is unlocked and set for programming by words.
fn write_word(at: usize, word: u32) -> Result<(), Error> {
    supply_suffices()?;
    let at = core::ptr::with_exposed_provenance_mut::<u32>(at);
    // SAFETY: inside the pages of the configuration or the journal, which hold no program or variable, and aligned to a
    // word.
    unsafe { at.write_volatile(word) };
    finish()
}

/// Address of the range, if the range is inside the configuration's pages.
fn inside(offset: u32, length: usize) -> Result<u32, Error> {
    let fits = (SIZE as usize).checked_sub(length).is_some_and(|last| offset as usize <= last);
    if fits { Ok(START + offset) } else { Err(REFUSED) }
}

fn supply_suffices() -> Result<(), Error> {
    if supply::is_low() { Err(Error(StoreFailed::SupplyLow)) } else { Ok(()) }
}

fn unlock() {
    // Writing the keys to unlocked flash would lock it until the next reset.
    if FLASH.cr().read().lock() {
        for key in KEYS {
            FLASH.keyr().write_value(key);
        }
    }
    clear_errors();
}

/// Flags are cleared by writing ones.
fn clear_errors() {
    FLASH.sr().modify(|_| {});
}

/// Locks the flash and resets the data cache. Erasing leaves old data in the cache (RM0090, 3.5.4), and written data
/// must be read back from the flash itself. The cache can be reset only while it is off.
fn lock() {
    FLASH.cr().write(|w| w.set_lock(true));
    critical_section::with(|_| {
        FLASH.acr().modify(|w| w.set_dcen(false));
        FLASH.acr().modify(|w| w.set_dcrst(true));
        FLASH.acr().modify(|w| w.set_dcrst(false));
        FLASH.acr().modify(|w| w.set_dcen(true));
    });
}

fn finish() -> Result<(), Error> {
    // The store that starts the operation must be complete before its status is read.
    cortex_m::asm::dsb();
    loop {
        let status = FLASH.sr().read();
        if !status.bsy() {
            return if status.0 & ERRORS == 0 { Ok(()) } else { Err(REFUSED) };
        }
    }
}
