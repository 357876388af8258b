//! Boots the ELF that is flashed, on modelled peripherals with estimated timing.
//!
//! | module | contents |
//! |---|---|
//! | [`emulator`] | the board: core, chip and its parts, memory, what is wired to the chip |
//! | [`product`] | what the product does on it: faults and their outcome, reports, boards in real time |

#![forbid(unsafe_code)]

pub mod emulator;
pub mod product;
