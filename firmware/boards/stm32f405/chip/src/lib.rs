//! Start and measurement of the crystal, detection of a low supply, and the address of the note in RAM, for the foot's
//! program and its bootloader.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(target_os = "none")]
pub mod crystal;
#[cfg(target_os = "none")]
pub mod supply;

/// Address of the note between the program and the bootloader: the last two words of CCM RAM, which are not linked
/// (`memory.x`).
pub const NOTE_ADDRESS: usize = 0x1000_FFF8;
