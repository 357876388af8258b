//! The driver on the simulated part, over the bus alone.

mod common;

mod asynch;
mod bytes;
mod crosscheck;
mod faults;
mod i2c;
mod properties;
mod readme;
mod simulated_part;
mod unconfigured;
