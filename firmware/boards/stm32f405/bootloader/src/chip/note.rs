//! Access to the note.

use bootloader::device::Restart;
use bootloader::note::{RESUME, STAY};
use stm32f405_chip::NOTE_ADDRESS;

const NOTE: *mut [u32; 2] = core::ptr::with_exposed_provenance_mut(NOTE_ADDRESS);

/// Returns whether the program asked the bootloader not to start it, and clears that request.
pub fn take_stay() -> bool {
    // SAFETY: these bytes are outside of the memory given to the linker, aligned, and any bits are numbers.
    let stays = unsafe { NOTE.read_volatile() } == STAY;
    if stays {
        write([0; 2]);
    }
    stays
}

/// Leaves a note for the program with the reason of its start. A note that no program has taken is lost at the next
/// restart.
pub fn write_for(restart: Restart) {
    write(match restart {
        Restart::AfterSilence => RESUME,
        Restart::ByMaster => [0; 2],
    });
}

fn write(note: [u32; 2]) {
    // SAFETY: as in `take_stay`.
    unsafe { NOTE.write_volatile(note) };
}
