//! Communication between the program and its bootloader: the journal of updates, and a note in RAM.

use bootloader::flash::{Flash, FlashFailed, Sector, Slot};
use bootloader::image::{Refusal, identification};
use bootloader::journal::{Event, Progress, State};
use bootloader::note;
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

/// The running program.
pub fn program() -> Program {
    let refusal = State::read(&Words).refusal;
    Program {
        identification: identification(&Words, Slot::Running),
        previous: identification(&Words, Slot::Previous),
        flash_status: refusal.map_or(0, Refusal::flash_status),
    }
}

/// Confirms a program on trial. Does nothing for any other program.
///
/// # Errors
/// The flash failed, or the supply is too low.
pub fn confirm() -> Result<(), StoreFailed> {
    let mut state = State::read(&Words);
    match state.progress {
        Progress::Trial(_) => {
            state.append(Event::Confirmed, &mut Words).map_err(|FlashFailed| StoreFailed::Flash)
        }
        Progress::Settled | Progress::Installing | Progress::Replacing | Progress::Restoring(_) => {
            Ok(())
        }
    }
}

const NOTE: *mut [u32; 2] = core::ptr::with_exposed_provenance_mut(note::ADDRESS);

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
