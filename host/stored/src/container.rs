//! An opened file: a text, or a container read from the disk, in one or several files.

use std::fs::{self, File};
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use files::compressed::{decompressed, without_ending};
use files::file_kind::{self, FileKind};
use files::utf16::in_utf8;
use options::format::Format;
use tempfile::{NamedTempFile, TempPath};

use crate::error::{InputError, Problem};

/// An opened file of known kind.
pub enum Readable {
    /// A text, which may be a table.
    Text(Text),
    /// A container.
    Container(Container),
}

/// The text of a file, decompressed and in UTF-8. It is read once, so it may come from a pipe.
pub struct Text {
    /// Path of the file, as given.
    pub file: String,
    /// Title of the recording.
    pub name: String,
    /// The text, from its start.
    pub text: Box<dyn Read>,
}

/// A container read from the disk, in one or several files.
pub struct Container {
    /// Format of the whole.
    pub format: Format,
    /// File or folder, as given.
    pub file: String,
    /// Title of the recording.
    pub name: String,
    /// Files in the order of their times.
    pub parts: Vec<ContainerFile>,
}

/// A file of a container.
pub struct ContainerFile {
    /// Format of this file.
    pub format: Format,
    /// Path of the file, or of its copy.
    pub path: PathBuf,
    /// Reader of the first pass, which shows its progress.
    first_pass: Option<Box<dyn Read>>,
    /// Temporary copy, so that the file can be read repeatedly and at any position.
    _copy: Option<TempPath>,
}

impl ContainerFile {
    /// Returns its bytes from the start.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn bytes(&mut self) -> io::Result<Box<dyn Read>> {
        match self.first_pass.take() {
            Some(bytes) => Ok(bytes),
            None => Ok(Box::new(File::open(&self.path)?)),
        }
    }
}

/// Feature that a format needs and this build lacks.
pub type MissingFeature = fn(Format) -> Option<&'static str>;

impl Readable {
    /// Opens a file, read through the result of `wrap` with its length in bytes; or a folder. `missing_feature` names
    /// the feature that a container needs and this build lacks.
    ///
    /// # Errors
    /// The file cannot be read, is of a kind that is not read or not of the given format, or needs a missing feature.
    pub fn open(
        path: &Path,
        given: Option<Format>,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
        missing_feature: MissingFeature,
    ) -> Result<Self, InputError> {
        let file = path.display().to_string();
        let opened = if path.is_dir() {
            Recognised::Container(Format::Rosbag2, Self::folder(path, missing_feature)?)
        } else {
            Recognised::file(path, wrap, missing_feature)
                .map_err(|source| InputError::unreadable(&file, source))?
        };
        match (opened, given) {
            (Recognised::Foreign(kind), _) => {
                Err(InputError::of_file(file, Problem::Foreign(kind)))
            }
            (Recognised::Text(_), Some(given)) if given.is_container() => {
                Err(other_format(file, given, None))
            }
            (Recognised::Text(text), _) => Ok(Self::Text(text)),
            (Recognised::Container(format, _), Some(given)) if format != given => {
                Err(other_format(file, given, Some(format)))
            }
            (Recognised::Container(format, parts), _) => match missing_feature(format) {
                Some(feature) => {
                    Err(InputError::of_file(file, Problem::NotBuilt { format, feature }))
                }
                None => Ok(Self::Container(Container {
                    format,
                    file,
                    name: recording_name(path),
                    parts,
                })),
            },
        }
    }

    /// Files of a rosbag2 in its folder.
    fn folder(
        path: &Path,
        missing_feature: MissingFeature,
    ) -> Result<Vec<ContainerFile>, InputError> {
        let file = path.display().to_string();
        let entries = fs::read_dir(path).map(|entries| entries.map(|entry| Ok(entry?.path())));
        let paths = entries.and_then(parts_among);
        let mut parts = Vec::new();
        for path in paths.map_err(|source| InputError::unreadable(&file, source))? {
            let file = path.display().to_string();
            let opened = Recognised::file(&path, |file, _| Box::new(file), missing_feature);
            match opened.map_err(|source| InputError::unreadable(&file, source))? {
                Recognised::Container(Format::Mcap | Format::Rosbag2, mut part) => {
                    parts.append(&mut part);
                }
                _ => return Err(other_format(file, Format::Rosbag2, None)),
            }
        }
        if parts.is_empty() {
            return Err(InputError::of_file(file, Problem::Folder));
        }
        Ok(parts)
    }
}

fn other_format(file: String, given: Format, found: Option<Format>) -> InputError {
    InputError::of_file(file, Problem::OtherFormat { given, found })
}

