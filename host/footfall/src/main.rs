//! The `footfall` command.

use std::process::ExitCode;

use clap::Parser;
use footfall::commands::Arguments;
use footfall::{interruption, messages};

fn main() -> ExitCode {
    interruption::tidy_up_when_interrupted();
    match Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            messages::error(&error);
            ExitCode::FAILURE
        }
    }
}
