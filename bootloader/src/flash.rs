//! The flash: its layout by sectors of the STM32F405 (RM0090, table 5), and its operations. Words are read and
//! programmed; sectors are erased.
//!
//! | sector | address | size | use |
//! |---|---|---|---|
//! | 0, 1 | 0x08000000 | 32 KiB | the bootloader |
//! | 2, 3 | 0x08008000 | 32 KiB | settings; no update changes them |
//! | 4 | 0x08010000 | 64 KiB | [journal](crate::journal) of updates |
//! | 5 | 0x08020000 | 128 KiB | [`Slot::Running`] |
//! | 6 | 0x08040000 | 128 KiB | [`Slot::New`] |
//! | 7 | 0x08060000 | 128 KiB | [`Slot::Previous`] |
//!
//! Sectors of 128 KiB leave no room to swap by pieces, with a record of the progress of each piece. So a program is
//! copied whole, and its source stays until the copy has been confirmed.

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

/// Error of a word that was not programmed, or of a sector that was not erased.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashFailed;

/// Address of the journal.
pub const JOURNAL: u32 = 0x0801_0000;

/// Size of the journal, bytes.
pub const JOURNAL_SIZE: u32 = 64 * 1024;

/// Size of a slot, bytes.
pub const SLOT_SIZE: u32 = 128 * 1024;

/// Place of a program with its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The program that is started. It is linked for this address.
    Running,
    /// The program received last.
    New,
    /// Copy of the program that ran before the last update.
    Previous,
}

impl Slot {
    /// All slots, in order of their addresses.
    pub const ALL: [Self; 3] = [Self::Running, Self::New, Self::Previous];

    /// Address of the slot's header.
    #[must_use]
    pub const fn start(self) -> u32 {
        0x0802_0000 + self as u32 * SLOT_SIZE
    }
}

/// Part of the flash that one operation erases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sector {
    /// The journal.
    Journal,
    /// A slot.
    Slot(Slot),
}

impl Sector {
    /// Number of the sector.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Journal => 4,
            Self::Slot(slot) => 5 + slot as u8,
        }
    }
}
