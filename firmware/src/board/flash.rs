//! Sectors 2 and 3 of the flash: the configuration, a page each.
//!
//! While the flash erases or writes, the processor cannot fetch from it: a word written holds
//! everything up for 16 µs (100 at most), a sector erased for a quarter of a second (half at
//! most). So pages are filled before they are erased.

use embassy_stm32::flash::{Bank1Region1, Blocking, Error, Flash};
use embassy_stm32::pac::FLASH;
use embassy_stm32::{Peri, peripherals};
use embassy_time::Timer;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// One sector.
pub const PAGE: u32 = 16 * 1024;

/// Two of them.
pub const SIZE: u32 = 2 * PAGE;

/// Where they begin, counted from the flash's start: `_config_start` in memory.x.
const OFFSET: u32 = 0x8000;

/// Two looks of whoever feeds the watchdog, and some.
const CATCH_UP_MILLIS: u64 = 150;

/// The configuration's flash, addressed from 0 to [`SIZE`].
pub struct ConfigFlash(Bank1Region1<'static, Blocking>);

impl ConfigFlash {
    pub(super) fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self(
            Flash::new_blocking(flash)
                .into_blocking_regions()
                .bank1_region1,
        )
    }
}

impl ErrorType for ConfigFlash {
    type Error = Error;
}

impl ReadNorFlash for ConfigFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.0.blocking_read(inside(offset, bytes.len())?, bytes)
    }

    fn capacity(&self) -> usize {
        SIZE as usize
    }
}

impl NorFlash for ConfigFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE as usize;

    /// Word by word: between two of them the sampling loop gets its turn.
    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.0.blocking_write(inside(offset, bytes.len())?, bytes)
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let length = to.checked_sub(from).ok_or(Error::Size)?;
        let start = inside(from, length as usize)?;
        for page in (start..start + length).step_by(Self::ERASE_SIZE) {
            let erased = self.0.blocking_erase(page, page + PAGE);
            forget_cached_data();
            erased?;
            // The rest of the program catches up, and feeds the watchdog, before the next one.
            Timer::after_millis(CATCH_UP_MILLIS).await;
        }
        Ok(())
    }
}

/// The offset in the region, where the range lies in the configuration's pages.
fn inside(offset: u32, length: usize) -> Result<u32, Error> {
    let fits = (SIZE as usize)
        .checked_sub(length)
        .is_some_and(|last| offset as usize <= last);
    if fits {
        Ok(OFFSET + offset)
    } else {
        Err(Error::Size)
    }
}

/// Erasing leaves old data in the data cache (RM0090, 3.5.4). It can be reset only while off.
fn forget_cached_data() {
    critical_section::with(|_| {
        FLASH.acr().modify(|w| w.set_dcen(false));
        FLASH.acr().modify(|w| w.set_dcrst(true));
        FLASH.acr().modify(|w| w.set_dcrst(false));
        FLASH.acr().modify(|w| w.set_dcen(true));
    });
}
