//! The Cortex-M4F: instructions by the Unicorn engine, everything around them by the architecture
//! reference manual.

pub mod cpu;
pub mod dbgmcu;
pub mod nvic;
pub mod scb;
pub mod semihosting;
pub mod systick;
