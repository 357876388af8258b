//! Where results go, checked before anything is computed.

use std::fs;
use std::path::{Path, PathBuf};

use recordings::input::InputError;

use crate::files::{OutputError, directory_of};

/// Checks that the results of a replay can go where they should: into directories that exist, not
/// over the recording, not over each other, and a picture into nothing but an `.svg`.
///
/// # Errors
/// The first of these that does not hold.
pub fn check(
    input: &Path,
    table: Option<&Path>,
    picture: Option<&Path>,
) -> Result<(), OutputError> {
    for target in table.into_iter().chain(picture) {
        check_directory(target)?;
        if same_file(input, target) {
            return Err(OutputError::OverInput {
                file: named(target),
            });
        }
    }
    if let Some(picture) = picture {
        check_is_svg(picture)?;
    }
    match (table, picture) {
        (Some(table), Some(picture)) if same_file(table, picture) => Err(OutputError::SameFile {
            file: named(picture),
        }),
        _ => Ok(()),
    }
}

/// Checks that up to two pictures can go where they should, as [`check`] does.
///
/// # Errors
/// The first thing that stands in the way.
pub fn check_pictures(one: Option<&Path>, other: Option<&Path>) -> Result<(), OutputError> {
    for picture in one.into_iter().chain(other) {
        check_directory(picture)?;
        check_is_svg(picture)?;
    }
    match (one, other) {
        (Some(one), Some(other)) if same_file(one, other) => {
            Err(OutputError::SamePicture { file: named(other) })
        }
        _ => Ok(()),
    }
}

/// Checks that a directory is there or can be made: that no file has its name.
///
/// # Errors
/// A file has its name.
pub fn check_can_be_directory(path: &Path) -> Result<(), OutputError> {
    if path.exists() && !path.is_dir() {
        return Err(OutputError::NotADirectory { file: named(path) });
    }
    Ok(())
}

fn check_directory(target: &Path) -> Result<(), OutputError> {
    if target.is_dir() {
        return Err(OutputError::IsDirectory {
            file: named(target),
        });
    }
    match directory_of(target).filter(|directory| !directory.is_dir()) {
        Some(directory) => Err(OutputError::NoDirectory {
            file: named(target),
            directory: named(directory),
        }),
        None => Ok(()),
    }
}

fn check_is_svg(picture: &Path) -> Result<(), OutputError> {
    // A pipe or a terminal is fine whatever its name.
    let special = picture.exists() && !picture.is_file();
    let extension = picture.extension().unwrap_or_default();
    if special || extension.eq_ignore_ascii_case("svg") {
        Ok(())
    } else {
        Err(OutputError::NotSvg {
            file: named(picture),
        })
    }
}

/// Checks that no recording is named twice: what it shows would count twice.
///
/// # Errors
/// One is.
pub fn check_inputs(inputs: &[PathBuf]) -> Result<(), InputError> {
    for (k, input) in inputs.iter().enumerate() {
        if inputs[..k].iter().any(|before| same_file(before, input)) {
            return Err(InputError::Twice { file: named(input) });
        }
    }
    Ok(())
}

/// Whether two names stand for one file, which need not exist yet.
fn same_file(a: &Path, b: &Path) -> bool {
    resolved(a).is_some_and(|a| Some(a) == resolved(b))
}

fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(resolved) = fs::canonicalize(path) {
        return Some(resolved);
    }
    let directory = fs::canonicalize(directory_of(path).unwrap_or(Path::new("."))).ok()?;
    Some(directory.join(path.file_name()?))
}

fn named(path: &Path) -> String {
    path.display().to_string()
}
