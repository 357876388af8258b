//! Boots the ELF that is flashed, on modelled peripherals with estimated timing.

#![forbid(unsafe_code)]

pub mod block;
pub mod board;
pub mod chip;
pub mod core;
pub mod corner;
pub mod elf;
pub mod failure;
pub mod fault;
pub mod machine;
pub mod memory;
pub mod motion;
pub mod parity;
pub mod part;
pub mod recorded;
pub mod report;
pub mod scenario;
#[cfg(unix)]
pub mod serve;
pub mod spread;
pub mod streams;
pub mod time;
pub mod traffic;
pub mod wiring;
