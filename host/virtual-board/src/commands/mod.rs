//! Commands of the program: their options and output.

mod elf;
#[cfg(unix)]
pub mod serve;
