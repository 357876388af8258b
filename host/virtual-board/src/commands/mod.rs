//! Commands of the program: their options and output.

mod elf;
mod options;
pub mod run;
#[cfg(unix)]
pub mod serve;
