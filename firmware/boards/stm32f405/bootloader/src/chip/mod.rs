//! Access to the STM32F405 by polling.

pub mod can;
pub mod clock;
pub mod flash;
pub mod note;
pub mod serial;
pub mod settings;
pub mod sleep;
pub mod watchdog;

use bootloader::flash::Slot;
use bootloader::image::{Board, HEADER};
use stm32f405_chip::supply;
use wire::foot::serial_number;

#[cfg(any(
    all(feature = "feather", feature = "reference"),
    not(any(feature = "feather", feature = "reference"))
))]
compile_error!("choose one board by a feature: `reference` or `feather`");

/// The board.
#[cfg(not(feature = "feather"))]
pub const BOARD: Board = Board::Reference;
/// The board.
#[cfg(feature = "feather")]
pub const BOARD: Board = Board::Feather;

/// Crystal of the board, MHz.
pub const CRYSTAL_MHZ: u32 = match BOARD {
    Board::Reference => 8,
    Board::Feather => 12,
};

/// Starts the program in [`Slot::Running`]. The program finds the chip as after a reset, except for the watchdog.
pub fn start_program() -> ! {
    supply::forget();
    let vectors = Slot::Running.start() + HEADER as u32;
    // SAFETY: no interrupt is enabled, and nothing else uses the register.
    unsafe { (*cortex_m::peripheral::SCB::PTR).vtor.write(vectors) };
    // SAFETY: the slot holds a whole program, which begins with its vector table.
    unsafe { cortex_m::asm::bootload(core::ptr::with_exposed_provenance(vectors as usize)) }
}

/// Serial number of the foot, the same as the foot's program reports.
pub fn serial() -> u32 {
    const UNIQUE_ID: usize = 0x1FFF_7A10;
    // SAFETY: the id can be read at any time, byte by byte.
    let byte = |at| unsafe { core::ptr::with_exposed_provenance::<u8>(at).read_volatile() };
    serial_number((UNIQUE_ID..UNIQUE_ID + 12).map(byte))
}
