//! Entry point of the laboratory's tasks, `cargo laboratory TASK`: the gate, measured figures, releases.
//!
//! | tasks | module |
//! |---|---|
//! | `gate`, `full` | [`checks`]: the tiers of checks beyond `.ci/test`, with [`install`], [`panics`], [`python`], [`crates`], [`socketcan`] |
//! | `results`, `measure` | [`results`]: measured figures, and the documents that show them; [`measure`]: the time that the gate takes |
//! | `book` | [`book`]: the documents with search |
//! | `release`, `installed` | [`release`]: files for users, and their [`requirements`]; [`installed`]: their first use |

mod book;
mod checks;
mod crates;
mod environment;
mod install;
mod installed;
mod measure;
mod panics;
mod python;
mod release;
mod requirements;
mod socketcan;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::requirements::Purpose;

#[derive(Parser)]
#[command(about = "Checks and measures the product, and builds releases", version)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Runs the tests, lints, budgets of the programs, the installed Python package and the first command: `.ci/run`.
    Gate,
    /// Runs all that the gate leaves out, in hours: `.ci/full`.
    Full {
        /// Parts to run, instead of all.
        #[arg(value_name = "PART")]
        parts: Vec<String>,
        /// Prints the names of the parts.
        #[arg(long)]
        list: bool,
    },
    /// Runs one part of the full checks in the environment as it is.
    #[command(hide = true)]
    Part {
        /// Name of the part.
        name: String,
    },
    /// Installs the tools of the full checks that this machine lacks.
    Install,
    /// Writes the figures of the results into the documents, and lists results of older programs.
    Results {
        /// Fails if a document differs, and writes nothing.
        #[arg(long)]
        check: bool,
    },
    /// Measures the checks and the first command in a fresh clone, and writes their figures.
    Measure {
        /// Another commit, whose tests and first command are measured in the same run.
        #[arg(long, value_name = "COMMIT")]
        beside: Option<String>,
    },
    /// Renders the documents as a book with search, in `target/book`, and checks its links.
    Book,
    /// Lists the places of a program that can panic by its code, and fails where its `panics.txt` lacks one.
    Panics {
        /// ELF of the program.
        elf: PathBuf,
        /// Prints the places instead of comparing them.
        #[arg(long)]
        print: bool,
    },
    /// Builds the files for users without a compiler, in `dist`: programs and wheels for Linux, the firmware, the
    /// estimator for C, descriptions of the wire, checksums.
    Release {
        /// This part alone.
        #[arg(long, value_enum, value_name = "PART")]
        only: Option<release::Part>,
        /// Builds the files without an address and with the development key, to look at them. They are not for users.
        #[arg(long)]
        draft: bool,
    },
    /// Installs each piece of a release from its folder into an empty environment, and runs its first example.
    Installed {
        /// Folder of the release.
        #[arg(default_value = "dist")]
        folder: PathBuf,
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
        Task::Gate => checks::gate(),
        Task::Full { list: true, .. } => {
            checks::parts().for_each(|part| println!("{part}"));
            Ok(())
        }
        Task::Full { parts, list: false } => checks::full(&parts),
        Task::Part { name } => checks::part(&name),
        Task::Install => install::run(),
        Task::Results { check } => {
            if check {
                results::check()?;
            } else {
                results::render()?;
            }
            results::print_older()
        }
        Task::Measure { beside } => measure::run(beside.as_deref()),
        Task::Book => {
            println!("{}", book::run()?.display());
            Ok(())
        }
        Task::Panics { elf, print } => panics::run(&elf, print),
        Task::Release { only, draft } => {
            release::run(only, if draft { Purpose::Draft } else { Purpose::Users })
        }
        Task::Installed { folder } => installed::run(&folder),
    }
}
