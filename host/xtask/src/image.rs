//! Makes the image of a board's program, which an update sends.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use bootloader::image::Sources;
use program_images::{DEVELOPMENT_KEY, ProgramOrigin, image, public_key};

use crate::command::{Step, root};
use crate::firmware::{self, Board};

/// Builds the program of a board and writes its image, signed with the key in a file of 32 bytes, or with the
/// development key.
///
/// # Errors
/// There is no such board, the program does not build, or a file cannot be read or written.
pub fn run(
    board: &str,
    key: Option<&Path>,
    sequence: Option<u32>,
    output: Option<PathBuf>,
) -> Result<()> {
    let elf = firmware::build(&Board::named(board)?, &[])?;
    let output = output.unwrap_or_else(|| elf.with_extension("img"));
    write(&elf, key, sequence, &output)
}

/// Writes the image of an ELF.
///
/// # Errors
/// A file cannot be read or written, or the ELF is not a program.
pub fn write(elf: &Path, key: Option<&Path>, sequence: Option<u32>, output: &Path) -> Result<()> {
    let key = key.map_or(Ok(*DEVELOPMENT_KEY), read_key)?;
    let mut origin = origin()?;
    origin.sequence = sequence.unwrap_or(origin.sequence);
    let program = fs::read(elf).with_context(|| elf.display().to_string())?;
    let image = image(&program, &origin, &key).with_context(|| elf.display().to_string())?;
    fs::write(output, &image).with_context(|| output.display().to_string())?;
    let hash = image.get(44..48).and_then(|bytes| bytes.try_into().ok());
    let number = u32::from_le_bytes(hash.unwrap_or_default());
    println!(
        "{}: {} bytes, 0x1F56 = {number:#010x}, sequence {}",
        output.display(),
        image.len(),
        origin.sequence
    );
    archive(elf, number)
}

/// Reads a private or public key, 32 bytes.
///
/// # Errors
/// The file cannot be read, or has another length.
pub fn read_key(path: &Path) -> Result<[u8; 32]> {
    let key = fs::read(path).with_context(|| path.display().to_string())?;
    let (file, expected) = (path.display(), "expected 32");
    <[u8; 32]>::try_from(key)
        .map_err(|key| anyhow!("{file}: a key of {} bytes, {expected}", key.len()))
}

/// Writes the public half of the private key in `private`, which the variable `FOOTFALL_KEY` names when the bootloader is
/// built.
///
/// # Errors
/// A file cannot be read or written, or `public` is there already.
pub fn write_public_key(private: &Path, public: &Path) -> Result<()> {
    let key = public_key(&read_key(private)?);
    let file = fs::File::create_new(public).and_then(|mut file| file.write_all(&key));
    file.with_context(|| public.display().to_string())
}

/// Copies an ELF under the number that object 0x1F56 of its foot shows, because an address of a crash can only be found
/// in exactly this ELF.
fn archive(elf: &Path, number: u32) -> Result<()> {
    let folder = root().join("target/elf");
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let kept = folder.join(format!("{number:08X}.elf"));
    fs::copy(elf, &kept).with_context(|| kept.display().to_string())?;
    Ok(())
}

/// The commit that is checked out.
fn origin() -> Result<ProgramOrigin> {
    let git = |arguments: &[&str]| Step::program("git").with(arguments).output();
    let shown = git(&["log", "-1", "--format=%H %ct"])?;
    let (hash, time) = shown.trim().split_once(' ').context("git shows a commit")?;
    let mut commit = [0; 20];
    for (byte, digits) in commit.iter_mut().zip(hash.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits)?, 16)?;
    }
    let changed = !git(&["status", "--porcelain"])?.is_empty();
    let mut version = [0; 3];
    for (number, text) in version.iter_mut().zip(env!("CARGO_PKG_VERSION").split('.')) {
        *number = text.parse().context("a version of numbers")?;
    }
    Ok(ProgramOrigin {
        version,
        commit,
        sources: if changed { Sources::Changed } else { Sources::Committed },
        sequence: time.parse().context("the time of a commit")?,
    })
}
