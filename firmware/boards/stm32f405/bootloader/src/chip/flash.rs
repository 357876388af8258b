//! The flash, written by words of 32 bits, which requires a supply of 2.7 to 3.6 V (RM0090, 3.6). Below that nothing is
//! written or erased. The option bytes are left to the program, because a connector may still bounce while the
//! bootloader runs.

use bootloader::flash::{Flash, FlashFailed, Sector};
use stm32_metapac::FLASH;
use stm32_metapac::flash::vals::Psize;
use stm32f405_chip::supply;

use super::watchdog;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Bits of `FLASH_SR`: WRPERR, PGAERR, PGPERR, PGSERR, OPERR.
const ERRORS: u32 = 0xF2;

/// The flash. It is created once, so there is only one.
pub struct ChipFlash(());

impl ChipFlash {
    /// Takes the flash and starts to watch the supply. The detector settles while the clocks start and the journal is
    /// read.
    pub fn new() -> Self {
        supply::watch();
        Self(())
    }
}

impl Flash for ChipFlash {
    fn read(&self, address: u32) -> u32 {
        // SAFETY: the journal and the slots hold no variable, and flash can be read at any time.
        unsafe { core::ptr::with_exposed_provenance::<u32>(address as usize).read_volatile() }
    }

    fn program(&mut self, address: u32, word: u32) -> Result<(), FlashFailed> {
        prepare()?;
        FLASH.cr().write(|w| {
            w.set_psize(Psize::PSIZE32);
            w.set_pg(true);
        });
        // SAFETY: the address lies in the journal or a slot, which hold no variable, and is aligned to a word.
        unsafe {
            core::ptr::with_exposed_provenance_mut::<u32>(address as usize).write_volatile(word);
        }
        finish()?;
        if self.read(address) == word { Ok(()) } else { Err(FlashFailed) }
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFailed> {
        prepare()?;
        FLASH.cr().write(|w| {
            w.set_psize(Psize::PSIZE32);
            w.set_ser(true);
            w.set_snb(sector.number());
        });
        FLASH.cr().modify(|w| w.set_strt(true));
        finish()
    }
}

/// Unlocks the flash, if the supply suffices.
fn prepare() -> Result<(), FlashFailed> {
    watchdog::feed();
    if supply::is_low() {
        return Err(FlashFailed);
    }
    // Writing the keys to unlocked flash would lock it until the next reset.
    if FLASH.cr().read().lock() {
        for key in KEYS {
            FLASH.keyr().write_value(key);
        }
    }
    // Writing ones clears the flags.
    FLASH.sr().modify(|_| {});
    Ok(())
}

fn finish() -> Result<(), FlashFailed> {
    // The store that starts the operation must be complete before its status is read.
    cortex_m::asm::dsb();
    let status = loop {
        let status = FLASH.sr().read();
        if !status.bsy() {
            break status;
        }
    };
    FLASH.cr().write(|w| w.set_lock(true));
    if status.0 & ERRORS == 0 { Ok(()) } else { Err(FlashFailed) }
}
