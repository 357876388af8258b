//! Opens files: a table is read sequentially, a container from the disk.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempPath};

use super::error::InputError;
use super::format::Format;
use super::refusal::ContainerError;
use super::table::reader::{Table, beginning_with, recording_name};
use crate::samples::compressed::decompressed;
use crate::samples::foreign::Foreign;
use crate::samples::magic;

/// An opened file.
pub(super) enum Source {
    Table(Box<Table>),
    Container(Container),
}

/// A container read from the disk, in one or several files.
#[cfg_attr(
    not(any(feature = "bags", feature = "parquet")),
    allow(dead_code, reason = "without readers nothing asks where a container is")
)]
pub(super) struct Container {
    pub(super) format: Format,
    /// File or folder, as given.
    pub(super) file: String,
    /// Title of the recording.
    pub(super) name: String,
    /// Files in the order of their times.
    pub(super) parts: Vec<Part>,
}

/// A file of a container.
#[cfg_attr(
    not(feature = "bags"),
    allow(dead_code, reason = "without readers nothing asks where a container is")
)]
pub(super) struct Part {
    pub(super) format: Format,
    pub(super) path: PathBuf,
    /// Reader of the first pass, which shows its progress.
    first_pass: Option<Box<dyn Read>>,
    /// Temporary copy, so that the file can be read repeatedly and at any position.
    _copy: Option<TempPath>,
}

#[cfg(feature = "bags")]
impl Part {
    /// Returns its bytes from the start.
    pub(super) fn bytes(&mut self) -> io::Result<Box<dyn Read>> {
        match self.first_pass.take() {
            Some(bytes) => Ok(bytes),
            None => Ok(Box::new(File::open(&self.path)?)),
        }
    }
}

impl Source {
    /// Opens a file, read through the result of `wrap` with its length in bytes; or a folder.
    pub(super) fn open(
        path: &Path,
        given: Option<Format>,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
    ) -> Result<Self, InputError> {
        let file = path.display().to_string();
        let opened = if path.is_dir() {
            Opened::Parts(Format::Rosbag2, Self::folder(path)?)
        } else {
            Opened::file(path, wrap).map_err(|source| InputError::unreadable(&file, source))?
        };
        match (opened, given) {
            (Opened::Foreign(kind), _) => Err(ContainerError::Foreign { file, kind }.into()),
            (Opened::Table(_), Some(given))
                if matches!(given, Format::Parquet | Format::Mcap | Format::Rosbag2) =>
            {
                Err(other_format(file, given, None))
            }
            (Opened::Table(table), _) => Ok(Self::Table(table)),
            (Opened::Parts(format, _), Some(given)) if format != given => {
                Err(other_format(file, given, Some(format)))
            }
            (Opened::Parts(format, parts), _) => match format.missing_feature() {
                Some(feature) => Err(ContainerError::NotBuilt { file, format, feature }.into()),
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
    fn folder(path: &Path) -> Result<Vec<Part>, InputError> {
        let file = path.display().to_string();
        let entries = fs::read_dir(path).map_err(|source| InputError::unreadable(&file, source))?;
        let mut paths: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| is_part(path))
            .collect();
        paths.sort_by_key(|path| (number_at_the_end(path), path.clone()));
        let mut parts = Vec::new();
        for path in paths {
            let file = path.display().to_string();
            let opened = Opened::file(&path, |file, _| Box::new(file));
            match opened.map_err(|source| InputError::unreadable(&file, source))? {
                Opened::Parts(Format::Mcap | Format::Rosbag2, mut part) => parts.append(&mut part),
                _ => return Err(other_format(file, Format::Rosbag2, None)),
            }
        }
        if parts.is_empty() {
            return Err(ContainerError::Folder { file }.into());
        }
        Ok(parts)
    }
}

fn other_format(file: String, given: Format, found: Option<Format>) -> InputError {
    ContainerError::OtherFormat { file, given, found }.into()
}

/// Kind of an opened file.
enum Opened {
    Table(Box<Table>),
    Parts(Format, Vec<Part>),
    Foreign(Foreign),
}

impl Opened {
    fn file(path: &Path, wrap: impl FnOnce(File, u64) -> Box<dyn Read>) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if about.is_file() {
            let first = beginning(&mut file)?;
            file.seek(SeekFrom::Start(0))?;
            if let Some(format) = magic::known(&first).and_then(Format::of_kind) {
                return Ok(Self::of(Part {
                    format,
                    path: path.to_owned(),
                    first_pass: Some(wrap(file, about.len())),
                    _copy: None,
                }));
            }
        }
        let mut text = decompressed(wrap(file, about.len()))?;
        let first = beginning(&mut text)?;
        let known = magic::known(&first);
        let mut text = beginning_with(first, text);
        let Some(kind) = known else {
            let table = Table::of(path.display().to_string(), recording_name(path), text)?;
            return Ok(Self::Table(Box::new(table)));
        };
        let Some(format) = Format::of_kind(kind) else {
            return Ok(Self::Foreign(kind));
        };
        // An unsupported file is not copied.
        if format.missing_feature().is_some() {
            return Ok(Self::Parts(format, Vec::new()));
        }
        let mut copy = NamedTempFile::new()?;
        io::copy(&mut text, &mut copy)?;
        let copy = copy.into_temp_path();
        Ok(Self::of(Part { format, path: copy.to_path_buf(), first_pass: None, _copy: Some(copy) }))
    }

    fn of(part: Part) -> Self {
        Self::Parts(part.format, vec![part])
    }
}

/// Reads the first bytes.
pub(super) fn beginning(file: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut first = Vec::new();
    file.take(magic::LENGTH as u64).read_to_end(&mut first)?;
    Ok(first)
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
