//! Programs for the boards: their builds, their size limits, and the files to be flashed.

use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result, bail};
use object::elf::{SHF_ALLOC, SHF_WRITE};
use object::{Object as _, ObjectSection as _, SectionFlags, SectionKind};

use crate::command::{Step, root};

/// Target of the firmware.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Limit of the flash that a program may take, bytes. Its slot has 127.5 KiB.
const FLASH_BUDGET: u64 = 120 * 1024;

/// Limit of the static RAM that a program may take, bytes.
const RAM_BUDGET: u64 = 40 * 1024;

/// A board.
pub struct Board {
    /// Name of its folder and of its feature.
    pub name: String,
    /// Name of its program.
    pub program: String,
}

impl Board {
    /// Returns all boards. Each folder of the firmware with a table of pins is a board, and the table names its program.
    ///
    /// # Errors
    /// A table cannot be read, or names no program.
    pub fn all() -> Result<Vec<Self>> {
        let mut boards = Vec::new();
        for entry in fs::read_dir(root().join("firmware/boards/stm32f405/src/wiring"))? {
            let table = entry?.path().join("pins.toml");
            if table.is_file() {
                boards.push(Self::read(&table)?);
            }
        }
        boards.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(boards)
    }

    fn read(table: &Path) -> Result<Self> {
        let text = fs::read_to_string(table).with_context(|| table.display().to_string())?;
        let line = text.lines().find_map(|line| line.strip_prefix("program = "));
        let program = line.map(|value| value.trim_matches('"').to_owned());
        let program = program.with_context(|| format!("{} has no program", table.display()))?;
        let folder = table.parent().and_then(Path::file_name);
        let name = folder.context("a table lies in a folder")?.display().to_string();
        Ok(Self { name, program })
    }

    /// Finds a board by its name.
    ///
    /// # Errors
    /// There is no board of this name.
    pub fn named(name: &str) -> Result<Self> {
        let boards = Self::all()?;
        let names: Vec<String> = boards.iter().map(|board| board.name.clone()).collect();
        let mut boards = boards.into_iter();
        let found = boards.find(|board| board.name == name);
        found.with_context(|| format!("no board {name:?}: there are {}", names.join(", ")))
    }

    /// Name of the program that measures the board before it gets its own.
    fn bring_up(&self) -> String {
        if self.name == "reference" { "bring-up".into() } else { format!("bring-up-{}", self.name) }
    }
}

/// Folder of the programs that are built.
fn built() -> PathBuf {
    root().join("target").join(TARGET).join("firmware")
}

/// Path of a program's ELF.
pub fn elf_of(program: &str) -> PathBuf {
    built().join(program)
}

/// Builds all programs that tests run: the boards' programs, their bootloaders, the programs that measure new boards,
/// and the program that checks an emulator.
///
/// # Errors
/// A program does not build.
pub fn build_all() -> Result<()> {
    for board in Board::all()? {
        build_programs(&board, &[&board.program, &board.bring_up()], &[])?;
        build_bootloader(&board, &[])?;
    }
    Step::cargo(&["build", "--locked", "--profile", "firmware", "--target", TARGET])
        .with(["--package", "foot-stm32f405", "--bin", "self-check"])
        .run()
}

/// Builds the program of a board, with more arguments for cargo, and returns the path of its ELF.
///
/// # Errors
/// It does not build.
pub fn build(board: &Board, arguments: &[String]) -> Result<PathBuf> {
    build_programs(board, &[&board.program], arguments)?;
    Ok(elf_of(&board.program))
}

fn build_programs(board: &Board, programs: &[&str], arguments: &[String]) -> Result<()> {
    let bins = programs.iter().flat_map(|program| ["--bin", program]);
    Step::cargo(&["build", "--locked", "--profile", "firmware", "--target", TARGET])
        .with(["--package", "foot-stm32f405", "--no-default-features", "--features", &board.name])
        .with(bins)
        .with(arguments)
        .run()
}

/// Builds the bootloader of a board, with more arguments for cargo, and returns the path of its ELF.
///
/// # Errors
/// It does not build.
pub fn build_bootloader(board: &Board, arguments: &[String]) -> Result<PathBuf> {
    Step::cargo(&["build", "--locked", "--quiet", "--profile", "firmware", "--target", TARGET])
        .with(["--package", "bootloader-stm32f405"])
        .with(["--features", &format!("program,{}", board.name)])
        .with(arguments)
        .run()?;
    // A distinct name, so that no board gets the bootloader of another.
    let elf = elf_of(&format!("bootloader-{}", board.name));
    fs::copy(built().join("bootloader"), &elf).with_context(|| elf.display().to_string())?;
    Ok(elf)
}

