//! `virtual-board serve` runs an ELF in real time behind pseudo-terminals, or in lock step behind sockets.

#![forbid(unsafe_code)]

#[cfg(unix)]
mod serve;

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
    Serve(serve::ServeArguments),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        #[cfg(unix)]
        Sub::Serve(arguments) => serve::serve(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
