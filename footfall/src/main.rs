//! The `footfall` command.

use std::process::ExitCode;

use clap::Parser;
use footfall::cli::Arguments;
use footfall::report::tell;

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tell(&error);
            ExitCode::FAILURE
        }
    }
}
