//! Entry point of the tasks on the repository: `cargo xtask quick | gate | update | release | mutants`.

mod boards;
mod changes;
mod command;
mod mutants;
mod packages;
mod quick;
mod release;
mod update;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::command::Step;

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
    /// Everything: the same as `.ci/run`.
    Gate,
    /// Writes all generated files and tables again.
    Update,
    /// Builds what is used without a compiler, in `dist`: programs and wheels for Linux, the firmware,
    /// descriptions of the wire, checksums.
    Release,
    /// Whether the tests would fail if the code broke (cargo-mutants).
    Mutants {
        /// The packages to break; without one, all those that are listed.
        packages: Vec<String>,
        /// Breaks one of N places, evenly over the code.
        #[arg(long, value_name = "N", default_value_t = 1)]
        one_in: u32,
        /// Which of the N: another number takes other places.
        #[arg(long, value_name = "K", default_value_t = 0)]
        nth: u32,
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
        Task::Gate => Step::program(".ci/run").run(),
        Task::Update => update::run(),
        Task::Release => release::run(),
        Task::Mutants {
            packages,
            one_in,
            nth,
        } => mutants::run(&packages, one_in, nth),
    }
}
