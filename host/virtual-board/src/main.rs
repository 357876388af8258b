//! `virtual-board serve` runs an ELF in real time behind pseudo-terminals, or in lock step behind sockets.

#![forbid(unsafe_code)]

mod commands;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Boots the very ELF that is flashed, on modelled peripherals, timing estimated.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Sub,
}

#[derive(Subcommand)]
enum Sub {
    /// Run an ELF in real time behind pseudo-terminals, or in lock step behind sockets: a serial line for each foot,
    /// and one bus behind an slcan adapter.
    #[cfg(unix)]
    Serve(commands::serve::ServeArguments),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        #[cfg(unix)]
        Sub::Serve(arguments) => commands::serve::serve(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
