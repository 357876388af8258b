//! The `evaluate` command.

use std::process::ExitCode;

use clap::Parser;
use evaluate::command::EvaluateArguments;
use footfall::program;

fn main() -> ExitCode {
    program::run(|| EvaluateArguments::parse().run())
}
