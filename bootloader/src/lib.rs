//! The bootloader starts the foot's program and replaces it over CAN or the serial line. It returns to the previous
//! program if the new one does not work. `docs/guide/update.md` has the guarantees and the
//! reasons.
//!
//! | content | module |
//! |---|---|
//! | the flash: its layout and its operations | [`flash`] |
//! | the header in front of a program | [`image`] |
//! | progress of an update, record by record | [`journal`] |
//! | programs in their slots; their hash and signature | [`program`], [`verify`] |
//! | the steps at a start, and a download | [`update`] |
//! | the objects visible to a master, and their node | [`device`], [`node`] |
//! | the serial line to that node | [`adapter`] |
//! | notes between program and bootloader in RAM | [`note`] |
//!
//! The crate does not allocate, has no `unsafe`, names no register, and no bytes make it panic. The program that accesses the
//! chip is the package in `firmware/boards/stm32f405/bootloader`.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

#[cfg(test)]
extern crate std;

/// Value of object 0x1008. It distinguishes the bootloader from the foot's program.
pub const DEVICE_NAME: &str = "footfall bootloader";

#[cfg(feature = "verify")]
pub mod adapter;
#[cfg(feature = "verify")]
pub mod device;
pub mod flash;
pub mod image;
pub mod journal;
#[cfg(feature = "verify")]
pub mod node;
#[cfg(feature = "verify")]
pub mod program;
#[cfg(feature = "verify")]
pub mod update;
#[cfg(feature = "verify")]
pub mod verify;

/// Notes between the program and the bootloader, at an address in RAM that the board's two programs share. A reset keeps
/// them, a power cut erases them.
pub mod note {
    /// Written by the program: do not start it, because another program is to be received.
    pub const STAY: [u32; 2] = [0xF007_57A9, !0xF007_57A9];

    /// Written by the bootloader: no master has asked for this start, so the program continues as after power-up.
    pub const RESUME: [u32; 2] = [0xF007_4E50, !0xF007_4E50];
}
