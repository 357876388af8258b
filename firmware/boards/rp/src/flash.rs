//! The last two sectors of the flash hold the settings, one page each.
//!
//! Nothing else runs while the flash is written or erased. Writing a page of 256 bytes takes 0.7 ms. An erase takes 50
//! ms, at most 400 ms (AT25SF128A, AC characteristics \[S\]).

use embassy_rp::Peri;
use embassy_rp::flash::{Blocking, ERASE_SIZE, Flash};
use embassy_rp::peripherals::FLASH;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use storage::StoreFailed;

use crate::board::FLASH_SIZE;

/// Size of both sectors, bytes.
pub const SETTINGS: u32 = 2 * ERASE_SIZE as u32;

const START: u32 = FLASH_SIZE as u32 - SETTINGS;

/// Flash of the settings, addressed from 0 to [`SETTINGS`].
pub struct SettingsFlash(pub Flash<'static, FLASH, Blocking, FLASH_SIZE>);

/// Failure of a flash operation.
#[derive(Clone, Copy, Debug)]
pub struct Refused;

impl From<Refused> for StoreFailed {
    fn from(_: Refused) -> Self {
        Self::Flash
    }
}

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl SettingsFlash {
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self(Flash::new_blocking(flash))
    }
}

impl ErrorType for SettingsFlash {
    type Error = Refused;
}

/// Address in the flash of a range of the settings.
fn place(offset: u32, length: usize) -> Result<u32, Refused> {
    let end = (offset as usize).checked_add(length).ok_or(Refused)?;
    (end <= SETTINGS as usize).then_some(START + offset).ok_or(Refused)
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        let place = place(offset, bytes.len())?;
        self.0.blocking_read(place, bytes).map_err(|_| Refused)
    }

    fn capacity(&self) -> usize {
        SETTINGS as usize
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        let length = to.checked_sub(from).ok_or(Refused)?;
        let place = place(from, length as usize)?;
        self.0.blocking_erase(place, place + length).map_err(|_| Refused)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        let place = place(offset, bytes.len())?;
        self.0.blocking_write(place, bytes).map_err(|_| Refused)
    }
}