/// Title of a recording: the file's name without its extension and the extension of its compression.
#[must_use]
pub fn recording_name(path: &Path) -> String {
    let stem = without_ending(path).file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// Format of a kind of file that is recognised by its first bytes; `None` if it is not read.
const fn format_of_kind(kind: FileKind) -> Option<Format> {
    match kind {
        FileKind::Mcap => Some(Format::Mcap),
        FileKind::Sqlite => Some(Format::Rosbag2),
        FileKind::Ros1Bag => Some(Format::Rosbag1),
        FileKind::Parquet => Some(Format::Parquet),
        _ => None,
    }
}

/// Kind of an opened file.
enum Recognised {
    Text(Text),
    Container(Format, Vec<ContainerFile>),
    Foreign(FileKind),
}

impl Recognised {
    fn file(
        path: &Path,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
        missing_feature: MissingFeature,
    ) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if about.is_file() {
            let first = beginning(&mut file)?;
            file.seek(SeekFrom::Start(0))?;
            if let Some(format) = FileKind::of_first_bytes(&first).and_then(format_of_kind) {
                return Ok(Self::of(ContainerFile {
                    format,
                    path: path.to_owned(),
                    first_pass: Some(wrap(file, about.len())),
                    _copy: None,
                }));
            }
        }
        let mut text = in_utf8(decompressed(wrap(file, about.len()))?)?;
        let first = beginning(&mut text)?;
        let known = FileKind::of_first_bytes(&first);
        let mut text: Box<dyn Read> = Box::new(Cursor::new(first).chain(text));
        let Some(kind) = known.or_else(|| FileKind::of_path(path)) else {
            let (file, name) = (path.display().to_string(), recording_name(path));
            return Ok(Self::Text(Text { file, name, text }));
        };
        let Some(format) = format_of_kind(kind) else {
            return Ok(Self::Foreign(kind));
        };
        // An unsupported file is not copied.
        if missing_feature(format).is_some() {
            return Ok(Self::Container(format, Vec::new()));
        }
        let mut copy = NamedTempFile::new()?;
        io::copy(&mut text, &mut copy)?;
        let copy = copy.into_temp_path();
        Ok(Self::of(ContainerFile {
            format,
            path: copy.to_path_buf(),
            first_pass: None,
            _copy: Some(copy),
        }))
    }

    fn of(part: ContainerFile) -> Self {
        Self::Container(part.format, vec![part])
    }
}

/// Reads the first bytes.
fn beginning(file: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut first = Vec::new();
    file.take(file_kind::LENGTH as u64).read_to_end(&mut first)?;
    Ok(first)
}

/// Files of a rosbag2 among the entries of its folder, in the order of their times.
///
/// # Errors
/// The folder cannot be read to its end: a file could be missing from the result.
fn parts_among(entries: impl Iterator<Item = io::Result<PathBuf>>) -> io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = entries.collect::<io::Result<_>>()?;
    paths.retain(|path| is_part(path));
    paths.sort_by_key(|path| (number_at_the_end(path), path.clone()));
    Ok(paths)
}

/// Returns whether this is the name of a file of a rosbag2.
fn is_part(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".zstd").unwrap_or(&name);
    name.ends_with(".mcap") || name.ends_with(".db3")
}

/// Number that rosbag2 appends to names of files: 10 of `walk_10.db3`.
fn number_at_the_end(path: &Path) -> u64 {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    let number = stem.rsplit('_').next().unwrap_or_default();
    number.parse().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_that_are_read_have_a_format() {
        for kind in FileKind::ALL {
            // Databases other than a rosbag2 are refused by their tables.
            let is_read = kind.advice().is_none() || kind == FileKind::Sqlite;
            assert_eq!(format_of_kind(kind).is_some(), is_read, "{kind}");
        }
    }

    #[test]
    fn folder_that_fails_midway_is_an_error() {
        let entry = |name: &str| Ok(PathBuf::from(name));
        let entries =
            || [entry("walk/walk_10.db3"), entry("walk/metadata.yaml"), entry("walk/walk_2.db3")];
        let paths = parts_among(entries().into_iter()).expect("all entries are readable");
        assert_eq!(paths, ["walk/walk_2.db3", "walk/walk_10.db3"].map(PathBuf::from));
        let broken = Err(io::Error::from(io::ErrorKind::StaleNetworkFileHandle));
        let error =
            parts_among(entries().into_iter().chain([broken])).expect_err("an entry is missing");
        assert_eq!(error.kind(), io::ErrorKind::StaleNetworkFileHandle);
    }
}
