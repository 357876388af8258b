//! Communication between the program and its bootloader: the journal of updates, and a note in RAM.

use core::sync::atomic::{AtomicBool, Ordering};

use bootloader::flash::{Flash, FlashFailed, Sector, Slot};
use bootloader::image::{Refusal, identification};
use bootloader::journal::{Event, Progress, State};
use bootloader::note;
use stm32f405_chip::NOTE_ADDRESS;
use storage::StoreFailed;
use wire::node::Program;

use crate::flash::program_word;

/// Journal and slots. They are read at any time, and programmed only at the thread level.
struct Words;

impl Flash for Words {
    fn read(&self, address: u32) -> u32 {
        // SAFETY: the journal and the slots hold no variable, and flash can be read at any time.
        unsafe { core::ptr::with_exposed_provenance::<u32>(address as usize).read_volatile() }
    }

    fn program(&mut self, address: u32, word: u32) -> Result<(), FlashFailed> {
        program_word(address as usize, word).map_err(|_| FlashFailed)?;
        if self.read(address) == word { Ok(()) } else { Err(FlashFailed) }
    }

    fn erase(&mut self, _: Sector) -> Result<(), FlashFailed> {
        // Only the bootloader erases.
        Err(FlashFailed)
    }
}

/// Whether the running program is on trial. Set at the start.
///
/// A read of the whole journal takes half a millisecond. Only a program on trial needs a second one, in [`confirm`].
static IS_ON_TRIAL: AtomicBool = AtomicBool::new(false);

/// Returns the running program. Reads the journal, and is called once, at the start.
pub fn program() -> Program {
    let state = State::read(&Words);
    IS_ON_TRIAL.store(matches!(state.progress, Progress::Trial(_)), Ordering::Relaxed);
    Program {
        identification: identification(&Words, Slot::Running),
        previous: identification(&Words, Slot::Previous),
        flash_status: state.refusal.map_or(0, Refusal::flash_status),
    }
}

/// Confirms a program on trial. Does nothing for any other program.
///
/// # Errors
/// The flash failed, or the supply is too low.
pub fn confirm() -> Result<(), StoreFailed> {
    if IS_ON_TRIAL.load(Ordering::Relaxed) {
        State::read(&Words)
            .append(Event::Confirmed, &mut Words)
            .map_err(|FlashFailed| StoreFailed::Flash)?;
        IS_ON_TRIAL.store(false, Ordering::Relaxed);
    }
    Ok(())
}

const NOTE: *mut [u32; 2] = core::ptr::with_exposed_provenance_mut(NOTE_ADDRESS);

/// Asks the bootloader not to start the program at the next reset.
pub fn ask_for_bootloader() {
    // SAFETY: the last words of CCM RAM, which hold no variable of this program.
    unsafe { NOTE.write_volatile(note::STAY) };
}

/// Returns whether the bootloader started the program without a command, and clears that note.
pub fn take_resume() -> bool {
    // SAFETY: as above, and any bits are numbers.
    let found = unsafe { NOTE.read_volatile() };
    // SAFETY: as above.
    unsafe { NOTE.write_volatile([0; 2]) };
    found == note::RESUME
}
