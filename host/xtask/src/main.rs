//! Entry point of the tasks on the repository: `cargo xtask quick | image | library | uf2 | release`.

mod boards;
mod command;
mod image;
mod library;
mod packages;
mod quick;
mod release;
mod uf2;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(about = "What is done to the repository", version)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Format, lints and unit tests of the packages that a change can have touched.
    Quick {
        /// The commit that the change began at.
        #[arg(long, default_value = "HEAD")]
        since: String,
    },
    /// Builds the image of a board's program, which an update sends.
    Image {
        /// The board.
        #[arg(long, default_value = "reference")]
        board: String,
        /// File with the private key, 32 bytes; the development key without it.
        #[arg(long, value_name = "FILE")]
        key: Option<PathBuf>,
        /// Sequence number, instead of the time of the commit: a foot refuses one lower than that of its program.
        #[arg(long, value_name = "N")]
        sequence: Option<u32>,
        /// The file to write, instead of one beside the ELF.
        #[arg(long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Packs the estimator for programs in C, for all processors, in `dist`.
    Library,
    /// Builds the program of the Nano RP2040 as a UF2 file.
    Uf2,
    /// Builds what is used without a compiler, in `dist`: programs and wheels for Linux, the firmware, the
    /// estimator for C, descriptions of the wire, checksums.
    Release {
        /// This part alone.
        #[arg(long, value_enum, value_name = "PART")]
        only: Option<release::Part>,
    },
}

fn main() -> ExitCode {
    match run(Arguments::parse().task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(task: Task) -> Result<()> {
    match task {
        Task::Quick { since } => quick::run(&since),
        Task::Image { board, key, sequence, output } => {
            image::run(&board, key.as_deref(), sequence, output)
        }
        Task::Library => {
            let dist = command::root().join("dist");
            std::fs::create_dir_all(&dist)?;
            library::run(&dist).map(drop)
        }
        Task::Uf2 => uf2::run().map(drop),
        Task::Release { only } => release::run(only),
    }
}
