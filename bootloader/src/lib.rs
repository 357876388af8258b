//! The bootloader: starts the foot's program, replaces it over CAN or the serial line, and returns to the previous one
//! if the new one does not work. `docs/update.md` has the promises and the reasons.
//!
//! | what | module |
//! |---|---|
//! | use of the flash | [`layout`] |
//! | the header in front of a program | [`image`] |
//! | what has been begun and not ended | [`journal`] |
//! | programs in their slots | [`program`] |
//! | the steps at a start, and a download | [`update`] |
//! | the objects that a master sees, and their node | [`device`], [`node`] |
//! | the serial line to that node | [`adapter`] |
//! | the crystal: its start and measurement; a supply too low for the flash; both on the target | `crystal`, `supply` |
//!
//! No allocation, no `unsafe`, no panic on any bytes. The other parts that touch the chip are those of the program,
//! in `src/main.rs` and `src/chip`.

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

/// Value of object 0x1008, which distinguishes the bootloader from the foot's program.
pub const DEVICE_NAME: &str = "footfall bootloader";

#[cfg(feature = "verify")]
pub mod adapter;
#[cfg(target_os = "none")]
pub mod crystal;
#[cfg(feature = "verify")]
pub mod device;
pub mod flash;
pub mod image;
pub mod journal;
pub mod layout;
#[cfg(feature = "verify")]
pub mod node;
pub mod note;
#[cfg(feature = "verify")]
pub mod program;
#[cfg(feature = "verify")]
pub mod start;
#[cfg(target_os = "none")]
pub mod supply;
#[cfg(feature = "verify")]
pub mod update;
#[cfg(feature = "verify")]
pub mod verify;
