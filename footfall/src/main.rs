//! The `footfall` command.

use std::process::ExitCode;

use clap::Parser;
use footfall::cli::Arguments;

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("footfall: {error}");
            ExitCode::FAILURE
        }
    }
}
