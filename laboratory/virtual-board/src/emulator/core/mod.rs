//! The Cortex-M4F: instructions by the Unicorn engine, everything around them by the architecture
//! reference manual.

pub mod cpu;
pub mod debugger;
pub mod nvic;
pub mod scb;
pub mod systick;
