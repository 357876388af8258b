//! Boots the flashed ELF on modelled peripherals with estimated timing.
//!
//! | module | contents |
//! |---|---|
//! | [`emulator`] | the board: core, chip and its parts, memory, the chip's wiring |
//! | [`product`] | the product's behaviour on it: faults and their outcome, reports, boards in real time |

#![forbid(unsafe_code)]

pub mod emulator;
pub mod product;
