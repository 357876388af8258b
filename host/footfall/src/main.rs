//! The `footfall` command.

use std::process::ExitCode;

use clap::Parser;
use footfall::commands::Arguments;
use footfall::program;

fn main() -> ExitCode {
    program::run(|| Arguments::parse().run())
}
