//! Output files, checked before anything is computed.

use std::fs;
use std::path::{Path, PathBuf};

use analysis::replay::estimates::Layout;
use recordings::input::{InputError, recording_name};

use crate::feature::Feature;
use crate::files::{OutputError, STANDARD, directory_of};

/// An output file by kind of result.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// Table of replay estimates.
    Estimates(&'a Path),
    /// Table of rows.
    Table(&'a Path),
    /// Table of events.
    Events(&'a Path),
    /// A picture.
    Picture(&'a Path),
    /// Picture of a replay, in any format of [`Drawing`].
    Drawing(&'a Path),
    /// A page of a report.
    Page(&'a Path),
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
        match self {
            Self::Estimates(path)
            | Self::Table(path)
            | Self::Events(path)
            | Self::Picture(path)
            | Self::Drawing(path)
            | Self::Page(path)
            | Self::Configuration(path)
            | Self::Bag(path)
            | Self::Settings(path)
            | Self::Samples(path) => path,
        }
    }

    /// Returns the feature that writes the format; `None` if it needs none.
    fn feature(self) -> Option<Feature> {
        match self {
            Self::Estimates(path) if Layout::of(path) == Layout::Parquet => Some(Feature::Parquet),
            Self::Drawing(path) if Drawing::of(path) == Drawing::Png => Some(Feature::Png),
            Self::Bag(_) => Some(Feature::Bags),
            _ => None,
        }
    }

    /// Returns the description of the result for error messages.
    const fn kind(self) -> &'static str {
        match self {
            Self::Estimates(_) => "tables are CSV or Parquet",
            Self::Table(_) | Self::Events(_) => "tables are CSV",
            Self::Picture(_) => "pictures are SVG",
            Self::Drawing(_) => "pictures are SVG, PNG or pages",
            Self::Page(_) => "reports are HTML",
            Self::Configuration(_) => "configurations are TOML",
            Self::Settings(_) => "settings are text",
            Self::Bag(_) => "recordings for ROS 2 are MCAP",
            Self::Samples(_) => "recordings are CSV, Parquet or bags",
        }
    }

    /// Accepted file extensions; empty accepts any.
    const fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Estimates(_) => &Layout::EXTENSIONS,
            Self::Table(_) | Self::Events(_) => &["csv"],
            Self::Picture(_) => &["svg"],
            Self::Page(_) => &["html"],
            Self::Drawing(_) => &Drawing::EXTENSIONS,
            Self::Configuration(_) => &["toml"],
            Self::Bag(_) => &["mcap"],
            Self::Settings(_) => &["txt"],
            Self::Samples(_) => &[],
        }
    }
}

/// Format of a replay picture, selected by the file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// SVG, one per foot.
    Svg,
    /// PNG, one per foot.
    Png,
    /// HTML page of all feet.
    Page,
}

impl Drawing {
    /// Accepted file extensions.
    const EXTENSIONS: [&'static str; 3] = ["svg", "png", "html"];

    /// Returns the format for a file of this name; standard output, pipes and other names get an SVG.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("png") {
            Self::Png
        } else if extension.eq_ignore_ascii_case("html") {
            Self::Page
        } else {
            Self::Svg
        }
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
            return Err(OutputError::OverInput { file: named(path) });
        }
        if let Some(feature) = target.feature() {
            feature.needed_for(path.display())?;
        }
        if path != Path::new(STANDARD) || matches!(target, Target::Bag(_)) {
            check_directory(path)?;
            check_extension(*target)?;
        }
        let is_stdout = |target: &Target<'_>| target.path() == Path::new(STANDARD);
        if is_stdout(target) && targets[..k].iter().any(is_stdout) {
            return Err(OutputError::StdoutTwice);
        }
        let is_same = |before: &Target<'_>| same_file(before.path(), path);
        if targets[..k].iter().any(is_same) {
            return Err(OutputError::SameFile { file: named(path) });
        }
    }
    Ok(())
}

/// Checks that a directory exists or can be created, i.e. that no file has its name.
///
/// # Errors
/// A file has this name.
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

/// Returns the file name for one of several feet, with the foot's name before the extension.
#[must_use]
pub fn with_foot(path: &Path, foot: &str) -> PathBuf {
    let safe: String = foot
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "-_.".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect();
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
    let path = target.path();
    // Pipes and terminals are accepted under any name.
    let special = path.exists() && !path.is_file();
    let extension = path.extension().unwrap_or_default();
    let mut known = target.extensions().iter();
    if special
        || target.extensions().is_empty()
        || known.any(|known| extension.eq_ignore_ascii_case(known))
    {
        Ok(())
    } else {
        Err(OutputError::Extension {
            file: named(path),
            kind: target.kind(),
            expected: target.extensions().join(" or ."),
        })
    }
}

/// Checks that no recording is named twice, as it would count twice.
///
/// # Errors
/// A recording is named twice.
pub fn check_inputs(inputs: &[PathBuf]) -> Result<(), InputError> {
    for (k, input) in inputs.iter().enumerate() {
        let is_standard = |path: &Path| path == Path::new(STANDARD);
        let is_same = |before: &PathBuf| {
            same_file(before, input) || (is_standard(before) && is_standard(input))
        };
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
    others
        .any(|other| recording_name(other) == name)
        .then(|| named(input))
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
