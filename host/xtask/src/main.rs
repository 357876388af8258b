//! Entry point of the tasks on the repository, `cargo xtask TASK`: checks, flash images, releases.
//!
//! | tasks | module |
//! |---|---|
//! | `quick`, `test`, `gate`, `full` | [`quick`], [`checks`]: the tiers of checks, with [`install`], [`panics`], [`python`], [`crates`], [`socketcan`] |
//! | `results`, `measure` | [`results`]: measured figures, and the documents that show them; [`measure`]: the time that the gate takes |
//! | `pictures`, `book` | the pictures of the documents; [`book`]: the documents with search |
//! | `programs`, `bootloader`, `hex`, `image`, `uf2` | [`firmware`], [`hex`], [`image`], [`uf2`]: files to be flashed |
//! | `library`, `release` | [`library`], [`release`]: files for users |

mod book;
mod checks;
mod command;
mod crates;
mod firmware;
mod hex;
mod image;
mod install;
mod library;
mod measure;
mod packages;
mod panics;
mod python;
mod quick;
mod release;
mod socketcan;
mod uf2;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::command::Step;
use crate::firmware::Board;
use crate::install::Tier;

#[derive(Parser)]
#[command(about = "Checks the repository, and builds what is flashed and released", version)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Checks format, lints and unit tests of the packages that a change can have touched.
    Quick {
        /// The commit that the change began at.
        #[arg(long, default_value = "HEAD")]
        since: String,
    },
    /// Tests every behaviour once. Installs what the tests need. `.ci/test` is its short name.
    Test,
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
    /// Installs the tools that the tests need and this machine lacks.
    Install {
        /// Also installs the tools of the full checks.
        #[arg(long)]
        full: bool,
    },
    /// Writes the figures of `results` into the documents, and lists results of older programs.
    Results {
        /// Fails if a document differs, and writes nothing.
        #[arg(long)]
        check: bool,
    },
    /// Measures the gate in a fresh clone, and writes its figures.
    Measure,
    /// Draws the pictures of the documents again, in `docs/pictures`.
    Pictures,
    /// Renders the documents as a book with search, in `target/book`, and checks its links.
    Book,
    /// Builds all programs for the boards that tests run.
    Programs,
    /// Builds the bootloader of a board, and prints the path of its ELF.
    Bootloader {
        /// The board.
        board: String,
    },
    /// Writes a program and its bootloader as Intel HEX and `DfuSe` files next to the program's ELF.
    ///
    /// The files contain only the bytes to be flashed. A raw binary would overwrite the settings, which are between
    /// bootloader and program.
    Hex {
        /// ELF of the program.
        program: PathBuf,
        /// ELF of the bootloader. Without it the files have the program alone, for a chip whose bootloader protects its sectors.
        bootloader: Option<PathBuf>,
    },
    /// Lists the places of a program that can panic by its code, and fails where its `panics.txt` lacks one.
    Panics {
        /// ELF of the program.
        elf: PathBuf,
        /// Prints the places instead of comparing them.
        #[arg(long)]
        print: bool,
    },
    /// Builds the image of a board's program, which an update sends.
    Image {
        /// The board.
        #[arg(long, default_value = "reference")]
        board: String,
        /// File with the private key, 32 bytes; the development key without it.
        #[arg(long, value_name = "FILE")]
        key: Option<PathBuf>,
        /// Sequence number, instead of the time of the commit. A foot refuses a lower number than that of its program.
        #[arg(long, value_name = "N")]
        sequence: Option<u32>,
        /// The file to write, instead of one beside the ELF.
        #[arg(long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Packs the estimator for programs in C, for all processors, in `dist`.
    Library {
        /// Builds a folder for only this target of the Rust compiler, which the archive may lack.
        #[arg(long, value_name = "TARGET")]
        target: Option<String>,
    },
    /// Builds the program of a board with an RP2040 or an RP2350 as a UF2 file.
    Uf2 {
        /// The board.
        #[arg(long, value_enum, default_value = "nano-rp2040")]
        board: uf2::Board,
    },
    /// Builds the files for users without a compiler, in `dist`: programs and wheels for Linux, the firmware, the
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
        Task::Test => checks::test(),
        Task::Gate => checks::gate(),
        Task::Full { list: true, .. } => {
            checks::parts().for_each(|part| println!("{part}"));
            Ok(())
        }
        Task::Full { parts, list: false } => checks::full(&parts),
        Task::Part { name } => checks::part(&name),
        Task::Install { full } => install::run(if full { Tier::Full } else { Tier::Test }),
        Task::Results { check } => {
            if check {
                results::check()?;
            } else {
                results::render()?;
            }
            results::print_older()
        }
        Task::Measure => measure::run(),
        Task::Pictures => Step::cargo(&["test", "--locked", "--package", "host-tests"])
            .with(["--test", "host", "--", "pictures::", "demo::"])
            .env("FOOTFALL_UPDATE", "1")
            .run(),
        Task::Book => {
            println!("{}", book::run()?.display());
            Ok(())
        }
        Task::Programs => firmware::build_all(),
        Task::Bootloader { board } => {
            let elf = firmware::build_bootloader(&Board::named(&board)?, &[])?;
            println!("{}", elf.strip_prefix(command::root())?.display());
            Ok(())
        }
        Task::Hex { program, bootloader } => hex::run(&program, bootloader.as_deref()),
        Task::Panics { elf, print } => panics::run(&elf, print),
        Task::Image { board, key, sequence, output } => {
            image::run(&board, key.as_deref(), sequence, output)
        }
        Task::Library { target } => {
            let dist = command::root().join("dist");
            std::fs::create_dir_all(&dist)?;
            match target {
                Some(target) => library::run_for(&target, &dist).map(drop),
                None => library::run(&dist).map(drop),
            }
        }
        Task::Uf2 { board } => uf2::run(board).map(drop),
        Task::Release { only } => release::run(only),
    }
}
