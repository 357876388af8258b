//! The flashed programs on emulated boards; the emulator itself; and `serve`, as programs see it.
//!
//! The long tests are ignored, and run by `.ci/full boards`.

mod common;
#[cfg(unix)]
#[path = "../../../wire/tests/python/environment.rs"]
mod environment;

mod attacks;
mod boards;
mod bring_up;
mod budgets;
mod core;
mod dictionary;
mod digest;
mod hour;
mod lines;
mod matrix;
mod pairs;
mod pin_tables;
mod recordings;
mod registers;
mod sensor;
#[cfg(unix)]
mod serve;
mod settings;
mod start;
mod supply;
mod sync;
mod timebase;
mod update;
