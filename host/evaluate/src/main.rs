//! The `evaluate` command.

use std::process::ExitCode;

use clap::Parser;
use evaluate::command::Arguments;
use footfall::program;

fn main() -> ExitCode {
    program::run(|| Arguments::parse().run())
}
