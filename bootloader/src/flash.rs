//! The flash as the update needs it: words that are read and programmed, sectors that are erased.

use crate::layout::Sector;

/// A word was not programmed, or a sector not erased.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashFailed;

/// Flash of the chip. Addresses are multiples of 4 between those of the journal and the end of the slots.
pub trait Flash {
    /// Reads a word.
    fn read(&self, address: u32) -> u32;

    /// Programs a word of erased flash, and reads it back.
    ///
    /// # Errors
    /// The word does not read back.
    fn program(&mut self, address: u32, word: u32) -> Result<(), FlashFailed>;

    /// Erases a sector: all bits are set.
    ///
    /// # Errors
    /// The flash reports an error.
    fn erase(&mut self, sector: Sector) -> Result<(), FlashFailed>;
}
