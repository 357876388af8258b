//! The flash by words of 32 bits, which requires a supply of 2.7 to 3.6 V (RM0090, 3.6). Below it nothing is written or
//! erased. The program sets brown-out level 3 (2.75 to 2.88 V) at its first start, in force from the next power-up on.

use bootloader::flash::{Flash, FlashFailed};
use bootloader::layout::Sector;
use bootloader::supply;
use stm32_metapac::flash::vals::Psize;
use stm32_metapac::{FLASH, RCC};

use super::watchdog;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

const OPTION_KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];

/// Sectors of the bootloader in `nWRP`, where a bit that is clear protects (RM0090, 3.6.4).
const OWN_SECTORS: u16 = 0b11;

/// `BOR_LEV` of a chip whose brown-out reset is off.
const NO_BROWN_OUT: u8 = 3;

/// Bits of `FLASH_SR`: WRPERR, PGAERR, PGPERR, PGSERR, OPERR.
const ERRORS: u32 = 0xF2;

/// The flash. There is one, as it is made once.
pub struct ChipFlash(());

impl ChipFlash {
    /// Takes the flash, and watches the supply.
    pub fn new() -> Self {
        supply::watch();
        Self(())
    }

    /// Protects the sectors of the bootloader from being written, by the option bytes: whatever a program does, the foot
    /// can be updated (RM0090, 3.6.2). It takes as long as the erase of 16 KiB, once.
    ///
    /// At a power-up alone: an attempt that ends in another reset is not repeated, and a probe can lift the protection to
    /// write another bootloader. Not before the program has set the brown-out level, since the supply must hold:
    /// option bytes that were erased and not written are those of readout protection, level 1 (3.6.3). The others keep their
    /// values.
    pub fn protect_bootloader(&mut self) {
        let options = FLASH.optcr().read();
        let flags = RCC.csr().read();
        let is_power_up = flags.porrstf() && !flags.sftrstf() && !flags.wdgrstf();
        let is_due = options.n_wrp() & OWN_SECTORS != 0 && options.bor_lev() != NO_BROWN_OUT;
        if !is_power_up || !is_due || prepare().is_err() {
            return;
        }
        FLASH.cr().write(|w| w.set_psize(Psize::PSIZE32));
        for key in OPTION_KEYS {
            FLASH.optkeyr().write_value(key);
        }
        FLASH
            .optcr()
            .modify(|w| w.set_n_wrp(w.n_wrp() & !OWN_SECTORS));
        FLASH.optcr().modify(|w| w.set_optstrt(true));
        // The next power-up tries again where it has failed.
        let _ = finish();
        FLASH.optcr().modify(|w| w.set_optlock(true));
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
        // SAFETY: in the journal or a slot, which hold no variable; the address is that of a word.
        unsafe {
            core::ptr::with_exposed_provenance_mut::<u32>(address as usize).write_volatile(word);
        }
        finish()?;
        if self.read(address) == word {
            Ok(())
        } else {
            Err(FlashFailed)
        }
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
    // Keys written to unlocked flash would lock it until the next reset.
    if FLASH.cr().read().lock() {
        for key in KEYS {
            FLASH.keyr().write_value(key);
        }
    }
    // Flags are cleared by writing ones.
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
    if status.0 & ERRORS == 0 {
        Ok(())
    } else {
        Err(FlashFailed)
    }
}
