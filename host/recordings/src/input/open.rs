//! Opens files: a table is read sequentially, a container from the disk.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempPath};

use crate::compressed::decompressed;
use crate::file_kind;
use crate::file_kind::FileKind;
use crate::input::error::{InputError, Problem};
use crate::input::format::Format;
use crate::input::table::reader::{Table, beginning_with, recording_name};
use crate::utf16::{ByteOrder, Utf8};

/// An opened file.
pub(super) enum Readable {
    Table(Box<Table>),
    Container(Container),
}

/// A container read from the disk, in one or several files.
#[cfg_attr(
    not(any(feature = "bags", feature = "parquet")),
    allow(dead_code, reason = "only the readers use it")
)]
pub(super) struct Container {
    pub(super) format: Format,
    /// File or folder, as given.
    pub(super) file: String,
    /// Title of the recording.
    pub(super) name: String,
    /// Files in the order of their times.
    pub(super) parts: Vec<ContainerFile>,
}

/// A file of a container.
#[cfg_attr(not(feature = "bags"), allow(dead_code, reason = "only the readers use it"))]
pub(super) struct ContainerFile {
    pub(super) format: Format,
    pub(super) path: PathBuf,
    /// Reader of the first pass, which shows its progress.
    first_pass: Option<Box<dyn Read>>,
    /// Temporary copy, so that the file can be read repeatedly and at any position.
    _copy: Option<TempPath>,
}

#[cfg(feature = "bags")]
impl ContainerFile {
    /// Returns its bytes from the start.
    pub(super) fn bytes(&mut self) -> io::Result<Box<dyn Read>> {
        match self.first_pass.take() {
            Some(bytes) => Ok(bytes),
            None => Ok(Box::new(File::open(&self.path)?)),
        }
    }
}

impl Readable {
    /// Opens a file, read through the result of `wrap` with its length in bytes; or a folder.
    pub(super) fn open(
        path: &Path,
        given: Option<Format>,
        wrap: impl FnOnce(File, u64) -> Box<dyn Read>,
    ) -> Result<Self, InputError> {
        let file = path.display().to_string();
        let opened = if path.is_dir() {
            Recognised::Container(Format::Rosbag2, Self::folder(path)?)
        } else {
            Recognised::file(path, wrap).map_err(|source| InputError::unreadable(&file, source))?
        };
        match (opened, given) {
            (Recognised::Foreign(kind), _) => {
                Err(InputError::of_file(file, Problem::Foreign(kind)))
            }
            (Recognised::Table(_), Some(given)) if given.is_container() => {
                Err(other_format(file, given, None))
            }
            (Recognised::Table(table), _) => Ok(Self::Table(table)),
            (Recognised::Container(format, _), Some(given)) if format != given => {
                Err(other_format(file, given, Some(format)))
            }
            (Recognised::Container(format, parts), _) => match format.missing_feature() {
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
    fn folder(path: &Path) -> Result<Vec<ContainerFile>, InputError> {
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
            let opened = Recognised::file(&path, |file, _| Box::new(file));
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

/// Kind of an opened file.
enum Recognised {
    Table(Box<Table>),
    Container(Format, Vec<ContainerFile>),
    Foreign(FileKind),
}

impl Recognised {
    fn file(path: &Path, wrap: impl FnOnce(File, u64) -> Box<dyn Read>) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        if about.is_file() {
            let first = beginning(&mut file)?;
            file.seek(SeekFrom::Start(0))?;
            if let Some(format) = file_kind::known(&first).and_then(Format::of_kind) {
                return Ok(Self::of(ContainerFile {
                    format,
                    path: path.to_owned(),
                    first_pass: Some(wrap(file, about.len())),
                    _copy: None,
                }));
            }
        }
        let mut text = decompressed(wrap(file, about.len()))?;
        let mut first = beginning(&mut text)?;
        if let Some(order) = ByteOrder::of_text(&first) {
            text = Box::new(Utf8::new(beginning_with(first, text), order));
            first = beginning(&mut text)?;
        }
        let known = file_kind::known(&first);
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
pub(super) fn beginning(file: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut first = Vec::new();
    file.take(file_kind::LENGTH as u64).read_to_end(&mut first)?;
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
