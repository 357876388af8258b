//! Two pages of flash with the settings of a simulated foot.

use std::convert::Infallible;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// Size of a page, bytes.
pub(super) const PAGE: usize = 16 * 1024;

/// Size of all pages, bytes.
pub(super) const SIZE: usize = 2 * PAGE;

/// Simulated flash: a write clears bits, an erase sets them.
#[derive(Clone, Debug)]
pub(super) struct Flash(Vec<u8>);

impl Flash {
    pub(super) fn blank() -> Self {
        Self(vec![0xFF; SIZE])
    }
}

impl ErrorType for Flash {
    type Error = Infallible;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        let stored = self.0.iter().skip(offset as usize);
        for (to, from) in bytes.iter_mut().zip(stored) {
            *to = *from;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        if let Some(pages) = self.0.get_mut(from as usize..to as usize) {
            pages.fill(0xFF);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        for (to, from) in self.0.iter_mut().skip(offset as usize).zip(bytes) {
            *to &= *from;
        }
        Ok(())
    }
}
