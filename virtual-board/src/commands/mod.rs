//! The commands of the program: their options, and what they print.

mod elf;
mod options;
pub mod run;
#[cfg(unix)]
pub mod serve;
