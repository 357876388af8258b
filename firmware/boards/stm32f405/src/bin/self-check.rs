//! The self-check on a Cortex-M4F.

#![no_std]
#![no_main]

#[path = "../../../self_check.rs"]
mod self_check;

// The vector table.
use stm32_metapac as _;
