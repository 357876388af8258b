//! Comparison of the decoder in C with this crate's decoder, frame by frame. The tests of host-tests use it too.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use wire::uart::Decoder;

#[path = "expected.rs"]
mod expected;

/// Compiler with its language standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    C11,
    Cpp17,
}

/// Checks for undefined behaviour while the program runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sanitizers {
    On,
    Off,
}

const STRICT: [&str; 9] = [
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-Wconversion",
    "-Wsign-conversion",
    "-Wshadow",
    "-Wundef",
    "-O2",
];

/// Folder of the committed decoder.
pub fn committed() -> PathBuf {
    wire().join("c")
}

/// C program in the README of the crate `wire`.
pub fn readme_program() -> PathBuf {
    let readme = fs::read_to_string(wire().join("README.md")).expect("a README");
    let (_, rest) = readme.split_once("```c\n").expect("a program in C");
    let (program, _) = rest.split_once("```").expect("its end");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme_program.c");
    fs::write(&file, program).expect("a file");
    file
}

/// Folder of this package; `host-tests` includes this file, too.
fn wire() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    if env!("CARGO_PKG_NAME") == "footfall-wire" { here.into() } else { here.join("../wire") }
}

/// Counts of each kind of frame, and of each reason for rejection: `contact`, `result 3`.
pub type Counts = BTreeMap<String, usize>;

/// Program that prints the output of the decoder in a folder.
#[derive(Debug)]
pub struct Program(PathBuf);

impl Program {
    /// Compiles the decoder of `folder` with code that prints every member; `name` is that of the program.
    pub fn build(
        name: &str,
        folder: &Path,
        language: Language,
        sanitizers: Sanitizers,
    ) -> Result<Self, String> {
        let print = wire().join("tests/c/print.c");
        Self::build_of(name, folder, &print, language, sanitizers)
    }

    /// Does the same with another `main`.
    pub fn build_of(
        name: &str,
        folder: &Path,
        main: &Path,
        language: Language,
        sanitizers: Sanitizers,
    ) -> Result<Self, String> {
        let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let (compiler, standard) = match language {
            Language::C11 => ("cc", ["-x", "c", "-std=c11"]),
            Language::Cpp17 => ("c++", ["-x", "c++", "-std=c++17"]),
        };
        let mut command = Command::new(compiler);
        command.args(standard).args(STRICT).arg("-I").arg(folder);
        if sanitizers == Sanitizers::On {
            command.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]);
        }
        command.arg(folder.join("footfall.c")).arg(main).arg("-o").arg(&program);
        run(&mut command)?;
        Ok(Self(program))
    }

    /// Runs the program on the bytes as its standard input; returns what it prints.
    pub fn print(&self, of: &str, input: &[u8]) -> Result<String, String> {
        let file = self.0.with_extension(of);
        fs::write(&file, input).map_err(|error| error.to_string())?;
        let input = File::open(&file).map_err(|error| error.to_string())?;
        run(Command::new(&self.0).arg(of).stdin(Stdio::from(input)))
    }

    /// Compares the decoders on CAN frames, which are identifiers and data; returns the counts, or
    /// the first frame with different results.
    pub fn compare_can(&self, frames: &[(u32, Vec<u8>)]) -> Result<Counts, String> {
        let lines: Vec<String> = frames.iter().map(line).collect();
        let printed = self.print("can", lines.concat().as_bytes())?;
        let expected = frames.iter().map(|(id, data)| expected::frame(*id, data));
        same(&printed, expected.zip(lines))
    }

    /// Compares the decoders on the bytes of a serial line; returns the counts, or the first
    /// difference.
    pub fn compare_serial(&self, bytes: &[u8]) -> Result<Counts, String> {
        let printed = self.print("serial", bytes)?;
        let mut decoder = Decoder::new();
        let expected = bytes.iter().enumerate().filter_map(|(i, byte)| {
            let came = decoder.push(*byte)?;
            Some((expected::message(&came), format!("byte {i}")))
        });
        same(&printed, expected)
    }
}

fn line((id, data): &(u32, Vec<u8>)) -> String {
    let data: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("{id:X} {data}\n")
}

/// Compares the printed lines with the expected ones, each with its source.
fn same(printed: &str, expected: impl Iterator<Item = (String, String)>) -> Result<Counts, String> {
    let mut counts = Counts::new();
    let mut lines = printed.lines();
    for (expected, of) in expected {
        let printed = lines.next();
        if printed != Some(&expected) {
            return Err(format!("{of}: {printed:?} is not {expected:?}"));
        }
        let kind = match expected.split_once(' ') {
            Some((kind, _)) if kind != "result" => kind,
            _ => &expected,
        };
        *counts.entry(kind.to_owned()).or_default() += 1;
    }
    match lines.next() {
        Some(more) => Err(format!("{more:?} comes of nothing")),
        None => Ok(counts),
    }
}

fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        let stderr = String::from_utf8_lossy(&output.stderr);
        Err(format!("{command:?} failed:\n{stderr}"))
    }
}
