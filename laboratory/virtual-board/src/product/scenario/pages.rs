//! Settings pages in which the next store has to erase, filled by the board's own stores.

use std::sync::{Mutex, PoisonError};

use super::list::OLD_SCALE;
use super::{BEFORE_MS, MILLISECOND, ScenarioError, ScenarioStep};
use crate::emulator::board::{Board, Injection};

/// The content of the settings pages at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pages {
    /// Blank, as in a new board.
    Blank,
    /// Full of records: the next store has to erase.
    BeforeAnErase,
}

/// Filled pages.
#[derive(Clone)]
pub(super) struct Filled {
    pub(super) bytes: Vec<u8>,
    /// Number of flash operations of the store that erases.
    pub(super) operations: u64,
}

/// Maximum number of stores: more than fit two pages.
const MOST_STORES: u32 = 400;

/// Time limit of a store without an erase, and with erases, ms.
const STORE_MS: u64 = 60;
const ERASE_MS: u64 = 3_000;

/// Pages filled so far, by ELF.
static FOUND: Mutex<Vec<(Vec<u8>, Filled)>> = Mutex::new(Vec::new());

/// Runs a board with `elf` and the old scale of the load. It stores settings until it erases. Returns the pages before the
/// erase.
pub(super) fn before_an_erase(elf: &[u8]) -> Result<Filled, ScenarioError> {
    let mut found = FOUND.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, filled)) = found.iter().find(|(known, _)| known == elf) {
        return Ok(filled.clone());
    }
    let mut board = Board::from_elf(elf).map_err(|error| ScenarioError::Elf(error.to_string()))?;
    board.run_until(BEFORE_MS * MILLISECOND)?;
    OLD_SCALE.act(&mut board);
    board.run_for(STORE_MS * MILLISECOND)?;
    for number in 1..=MOST_STORES {
        // At once it takes four stores.
        if number.is_multiple_of(4) {
            board.inject(Injection::Reset);
            board.run_for(BEFORE_MS * MILLISECOND)?;
        }
        let bytes = board.settings();
        let counts = |board: &mut Board| {
            let machine = board.cpu().machine();
            (machine.chip.flash.operations, machine.chip.flash.erases)
        };
        let (operations, erases) = counts(&mut board);
        ScenarioStep::StoreStopped.act(&mut board);
        board.run_for(STORE_MS * MILLISECOND)?;
        if counts(&mut board).1 > erases {
            board.run_for(ERASE_MS * MILLISECOND)?;
            let operations = counts(&mut board).0 - operations;
            let filled = Filled { bytes, operations };
            found.push((elf.to_vec(), filled.clone()));
            return Ok(filled);
        }
        board.take_can();
        board.take_uart();
        board.take_can_requests();
    }
    Err(ScenarioError::Elf("no store erases".into()))
}
