//! Entry of a program: runs a command and reports its error.

use std::fmt::Display;
use std::process::ExitCode;

use crate::{interruption, messages};

/// Runs a command so that an interruption leaves no unfinished file, and prints its error, if any.
pub fn run<E: Display>(command: impl FnOnce() -> Result<(), E>) -> ExitCode {
    interruption::tidy_up_when_interrupted();
    match command() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            messages::error(&error);
            ExitCode::FAILURE
        }
    }
}
