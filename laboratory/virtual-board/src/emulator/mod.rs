//! The emulated board, independent of the program that it runs.
//!
//! | part | file |
//! |---|---|
//! | the whole board, faults injected into it, its observation | [`board`] |
//! | execution of instructions, accesses to memory, counters | [`machine`]; [`block`], [`memory`], [`elf`], [`time`] |
//! | Cortex-M4F: the CPU and the peripherals of the core | [`core`] |
//! | STM32F405: clocks, DMA, interrupts and pins between its peripherals, and its specimens | [`chip`], [`corner`] |
//! | one peripheral each, its registers | [`part`] |
//! | connections of the pins | [`wiring`] |
//! | misuse that ends a run | [`failure`] |

pub mod block;
pub mod board;
pub mod chip;
pub mod core;
pub mod corner;
pub mod elf;
pub mod failure;
pub mod machine;
pub mod memory;
pub mod part;
pub mod time;
pub mod wiring;
