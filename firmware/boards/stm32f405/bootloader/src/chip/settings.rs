//! Node id and rates from the stored settings. The bootloader only reads them.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use storage::{Storage, StoreFailed};
use wire::dictionary::{Address, index};
use wire::foot::{Foot, NodeId};

/// Start of the pages: `_config_start` in memory.x.
const START: usize = 0x0800_8000;

/// Size of a page, bytes.
const PAGE: usize = 16 * 1024;

/// Bit rates of the bus, kbit/s; the first is the default.
const BIT_RATES_KBIT: [u32; 4] = [1000, 500, 250, 125];

/// Default rate of the serial line, Bd.
const BAUD: u32 = 1_000_000;

/// Returns the node id, the bit rate of the bus (bit/s) and the rate of the serial line (Bd), as stored, or the
/// defaults.
pub fn read() -> (Option<NodeId>, u32, u32) {
    let Ok(mut storage) = Storage::new(Pages, &(0..2 * PAGE as u32)) else {
        return (None, BIT_RATES_KBIT[0] * 1000, BAUD);
    };
    let mut value = |index| storage.raw_value(Address::new(index, 0));
    let foot = value(index::FOOT).and_then(|code| Foot::from_code(code as u8));
    let id = match value(index::NODE_ID).unwrap_or(0) {
        0 => Some(foot.unwrap_or_default().default_node_id()),
        id => NodeId::new(id as u8),
    };
    let stored = value(index::CAN_BIT_RATE);
    let rate =
        BIT_RATES_KBIT.into_iter().find(|rate| Some(*rate) == stored).unwrap_or(BIT_RATES_KBIT[0]);
    (id, rate * 1000, value(index::UART_RATE).unwrap_or(BAUD))
}

/// The pages, read-only.
struct Pages;

/// Error of an attempt to write a page.
#[derive(Debug)]
struct ReadOnly;

impl From<ReadOnly> for StoreFailed {
    fn from(_: ReadOnly) -> Self {
        Self::Flash
    }
}

impl NorFlashError for ReadOnly {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Pages {
    type Error = ReadOnly;
}

impl ReadNorFlash for Pages {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), ReadOnly> {
        let end = (offset as usize).saturating_add(bytes.len());
        if end > self.capacity() {
            return Err(ReadOnly);
        }
        for (at, byte) in (START + offset as usize..).zip(bytes) {
            // SAFETY: inside the pages, which hold no program or variable.
            *byte = unsafe { core::ptr::with_exposed_provenance::<u8>(at).read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * PAGE
    }
}

impl NorFlash for Pages {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), ReadOnly> {
        Err(ReadOnly)
    }

    fn erase(&mut self, _: u32, _: u32) -> Result<(), ReadOnly> {
        Err(ReadOnly)
    }
}
