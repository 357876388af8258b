//! Output files, checked before anything is computed.

use std::fs;
use std::path::{Path, PathBuf};

use recordings::analysis::replay::estimates::Layout;
use recordings::input::{InputError, recording_name};

use crate::feature::Feature;
use crate::files::{OutputError, STANDARD, check_directory_of, directory_of};

/// An output file by kind of result.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// Table of replay estimates.
    Estimates(&'a Path),
    /// Table of events.
    Events(&'a Path),
    /// Table of decoded rows.
    Rows(&'a Path),
    /// Picture of a replay, in any format of [`Drawing`].
    Drawing(&'a Path),
    /// A configuration file.
    Configuration(&'a Path),
    /// A recording for ROS 2.
    Bag(&'a Path),
    /// Settings of a foot.
    Settings(&'a Path),
    /// Recording in the format given by its name or by an option.
    Samples(&'a Path),
}

impl<'a> Target<'a> {
    const fn path(self) -> &'a Path {
        self.parts().0
    }
    /// Path, description of the result for error messages, and accepted file extensions; none accepts any.
    const fn parts(self) -> (&'a Path, &'static str, &'static [&'static str]) {
        match self {
            Self::Estimates(path) => (path, "tables are CSV or Parquet", &Layout::EXTENSIONS),
            Self::Events(path) | Self::Rows(path) => (path, "tables are CSV", &["csv"]),
            Self::Drawing(path) => (path, "pictures are SVG or pages", &Drawing::EXTENSIONS),
            Self::Configuration(path) => (path, "configurations are TOML", &["toml"]),
            Self::Bag(path) => (path, "recordings for ROS 2 are MCAP", &["mcap"]),
            Self::Settings(path) => (path, "settings are text", &["txt"]),
            Self::Samples(path) => (path, "recordings are CSV, Parquet or bags", &[]),
        }
    }

    /// Returns the feature that writes the format; `None` if it needs none.
    fn feature(self) -> Option<Feature> {
        match self {
            Self::Estimates(path) if Layout::of(path) == Layout::Parquet => Some(Feature::Parquet),
            Self::Bag(_) => Some(Feature::Bags),
            _ => None,
        }
    }
}

/// Format of a replay picture, selected by the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// SVG, one per foot.
    Svg,
    /// HTML page of all feet.
    Page,
}

impl Drawing {
    /// Accepted file extensions.
    const EXTENSIONS: [&'static str; 2] = ["svg", "html"];

    /// Returns the format for a file of this name; standard output, pipes and other names get an SVG.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("html") { Self::Page } else { Self::Svg }
    }
}

/// Checks the output files: their directories exist, no recording and no other output is overwritten, and
/// extensions match the results. Standard output takes one result, but not a streamed recording, which needs a
/// file.
///
/// # Errors
/// The first violation found.
pub fn check(inputs: &[PathBuf], targets: &[Target<'_>]) -> Result<(), OutputError> {
    for (k, target) in targets.iter().enumerate() {
        let path = target.path();
        if inputs.iter().any(|input| same_file(input, path)) {
            return Err(OutputError::OverInput(named(path)));
        }
        if let Some(feature) = target.feature() {
            feature.needed_for(path.display())?;
        }
        if path != Path::new(STANDARD) || matches!(target, Target::Bag(_)) {
            if path.is_dir() {
                return Err(OutputError::IsDirectory(named(path)));
            }
            check_directory_of(path)?;
            check_extension(*target)?;
        }
        let is_stdout = |target: &Target<'_>| target.path() == Path::new(STANDARD);
        if is_stdout(target) && targets[..k].iter().any(is_stdout) {
            return Err(OutputError::StdoutTwice);
        }
        let is_same = |before: &Target<'_>| same_file(before.path(), path);
        if targets[..k].iter().any(is_same) {
            return Err(OutputError::SameFile(named(path)));
        }
    }
    Ok(())
}

/// Returns the file name for one of several feet, with the foot's name before the extension.
#[must_use]
pub fn with_foot(path: &Path, foot: &str) -> PathBuf {
    let is_safe = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let safe = foot.replace(|c| !is_safe(c), "_");
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{safe}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Returns the path, with a number before the extension if it is already taken.
#[must_use]
pub fn unlike(path: PathBuf, taken: &[PathBuf]) -> PathBuf {
    let numbered = (2..).map(|number: u32| with_foot(&path, &number.to_string()));
    let mut names = std::iter::once(path.clone()).chain(numbered);
    names.find(|name| !taken.contains(name)).unwrap_or(path)
}

fn check_extension(target: Target<'_>) -> Result<(), OutputError> {
    let (path, kind, extensions) = target.parts();
    // Pipes and terminals are accepted under any name.
    let special = path.exists() && !path.is_file();
    let extension = path.extension().unwrap_or_default();
    let is_known = |known: &&str| extension.eq_ignore_ascii_case(known);
    if special || extensions.is_empty() || extensions.iter().any(is_known) {
        return Ok(());
    }
    Err(OutputError::Extension { file: named(path), kind, expected: extensions.join(" or .") })
}

/// Checks that no recording is named twice, as it would count twice.
///
/// # Errors
/// A recording is named twice.
pub fn check_inputs(inputs: &[PathBuf]) -> Result<(), InputError> {
    for (k, input) in inputs.iter().enumerate() {
        let is_standard = input == Path::new(STANDARD);
        let is_same =
            |before: &PathBuf| same_file(before, input) || (is_standard && before == input);
        if inputs[..k].iter().any(is_same) {
            return Err(InputError::Twice { file: named(input) });
        }
    }
    Ok(())
}

/// Returns the path of a recording as its name if another of `inputs` has the same file name.
#[must_use]
pub fn name_among(inputs: &[PathBuf], input: &Path) -> Option<String> {
    let name = recording_name(input);
    let mut others = inputs.iter().filter(|other| *other != input);
    others.any(|other| recording_name(other) == name).then(|| named(input))
}

/// Returns whether two paths refer to one file, which may not exist yet.
fn same_file(a: &Path, b: &Path) -> bool {
    if a == Path::new(STANDARD) || b == Path::new(STANDARD) {
        return false;
    }
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