/// Lints the programs of all boards, in the profile in which they are flashed: their build scripts and macros are compiled.
///
/// # Errors
/// A lint fails.
pub fn lint() -> Result<()> {
    let clippy =
        || Step::cargo(&["clippy", "--locked", "--profile", "firmware", "--target", TARGET]);
    for board in Board::all()? {
        clippy()
            .with([
                "--package",
                "foot-stm32f405",
                "--no-default-features",
                "--features",
                &board.name,
            ])
            .with(["--", "-D", "warnings"])
            .run()?;
        clippy()
            .with(["--package", "bootloader-stm32f405"])
            .with(["--features", &format!("program,{}", board.name)])
            .with(["--", "-D", "warnings"])
            .run()?;
    }
    Ok(())
}

/// Flash and static RAM that a program takes.
#[derive(Debug, Default, PartialEq, Eq)]
struct Size {
    /// Code, constants and vectors, with the initial values of variables, bytes.
    flash: u64,
    /// Variables, bytes. The stack is not one of them.
    ram: u64,
}

impl Size {
    fn of(bytes: &[u8]) -> Result<Self> {
        let file = object::File::parse(bytes)?;
        let mut size = Self::default();
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(SHF_ALLOC) == 0 {
                continue;
            }
            let is_uninitialised = section.kind() == SectionKind::UninitializedData;
            if !is_uninitialised {
                size.flash += section.size();
            }
            if is_uninitialised || sh_flags & u64::from(SHF_WRITE) != 0 {
                size.ram += section.size();
            }
        }
        Ok(size)
    }
}

/// Prints the flash and the RAM that programs take.
///
/// # Errors
/// A program exceeds its budget, or is not an ELF.
pub fn check_sizes(elfs: &[PathBuf]) -> Result<()> {
    println!("{:32} {:>8} of {:>6} {:>8} of {:>6}", "bytes", "flash", "", "RAM", "");
    for path in elfs {
        let bytes = fs::read(path).with_context(|| path.display().to_string())?;
        let size = Size::of(&bytes).with_context(|| path.display().to_string())?;
        let name = path.file_name().unwrap_or_default().display().to_string();
        let Size { flash, ram } = size;
        println!("{name:32} {flash:>8} of {FLASH_BUDGET:>6} {ram:>8} of {RAM_BUDGET:>6}");
        if flash > FLASH_BUDGET || ram > RAM_BUDGET {
            bail!("{}: it exceeds its budget", path.display());
        }
    }
    Ok(())
}

/// Folders that an ELF would name its sources by, with names that are the same on every machine.
///
/// # Errors
/// The home folder or the compiler is not found.
pub fn folders() -> Result<[(PathBuf, &'static str); 3]> {
    let home = env::var("CARGO_HOME").map(PathBuf::from).or_else(|_| {
        let home = env::home_dir().context("neither CARGO_HOME nor a home folder is known")?;
        anyhow::Ok(home.join(".cargo"))
    })?;
    let compiler = Step::program("rustc").with(["--print", "sysroot"]).output()?;
    Ok([
        (root().canonicalize()?, "/footfall"),
        (home, "/cargo"),
        (PathBuf::from(compiler.trim()), "/rust"),
    ])
}

/// Arguments of cargo that give the folders their names.
pub fn remap(folders: &[(PathBuf, &str)]) -> Vec<String> {
    let flag = |(folder, name): &(PathBuf, &str)| {
        format!("--remap-path-prefix={}={name}", folder.display())
    };
    let flags: Vec<String> = folders.iter().map(flag).collect();
    let setting = format!("target.{TARGET}.rustflags = {flags:?}");
    vec!["--config".into(), setting]
}

/// Checks that the bytes of a program name none of the folders.
///
/// # Errors
/// They name one.
pub fn check_names(bytes: &[u8], folders: &[(PathBuf, &str)]) -> Result<()> {
    for (folder, _) in folders {
        let name = folder.as_os_str().as_encoded_bytes();
        if bytes.windows(name.len()).any(|found| found == name) {
            bail!("it names {}", folder.display());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_board_has_a_name_and_a_program() {
        let boards = Board::all().expect("the tables can be read");
        let names: Vec<&str> = boards.iter().map(|board| board.name.as_str()).collect();
        assert_eq!(names, ["feather", "reference"]);
        let missing = Board::named("feathre").err().expect("there is no such board").to_string();
        assert_eq!(missing, r#"no board "feathre": there are feather, reference"#);
    }
}
