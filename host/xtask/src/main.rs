//! Entry point of the tasks on the repository, `cargo xtask TASK`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use xtask::command::{self, Step};
use xtask::firmware::{self, Board};
use xtask::{hex, image, install, library, quick, test, uf2};

#[derive(Parser)]
#[command(about = "Tests the product, and builds what is flashed", version)]
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
    /// Installs the tools that the tests need and this machine lacks.
    Install,
    /// Draws the pictures of the documents again, in `docs/pictures`.
    Pictures,
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
    /// Writes the public half of a private key, 32 bytes, for a bootloader that accepts no other program.
    PublicKey {
        /// File with the private key.
        private: PathBuf,
        /// The file to write.
        public: PathBuf,
    },
    /// Packs the estimator for programs in C, for all processors, in `dist`.
    Library {
        /// Builds a folder for only this target of the Rust compiler, which the archive may lack, or for `generic`: the
        /// file of C.
        #[arg(long, value_name = "TARGET")]
        target: Option<String>,
    },
    /// Builds the program of a board with an RP2040 or an RP2350 as a UF2 file.
    Uf2 {
        /// The board.
        #[arg(long, value_enum, default_value = "nano-rp2040")]
        board: uf2::Board,
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
        Task::Test => test::run(),
        Task::Install => install::run(&test::TOOLS),
        Task::Pictures => Step::cargo(&["test", "--locked", "--package", "host-tests"])
            .with(["--test", "host", "--", "pictures::", "demo::"])
            .env("FOOTFALL_UPDATE", "1")
            .run(),
        Task::Programs => firmware::build_all(),
        Task::Bootloader { board } => {
            let elf = firmware::build_bootloader(&Board::named(&board)?, &[])?;
            println!("{}", elf.strip_prefix(command::root())?.display());
            Ok(())
        }
        Task::Hex { program, bootloader } => hex::run(&program, bootloader.as_deref()),
        Task::Image { board, key, sequence, output } => {
            image::run(&board, key.as_deref(), sequence, output)
        }
        Task::PublicKey { private, public } => image::write_public_key(&private, &public),
        Task::Library { target } => {
            let dist = command::root().join("dist");
            std::fs::create_dir_all(&dist)?;
            match target {
                Some(target) => library::run_for(&target, &dist).map(drop),
                None => library::run(&dist).map(drop),
            }
        }
        Task::Uf2 { board } => uf2::run(board).map(drop),
    }
}
