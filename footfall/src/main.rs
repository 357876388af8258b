//! The `footfall` command.

use std::process::ExitCode;

use clap::Parser;
use footfall::commands::Arguments;
use footfall::report::warn;

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            warn(&error);
            ExitCode::FAILURE
        }
    }
}
