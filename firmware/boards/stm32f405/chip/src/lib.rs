//! Start and measurement of the crystal, and detection of a low supply, for the foot's program and its bootloader.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(target_os = "none")]
pub mod crystal;
#[cfg(target_os = "none")]
pub mod supply;
